#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""extra.py HYST FOLDER: the columns of a file that a recording has no meaning for.

HDF5 and CSV keep them, with unit and name of origin, for other programs; whatever rewrites such a recording keeps them;
nothing else changes by them.
"""
import json
import os
import shutil
import subprocess
import sys

import h5py
import numpy as np

hyst, folder = os.path.abspath(sys.argv[1]), sys.argv[2]
shutil.rmtree(folder, ignore_errors=True)
os.makedirs(folder)
os.chdir(folder)


def run(*arguments):
    done = subprocess.run([hyst, *arguments], capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, (arguments, done.returncode, done.stdout, done.stderr)
    return done.stdout


def text(value):
    return value.decode() if isinstance(value, bytes) else value


def kept_in(path):
    """Further data sets in their order: name, unit, long name, values; all on the dimension scale."""
    known = {"time", "drive", "displacement", "reference", "voltage", "current", "temperature"}
    with h5py.File(path) as file:
        names = [name for name in file if name not in known]
        for name in names:
            assert file[name].dims[0][0].name == "/time" and file[name].dtype == "<f8", name
        return {name: (text(file[name].attrs.get("units")), text(file[name].attrs.get("long_name")), file[name][:])
                for name in names}


samples = 3000
k = np.arange(samples)
T = k / 1000.0
U = np.round(50.0 + 40.0 * np.sin(2 * np.pi * 2.0 * T), 4)
Y = np.round(0.1 * U + 0.4 * np.cos(2 * np.pi * 2.0 * T), 5)
PRESSURE = np.round(1010.0 + 3.0 * np.sin(T), 3)
further = {  # as the file has it: (name in HDF5, unit, values)
    "Chamber pressure (mbar)": ("Chamber_pressure", "mbar", PRESSURE),
    "Größe [kHz]": ("Gr_e", "kHz", k % 17 / 8.0),
    "17th/status": ("column_17th_status", None, (k % 5).astype(float)),
    "17th status": ("column_17th_status_2", None, (k % 7).astype(float)),
    "plain": ("plain", None, k * 0.25),
    'raw, "A" [Pa]': ("raw_A", "Pa", 1e-7 / (1.0 + k)),
}


def write(path, columns):
    with open(path, "w", encoding="utf-8") as file:
        file.write(",".join('"' + name.replace('"', '""') + '"' if "," in name else name for name in columns) + "\n")
        file.writelines(",".join(f"{value:.17g}" for value in row) + "\n" for row in zip(*columns.values()))


bare = {"Time (s)": T, "Drive (V)": U, "Position (um)": Y}
write("bare.csv", bare)
write("scope.csv", {**bare, **{written: values for written, (_, _, values) in further.items()}})

# Kept in HDF5: names, units, names of origin, and every bit.
told = run("import", "scope.csv", "-o", "x.h5")
assert "kept beside them: Chamber_pressure (mbar), Gr_e (kHz), column_17th_status, column_17th_status_2, plain, raw_A (Pa)\n" in told, told
wanted = {name: (unit, None if name == written else written) for written, (name, unit, _) in further.items()}


def check(path, order=True):
    found = kept_in(path)
    assert {name: column[:2] for name, column in found.items()} == wanted, (path, found)
    assert not order or list(found) == list(wanted), (path, list(found))
    for name, _, values in further.values():
        assert np.array_equal(found[name][2], values), (path, name)


check("x.h5")
listed = json.loads(run("import", "scope.csv", "-o", "x.h5", "--json"))["kept"]
assert listed == [{"name": name, "long_name": written, "unit": unit or ""}
                  for written, (name, unit, _) in further.items()], listed

# CSV has them too, and there and back nothing is lost. Without such columns there is nothing to say.
told = run("import", "scope.csv", "-o", "x.csv")
assert "kept beside them: Chamber_pressure (mbar), Gr_e" in told, told
assert json.loads(run("import", "scope.csv", "-o", "x.csv", "--json"))["kept"] == listed
own = open("x.csv", encoding="utf-8").read()
assert f"\nt,drive,displacement,{','.join(wanted)}\n" in own, own[:2000]
assert "# Chamber_pressure_unit: mbar\n" in own and '# raw_A_long_name: raw, "A" [Pa]\n' in own, own[:2000]
run("import", "x.csv", "-o", "from-csv.h5")
check("from-csv.h5")
run("import", "from-csv.h5", "-o", "again.csv")
run("import", "again.csv", "-o", "from-csv.h5")
check("from-csv.h5", order=False)
assert json.loads(run("import", "scope.csv", "--json"))["kept"] is None
for output in ("bare.h5", "bare-own.csv"):
    assert "kept" not in run("import", "bare.csv", "-o", output)
with h5py.File("bare.h5") as file:
    assert set(file) == {"time", "drive", "displacement"}, list(file)

# Nothing is made of them: a look and a fit are those of the recording without them, to the digit.
for command in (("look",), ("fit", "--operators", "5")):
    answers = [run(*command, name).replace(name, "") for name in ("x.h5", "x.csv", "bare.h5")]
    assert answers[0] == answers[1] == answers[2] != "", command

# What rewrites such a recording keeps them.
run("fit", "x.h5", "--operators", "5", "-o", "model.json")
told = run("simulate", "model.json", "x.h5", "-o", "simulated.h5")
assert "kept beside them: Chamber_pressure (mbar)" in told, told
check("simulated.h5")
assert "kept beside them: Chamber_pressure" in run("simulate", "model.json", "x.h5", "-o", "simulated.csv")
run("simulate", "model.json", "simulated.csv", "-o", "simulated.h5")
check("simulated.h5")
told = run("import", "x.h5", "-o", "again.h5")
assert "not used     column" in told and "kept beside them" in told, told
check("again.h5", order=False)

# A column of times that is not taken may not take the place of the recording's own.
run("import", "scope.csv", "--time", "none", "--sample-rate", "500", "-o", "other.h5")
other = kept_in("other.h5")
assert np.array_equal(other["Time_2"][2], T) and other["Time_2"][:2] == ("s", "Time (s)"), list(other)

# What is no number stays none; uneven stamps are made even in all columns.
gap = np.where(k == 7, np.nan, PRESSURE)
np.savez("gap.npz", t=T, drive_V=U, position_um=Y, pressure=gap)
run("import", "gap.npz", "-o", "gap.h5")
assert np.array_equal(kept_in("gap.h5")["pressure"][2], gap, equal_nan=True)
stamps = T + 0.0004 * np.sin(k * 1.7)
write("uneven.csv", {"Time (s)": stamps, "Drive (V)": U, "Position (um)": Y, "ramp": 2.0 * stamps})
assert "resampled" in run("import", "uneven.csv", "-o", "uneven.h5")
with h5py.File("uneven.h5") as file:
    even, ramp = file["time"][:], file["ramp"][:]
assert len(even) == len(ramp) and np.allclose(ramp, 2.0 * even, atol=1e-4), np.abs(ramp - 2.0 * even).max()

# Of several actuators each has what is no other's.
write("stages.csv", {"Time (s)": T, "V1 (V)": U, "X1 (um)": Y, "V2 (V)": U[::-1], "X2 (um)": Y[::-1], "p (mbar)": PRESSURE})
run("import", "stages.csv", "--drive", "V*", "--displacement", "X*", "-o", "stage.h5")
for number in (1, 2):
    assert list(kept_in(f"stage-{number}.h5")) == ["p"], number

# Other programs: a data set of another length or kind is theirs alone, and one of their own long names stays.
shutil.copy("x.h5", "theirs.h5")
with h5py.File("theirs.h5", "r+") as file:
    file["short"] = np.arange(5.0)
    file["picture"] = np.zeros((samples, 3))
    file["words"] = "a note"
    file.create_group("group")["inner"] = np.arange(samples)
    file["whole"] = np.arange(samples)
    file["whole"].attrs["long_name"], file["whole"].attrs["units"] = "a count", "1"  # of variable length
run("simulate", "model.json", "theirs.h5", "-o", "theirs-again.h5")
theirs = kept_in("theirs-again.h5")
assert set(theirs) == {*wanted, "whole"} and theirs["whole"][:2] == ("1", "a count"), list(theirs)

try:
    import xarray
except ImportError:
    print("no xarray here: its part is skipped")
    sys.exit()
for engine in ("h5netcdf", "netcdf4"):
    with xarray.open_dataset("x.h5", engine=engine) as opened:
        assert set(opened.data_vars) == {"drive", "displacement", *wanted}, (engine, opened)
        for written, (name, unit, values) in further.items():
            assert opened[name].dims == ("time",) and np.array_equal(opened[name].values, values), (engine, name)
            assert opened[name].attrs.get("units") == unit, (engine, name)
            assert opened[name].attrs.get("long_name", name) == written, (engine, name)
        opened.to_netcdf(f"by-{engine}.nc", engine=engine)
    run("simulate", "model.json", f"by-{engine}.nc", "-o", "back.h5")
    check("back.h5", order=False)
