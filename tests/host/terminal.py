#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""terminal.py HYST DIAGNOSIS.MD FOLDER: what commands write to a terminal.

While a diagnosis works, a line of stderr says which of the stages of docs/DIAGNOSIS.md it is in; it is never wider than
80 columns, never goes back within the diagnosis, and is gone in the end. Nothing is coloured, with NO_COLOR or without
it. What is no terminal gets no progress, and lines of it where HYST_PROGRESS asks for them.
"""
import math
import os
import pty
import random
import re
import select
import subprocess
import sys

hyst, document, folder = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2]), sys.argv[3]
os.makedirs(folder, exist_ok=True)
os.chdir(folder)
ERASED = "\r\033[K"


def run(*arguments, **variables):
    """Exit status, stdout and stderr, each of a terminal of its own."""
    environment = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "HYST_PROGRESS")}
    ends = [pty.openpty(), pty.openpty()]
    with subprocess.Popen([hyst, *arguments], stdin=subprocess.DEVNULL, stdout=ends[0][1], stderr=ends[1][1],
                          env={**environment, "TERM": "xterm-256color", **variables}) as process:
        for _, held in ends:
            os.close(held)
        written = {near: b"" for near, _ in ends}
        reading = set(written)
        while reading:
            for near in select.select(list(reading), [], [])[0]:
                try:
                    data = os.read(near, 65536)
                except OSError:  # the other end is closed
                    data = b""
                written[near] += data
                if not data:
                    reading.remove(near)
                    os.close(near)
        status = process.wait()
    return status, *(text.decode().replace("\r\n", "\n") for text in written.values())


def piped(*arguments, **variables):
    environment = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "HYST_PROGRESS")}
    done = subprocess.run([hyst, *arguments], capture_output=True, text=True, check=True, env={**environment, **variables})
    return done.stdout, done.stderr


# A hysteresis and noise, of which a diagnosis is short.
RATE = 1000.0
random.seed(1)
with open("recording.csv", "w", encoding="ascii") as file:
    file.write(f"# sample_rate_hz: {RATE:g}\nt,drive,displacement\n")
    a = b = 50.0
    for k in range(2000):
        u = 50.0 + 40.0 * math.sin(2 * math.pi * 3.0 * k / RATE)
        a, b = min(max(a, u - 8.0), u + 8.0), min(max(b, u - 20.0), u + 20.0)
        file.write(f"{k / RATE:.3f},{u:.5f},{0.1 * u + 0.04 * a + 0.02 * b + random.gauss(0.0, 0.01):.6f}\n")

with open(document, encoding="utf-8") as file:
    text = file.read()
stages = re.findall(r"^\| ([a-z ]+) \|", text.split("<!-- begin stages -->")[1].split("<!-- end stages -->")[0], re.M)[1:]
assert len(stages) > 10, stages

status, out, err = run("diagnose", "recording.csv", "--report", "page.html")
assert status == 0 and "NRMSE" in out, (status, err)
drawn = [line for line in err.split(ERASED) if line]
labels, fractions = [], {}
for line in drawn:
    found = re.fullmatch(r"([a-z: ]+) \[(#*) *\] +(\d+) %", line)
    assert found and len(line) <= 80, line
    if found[1] != "fitting" and labels[-1:] != [found[1]]:  # a fit is a piece of a stage
        labels.append(found[1])
    fractions.setdefault(found[1], []).append(int(found[3]))
wanted = ["looking", "looking: faults", *(f"diagnosing: {stage}" for stage in stages), "diagnosing: account",
          "writing the page"]
assert labels == wanted, labels
told = [fraction for stage in stages for fraction in fractions[f"diagnosing: {stage}"]]
assert told == sorted(told) and told[-1] > 50, told
assert err.endswith(ERASED), repr(err[-200:])  # nothing of it stays

# No colours and no bold type, on a terminal either; NO_COLOR changes nothing.
commands = (("--help",), ("help", "fit"), ("look", "recording.csv"), ("fit", "recording.csv", "-o", "model.json"),
            ("simulate", "model.json", "recording.csv"), ("blocks",), ("fit", "missing.csv"), ("fit",))
for arguments in commands:
    plain, quiet = run(*arguments), run(*arguments, NO_COLOR="1")
    for answer in (plain, quiet):
        assert "\033" not in answer[1], (arguments, answer[1])
        assert set(re.findall(r"\033[^A-Za-z]*[A-Za-z]", answer[2])) <= {"\033[K"}, (arguments, answer[2])
    assert plain[:2] == quiet[:2], arguments

# Progress is a terminal's, or a program's that asks for it.
assert piped("fit", "recording.csv", "-o", "model.json")[1] == ""
lines = piped("diagnose", "recording.csv", HYST_PROGRESS="lines")[1].splitlines()
assert all(re.fullmatch(r"progress: \d+ % [a-z: ]+", line) for line in lines), lines
assert {f"diagnosing: {stage}" for stage in stages} <= {line.split(" % ")[1] for line in lines}, lines
