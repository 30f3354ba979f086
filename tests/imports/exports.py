#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of measurements as laboratories have them, and what `hyst import` makes of each.

exports.py HYST FOLDER [--table FILE.md [PAGE.md]]
exports.py HYST FOLDER --damage SEED COUNT

Every entry of EXPORTS writes one and the same measurement (a triangle of 0 to 100 V and a displacement with hysteresis,
1 kHz) in another way: by the libraries that write these files (numpy, scipy, h5py, gzip) or, for instruments, in the
layout that their manuals print. A file that can be read has to give the same numbers; one that must not be is to be
refused with one line that names the reason. --table writes the list for the documentation, and compares it with the page that is there. --damage changes bytes of
these files, cuts or doubles parts of them: whatever comes of it, hyst must end with 0, or with 1 and one line.
"""
import gzip
import io
import os
import subprocess
import sys

import h5py
import numpy as np
import scipy.io

RATE, ROWS = 1000.0, 400
K = np.arange(ROWS)
T = K / RATE
# Triangles of 0 to 100 V; the displacement lags behind by a play of 8 V and bends a little.
U = 100.0 * np.abs((K / 100.0 + 1.0) % 2.0 - 1.0)
Y = np.zeros(ROWS)
_w = 0.0
for _k in range(ROWS):
    _w = max(U[_k] - 8.0, min(U[_k] + 8.0, _w))
    Y[_k] = 0.12 * _w + 0.02 * U[_k] + 1e-4 * U[_k] ** 2
REF = 0.15 * U

EXPORTS = []

PAGE = """<!-- Written by tests/imports/exports.py, and compared by the test imports. -->
# Files that `hyst` reads

The same measurement in the ways in which laboratories export it, and what becomes of each. Every command reads these
files; `hyst import` says what it takes the columns for, and has options for what a file does not say. The libraries
that write these formats wrote the files. Those of instruments are in the layout that their manuals print.

LabVIEW's TDMS is read by the Python package alone: `hyst.read("x.tdms")`, and `.write("x.csv")` for the commands. The
one well-kept reader of that format is npTDMS, a Python library, and there is none in C. A command that started Python
in silence would depend on what is installed there. So the command says what to do. The test `python_tdms` has files by
npTDMS: waveforms with units, time stamps, groups, and what is refused.

