# SPDX-License-Identifier: GPL-3.0-or-later
"""programs.py HYST FOLDER SAMPLES...: what whole runs of hyst take: its start, and diagnoses of recordings that long.

Lines: "start", the arguments, milliseconds of processor time (the best of some runs). "diagnose", samples, how many of
them were used, seconds of processor time and elapsed, peak memory in MB, and the machine's load at the end: elapsed times beside
other work say little. The recordings are simulated, in FOLDER, which
is made: the drive has sines from 2 to 61 Hz whose sizes wander, at 10 kHz; the actuator has six plays, creeps, rings
at 700 Hz, and its sensor has 0.01 um of noise. The diagnosis begins without a model.
"""
import json
import math
import os
import sys
import time

ACTUATOR = {
    "format": "hyst-model-1", "sample_rate_hz": 10000,
    "chain": [
        {"block": "prandtl_ishlinskii", "parameters": {
            "offset_um": {"value": 2.0}, "weights": {"value": [0.15, 0.02, 0.02, 0.02, 0.02, 0.015, 0.01]},
            "thresholds_v": {"value": [2.0, 5.0, 10.0, 17.0, 25.0, 35.0]}}},
        {"block": "creep", "parameters": {"gamma_per_decade": {"value": 0.02}}},
        {"block": "resonance", "parameters": {"frequency_hz": {"value": 700}, "damping_ratio": {"value": 0.03}}},
        {"block": "sensor_noise", "parameters": {"rms_um": {"value": 0.01}}}],
    "fit": {"drive_range_v": [0, 100], "displacement_range_um": [0, 35]}}


def run(arguments, output):
    """Processor time and elapsed time in s, peak memory in MB."""
    start = time.monotonic()
    pid = os.fork()
    if pid == 0:
        os.dup2(os.open(output, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644), 1)
        os.execv(arguments[0], arguments)
    _, status, usage = os.wait4(pid, 0)
    if status != 0:
        sys.exit(f"programs.py: {' '.join(arguments)} failed")
    return usage.ru_utime + usage.ru_stime, time.monotonic() - start, usage.ru_maxrss / 1024


def drive(path, samples):
    turn = 2 * math.pi
    with open(path, "w", encoding="utf-8") as out:
        out.write("# sample_rate_hz: 10000\n# drive_unit: V\n# displacement_unit: um\nt,drive,displacement\n")
        for k in range(samples):
            t = k / 10000
            slow, fast = 0.6 + 0.4 * math.sin(0.031 * turn * t + 1), 0.5 + 0.5 * math.sin(0.17 * turn * t)
            u = (50 + 28 * slow * math.sin(turn * 2.3 * t) + 14 * fast * math.sin(turn * 13.7 * t)
                 + 7 * math.sin(turn * 61 * t + 3 * math.sin(turn * 0.4 * t)))
            out.write(f"{t:.4f},{u:.5f},{k % 2}\n")


def main(hyst, folder, *lengths):
    os.makedirs(folder, exist_ok=True)
    for arguments in ("--version", "blocks"):
        best = min(run([hyst, arguments], os.devnull)[0] for _ in range(20))
        print(f"start {arguments} {1000 * best:.1f}", flush=True)
    model, csv, json_path = (os.path.join(folder, name) for name in ("actuator.json", "drive.csv", "diagnosis.json"))
    with open(model, "w", encoding="utf-8") as out:
        json.dump(ACTUATOR, out)
    for samples in map(int, lengths):
        recording = os.path.join(folder, f"{samples}.h5")
        drive(csv, samples)
        run([hyst, "simulate", model, csv, "-o", recording], os.devnull)
        cpu, elapsed, peak = run([hyst, "diagnose", recording, f"--json={json_path}"], os.devnull)
        with open(json_path, encoding="utf-8") as answer:
            used = json.load(answer).get("used", [{"samples": samples}])[0]["samples"]
        print(f"diagnose {samples} {used} {cpu:.1f} {elapsed:.1f} {peak:.0f} {os.getloadavg()[0]:.0f}", flush=True)
        os.remove(csv)


main(*sys.argv[1:])
