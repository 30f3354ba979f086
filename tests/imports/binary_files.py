# SPDX-License-Identifier: GPL-3.0-or-later
"""Binary files, by the libraries that write them."""
import io
import os

import h5py
import numpy as np
import scipy.io
import scipy.sparse
from measurement import export, K, RATE, ROWS, rows, T, U, Y


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


# ---- what stands beside the signals, and what of them cannot be used


@export("MATLAB 5 .mat, a sparse matrix as drive", refused="left out are others: drive is a sparse matrix: save full() of it")
def _(path):
    scipy.io.savemat(path + ".mat", {"t": T, "drive": scipy.sparse.csc_matrix(U), "displacement": Y})
    os.replace(path + ".mat", path)


@export("MATLAB 5 .mat, a displacement of complex numbers",
        refused="left out are others: displacement holds complex numbers: save their real part or magnitude")
def _(path):
    scipy.io.savemat(path + ".mat", {"t": T, "drive": U, "displacement": Y + 1j * U})
    os.replace(path + ".mat", path)


@export("MATLAB 5 .mat, a displacement that is five samples shorter, and settings",
        refused="left out are others: displacement has 395 samples where others have 400")
def _(path):
    scipy.io.savemat(path + ".mat", {"gain": 20.0, "t": T, "drive": U, "displacement": Y[:-5], "axis": 1.0})
    os.replace(path + ".mat", path)


@export("NumPy .npz, a displacement that is one sample shorter",
        refused="left out are others: displacement has 399 samples where others have 400")
def _(path):
    with open(path, "wb") as file:
        np.savez(file, t=T, drive=U, displacement=Y[1:])


@export("HDF5, a displacement of complex numbers",
        refused="left out are others: displacement holds complex numbers: save their real part or magnitude")
def _(path):
    with h5py.File(path, "w") as file:
        file["t"], file["drive"], file["displacement"] = T, U, Y + 1j * U


@export("HDF5, packed by LZF", refused="displacement cannot be read: it is packed by lzf (filter 32000), unpack it")
def _(path):
    with h5py.File(path, "w") as file:
        for name, value in (("displacement", Y), ("drive", U), ("t", T)):
            file.create_dataset(name, data=value, compression="lzf")


@export("HDF5, names of the columns in an attribute, the position first",
        says=["column 3 'data/drive', taken for V (by its name)"])
def _(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("data", data=np.column_stack([T, Y, U])).attrs["columns"] = ["time", "position", "drive"]


@export("HDF5, signals in rows, names and units in attributes, behind a shorter array",
        says=["'data/pos' in nm", "'data/drive' in V"])
def _(path):
    with h5py.File(path, "w") as file:
        file["axis"] = np.arange(5.0)
        data = file.create_dataset("data", data=np.vstack([1e3 * T, 1e3 * Y, U]))
        data.attrs["names"] = np.array([b"t", b"pos", b"drive"])
        data.attrs["units"] = np.array([b"ms", b"nm", b"V"])


@export("HDF5, times as netCDF writes dates")
def _(path):
    with h5py.File(path, "w") as file:
        file["time"], file["drive"], file["displacement"] = K.astype("i8"), U, Y
        file["time"].attrs["units"] = "milliseconds since 2026-11-30 10:00:00"


@export("HDF5, ticks of a lock-in amplifier's clock", "--drive auxin0 --displacement auxin1 --displacement-scale 5",
        refused="are whole numbers without a unit, 210000 apart: say the rate")
def _(path):
    with h5py.File(path, "w") as file:
        group = file.create_group("demods")
        group["timestamp"], group["auxin0"], group["auxin1"] = (1234567890 + 210000 * K).astype("u8"), U, Y / 5.0


@export("HDF5, ticks of a lock-in amplifier's clock, left out",
        "--time none --sample-rate 1000 --drive auxin0 --displacement auxin1 --displacement-scale 5")
def _(path):
    with h5py.File(path, "w") as file:
        group = file.create_group("demods")
        group["timestamp"], group["auxin0"], group["auxin1"] = (1700000000000 + 210000 * K).astype("u8"), U, Y / 5.0
