# SPDX-License-Identifier: GPL-3.0-or-later
"""What has to be refused, and why."""
import gzip
import io

import h5py
import numpy as np
import scipy.io
from measurement import export, ROWS, rows, T, text, U, Y


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


@export("a bad line, an unknown unit and a gap",
        refused="line 102: 'overflow' is not a number (hyst import --fill-missing: straight lines over them); line 252: gap in time: from 0.249 s to 0.35 s, one sample is 0.001 s; "
                "displacement is column 3 'y' in 'bananas', an unknown unit: say how many um")
def _(path):
    lines = rows(T, U, Y).splitlines()
    lines[100] = lines[100].rsplit(",", 1)[0] + ",overflow"
    for k in range(250, len(lines)):
        time, rest = lines[k].split(",", 1)
        lines[k] = f"{float(time) + 0.1:.6f},{rest}"
    text(path, "t,u,y [bananas]\n" + "\n".join(lines) + "\n")


def at_times(path, at):
    text(path, "t [s],u [V],y [um]\n" + rows(at, np.interp(at, T, U), np.interp(at, T, Y), form="%.12g"))


# Jitter is made even. What is sampled at another rate elsewhere would be made up there, or lost.
@export("times spaced by their logarithm", refused="the sample rate changes: from line 2 on samples are 4.081e-06 s")
def _(path):
    at_times(path, np.logspace(-4, np.log10(0.3), ROWS))


@export("a second half at half the rate",
        refused="the sample rate changes: from line 2 on samples are 0.0005 s apart, from line 202 on 0.001 s: "
                "resample the file to even times, or take a part of one rate")
def _(path):
    at_times(path, np.cumsum(np.where(np.arange(ROWS) <= 200, 0.0005, 0.001)))


@export("a gap among stamps that jitter", refused="line 202: gap in time: from 0.1")
def _(path):
    at = 0.0008 * (np.arange(ROWS) + np.random.default_rng(7).uniform(-0.35, 0.35, ROWS))
    at_times(path, at + 0.004 * (np.arange(ROWS) >= 200))


@export("a line cut short", refused="line 301: 2 numbers where others have 3")
def _(path):
    lines = rows(T, U, Y).splitlines()
    lines[299] = lines[299].rsplit(",", 1)[0]
    text(path, "t,u,y\n" + "\n".join(lines) + "\n")


@export("one column as two", "--drive u --displacement 2", refused="column 2 'u' cannot be both drive and displacement: "
        "say another for one of them")
def _(path):
    text(path, "t,u,y\n" + rows(T, U, Y))


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


def packed(write):
    """As gzip, what `write` puts into a file."""
    def pack(path):
        write(path)
        with open(path, "rb") as file:
            data = file.read()
        with gzip.open(path, "wb") as file:
            file.write(data)
    return pack


def savez(path):
    with open(path, "wb") as file:
        np.savez(file, t=T, drive=U, position=Y)


def save(path):
    with open(path, "wb") as file:
        np.save(file, np.column_stack([T, U, Y]))


def savemat(path):
    with open(path, "wb") as file:
        scipy.io.savemat(file, {"t": T, "drive": U, "position": Y})


def save_hdf5(path):
    with h5py.File(path, "w") as file:
        file["t"], file["drive"], file["position"] = T, U, Y


UNPACK = ": only text is read from gzip, unpack it first"
export("gzip of .npz", refused="gzip of an archive (NumPy .npz?)" + UNPACK)(packed(savez))
export("gzip of .npy", refused="gzip of a NumPy array" + UNPACK)(packed(save))
export("gzip of .mat", refused="gzip of a MATLAB file" + UNPACK)(packed(savemat))
export("gzip of HDF5", refused="gzip of HDF5" + UNPACK)(packed(save_hdf5))
export("gzip of a picture", refused="gzip of a picture, no measurements")(packed(lambda path: text(path, "\x89PNG\r\n", "latin-1")))
