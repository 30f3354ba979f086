#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of measurements as laboratories have them, and what `hyst import` makes of each.

exports.py HYST FOLDER [--table FILE.md [PAGE.md]]
exports.py HYST FOLDER --damage SEED COUNT

Every entry of EXPORTS writes one and the same measurement (measurement.py: a triangle of 0 to 100 V and a displacement
with hysteresis, 1 kHz) in another way: by the libraries that write these files (numpy, scipy, h5py, gzip) or, for
instruments, in the layout that their manuals print. A file that can be read has to give the same numbers; one that must
not be is to be refused with one line that names the reason. --table writes the list for the documentation, and compares
it with the page that is there. --damage changes bytes of these files, cuts or doubles parts of them: whatever comes of
it, hyst must end with 0, or with 1 and one line.
"""
import os
import subprocess
import sys

import numpy as np
from measurement import EXPORTS, RATE, ROWS, U, Y

# Each of these adds its files to EXPORTS, in this order.
import text_files
import lab_headers
import instrument_files
import binary_files
import lab_day
import found_files
import other_labs
import refused_files

PAGE = """<!-- Written by tests/imports/exports.py, and compared by the test imports. -->
# Files that `hyst` reads

The same measurement in the ways in which laboratories export it, and what becomes of each: {read} kinds are read, {refused}
are refused with the reason. Every command reads these files; `hyst import` says what it takes the columns for, and has
options for what a file does not say. The libraries that write these formats wrote the files. Those of instruments are
in the layout that their manuals print.

What a column is, its name and its unit say. Words of names are English, German and French, some of other languages.
What neither says is taken by its place only where nothing is left to choose; then a line says so. Where two columns
could be the drive or the displacement, the file is refused, with the columns and the option to give.

A unit that nothing states is said: `taken for s`, `taken for um`. Times in ms that say nothing of it are read as
seconds so, with a rate that is a thousand times too low; `--sample-rate` says the right one, and with it the unit.
Whole numbers as times without a unit are refused for that.

Files that real instruments wrote are read as well: `./scripts/recordings --exports` brings 14 of them from public
repositories, by commit and checksum, and shows their licences; they are not part of this one. The test `imports_real`
compares rate, first time and every value with what rules written for each file alone give, and is skipped without them.

| instrument | repository, licence |
|---|---|
| Rigol DS1052E, DS1074Z, DS1102D, DS1102E, DS1204B, DS2072A, DS4024; Rohde & Schwarz RTP | scottprahl/RigolWFM at 159e647c, BSD-3-Clause |
| Keysight InfiniiVision | HCui91/Scope_plot at d994896a, MIT |
| Tektronix MSO64 (one channel: refused) | tektronix/tm_data_types at 6a109308, Apache-2.0 |
| LabVIEW `.lvm`: no times, times beside each signal, decimal commas, empty fields | ladisk/lvm_read at a20623c1, MIT |

None of LeCroy's or PicoScope's with a licence was found; these are imitations alone.

LabVIEW's TDMS is read by the Python package alone: `hyst.read("x.tdms")`, and `.write("x.csv")` for the commands. The
one well-kept reader of that format is npTDMS, a Python library, and there is none in C. A command that started Python
in silence would depend on what is installed there. So the command says what to do. The test `python_tdms` has files by
npTDMS: waveforms with units, time stamps, groups, and what is refused.

