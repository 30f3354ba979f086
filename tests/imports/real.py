#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""real.py HYST SCRATCH: what `hyst import` makes of files that real instruments wrote.

They are in exports/ of the folder HYST_RECORDINGS, which `scripts/recordings --exports` fills. Each file is read here by rules that were
written for it alone, by hand, and compared. Exits with 77 where none is there.
"""
import os
import subprocess
import sys

# name, arguments, lines before the data, separator, decimal sign, field of the drive, field of the displacement, time:
# a field, or (start, interval) in seconds with the number in field 0 counted, or None for rows counted from 0.
GOOD = (
    ("keysight-infiniivision.csv", "--displacement-scale 1", 2, ",", ".", 1, 2, 0),
    ("rigol-ds1052e.csv", "--displacement-scale 1", 16, ",", ".", 1, 2, 0),
    ("rigol-ds1074z.csv", "--drive CH1 --displacement CH2 --displacement-scale 1", 2, ",", ".", 1, 2, (-2e-3, 2e-5)),
    ("rigol-ds1102d.csv", "--displacement-scale 1", 1, ",", ".", 1, 2, 0),
    ("rigol-ds1102e.csv", "--displacement-scale 1", 2, ",", ".", 1, 2, 0),
    ("rigol-ds1204b.csv", "--displacement-scale 1", 2, ",", ".", 1, 2, 0),
    ("rigol-ds2072a.csv", "--displacement-scale 1", 2, ",", ".", 1, 2, (-3.5e-3, 5e-6)),
    ("rigol-ds4024.csv", "--displacement-scale 1", 2, ",", ".", 1, 2, (-1.4e-3, 2e-6)), # its numbers begin at 22
    ("rohde-schwarz-rtp.csv", "", 0, ",", ".", 1, 2, 0),
    ("labview-no-times.lvm", "--drive 2 --displacement 3 --drive-scale 1 --displacement-scale 1", 22, "\t", ".", 1, 2, None),
    ("labview-times-beside-signals.lvm", "--displacement 4 --displacement-scale 1", 23, "\t", ".", 1, 3, 0),
    ("labview-decimal-comma.lvm", "--drive 2 --displacement 3 --drive-scale 1 --displacement-scale 1", 23, "\t", ",", 1, 2, None),
    ("labview-empty-fields.lvm", "--drive 2 --displacement 3", 23, "\t", ".", 1, 2, 0),
)
INTERVALS = {"labview-no-times.lvm": 0.000977, "labview-decimal-comma.lvm": 3.90625e-5}
REFUSED = (
    ("keysight-infiniivision.csv", "displacement is column 3 'column 3' in Volt: say how many um"),
    ("rigol-ds1052e.csv", "displacement is column 3 'Voltage' in V: say how many um"),
    ("rigol-ds1074z.csv", "3 columns could be the drive: 2 'CH1' in Volt (voltage), 3 'CH2' in Volt (voltage), 4 'CH3'"),
    ("labview-times-beside-signals.lvm", "no column is left for displacement: the file has 4"),
    ("labview-decimal-comma.lvm", "no column is left for drive: the file has 2"),
    ("labview-no-times.lvm", "3 columns could be the drive: 2 'F' in g (unknown)"),
    ("labview-empty-fields.lvm", "3 columns could be the drive: 2 'Dev0/Ai0' (unknown)"),
    ("tektronix-mso64.csv", "no column is left for displacement: the file has 2"),
)


def by_hand(path, rule):
    _, _, skip, separator, point, drive, displacement, time = rule
    rows = []
    with open(path, encoding="latin-1", newline=None) as file:
        for line in file.read().splitlines()[skip:]:
            fields = line.replace(point, ".").split(separator) if point != "." else line.split(separator)
            if len(fields) > displacement and fields[drive].strip() != "":
                at = len(rows) if time is None else float(fields[0])
                rows.append((at, float(fields[drive]), float(fields[displacement])))
    if isinstance(time, tuple):
        rows = [(time[0] + k * time[1], u, y) for k, u, y in rows]
    if time is None:
        interval = INTERVALS[rule[0]]
        rows = [(k * interval, u, y) for k, u, y in rows]
    return rows


def recording(path):
    with open(path, encoding="utf-8") as file:
        lines = file.read().splitlines()
    rate = next(float(line.split(":")[1]) for line in lines if line.startswith("# sample_rate_hz"))
    return rate, [tuple(float(x) for x in line.split(",")) for line in lines if line[0] in "-0123456789"]


def compare(name, out, wanted):
    rate, rows = recording(out)
    if len(rows) != len(wanted):
        return f"{name}: {len(rows)} samples, by hand {len(wanted)}"
    by_stamps = (len(wanted) - 1) / (wanted[-1][0] - wanted[0][0])
    # Stamps have seven digits or more; the rate of the shortest file, three samples, comes from two of them.
    if abs(rate / by_stamps - 1.0) > 1e-6:
        return f"{name}: {rate} Hz, by hand {by_stamps}"
    if abs(rows[0][0] - wanted[0][0]) > 1.1e-9: # a recording's times have nine decimals
        return f"{name}: begins at {rows[0][0]} s, by hand {wanted[0][0]}"
    for k, (row, want) in enumerate(zip(rows, wanted)):
        if any(abs(a - b) > 1e-8 * max(abs(b), 1e-3) for a, b in zip(row[1:], want[1:])): # nine digits are written
            return f"{name}: sample {k}: {row[1:]}, by hand {want[1:]}"
    return None


def main():
    hyst, scratch = sys.argv[1:3]
    folder = os.path.join(os.environ.get("HYST_RECORDINGS", ""), "exports")
    os.makedirs(scratch, exist_ok=True)
    there = set(os.listdir(folder)) if os.path.isdir(folder) else set()
    wrong, done = [], 0
    for rule in GOOD:
        if rule[0] not in there:
            continue
        path, out = os.path.join(folder, rule[0]), os.path.join(scratch, rule[0] + ".csv")
        ran = subprocess.run([hyst, "import", path, *rule[1].split(), "-o", out], capture_output=True, text=True, timeout=60)
        trouble = ran.stderr if ran.returncode != 0 else compare(rule[0], out, by_hand(path, rule))
        done += 1
        if trouble:
            wrong.append(f"{trouble}\n{ran.stdout}")
    for name, reason in REFUSED:
        if name in there:
            ran = subprocess.run([hyst, "import", os.path.join(folder, name)], capture_output=True, text=True, timeout=60)
            done += 1
            if ran.returncode != 1 or reason not in ran.stderr:
                wrong.append(f"{name}: wanted '{reason}': exit {ran.returncode}, {ran.stderr}")
    if done == 0:
        print(f"skipped: no exports in {folder}: ./scripts/recordings --exports")
        sys.exit(77)
    print("\n".join(wrong), f"{done - len(wrong)} of {done} as by hand", sep="\n")
    sys.exit(1 if wrong else 0)


main()
