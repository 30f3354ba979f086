#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""skew.py HYST FOLDER [--no-diagnosis]: a position sampled before or after the drive of its row, as header key displacement_sampled_after_s.

A simulated actuator without a delay. Its position is sampled 0.4 samples before the drive. Without the key that is a
delay of 0.4 samples, for `hyst diagnose`, too; with it the model that made the recording is right, and nothing is missing.
The key goes through CSV, HDF5 and `hyst import`. --no-diagnosis: without the two diagnoses at the end, which take long
where the command is instrumented.
"""
import json
import os
import subprocess
import sys

import numpy as np

hyst = os.path.abspath(sys.argv[1])
os.makedirs(sys.argv[2], exist_ok=True)
os.chdir(sys.argv[2])
RATE, SAMPLES, EARLY = 2000.0, 16000, 0.4


def run(*arguments, status=0):
    done = subprocess.run([hyst, *arguments], capture_output=True, text=True, timeout=900, check=False)
    assert done.returncode == status, (arguments, done.returncode, done.stderr)
    return done


def model(name, delay_s):
    delay = [{"block": "transport_delay", "parameters": {"delay_s": {"value": delay_s}}}] if delay_s else []
    with open(name, "w", encoding="ascii") as file:
        json.dump({"format": "hyst-model-1", "sample_rate_hz": RATE, "chain": [*delay, {
            "block": "prandtl_ishlinskii", "parameters": {
                "offset_um": {"value": 0.1}, "weights": {"value": [0.1, 0.03, 0.02]},
                "thresholds_v": {"value": [5.0, 20.0]}}}]}, file)


def write(name, drive, displacement, key):
    with open(name, "w", encoding="ascii") as file:
        file.write(f"# sample_rate_hz: {RATE:g}\n# drive_unit: V\n# displacement_unit: um\n{key}t,drive,displacement\n")
        for k, (u, y) in enumerate(zip(drive, displacement)):
            file.write(f"{k / RATE:.6f},{u:.9g},{y:.9g}\n")


def error(path):
    return json.loads(run("simulate", "model.json", path, "--json").stdout)["nrmse_percent"]


seed = 19
print("seed", seed)
random = np.random.default_rng(seed)
model("model.json", 0.0)
model("late.json", EARLY / RATE)
t = np.arange(SAMPLES) / RATE
drive = 50.0 + 25.0 * np.sin(2 * np.pi * 3.0 * t) * (1 - t / 16) + 15.0 * np.sin(2 * np.pi * 11.3 * t) + 8.0 * np.sin(2 * np.pi * 37.0 * t)
write("drive.csv", drive, 0.1 * drive, "")
run("simulate", "late.json", "drive.csv", "-o", "late.csv")
late = np.loadtxt("late.csv", delimiter=",", skiprows=4, usecols=2, encoding="ascii")
late += 0.01 * random.standard_normal(SAMPLES)  # 0.01 um of about 12
key = f"# displacement_sampled_after_s: {-EARLY / RATE}\n"
write("silent.csv", drive, late, "")
write("said.csv", drive, late, key)

# The noise is 0.01 um of the stroke. The skew is 2e-4 s, at up to 3000 V/s 0.6 V or 0.09 um of it.
noise = 100 * 0.01 / np.ptp(late)
silent, said = error("silent.csv"), error("said.csv")
print(f"noise {noise:.4f} %, without the key {silent:.4f} %, with it {said:.4f} %")
assert silent > 2.0 * noise, (silent, noise)
assert said < 1.1 * noise, (said, noise)

# It is kept by every format, and says what was done.
run("import", "said.csv", "-o", "kept.h5")
run("import", "kept.h5", "-o", "kept.csv")
for kept in ("kept.h5", "kept.csv"):
    assert error(kept) == said, kept
assert "displacement_sampled_after_s: -0.0002" in open("kept.csv", encoding="ascii").read()
told = run("simulate", "model.json", "said.csv", "-o", "moved.csv").stderr
assert "taken 200 us earlier" in told and "1 row dropped" in told, told
header = [line for line in open("moved.csv", encoding="ascii") if line.startswith("#")]
assert "# displacement_sampled_after_s: 0\n" in header and any("drive_moved_s: -0.0002" in line for line in header), header
assert json.loads(run("look", "said.csv", "--json").stdout)["recordings"][0]["drive"]["moved_s"] == -EARLY / RATE
assert json.loads(run("look", "silent.csv", "--json").stdout)["recordings"][0]["drive"]["moved_s"] is None
write("bad.csv", drive, late, "# displacement_sampled_after_s: soon\n")
refused = run("simulate", "model.json", "bad.csv", status=1)
assert refused.stderr.count("\n") == 1 and "'soon', not a number of seconds" in refused.stderr, refused.stderr


def lags(path):
    """Findings that are a delay or a lag, with their numbers."""
    found = json.loads(run("diagnose", path, "--model", "model.json", "--json").stdout)["findings"]
    return {one["block"] for one in found} & {"transport_delay", "amplifier_bandwidth", "sensor_bandwidth"}


if "--no-diagnosis" not in sys.argv[3:]:
    assert lags("silent.csv"), "a skew that nobody says looks like a delay"
    assert not lags("said.csv"), "a known skew is no delay"