| file | `hyst import` |
|---|---|
"""


def read_recording(path):
    with open(path, encoding="utf-8") as file:
        lines = [line for line in file if not line.startswith("#")]
    names = lines[0].strip().split(",")
    values = np.array([[float(field) for field in line.split(",")] for line in lines[1:]])
    rate = next(float(line.split(":")[1]) for line in open(path, encoding="utf-8") if line.startswith("# sample_rate_hz"))
    return rate, {name: values[:, i] for i, name in enumerate(names)}


def check(hyst, folder, number, entry):
    """What is wrong, or None; and the outcome for the table."""
    name, write, arguments, refused, tolerance, options = entry
    path, out = os.path.join(folder, f"export-{number:02d}"), os.path.join(folder, f"export-{number:02d}.recording.csv")
    if os.path.exists(out):
        os.remove(out)
    write(path)
    done = subprocess.run([hyst, "import", path, "-o", out, *arguments], capture_output=True, text=True, timeout=60)
    if refused is not None:
        if done.returncode != 1:
            return f"{name}: exit {done.returncode}, wanted 1\n{done.stdout}", ""
        if len(done.stderr.strip().splitlines()) != 1 or not any(part in done.stderr for part in refused.split("|")):
            return f"{name}: wanted '{refused}', said: {done.stderr}", ""
        if os.path.exists(out):
            return f"{name}: refused, and written all the same", ""
        return None, "refused: " + done.stderr.strip().split(": ", 2)[2].replace("|", "\\|")
    if done.returncode != 0:
        return f"{name}: exit {done.returncode}: {done.stderr}", ""
    rate, column = read_recording(out)
    if abs(rate / RATE - 1.0) > 1e-9:
        return f"{name}: {rate} Hz\n{done.stdout}", ""
    if abs(column["t"][0] - options.get("start", column["t"][0])) > 1e-9:
        return f"{name}: begins at {column['t'][0]} s\n{done.stdout}", ""
    for part in options.get("says", []):
        if part not in done.stdout:
            return f"{name}: wanted '{part}'\n{done.stdout}", ""
    for part in options.get("says_not", []):
        if part in done.stdout:
            return f"{name}: not wanted: '{part}'\n{done.stdout}", ""
    with open(out, encoding="utf-8") as file:
        header = file.read()
    for key in options.get("keys", []):
        if key + "\n" not in header:
            return f"{name}: wanted the header line '{key}'\n{done.stdout}", ""
    for what, truth in (("drive", U), ("displacement", Y)):
        size = min(len(truth), len(column[what]))
        error = np.max(np.abs(column[what][:size] - truth[:size])) / np.ptp(truth)
        if size < ROWS - 1 or error > tolerance:
            return f"{name}: {what} off by {error:.3g} of its range, {size} samples\n{done.stdout}", ""
    return None, "read" + (" with `" + " ".join(arguments) + "`" if arguments else "")


def damage(hyst, folder, seed, count):
    random = np.random.default_rng(seed)
    path = os.path.join(folder, "damaged")
    wrong, refused = 0, 0
    for i in range(count):
        EXPORTS[i % len(EXPORTS)][1](path)
        with open(path, "rb") as file:
            data = bytearray(file.read())
        for _ in range(random.integers(1, 6) if data else 0):
            at = int(random.integers(0, len(data)))
            kind = random.integers(0, 4)
            if kind == 0:
                data[at] = random.integers(0, 256)
            elif kind == 1:
                del data[at:at + int(random.integers(1, 200))]
            elif kind == 2:
                data[at:at] = data[at:at + int(random.integers(1, 200))]
            else: # the first bytes, where formats say what comes
                data[int(random.integers(0, min(len(data), 600)))] = random.integers(0, 256)
            if not data:
                break
        with open(path, "wb") as file:
            file.write(data)
        done = subprocess.run([hyst, "import", path], capture_output=True, timeout=120)
        lines = done.stderr.strip().splitlines()
        refused += done.returncode == 1
        if not (done.returncode == 0 and not lines or done.returncode == 1 and len(lines) == 1):
            wrong += 1
            keep = os.path.join(folder, f"damaged-{seed}-{i}")
            os.replace(path, keep)
            print(f"{keep} ({EXPORTS[i % len(EXPORTS)][0]}): exit {done.returncode}: {done.stderr[-400:]!r}")
    print(f"seed {seed}: {count} damaged files, {refused} refused, {wrong} handled wrongly")
    sys.exit(1 if wrong else 0)


def main():
    hyst, folder = sys.argv[1], sys.argv[2]
    os.makedirs(folder, exist_ok=True)
    if len(sys.argv) > 4 and sys.argv[3] == "--damage":
        damage(hyst, folder, int(sys.argv[4]), int(sys.argv[5]))
    wrong, lines = [], []
    for number, entry in enumerate(EXPORTS, 1):
        trouble, outcome = check(hyst, folder, number, entry)
        if trouble:
            wrong.append(f"export-{number:02d}: {trouble}")
        lines.append(f"| {entry[0]} | {outcome or 'WRONG'} |")
    if len(sys.argv) > 4 and sys.argv[3] == "--table":
        read = sum(entry[3] is None for entry in EXPORTS)
        page = PAGE.format(read=read, refused=len(EXPORTS) - read) + "\n".join(lines) + "\n"
        with open(sys.argv[4], "w", encoding="utf-8") as file:
            file.write(page)
        if len(sys.argv) > 5:
            with open(sys.argv[5], encoding="utf-8") as file:
                if file.read() != page:
                    wrong.append(f"{sys.argv[5]} is not what is read and refused: {sys.argv[4]} is")
            comparison = os.path.join(os.path.dirname(sys.argv[5]), "COMPARISON.md")
            with open(comparison, encoding="utf-8") as file:
                if f"| {read} kinds of export ([IMPORTS](IMPORTS.md)) |" not in file.read():
                    wrong.append(f"{comparison}: not {read} kinds of export, which are read")
    for line in wrong:
        print(line)
    print(f"{len(EXPORTS) - len(wrong)} of {len(EXPORTS)} as they should be")
    sys.exit(1 if wrong else 0)


main()
