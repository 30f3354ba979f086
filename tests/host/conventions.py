#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""conventions.py HYST FOLDER: what all commands of `hyst` have in common, for each that `hyst --help` lists.

Help by both ways, one line and status 2 for a wrong option, before a port is opened; --json to stdout and into a file;
"-" for the standard streams; no escape sequences where no terminal is. A command that is neither asked with a port nor
in ANSWERS fails: say there how it is asked.
"""
import json
import os
import re
import shutil
import subprocess
import sys

hyst, folder = sys.argv[1:3]
shutil.rmtree(folder, ignore_errors=True)
os.makedirs(folder)
os.chdir(folder)
with open("recording.csv", "w", encoding="ascii") as file:  # triangles over a play of 20 V, and a little noise
    file.write("# sample_rate_hz: 1000\n# drive_unit: V\n# displacement_unit: um\nt,drive,displacement,reference\n")
    corners, z, chance = [0, 100, -100, 60, -20, 100, -100, 100, 20, 100, -100, 50, 0, 100, -100, 100], 0.0, 1
    for k in range(2400):
        a, b = corners[k // 100 % 16], corners[(k // 100 + 1) % 16]
        u = a + (b - a) * (k % 100) / 100
        z = min(max(z, u - 20), u + 20)
        chance = chance * 16807 % 2147483647
        x = 5 + 0.1 * u + 0.05 * z
        file.write(f"{k / 1000:.3f},{u:.4f},{x + 0.02 * (chance / 2147483647 - 0.5):.6f},{x:.6f}\n")
faults = []


def run(*arguments, stdin=subprocess.DEVNULL):
    return subprocess.run([hyst, *arguments], capture_output=True, text=True, timeout=300, check=False,
                          **({"input": stdin} if isinstance(stdin, str) else {"stdin": stdin}))


def check(good, *what):
    if not good:
        faults.append(" ".join(str(part) for part in what))


run("fit", "recording.csv", "--operators", "4", "-o", "model.json")
run("simulate", "model.json", "recording.csv", "-o", "track.csv")
# How a command is asked that needs no amplifier. It answers in text, and with --json.
ANSWERS = {
    "import": ["recording.csv"],
    "fit": ["recording.csv", "--operators", "4"],
    "look": ["recording.csv"],
    "bode": ["recording.csv"],
    "diagnose": ["recording.csv", "--model", "model.json"],
    "simulate": ["model.json", "recording.csv"],
    "compile": ["model.json"],
    "blocks": [],
    "report": ["model.json", "recording.csv", "a=track.csv,track.csv", "-o", "page.html"],
}
# These wait for something: a device, an emulator, a browser.
WAITING = {"bench", "twin", "serve"}

listed = re.findall(r"^  ([a-z]+) +\S", run("--help").stdout, re.M)
check(len(listed) > 15, "hyst --help lists", listed)
for ask in ("-V", "--version"):
    answer = run(ask)
    check(answer.returncode == 0 and re.fullmatch(r"hyst \d+\.\d+\.\d+\n", answer.stdout), ask, answer.stdout)

for name in listed:
    described = run(name, "--help")
    check(described.returncode == 0 and described.stderr == "", name, "--help:", described.stderr)
    check(run("help", name).stdout == described.stdout, "hyst help", name, "is not what", name, "--help says")
    for line in described.stdout.splitlines():
        check(len(line) <= 120, name, "--help has a line of", len(line), "characters:", line)
    options = set(re.findall(r"(?:^|, |\s)(--[a-z-]+)", described.stdout))
    check("--json[=FILE]" in described.stdout, name, "has no --json[=FILE]")
    wrong = run(name, "--no-such-option")
    check(wrong.returncode == 2 and wrong.stdout == "" and wrong.stderr.count("\n") == 1, name, "--no-such-option:",
          wrong.returncode, wrong.stderr)
    if "--port" in options and name not in WAITING:
        for bad in (["--baud", "7"], ["--slave", "0"], ["--timeout", "0"], ["--json="]):
            answer = run(name, "--port", "no/such/port", *(["x.image"] if name == "push" else []),
                         *(["-o", "out.csv"] if name in ("record", "pull") else []), *bad)
            check(answer.returncode == 2 and "no/such/port" not in answer.stderr and answer.stderr.count("\n") == 1,
                  name, *bad, "was not refused before the port was opened:", answer.stderr)
    elif name not in WAITING:
        check(name in ANSWERS, name, "is not in ANSWERS: say how it is asked")
for name in ("record", "track"):
    for bad in (["--waveform", "square"], ["--waveform", "sine", "--frequency", "0"], ["--waveform", "sine", "--cycles", "0"],
                ["--waveform", "sine", "--amplitude", "-1"], ["--waveform", "staircase", "--steps", "0"]):
        answer = run(name, "--port", "no/such/port", "-o", "out.csv", *bad, *(["--both"] if name == "track" else []))
        check(answer.returncode == 2 and answer.stderr.count("\n") == 1, name, *bad, ":", answer.returncode, answer.stderr)


def parsed(name, text):
    try:
        return json.loads(text)
    except ValueError as error:
        check(False, name, "--json is no JSON:", error)
        return {}


for name, arguments in ANSWERS.items():
    plain, on_stdout = run(name, *arguments), run(name, *arguments, "--json")
    into_file = run(name, *arguments, "--json=answer.json")
    check(plain.returncode == 0 == on_stdout.returncode == into_file.returncode, name, plain.stderr, into_file.stderr)
    check("\x1b" not in plain.stdout + plain.stderr, name, "writes escape sequences where no terminal is")
    answer = parsed(name, on_stdout.stdout)
    check(str(answer.get("format", "")).startswith("hyst-"), name, "--json has no format:", list(answer)[:3])
    check(parsed(name, open("answer.json", encoding="utf-8").read()) == answer, name, "--json=FILE differs from --json")
    check(plain.stdout and into_file.stdout == plain.stdout, name, "--json=FILE changes the text")
    check(run(name, *arguments, "--json=-").stdout == on_stdout.stdout, name, "--json=- is not --json")
    refused = run(name, *arguments, "--json=no/such/folder/x.json")
    check(refused.returncode == 1 and refused.stdout == "" and refused.stderr.count("\n") == 1, name,
          "--json=no/such/folder:", refused.stderr)

# "-": a recording on stdin, for whoever takes one; a result on stdout, with the text out of the way.
recording = open("recording.csv", encoding="utf-8").read()
for name in ("look", "bode", "fit", "import"):
    piped = run(name, "-", *ANSWERS[name][1:], stdin=recording)
    check(piped.returncode == 0 and piped.stdout, name, "-:", piped.stderr)
model = run("fit", "recording.csv", "--operators", "4", "-o", "-")
check(parsed("fit -o -", model.stdout).get("format") == "hyst-model-1" and "NRMSE" in model.stderr, "fit -o -", model.stderr)
check(run("compile", "-", "--json", stdin=model.stdout).stdout == run("compile", "model.json", "--json").stdout,
      "compile - is not compile model.json")
check(run("import", "recording.csv", "-o", "-").stdout.startswith("# sample_rate_hz"), "import -o -")
both = run("fit", "recording.csv", "-o", "-", "--json")
check(both.returncode == 2 and "two outputs on stdout" in both.stderr, "fit -o - --json", both.stderr)

print("\n".join(faults) or f"{len(listed)} commands")
sys.exit(bool(faults))