| file | `hyst import` |
|---|---|
"""


def export(name, arguments="", refused=None, tolerance=1e-6, **options):
    """arguments: of `hyst import`. refused: what the line has to say."""

    def register(write):
        EXPORTS.append((name, write, arguments.split(), refused, tolerance, options))
        return write

    return register


def rows(*columns, separator=",", comma=False, form="%.9g", end="\n"):
    lines = []
    for values in zip(*columns):
        fields = [(form % value).replace(".", "," if comma else ".") for value in values]
        lines.append(separator.join(fields))
    return end.join(lines) + end


def text(path, content, encoding="utf-8"):
    with open(path, "wb") as file:
        file.write(content.encode(encoding))


# ---- separators, decimal signs, names

@export("CSV with names")
def _(path):
    text(path, "time,drive,displacement\n" + rows(T, U, Y))


@export("CSV, names in another order and case")
def _(path):
    text(path, "Displacement,Time,Drive\n" + rows(Y, T, U))


@export("CSV without names")
def _(path):
    text(path, rows(T, U, Y))


@export("CSV, blanks behind commas")
def _(path):
    text(path, "t, u, y\n" + rows(T, U, Y, separator=", "))


@export("CSV, a comma at the end of each line")
def _(path):
    text(path, "t,u,y,\n" + rows(T, U, Y, end=",\n"))


@export("semicolons")
def _(path):
    text(path, "t;drive;position\n" + rows(T, U, Y, separator=";"))


@export("semicolons and decimal commas (German spreadsheet)")
def _(path):
    text(path, "Zeit;drive;position\r\n" + rows(T, U, Y, separator=";", comma=True, end="\r\n"))


@export("tabs")
def _(path):
    text(path, "t\tdrive\tposition\n" + rows(T, U, Y, separator="\t"))


@export("tabs and decimal commas")
def _(path):
    text(path, "t\tdrive\tposition\n" + rows(T, U, Y, separator="\t", comma=True))


@export("columns between blanks")
def _(path):
    text(path, "t drive position\n" + rows(T, U, Y, separator="   ", form="%12.6f"), )


@export("bars")
def _(path):
    text(path, "t|drive|position\n" + rows(T, U, Y, separator="|"))


@export("quoted names and numbers")
def _(path):
    text(path, '"time","drive","displacement"\n' + "".join(f'"{t:.6f}","{u:.9g}","{y:.9g}"\n' for t, u, y in zip(T, U, Y)))


@export("quoted numbers with decimal commas")
def _(path):
    text(path, '"time","drive","displacement"\n' +
         "".join(",".join('"' + (f"{v:.9g}").replace(".", ",") + '"' for v in row) + "\n" for row in zip(T, U, Y)))


@export("Windows line ends")
def _(path):
    text(path, "t,u,y\r\n" + rows(T, U, Y, end="\r\n"))


@export("old Macintosh line ends")
def _(path):
    text(path, "t,u,y\r" + rows(T, U, Y, end="\r"))


@export("byte order mark")
def _(path):
    text(path, "t,u,y\n" + rows(T, U, Y), "utf-8-sig")


@export("UTF-16 with a mark, tabs (spreadsheet's Unicode text)")
def _(path):
    text(path, "t\tu\ty\r\n" + rows(T, U, Y, separator="\t", end="\r\n"), "utf-16")


@export("UTF-16 without a mark")
def _(path):
    text(path, "t,u,y\n" + rows(T, U, Y), "utf-16-le")


@export("Latin-1 with a micro sign")
def _(path):
    text(path, "t [s];U [V];Weg [µm]\n" + rows(T, U, Y, separator=";"), "latin-1")


@export("gzip")
def _(path):
    with gzip.open(path, "wb") as file:
        file.write(("t,u,y\n" + rows(T, U, Y)).encode())


@export("empty line at the end, and text below the table")
def _(path):
    text(path, "t,u,y\n" + rows(T, U, Y) + "\nend of data\n")


# ---- units and scales

@export("units in brackets")
def _(path):
    text(path, "Time [s],V_in [V],Position [um]\n" + rows(T, U, Y))


@export("units in parentheses: ms, mV, nm")
def _(path):
    text(path, "Time (ms),V_in (mV),Position (nm)\n" + rows(1e3 * T, 1e3 * U, 1e3 * Y))


@export("units behind an underscore or a slash")
def _(path):
    text(path, "t_us,drive/kV,pos_mm\n" + rows(1e6 * T, 1e-3 * U, 1e-3 * Y, form="%.12g"))


@export("a line of units under the names")
def _(path):
    text(path, "Time,Channel A,Position\n(ms),(V),(um)\n\n" + rows(1e3 * T, U, Y))


@export("metres")
def _(path):
    text(path, "t,drive,displacement [m]\n" + rows(T, U, 1e-6 * Y))


@export("drive before an amplifier with a gain of 20", "--drive-scale 20")
def _(path):
    text(path, "t,drive [V],position [um]\n" + rows(T, U / 20.0, Y))


@export("sensor in volts, 5 um/V", "--displacement-scale 5")
def _(path):
    text(path, "t,drive [V],sensor [V]\n" + rows(T, U, Y / 5.0))


@export("sensor in volts, nothing said", refused="displacement is column 3 'sensor' in V: say how many um")
def _(path):
    text(path, "t,drive [V],sensor [V]\n" + rows(T, U, Y / 5.0))


@export("several actuators, chosen by name", "--drive V2 --displacement X2")
def _(path):
    text(path, "t,V1,X1,V2,X2\n" + rows(T, 0 * U + 3.0, 0 * Y + 1.0, U, Y))


@export("several actuators, chosen by number", "--drive 4 --displacement 5")
def _(path):
    text(path, "t,V1,X1,V2,X2\n" + rows(T, 0 * U + 3.0, 0 * Y + 1.0, U, Y))


@export("a reference beside it")
def _(path):
    text(path, "t,setpoint,drive,position\n" + rows(T, REF, U, Y))


# ---- time

@export("no time, a rate given", "--sample-rate 1000")
def _(path):
    text(path, "drive,position\n" + rows(U, Y))


@export("no time, the rate in a header line")
def _(path):
    text(path, "# Sampling rate: 1 kHz\n# drive position\n" + rows(U, Y, separator=" "))


@export("no time, no rate", refused="neither a column of times nor a sample rate")
def _(path):
    text(path, "drive,position\n" + rows(U, Y))


@export("sample numbers and a rate", "--sample-rate 1000")
def _(path):
    text(path, "sample,drive,position\n" + rows(K, U, Y, form="%.9g"))


@export("stamps with three digits at 1 kHz")
def _(path):
    text(path, "t,u,y\n" + "".join(f"{t:.3f},{u:.9g},{y:.9g}\n" for t, u, y in zip(T, U, Y)))


_jitter = np.random.default_rng(7).uniform(-0.35, 0.35, ROWS) / RATE
_jitter[0] = _jitter[-1] = 0.0


# Between the samples of a triangle no interpolation knows its tips: 3 % of the range there.
@export("stamps that jitter", tolerance=0.03)
def _(path):
    at = T + _jitter
    text(path, "t,u,y\n" + rows(at, np.interp(at, T, U), np.interp(at, T, Y), form="%.12g"))


@export("stamps in seconds since 1970")
def _(path):
    text(path, "timestamp,u,y\n" + "".join(f"{1.7e9 + t:.6f},{u:.9g},{y:.9g}\n" for t, u, y in zip(T, U, Y)))


@export("stamps as times of day")
def _(path):
    text(path, "t,u,y\n" + "".join(f"10:00:{t:09.6f},{u:.9g},{y:.9g}\n" for t, u, y in zip(T, U, Y)))


@export("date and time of day")
def _(path):
    text(path, "t;u;y\n" + "".join(f"2026-11-23 23:59:59,{k:03d};{u:.9g};{y:.9g}\n".replace("59:59", "59:%02d" % 30)
                                   for k, u, y in zip(range(400), U, Y)))


@export("a time column that contradicts the given rate", "--sample-rate 50", refused="the time column says 1000 Hz")
def _(path):
    text(path, "t,u,y\n" + rows(T, U, Y))


@export("a gap", refused="gap in time")
def _(path):
    text(path, "t,u,y\n" + rows(np.delete(T, slice(100, 110)), np.delete(U, slice(100, 110)), np.delete(Y, slice(100, 110))))


@export("stamps that go back", refused="time stays or goes back")
def _(path):
    text(path, "t,u,y\n" + rows(np.where(K == 200, 0.1, T), U, Y))


# ---- instruments, in the layout of their manuals

@export("Tektronix MSO/DPO CSV", "--displacement-scale 5")
def _(path):
    text(path, "Model,MSO4034\nFirmware Version,2.98\n\nPoint Format,Y,\nHorizontal Units,S,\nHorizontal Scale,0.04,\n"
         "Sample Interval,0.001,\nRecord Length,400,\nProbe Attenuation,10,1\nVertical Units,V,V\n"
         "Vertical Offset,0,0\n\nLabel,,\nTIME,CH1,CH2\n" + rows(T, U, Y / 5.0))


@export("Tektronix TDS: facts beside the first samples", "--drive 5 --displacement 6 --displacement-scale 5 --time 4")
def _(path):
    facts = ["Record Length,4.000000e+02,", "Sample Interval,1.000000e-03,", "Trigger Point,0.000000e+00,", ",,",
             "Source,CH1,", "Vertical Units,V,", "Vertical Scale,2.000000e+01,", "Horizontal Units,s,"]
    lines = rows(T, U, Y / 5.0, form="%.9f").splitlines()
    text(path, "".join((facts[i] if i < len(facts) else ",,") + "," + line + ",\n" for i, line in enumerate(lines)))


@export("Keysight InfiniiVision CSV", "--displacement-scale 5")
def _(path):
    text(path, "x-axis,1,2\nsecond,Volt,Volt\n" + rows(T, U, Y / 5.0, form="%+.8E"))


@export("Rigol DS1000 CSV: sample numbers, increment in the header", "--displacement-scale 5")
def _(path):
    text(path, "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,0.000000e+00,1.000000e-03\n" +
         rows(K, U, Y / 5.0, form="%.9g", end=",,\n"))


@export("Rigol MSO5000 CSV", "--displacement-scale 5")
def _(path):
    text(path, "Time(s),CH1(V),CH2(V)\n" + rows(T, U, Y / 5.0))


@export("LeCroy ASCII", "--drive 2 --displacement 3 --displacement-scale 5")
def _(path):
    text(path, "LECROYWS64Xs,12345,Waveform\nSegments,1,SegmentSize,400\nSegment,TrigTime,TimeSinceSegment1\n"
         "#1,23-Nov-2026 10:00:00,0\nTime,Ampl,Ampl\n" + rows(T, U, Y / 5.0))


@export("PicoScope CSV", "--displacement-scale 5")
def _(path):
    text(path, "Time,Channel A,Channel B\n(ms),(V),(V)\n\n" + rows(1e3 * T, U, Y / 5.0, form="%.8f"))


LVM = ("LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t{point}\n"
       "Multi_Headings\tNo\nX_Columns\t{columns}\nTime_Pref\tRelative\nOperator\tlab\nDate\t2026/11/23\n"
       "Time\t10:00:00\n***End_of_Header***\t\n\t\nChannels\t2\t\t\nSamples\t400\t400\t\n"
       "Date\t2026/11/23\t2026/11/23\t\nTime\t10:00:00\t10:00:00\t\nX_Dimension\tTime\tTime\t\nX0\t0\t0\t\n"
       "Delta_X\t{delta}\t{delta}\t\n***End_of_Header***\t\t\t\nX_Value\tdrive\tposition\tComment\n")


@export("LabVIEW .lvm with times")
def _(path):
    text(path, LVM.format(point=".", columns="One", delta="0.001") + rows(T, U, Y, separator="\t"))


@export("LabVIEW .lvm without times, decimal commas")
def _(path):
    text(path, LVM.format(point=",", columns="No", delta="0,001") +
         "".join("\t" + line + "\n" for line in rows(U, Y, separator="\t", comma=True).splitlines()))


@export("NumPy savetxt")
def _(path):
    np.savetxt(path, np.column_stack([T, U, Y]), header="t drive displacement")


# ---- binary files, by the libraries that write them

@export("MATLAB 5 .mat, vectors")
def _(path):
    scipy.io.savemat(path + ".mat", {"t": T, "drive": U, "position": Y})
    os.replace(path + ".mat", path)


@export("MATLAB 5 .mat, a structure, compressed, and a rate")
def _(path):
    scipy.io.savemat(path + ".mat", {"data": {"drive": U[:, None], "pos": Y[:, None]}, "fs": RATE}, do_compression=True)
    os.replace(path + ".mat", path)


@export("MATLAB 5 .mat, one matrix", "--drive 2 --displacement 3")
def _(path):
    scipy.io.savemat(path + ".mat", {"data": np.column_stack([T, U, Y])})
    os.replace(path + ".mat", path)


@export("MATLAB 7.3 .mat")
def _(path):
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in (("t", T), ("drive", U), ("position", Y)):
            data = file.create_dataset(name, data=value[None, :])
            data.attrs["MATLAB_class"] = np.bytes_("double")
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Mon Nov 23 10:00:00 2026 HDF5 schema 1.00 .".ljust(124)
                   + b"\x00\x02IM")


@export("NumPy .npy of one matrix")
def _(path):
    with open(path, "wb") as file:
        np.save(file, np.column_stack([T, U, Y]))


@export("NumPy .npy, signals in rows, single precision, columns first", tolerance=1e-6)
def _(path):
    with open(path, "wb") as file:
        np.save(file, np.asfortranarray(np.vstack([T, U, Y]).astype(np.float32)))


@export("NumPy .npy, structured")
def _(path):
    array = np.zeros(ROWS, dtype=[("t", "<f8"), ("drive", ">f4"), ("position", "<f8")])
    array["t"], array["drive"], array["position"] = T, U, Y
    with open(path, "wb") as file:
        np.save(file, array)


@export("NumPy .npz with a rate")
def _(path):
    with open(path, "wb") as file:
        np.savez_compressed(file, drive=U, position=Y, fs=RATE)


@export("HDF5 with units")
def _(path):
    with h5py.File(path, "w") as file:
        for name, value, unit in (("time", T, "s"), ("drive", 1e3 * U, "mV"), ("position", 1e3 * Y, "nm")):
            file.create_dataset(name, data=value, compression="gzip").attrs["units"] = unit


@export("HDF5, in a group, a rate as attribute")
def _(path):
    with h5py.File(path, "w") as file:
        group = file.create_group("run1")
        group.attrs["sample_rate_hz"] = RATE
        group["drive"], group["position"] = U, Y


# ---- what has to be refused, and why

@export("an empty file", refused="empty file")
def _(path):
    text(path, "")


@export("prose", refused="no table of numbers")
def _(path):
    text(path, "Dear colleague,\nplease find the data\nin the other folder.\n")


@export("words among the numbers", refused="2 of 400 lines of data cannot be read: line 52: 'overflow' is not a number")
def _(path):
    lines = rows(T, U, Y).splitlines()
    lines[50] = lines[50].rsplit(",", 1)[0] + ",overflow"
    lines[60] = "0.060,NaN,1"
    text(path, "t,u,y\n" + "\n".join(lines) + "\n")


@export("a line cut short", refused="line 301: 2 numbers where others have 3")
def _(path):
    lines = rows(T, U, Y).splitlines()
    lines[299] = lines[299].rsplit(",", 1)[0]
    text(path, "t,u,y\n" + "\n".join(lines) + "\n")


@export("a position that never changes", refused="never changes")
def _(path):
    text(path, "t,u,y\n" + rows(T, U, 0 * Y))


@export("a truncated gzip", refused="ends in the middle|unexpected end of file")
def _(path):
    packed = io.BytesIO()
    with gzip.GzipFile(fileobj=packed, mode="wb") as file:
        file.write(("t,u,y\n" + rows(T, U, Y)).encode())
    with open(path, "wb") as file:
        file.write(packed.getvalue()[:1500])


@export("a truncated .npy", refused="not whole")
def _(path):
    packed = io.BytesIO()
    np.save(packed, np.column_stack([T, U, Y]))
    with open(path, "wb") as file:
        file.write(packed.getvalue()[:5000])


@export("a TDMS file", refused="LabVIEW TDMS")
def _(path):
    with open(path, "wb") as file:
        file.write(b"TDSm" + bytes(64))


@export("a workbook", refused="without NumPy arrays|cannot be read")
def _(path):
    import zipfile
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("xl/workbook.xml", "<workbook/>")


@export("a picture", refused="a picture")
def _(path):
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + bytes(64))


def read_recording(path):
    with open(path, encoding="utf-8") as file:
        lines = [line for line in file if not line.startswith("#")]
    names = lines[0].strip().split(",")
    values = np.array([[float(field) for field in line.split(",")] for line in lines[1:]])
    rate = next(float(line.split(":")[1]) for line in open(path, encoding="utf-8") if line.startswith("# sample_rate_hz"))
    return rate, {name: values[:, i] for i, name in enumerate(names)}


def check(hyst, folder, number, entry):
    """What is wrong, or None; and the outcome for the table."""
    name, write, arguments, refused, tolerance, _ = entry
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
        page = PAGE + "\n".join(lines) + "\n"
        with open(sys.argv[4], "w", encoding="utf-8") as file:
            file.write(page)
        if len(sys.argv) > 5:
            with open(sys.argv[5], encoding="utf-8") as file:
                if file.read() != page:
                    wrong.append(f"{sys.argv[5]} is not what is read and refused: {sys.argv[4]} is")
    for line in wrong:
        print(line)
    print(f"{len(EXPORTS) - len(wrong)} of {len(EXPORTS)} as they should be")
    sys.exit(1 if wrong else 0)


main()
