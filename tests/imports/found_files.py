# SPDX-License-Identifier: GPL-3.0-or-later
"""In the style of files that laboratories have published, each of which was once taken wrongly, or refused without need
or without a way on."""
import os
import struct

import h5py
import numpy as np
import scipy.io
from measurement import export, K, rows, T, text, U, Y


# ---- units

@export("units behind commas in the names", says=["'U' in V", "'x' in nm"])
def _(path):
    text(path, "Time,s\tU,V\tx,nm\n" + rows(T, U, 1e3 * Y, separator="\t"))


@export("a time that is named by its unit in brackets alone", says=["column 1 'column 1' (by its unit)", "'CH1' in V"])
def _(path):
    text(path, "[ms],CH1[V],pos[nm]\n" + rows(1e3 * T, U, 1e3 * Y))


@export("units in Cyrillic letters", says=["'U' in мВ", "'x' in нм"])
def _(path):
    text(path, "t, мс\tU, мВ\tx, нм\n" + rows(1e3 * T + 0.5, 1e3 * U, 1e3 * Y, separator="\t"))


@export("HDF5, names whose brackets hold no unit", says=["'stage (measured)' in nm"])
def _(path):
    with h5py.File(path, "w") as file:
        for name, value, unit in (("time", T, "s"), ("stage (command)", U, "V"), ("stage (measured)", 1e3 * Y, "nm")):
            file.create_dataset(name, data=value).attrs["unit"] = unit


# ---- oscilloscopes

PEAKS = "Model,MSO2024\nPoint Format,Y,,,\nHorizontal Units,S,,,\nSample Interval,0.001,,,\nVertical Units,V,,V,\nLabel,,,,\n"


@export("Tektronix MSO 2000: peaks beside two channels", "--displacement-scale 5",
        says=["'CH1' in V", "'CH2' in V, scaled", "3 'CH1 Peak Detect' (another quantity)"])
def _(path):
    text(path, PEAKS + "TIME,CH1,CH1 Peak Detect,CH2,CH2 Peak Detect\n" +
         rows(T, U, U + 0.2 * (K % 2), Y / 5.0, Y / 5.0 + 0.01 * (K % 2)))


@export("Tektronix MSO 2000: peaks beside one channel", refused="no column is left for displacement: the file has 3")
def _(path):
    text(path, PEAKS.replace(",V,,V,", ",V,") + "TIME,CH1,CH1 Peak Detect\n" + rows(T, U, U + 0.2 * (K % 2)))


def tds(channel, column):
    """What a Tektronix TDS writes: a file for each channel, with facts beside the first samples."""
    facts = ["Record Length,4.000000e+02,", "Sample Interval,1.000000e-03,", "Trigger Point,0.000000e+00,", ",,", ",,", ",,",
             f"Source,{channel},", "Vertical Units,V,", "Vertical Scale,2.000000e+01,", "Vertical Offset,0.000000e+00,",
             "Horizontal Units,s,", "Horizontal Scale,5.000000e-02,", "Pt Fmt,Y,"]
    lines = rows(T, column, form="%14.9f").splitlines()
    return [(facts[i] if i < len(facts) else ",,") + "," + line + "," for i, line in enumerate(lines)]


@export("Tektronix TDS: two channels' files side by side", "--displacement-scale 5", says=["'CH1' in V", "'CH2' in V, scaled"])
def _(path):
    text(path, "\r\n".join(a + "," + b for a, b in zip(tds("CH1", U), tds("CH2", Y / 5.0))) + "\r\n")


@export("Tektronix TDS: two channels' files side by side, nothing said of the sensor",
        refused="displacement is column 11 'CH2' in V: say how many um")
def _(path):
    text(path, "\r\n".join(a + "," + b for a, b in zip(tds("CH1", U), tds("CH2", Y / 5.0))) + "\r\n")


@export("Tektronix TDS: one channel's file",
        refused="5 'CH1' in V (voltage): drive and displacement have to stand in one file: put the columns of both side by side")
def _(path):
    text(path, "\r\n".join(tds("CH1", U)) + "\r\n")


@export("Fluke ScopeMeter: the highest and lowest values of two inputs, facts in quotes above",
        "--drive 2 --displacement 6 --displacement-scale 5", start=-0.028, says=["'column 2' in V", "5 'column 5' (the same times)"])
def _(path):
    facts = [("Title", '"Input A"', '"Input B"'), ("X Scale", "5.0E-03", "5.0E-03"), ("X Unit", '"s"', '"s"'),
             ("Y Scale", "1.00E-01", "1.00E+00"), ("Y Unit", '"V"', '"V"'), ("Y Label", '"mV"', '"V"')]
    text(path, "".join(f'"{key:13s}"\t{a}\t \t\t"{key:13s}"\t{b}\t \n' for key, a, b in facts) + "\n" +
         "".join(f"{t:.3f}\t{u:.9g}\t{u + 1:.9g}\t\t{t:.3f}\t{y:.9g}\t{y + 0.1:.9g}\n" for t, u, y in zip(T - 0.028, U, Y / 5.0)))


# ---- tables that are not what they seem

@export("a multimeter's log: decimal commas between commas, words beside them",
        refused="line 4 has 5 names, and line 5 has 6 fields, all whole numbers: decimal commas and separators are the same")
def _(path):
    text(path, "Title, \nType, DCV_(020)\n\nNo, Date, Time, Value, Unit\n" +
         "".join(f" {k + 1:04d}, 2026/11/23, 10.{k // 60:02d}.{k % 60:02d}, {int(u)},{round(100 * u) % 100:02d}, V\n"
                 for k, u in zip(K, U)))


@export("a piezo tester: the table of another run below the first",
        refused="line 206 has the names of line 3 again: another table begins; keep one in a file")
