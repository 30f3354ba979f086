# SPDX-License-Identifier: MIT
"""quotes.py SOURCE HYST: every message that docs/TROUBLESHOOTING.md quotes is in the sources, so is every name that the
glossary explains, README's output is the tutorial's, and every option that a document gives to a command of hyst exists.

A quoted message is a line "> text", where ".." stands for what varies. Its pieces have to stand, in this order, in one
string of a source file; strings side by side are one string, as for the compiler.
"""
import glob
import os
import re
import subprocess
import sys

source, hyst = sys.argv[1:3]
STRINGS = re.compile(r'"(?:[^"\\\n]|\\.)*"(?:\s*"(?:[^"\\\n]|\\.)*")*')
CONVERSION = re.compile(r'%[-+ #0]*[\d*]*(?:\.[\d*]+)?(?:hh|h|ll|l|z|j|t)?[a-zA-Z]|"\s*PRI\w+\s*"')
failures = 0


def complain(text):
    global failures
    print("FAIL:", text)
    failures += 1


def strings():
    """The strings of the sources, a conversion of printf as a line break, which no quoted piece has."""
    rooms = (os.path.join(source, room, "**", "*") for room in ("host_tools", "firmware", "lib"))
    for path in (path for room in rooms for path in glob.glob(room, recursive=True)):
        if not path.endswith((".c", ".h", ".def")):
            continue
        with open(path, encoding="utf-8") as file:
            text = re.sub(r'"\s*PRI\w+\s*"', "u", file.read())
        for match in STRINGS.finditer(text):
            joined = "".join(part[1:-1] for part in re.findall(r'"(?:[^"\\\n]|\\.)*"', match[0]))
            yield CONVERSION.sub("\n", joined.replace("%%", "%"))


def holds(text, pieces):
    at = 0
    for piece in pieces:
        at = text.find(piece, at)
        if at < 0:
            return False
        at += len(piece)
    return True


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


corpus = list(strings())
guide = read(os.path.join(source, "docs", "TROUBLESHOOTING.md"))
quotes = re.findall(r"^> (.*)$", guide, re.M)
for quote in quotes:
    pieces = [piece.strip() for piece in quote.split("..") if piece.strip(" :,()")]
    if not pieces:
        complain(f"'{quote}' quotes nothing")
    elif not any(holds(text, pieces) for text in corpus):
        complain(f"TROUBLESHOOTING.md quotes '{quote}', which no source has")
symptoms = len(re.findall(r"^### ", guide, re.M))
if symptoms < 15 or len(quotes) < 15:
    complain(f"only {symptoms} symptoms and {len(quotes)} quotes")
for section in re.split(r"^### ", guide, flags=re.M)[1:]:
    if not re.search(r"^1\. \*", section, re.M) or "Cure" not in section and "cure" not in section:
        complain(f"no cause or no cure: {section.splitlines()[0]}")

# A name that the glossary explains is one that the code has.
explained = re.findall(r"`([A-Za-z_]+)`", read(os.path.join(source, "docs", "GLOSSARY.md")).split("## Older names")[1])
known = set()
for room in ("host_tools", "firmware", "lib", "tests"):
    for path in glob.glob(os.path.join(source, room, "**", "*.[ch]"), recursive=True):
        for identifier in re.findall(r"[A-Za-z_]+", path + read(path)):
            known.update((identifier, identifier.rstrip("s"), *identifier.split("_")))
for name in explained:
    if name != "seed_NNN" and name not in known:
        complain(f"GLOSSARY.md explains '{name}', which no source has")
if len(explained) < 10:
    complain(f"only {len(explained)} names of the glossary were found")

# README shows output: a block behind a line that ends with "prints:" has lines of the tutorial, which a test keeps true.
tutorial = {line.strip() for line in read(os.path.join(source, "docs", "TUTORIAL.md")).split("\n")}
screens = re.findall(r"prints:\n\n((?:^    .*\n)+)", read(os.path.join(source, "README.md")), re.M)
shown = [line.strip() for screen in screens for line in screen.split("\n") if line.strip()]
for line in shown:
    if line not in tutorial:
        complain(f"README.md shows '{line}', which the tutorial does not")
if len(shown) < 5:
    complain(f"README.md shows {len(shown)} lines of output")

# "hyst fit a.csv --creep" in code, inline or in a block: the options are those of its --help.
options, checked = {}, 0
listed = subprocess.run([hyst, "--help"], stdout=subprocess.PIPE, text=True, check=True).stdout
for command in re.findall(r"^  ([a-z]+) ", listed, re.M):
    text = subprocess.run([hyst, command, "--help"], stdout=subprocess.PIPE, text=True, check=True).stdout
    left = re.findall(r"^  (?:(-[a-z]), )?(--[a-z-]+)", text, re.M)
    options[command] = {name for pair in left for name in pair}
for path in sorted(glob.glob(os.path.join(source, "docs", "*.md")) + [os.path.join(source, "README.md")]):
    text = read(path)
    code = re.findall(r"`([^`\n]+)`", text) + re.findall(r"^(?:    |\$ |> +)(.*)", text, re.M)
    for command, arguments in (m for c in code for m in re.findall(r"(?:^|[ |(])hyst ([a-z]+)((?: +[^|;`]*)?)", c)):
        if command not in options:
            continue
        for option in re.findall(r"(?<!\S)(--?[a-z][a-z-]*)", arguments):
            checked += 1
            if option not in options[command]:
                complain(f"{os.path.basename(path)}: hyst {command} has no {option}")
if checked < 20:
    complain(f"only {checked} options were checked")
print(f"{symptoms} symptoms, {len(quotes)} quotes, {len(explained)} names, {checked} options, {failures} failures")
sys.exit(1 if failures else 0)
