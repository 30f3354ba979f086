# SPDX-License-Identifier: GPL-3.0-or-later
"""tutorial.py SOURCE BUILD SCRATCH DOCUMENT [--rewrite]: docs/DOCUMENT is true. README.md too: see use_it.

Runs the commands of its ```console blocks, in order and in one shell, in a copy of the layout that a reader has, and
compares what they print with what the document shows. --rewrite puts what was printed into the document instead; a
screen that leaves lines out is compared all the same.

In a block, "$ " begins a command and "> " continues it; the other lines are its output. A line "..." stands for any
lines. Numbers may differ by 1 %: the fits are the same everywhere but for the rounding of another processor's BLAS.
<!-- numbers: 30 % or 0.01 --> before a block states another tolerance and what a small number may differ by;
<!-- numbers: any --> compares the words only. Ports,
identities of models, runs of blanks and the instant of a largest error (noise decides it) are not compared.
"""
import os
import re
import shutil
import subprocess
import sys

DONE = "tutorial-command-ended"
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?")


def blocks(lines):
    """Yields (tolerance, [(first line of the command, command, [first line of its output, end])])."""
    usual = (0.01, 0.0)
    tolerance, at = usual, 0
    while at < len(lines):
        stated = re.fullmatch(r"<!-- numbers: (?:(\d+) %(?: or ([\d.]+))?|(any)) -->", lines[at])
        if stated:
            tolerance = (0.0, float("inf")) if stated[3] else (int(stated[1]) / 100.0, float(stated[2] or 0.0))
        elif lines[at] == "```console":
            commands = []
            at += 1
            while lines[at] != "```":
                if lines[at].startswith("$ "):
                    first, text = at, lines[at][2:]
                    while lines[at + 1].startswith("> "):
                        at += 1
                        text += "\n" + lines[at][2:]
                    commands.append((first, text, [at + 1, at + 1]))
                else:
                    commands[-1][2][1] = at + 1
                at += 1
            yield tolerance, commands
            tolerance = usual
        at += 1


def normal(line):
    line = re.sub(r"/dev/pts/\d+", "PORT", line)
    line = re.sub(r"\bat (?:t = )?[\d.]+ s\b", "at TIME", line)
    line = re.sub(r"(?<!\.)\b(?:0x)?(?=[0-9a-fA-F]*\d)[0-9a-fA-F]{8}\b", "IDENTITY", line) # not the digits of a fraction
    line = line.replace("..", " .. ") # or ..30 would be read as .30
    return re.sub(r"\s+", " ", line).strip()


def same_line(shown, printed, tolerance):
    shown, printed = normal(shown), normal(printed)
    if NUMBER.sub("#", shown) != NUMBER.sub("#", printed):
        return False
    pairs = zip(map(float, NUMBER.findall(shown)), map(float, NUMBER.findall(printed)))
    return all(abs(a - b) <= max(tolerance[1], tolerance[0] * max(abs(a), abs(b))) for a, b in pairs)


def same(shown, printed, tolerance):
    if not shown:
        return not printed
    if shown[0].strip() == "...":
        return any(same(shown[1:], printed[skip:], tolerance) for skip in range(len(printed) + 1))
    return bool(printed) and same_line(shown[0], printed[0], tolerance) and same(shown[1:], printed[1:], tolerance)


def use_it(lines):
    """Yields (first line, command, first line of what of its output is shown, end, tolerance) of README's "Use it".

    Each indented block up to the reader's own recording is one paste; what stands behind a line that ends with "prints:"
    is of the paste before. No pair of numbers is farther apart than the tutorial allows, which shows the same lines.
    """
    at = lines.index("## Use it")
    end = next(i for i in range(at, len(lines)) if lines[i].startswith("**Your own recording**"))
    pastes, heading = [], ""
    while at < end:
        first = at
        while at < end and lines[at].startswith("    "):
            at += 1
        if at == first:
            heading = lines[at] or heading
            at += 1
        elif heading.endswith("prints:"):
            pastes[-1][2:4] = first, at
        else:
            pastes.append([first, "\n".join(line[4:] for line in lines[first:at]), at, at])
    return pastes


def lay_out(source, build, scratch):
    """What a reader has beside docs/: the build in build/host, and scripts/build, which has built it."""
    shutil.rmtree(scratch, ignore_errors=True)
    for folder in "build", "scripts":
        os.makedirs(os.path.join(scratch, folder))
    os.symlink(os.path.join(source, "docs"), os.path.join(scratch, "docs"))
    os.symlink(build, os.path.join(scratch, "build", "host"))
    os.symlink("/bin/true", os.path.join(scratch, "scripts", "build"))


def main():
    source, build, scratch = (os.path.abspath(path) for path in sys.argv[1:4])
    name = sys.argv[4]
    rewrite = sys.argv[5:] == ["--rewrite"]
    readme = name == "README.md"
    document = os.path.join(source, "" if readme else "docs", name)
    with open(document, encoding="utf-8") as file:
        lines = file.read().split("\n")
    lay_out(source, build, scratch)
    shell = subprocess.Popen(["bash", "--norc"], cwd=scratch, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                             stderr=subprocess.STDOUT, text=True, env={**os.environ, "LC_ALL": "C.UTF-8"})
    print("trap 'kill $(jobs -p) 2> /dev/null' EXIT", file=shell.stdin)
    failures, checked, shifts = 0, 0, []
    if readme: # as a reader pastes it, but ending at the first failure, whose status is that of no last command
        print("set -e", file=shell.stdin)
        found = (((0.4, 0.01), [(first, paste, (begin, end))]) for first, paste, begin, end in use_it(lines))
    else:
        found = blocks(lines)
    for tolerance, commands in found:
        for first, command, (begin, end) in commands:
            print(f"{command}\nprintf '\\n%s %s\\n' {DONE} $?", file=shell.stdin, flush=True)
            printed = []
            for line in shell.stdout:
                if line.startswith(DONE):
                    break
                printed.append(line.rstrip("\n"))
            else:
                sys.exit(f"FAIL: {name}:{first + 1}: the shell ended at: {command}")
            status = line.split()[1]
            while printed and not printed[-1].strip():
                printed.pop()
            shown = lines[begin:end]
            if readme: # shows some of the lines
                shown = ["...", *(part for line in shown for part in (line, "..."))]
            if status != "0":
                print(f"FAIL: {name}:{first + 1}: exit status {status}: {command}", *printed, sep="\n    ")
                failures += 1
            elif rewrite and not readme and "..." not in map(str.strip, shown):
                shifts.append((begin, end, printed))
            elif not same(shown, printed, tolerance):
                print(f"FAIL: {name}:{first + 1}: {command}", "shown:", *shown, "printed:", *printed, sep="\n    ")
                failures += 1
            checked += len(shown)
    shell.stdin.close()
    shell.wait()
    for begin, end, printed in reversed(shifts):
        lines[begin:end] = printed
    if rewrite:
        with open(document, "w", encoding="utf-8") as file:
            file.write("\n".join(lines))
    if checked < (5 if readme else 20) and not rewrite:
        print(f"FAIL: only {checked} lines were compared")
        failures += 1
    print(f"{checked} lines, {failures} failures")
    sys.exit(1 if failures else 0)


main()