def _(path):
    names = "Time [s]\tV+ [V]\tD1 [nm]\t\n"
    lines = rows(T, U, 1e3 * Y, separator="\t", end="\t\n").splitlines(keepends=True)
    text(path, "Table 1\nWaveform: triangle\n" + names + "".join(lines[:200]) + "\nTable 2\n" + names + "".join(lines[:200]))


# ---- lines that are no data

NOTES = "".join(f"# Noise of loop {i} ({axis}): 12.{i}5 nm\n" for i in range(30) for axis in "XYZ")


@export("attocube: remarks of half a page below the table, which are no longer the data")
def _(path):
    text(path, "# Scantype: Linescan\n# Step size: (500, 500) nm\n# Columns: Time (s), Drive (V), Position (um), Movement Type\n" +
         "".join(f"{t:.9g}\t{u:.9g}\t{y:.9g}\t Idle\n" for t, u, y in zip(T, U, Y)) + NOTES)


@export("a line that says that names follow", says=["'U' in V", "'x' in nm"])
def _(path):
    text(path, "# Stage 3\n# Columns: x (nm) U (V) t (ms)\n" + rows(1e3 * Y, U, 1e3 * T + 0.5, separator=" "))


@export("remarks among the data, beside a value that is missing",
        refused="1 of 400 lines of data cannot be read: line 202: '#N/A' is not a number")
def _(path):
    lines = rows(T, U, Y, separator=";").splitlines(keepends=True)
    lines[200] = "#N/A" + lines[200][lines[200].index(";"):]
    text(path, "t;drive;position\n" + "".join(lines[:300]) + "# door opened\n" + "".join(lines[300:]))


@export("remarks among the data, and a gap behind them", refused="line 304: gap in time: from 0.299 s to 0.301 s")
def _(path):
    lines = rows(T, U, Y).splitlines(keepends=True)
    text(path, "t,drive,position\n" + "".join(lines[:200]) + "# door opened\n\n" + "".join(lines[200:300] + lines[301:]))


@export("a vibrometer's Universal File", refused="a Universal File (UFF), as vibrometers write: export the signals as text")
def _(path):
    text(path, "    -1\n   151\nbox.svd\n\nPSV Version 9.2.0.3\n    -1\n    -1\n    58\n" + rows(T, U, Y, separator=" ") + "    -1\n")


# ---- columns that say nothing new

@export("a piezo tester: no negative half, and the mean of one loop is that loop", says=["'V+' in V", "'D1' in nm"])
def _(path):
    text(path, "Time [s]\tV+ [V]\tV- [V]\tD1 [nm]\tD2 [nm]\tD3 [nm]\t\n" +
         rows(T, U, 0 * U, 1e3 * Y, 1e3 * Y, 0 * Y, separator="\t", end="\t\n"))


@export("two axes, one of them parked", says=["'y' in um", "2 'Drive x' in V (drive), 4 'x' in um (displacement)"])
def _(path):
    text(path, "Time (s),Drive x (V),Drive y (V),x (um),y (um)\n" + rows(T, 0 * U + 50.0, U, 0 * Y + 7.5, Y))


# ---- MATLAB, beside arrays of numbers

def element(kind, data):
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def matrix(flags, *parts):
    return element(14, element(6, struct.pack("<II", flags, 0)) + b"".join(parts))


def add_object(path):
    """As MATLAB writes a table: an array that names its class, and a nameless one of bytes that all objects are in."""
    with open(path, "ab") as file:
        reference = matrix(13, element(5, struct.pack("<ii", 6, 1)), element(1, b""), element(6, struct.pack("<6I", *range(6))))
        file.write(matrix(17, element(1, b"log"), element(1, b"MCOS"), element(1, b"table"), reference))
        file.write(matrix(9, element(5, struct.pack("<ii", 1, 936)), element(1, b""), element(2, bytes(range(234)) * 4)))


@export("MATLAB 5 .mat, an object of a class beside vectors", says=["1 object of a MATLAB class"])
def _(path):
    scipy.io.savemat(path + ".mat", {"t": T, "drive": U, "position": Y})
    os.replace(path + ".mat", path)
    add_object(path)


@export("MATLAB 5 .mat, an object of a class alone", refused="objects of MATLAB classes (table, timeseries) are not read: save")
def _(path):
    scipy.io.savemat(path + ".mat", {"note": "stage 3"})
    os.replace(path + ".mat", path)
    add_object(path)


@export("MATLAB 5 .mat, a text that is longer than the signals")
def _(path):
    scipy.io.savemat(path + ".mat", {"t": T, "drive": U, "position": Y})
    os.replace(path + ".mat", path)
    note = ("stage 3 " * 60).encode("utf-16-le")
    with open(path, "ab") as file:
        file.write(matrix(4, element(5, struct.pack("<ii", 1, len(note) // 2)), element(1, b"note"), element(4, note)))


@export("MATLAB 7.3 .mat, a text, an empty array and an object beside vectors")
def _(path):
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, kind, value in (("a_note", "char", np.frombuffer(b"stage 3 " * 60, np.uint8).astype(np.uint16)),
                                  ("empty", "double", np.zeros(2, np.uint64)), ("t", "double", T), ("drive", "double", U),
                                  ("log", "table", np.arange(6, dtype=np.uint32)), ("position", "double", Y)):
            data = file.create_dataset(name, data=value[:, None])
            data.attrs["MATLAB_class"] = np.bytes_(kind)
            if kind == "table":
                data.attrs["MATLAB_object_decode"] = np.int32(3)
            if name == "empty":
                data.attrs["MATLAB_empty"] = np.uint8(1)
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Mon Nov 23 10:00:00 2026 HDF5 schema 1.00 .".ljust(124)
                   + b"\x00\x02IM")
