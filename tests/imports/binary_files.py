# SPDX-License-Identifier: GPL-3.0-or-later
"""Binary files, by the libraries that write them."""
import io
import os

import h5py
import numpy as np
import scipy.io
from measurement import export, RATE, ROWS, rows, T, U, Y


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


@export("MATLAB 5 .mat, units in the names, a rate", says=["'disp' in nm"])
def _(path):
    scipy.io.savemat(path + ".mat", {"fs": RATE, "Vin_mV": 1e3 * U, "disp_nm": 1e3 * Y, "note": "stage 3"})
    os.replace(path + ".mat", path)


@export("HDF5, analog inputs in groups, by the last part of their names", "--drive ai0 --displacement ai1 --sample-rate 1000")
def _(path):
    with h5py.File(path, "w") as file:
        file["acq/run1/ai0"], file["acq/run1/ai1"] = U, Y


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


@export("NumPy .npz, half precision", tolerance=1e-3)
def _(path):
    with open(path, "wb") as file:
        np.savez(file, t=T, drive=U.astype(">f2"), position=Y.astype(np.float16))


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
