# SPDX-License-Identifier: GPL-3.0-or-later
"""In the style of files that laboratories have published, each of which was once taken wrongly, or refused without need
or without a way on."""
import h5py
from measurement import export, rows, T, text, U, Y


# ---- units

@export("units behind commas in the names", says=["'U' in V", "'x' in nm"])
def _(path):
    text(path, "Time,s\tU,V\tx,nm\n" + rows(T, U, 1e3 * Y, separator="\t"))


@export("a time that is named by its unit in brackets alone", says=["column 1 'column 1' (by its unit)", "'CH1' in V"])
def _(path):
    text(path, "[ms],CH1[V],pos[nm]\n" + rows(1e3 * T, U, 1e3 * Y))


@export("HDF5, names whose brackets hold no unit", says=["'stage (measured)' in nm"])
def _(path):
    with h5py.File(path, "w") as file:
        for name, value, unit in (("time", T, "s"), ("stage (command)", U, "V"), ("stage (measured)", 1e3 * Y, "nm")):
            file.create_dataset(name, data=value).attrs["unit"] = unit
