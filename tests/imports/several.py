#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""several.py HYST FOLDER: one recording of each actuator in a file, by names with a '*'."""
import json
import os
import shutil
import subprocess
import sys

import h5py
import numpy as np

hyst, folder = os.path.abspath(sys.argv[1]), sys.argv[2]
shutil.rmtree(folder, ignore_errors=True)
os.makedirs(folder)
os.chdir(folder)
K = np.arange(400.0)
T, U = K / 1000.0, 100.0 * np.abs((K / 100.0 + 1.0) % 2.0 - 1.0)
DRIVES, POSITIONS = [U, 0.5 * U + 3.0, 0.25 * U - 7.0], [0.1 * U, 0.07 * U + 1.0, 0.2 * U]


def run(*arguments, status=0):
    done = subprocess.run([hyst, "import", *arguments], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == status, (arguments, done.returncode, done.stdout, done.stderr)
    assert status == 0 or done.stderr.count("\n") == 1, done.stderr
    return done


def values(path):
    with open(path, encoding="utf-8") as file:
        lines = [line for line in file if not line.startswith("#")]
    columns = np.loadtxt(lines[1:], delimiter=",", unpack=True)
    return dict(zip(lines[0].strip().split(","), columns))


def expect(path, which):
    found = values(path)
    assert np.allclose(found["drive"], DRIVES[which], atol=1e-9), (path, which)
    assert np.allclose(found["displacement"], POSITIONS[which], atol=1e-9), (path, which)
    return found


np.savetxt("stages.csv", np.column_stack([T, *[c for pair in zip(DRIVES, POSITIONS) for c in pair], 20.0 + T]), delimiter=",",
           header="t,V1,X1,V2,X2,V10,X10,T", comments="")
told = run("stages.csv").stdout
assert "3 pairs of such columns" in told and "--drive 'V*' --displacement 'X*'" in told, told
pattern = ("--drive", "V*", "--displacement", "X*", "--temperature", "T")
report = json.loads(run("stages.csv", *pattern, "-o", "stage.csv", "--json").stdout)
assert report["format"] == "hyst-imports-1", report
assert [one["recording"] for one in report["recordings"]] == ["stage-1.csv", "stage-2.csv", "stage-10.csv"], report
for which, name in enumerate(("stage-1.csv", "stage-2.csv", "stage-10.csv")):
    assert np.allclose(expect(name, which)["temperature"], 20.0 + T), "T is the temperature, and t the time"
# One by one it is the same, and what the others have is kept beside it.
run("stages.csv", "--drive", "V2", "--displacement", "X2", "--temperature", "T", "-o", "alone.csv")
alone, together = values("alone.csv"), values("stage-2.csv")
assert list(alone) == [*together, "V1", "X1", "V10", "X10"], list(alone)
assert all(np.array_equal(alone[name], together[name]) for name in together)
# Groups of a file.
with h5py.File("stages.h5", "w") as file:
    for name, drive, position in zip(("left", "right"), DRIVES, POSITIONS):
        start = 7.0 if name == "right" else 0.0
        file[f"{name}/time"], file[f"{name}/drive"], file[f"{name}/position"] = T + start, drive, position
told = run("stages.h5").stdout
assert "2 pairs of such columns" in told and "--drive '*/drive' --displacement '*/position'" in told, told
run("stages.h5", "--drive", "*/drive", "--displacement", "*/position", "--time", "*/time", "-o", "side.csv")
expect("side-left.csv", 0)
assert abs(expect("side-right.csv", 1)["t"][0] - 7.0) < 1e-9, "the time is that of its group"
# What is not there, or would be lost.
for arguments, why in ((("--drive", "W*", "--displacement", "X*"), "no column is called 'W*'"),
                       (("--drive", "V*", "--displacement", "X1"), "both need a '*'"),
                       (("--drive", "V*", "--displacement", "Y*"), "no column 'Y1'")):
    assert why in run("stages.csv", *arguments, status=1).stderr, arguments
shutil.copy("stages.csv", "stage-1.csv")
assert "is the same file as the input" in run("stage-1.csv", *pattern, "-o", "stage.csv", status=1).stderr
assert "need names" in run("stages.csv", *pattern, "-o", "-", status=2).stderr
with open("single.csv", "w", encoding="ascii") as file:
    file.writelines(["t,V1,X1\n"] + [f"{t},{u},{y}\n" for t, u, y in zip(T, U, POSITIONS[0])])
assert "pairs" not in run("single.csv").stdout
print("several actuators: by numbers and by groups")
