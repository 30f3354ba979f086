#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""hdf5.py HYST FOLDER: recordings as HDF5.

There and back again bit for bit, with header keys in their order; where it comes from; xarray and netCDF-4 open it; a
damaged or foreign file is one line. With --speed SAMPLES: how long `hyst simulate` takes to read and write a recording
of so many samples as CSV and as HDF5.
"""
import hashlib
import os
import shutil
import struct
import subprocess
import sys
import time

import h5py
import numpy as np

hyst, folder = os.path.abspath(sys.argv[1]), sys.argv[2]
shutil.rmtree(folder, ignore_errors=True)
os.makedirs(folder)
os.chdir(folder)


def run(*arguments, status=0):
    done = subprocess.run([hyst, *arguments], capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == status, (arguments, done.returncode, done.stderr)
    return done


def write_csv(path, samples):
    k = np.arange(samples)
    u = 50.0 + 50.0 * np.sin(2 * np.pi * k / 1700.0) * np.cos(k / 91000.0)
    y = 0.15 * u + 0.3 * np.sin(k / 3.0)
    with open(path, "w", encoding="utf-8") as file:
        file.write("# sample_rate_hz: 10000\n# drive_unit: V\n# displacement_unit: um\n# actuator: P-885 <1> µ\n"
                   "# preload_n: 0\n# another key: z\n# drive_between_samples: held\nt,drive,displacement,temperature\n")
        step = 100000
        for first in range(0, samples, step):
            part = slice(first, min(first + step, samples))
            file.write("\n".join(f"{(n + 12) / 10000:.4f},{a:.9g},{b:.17g},21.5"
                                 for n, a, b in zip(k[part].tolist(), u[part].tolist(), y[part].tolist())) + "\n")


if len(sys.argv) > 3:
    samples = int(sys.argv[4])
    write_csv("long.csv", samples)
    with open("gain.json", "w", encoding="ascii") as model:  # little work beside reading and writing
        model.write('{"format": "hyst-model-1", "sample_rate_hz": 10000, "chain": [{"block": "prandtl_ishlinskii",'
                    '"parameters": {"offset_um": {"value": 0}, "weights": {"value": [0.15, 0]},'
                    '"thresholds_v": {"value": [7.0]}}}]}')
    seconds = {}
    for what, source, target in (("CSV to CSV", "long.csv", "a.csv"), ("CSV to HDF5", "long.csv", "a.h5"),
                                 ("HDF5 to CSV", "a.h5", "b.csv"), ("HDF5 to HDF5", "a.h5", "b.h5")):
        best = float("inf")
        for _ in range(3):
            begin = time.monotonic()
            run("simulate", "gain.json", source, "-o", target)
            best = min(best, time.monotonic() - begin)
        seconds[what] = round(best, 3)
    print(seconds)
    sys.exit()

write_csv("plain.csv", 150000)
with open("model.json", "w", encoding="ascii") as model:
    model.write('{"format": "hyst-model-1", "sample_rate_hz": 10000, "chain": [{"block": "prandtl_ishlinskii",'
                '"parameters": {"offset_um": {"value": 0.1}, "weights": {"value": [0.15, 0.05]},'
                '"thresholds_v": {"value": [7.0]}}}]}')
# `simulate` reads a recording with all that it has, and writes it with the model's displacement.
run("simulate", "model.json", "plain.csv", "-o", "once.csv")
run("simulate", "model.json", "plain.csv", "-o", "once.h5")
run("simulate", "model.json", "once.h5", "-o", "twice.h5")
run("simulate", "model.json", "once.csv", "-o", "twice.csv")
run("simulate", "model.json", "once.h5", "-o", "back.csv")
assert open("back.csv", "rb").read() == open("twice.csv", "rb").read(), "the way through HDF5 changes the recording"

columns = np.loadtxt("once.csv", delimiter=",", skiprows=8, unpack=True, encoding="utf-8")
names = ["drive", "displacement", "reference", "temperature"]
with h5py.File("once.h5") as file:
    assert file.attrs["format"] == b"hyst-recording-1" or file.attrs["format"] == "hyst-recording-1"
    assert file.attrs["sample_rate_hz"] == 10000.0 and abs(file.attrs["start_s"] - 0.0012) < 1e-12
    for number, name in enumerate(names, 1):
        assert np.array_equal(file[name][:], columns[number]), name  # to the bit
        assert file[name].dims[0][0].name == "/time", name
        assert file[name].chunks is None and file[name].id.get_offset() is not None, "a column is one piece of the file"
    text = {key: value.decode() if isinstance(value, bytes) else value for key, value in file.attrs.items()}
    units = {name: file[name].attrs["units"] for name in ["time", *names]}
assert [u.decode() if isinstance(u, bytes) else u for u in units.values()] == ["s", "V", "um", "um", "degC"], units
assert text["actuator"] == "P-885 <1> µ" and text["another key"] == "z" and text["drive_between_samples"] == "held", text
assert "hyst simulate model.json plain.csv -o once.h5" in text["history"], text["history"]
for name in ("model.json", "plain.csv"):
    digest = hashlib.sha256(open(name, "rb").read()).hexdigest()
    assert f"{digest}  {name}" in text["source_files"].split("\n"), text["source_files"]
assert len(text["source_files"].split("\n")) == 2

# What is no recording of this format is imported as any HDF5; what is damaged is refused with one line.
with h5py.File("foreign.h5", "w") as file:
    file["drive"], file["displacement"] = columns[1], columns[2]
    file.attrs["sample_rate_hz"] = 10000.0
assert "HDF5" in run("simulate", "model.json", "foreign.h5").stderr
whole = open("once.h5", "rb").read()
for name, change, told in (
        ("cut.h5", lambda f: f[:len(f) // 2], "cut.h5"),
        ("nan.h5", lambda f: f.replace(struct.pack("<d", columns[2][777]), struct.pack("<d", float("nan"))), "nan")):
    with open(name, "wb") as file:
        file.write(change(whole))
    refused = run("simulate", "model.json", name, status=1)
    assert refused.stderr.count("\n") == 1 and told in refused.stderr, (name, refused.stderr)
shutil.copy("once.h5", "zero.h5")
with h5py.File("zero.h5", "r+") as file:
    file.attrs["sample_rate_hz"] = 0.0
assert "sample_rate_hz" in run("simulate", "model.json", "zero.h5", status=1).stderr

try:
    import xarray
except ImportError:
    print("no xarray here: its part is skipped")
    sys.exit()
for engine in ("h5netcdf", "netcdf4"):
    with xarray.open_dataset("once.h5", engine=engine) as opened:
        assert set(opened.data_vars) == set(names), (engine, opened)
        assert opened["displacement"].dims == ("time",) and opened["drive"].attrs["units"] == "V", (engine, opened)
        assert np.array_equal(opened["displacement"].values, columns[2]), engine
        near = opened["displacement"].sel(time=1.0012, method="nearest")
        assert float(near) == columns[2][10000], engine
        assert opened.attrs["sample_rate_hz"] == 10000.0 and opened.attrs["actuator"] == "P-885 <1> µ", opened.attrs
