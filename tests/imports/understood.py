#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""understood.py HYST FOLDER: what is said of files before they are used, the same in every command.

What a recording holds (range, stroke, kind of drive, periods, noise) in text and JSON, against what the file was made of;
units in header keys; standard input by its name; all problems of all files in one run.
"""
import json
import os
import subprocess
import sys

import numpy as np

hyst = os.path.abspath(sys.argv[1])
os.makedirs(sys.argv[2], exist_ok=True)
os.chdir(sys.argv[2])


def run(*arguments, status=0, **options):
    done = subprocess.run([hyst, *arguments], capture_output=True, text=True, timeout=600, check=False, **options)
    assert done.returncode == status, (arguments, done.returncode, done.stdout, done.stderr)
    return done


def write(path, t, u, y, header="Time (s),Drive (V),Position (um)\n"):
    with open(path, "w", encoding="utf-8") as file:
        file.write(header)
        file.writelines(f"{a:.9g},{b:.7g},{c:.7g}\n" for a, b, c in zip(t.tolist(), u.tolist(), y.tolist()))


# 40 periods of 1 Hz, -20 to 120 V, a loop, and noise of 5 nm.
seed = 11
print("seed", seed)
random = np.random.default_rng(seed)
RATE = 500.0
T = np.arange(int(40 * RATE)) / RATE
U = 50.0 - 70.0 * np.cos(2 * np.pi * T)
CLEAN = 0.1 * U + 0.6 * np.sin(2 * np.pi * T - 0.3)
Y = CLEAN + 0.005 * random.standard_normal(len(T))
write("scope.csv", T, U, Y)
holds = json.loads(run("import", "scope.csv", "--json").stdout)["holds"]
assert holds["drive_kind"] == "sine" and holds["periods"] == 40, holds
assert abs(holds["period_s"] - 1.0) < 1e-3, holds  # half a sample is 1e-3 s; a period is known to a part of one
assert np.allclose(holds["drive_range_v"], [-20.0, 120.0], atol=1e-6), holds
assert np.allclose(holds["position_range_um"], [Y.min(), Y.max()], atol=1e-6), holds
# 20000 samples: the deviation of a deviation is 0.5 %. Differences between passes bring less than a tenth.
assert abs(holds["noise_um"] / 0.005 - 1.0) < 0.1, holds
assert abs(holds["looked_at_s"] - 40.0) < 1e-6, holds
told = run("import", "scope.csv").stdout.splitlines()
first = next(i for i, text in enumerate(told) if text.startswith("it holds"))
line = "\n".join(told[first:first + 2])
for part in ("drive -20 to 120 V, is one sine over and over, 40 periods of 1 s (1 Hz)", "stroke 14.", "noise about 5", " nm"):
    assert part in line, line
# Every command says it before it uses such a file; of the project's own, nothing has to be understood.
for command in (("fit", "scope.csv", "-o", "model.json"), ("simulate", "model.json", "scope.csv"), ("bode", "scope.csv")):
    assert line in run(*command).stderr, command
run("import", "scope.csv", "-o", "own.csv")
assert "it holds" not in run("bode", "own.csv").stderr

# A long recording is looked at in part: a slow drive all the same as a whole, a fast one in its beginning.
long_t = np.arange(400000) / 10000.0
for frequency, periods, whole in ((1.0, 40, True), (200.0, None, False)):
    u = 50.0 + 40.0 * np.sin(2 * np.pi * frequency * long_t)
    write("long.csv", long_t, u, 0.1 * u + 0.3 * np.cos(2 * np.pi * frequency * long_t))
    holds = json.loads(run("import", "long.csv", "--json").stdout)["holds"]
    assert (holds["looked_at_s"] > 39.9) == whole and holds["drive_kind"] == "sine", holds
    assert periods is None or holds["periods"] == periods, holds
    assert whole or abs(holds["period_s"] * frequency - 1.0) < 1e-3, holds
assert "ranges of all, the rest of the first 6.55" in run("import", "long.csv").stdout

# Times in ms that do not say so are read as s. That shows in the rate, and the line says what to type.
write("unsaid.csv", 0.25 * np.arange(4000), U[:4000], Y[:4000], "time,drive,position\n")
assert "Where the times are ms: --sample-rate 4000\n" in run("import", "unsaid.csv").stdout
told = run("import", "unsaid.csv", "--sample-rate", "4000", "-o", "said.csv").stdout
assert "its rate says that they are ms" in told and "plausible" not in told, told
assert "said.csv: 4000 samples at 4000 Hz" in told, told
write("unsaid.csv", T[:4000], U[:4000], Y[:4000], "time,drive,position\n")
assert "plausible" not in run("import", "unsaid.csv").stdout

# Header keys with units: `import` and every other command read the same numbers.
OWN = "# sample_rate_hz: 500\n# drive_unit: mV\n# displacement_unit: nm\nt,drive,displacement\n"
write("own_nm.csv", T, 1e3 * U, 1e3 * Y, OWN)
run("import", "own_nm.csv", "-o", "imported.csv")
run("simulate", "model.json", "own_nm.csv", "-o", "simulated.csv")
wanted = np.loadtxt("own.csv", delimiter=",", skiprows=5, unpack=True)
imported = np.loadtxt("imported.csv", delimiter=",", skiprows=5, unpack=True)
simulated = np.loadtxt("simulated.csv", delimiter=",", skiprows=4, unpack=True)
assert "displacement_unit: um" in open("imported.csv", encoding="utf-8").read()
assert np.allclose(imported, wanted, atol=1e-5), "nm and mV in the header"  # seven digits of 120000 mV are 0.1 mV
assert np.allclose(simulated[1], wanted[1], atol=1e-4), "the drive that simulate read"
errors = [json.loads(run("simulate", "model.json", name, "--json").stdout)["nrmse_percent"] for name in ("own.csv", "own_nm.csv")]
assert abs(errors[0] / errors[1] - 1.0) < 1e-3, errors
write("wrong.csv", T, U, Y, OWN.replace("nm", "bananas"))
for command in (("import", "wrong.csv"), ("look", "wrong.csv")):
    refused = run(*command, status=1).stderr
    assert "bananas" in refused and "um" in refused and refused.count("\n") == 1, refused

# A recording that a spreadsheet has opened and written anew keeps what its header says, in every command: English with
# commas behind the remarks, as one quoted cell with a byte order mark, German with semicolons and decimal commas.
KEYS = ["# sample_rate_hz: 500", "# drive_unit: V", "# displacement_unit: nm", "# drive_between_samples: held",
        "# waveform: sweep, slow triangle"]
table = [f"{a:.9g},{b:.7g},{1e3 * c:.7g}" for a, b, c in zip(T.tolist(), U.tolist(), Y.tolist())]
english = "".join(key + "," * (2 - key.count(",")) + "\r\n" for key in KEYS) + "t,drive,displacement\r\n" + "\r\n".join(table)
quoted = "\ufeff" + "".join(f'"{key}",,\r\n' for key in KEYS) + "t,drive,displacement\r\n" + "\r\n".join(table)
german = "".join(key + ";;\r\n" for key in KEYS) + "t;drive;displacement\r\n" + \
    "\r\n".join(line.replace(",", ";").replace(".", ",") for line in table)
for name, text in (("english.csv", english), ("quoted.csv", quoted), ("german.csv", german)):
    with open(name, "w", encoding="utf-8", newline="") as file:
        file.write(text + "\r\n")
    look = run("look", name).stdout
    assert "held between samples (header)" in look and "position   -" in look, (name, look)
    run("import", name, "-o", "again.csv")
    with open("again.csv", encoding="utf-8") as file:
        again = file.read()
    assert "# drive_between_samples: held\n" in again and "# waveform: sweep, slow triangle\n" in again, (name, again[:400])
    assert "_unit: nm" not in again and abs(float(again.splitlines()[-1].split(",")[2]) - Y[-1]) < 1e-5, name
with open("english.csv", "w", encoding="utf-8", newline="") as file:
    file.write(german.replace("between_samples: held", "between_samples: often"))
refused = run("look", "english.csv", status=1).stderr
assert "drive_between_samples is 'often'" in refused, refused

# Standard input has a name, and no file of this program's.
with open("scope.csv", encoding="utf-8") as file:
    text = file.read()
for command in (("import", "-"), ("import", "-", "--json"), ("import", "-", "-o", "-"), ("look", "-", "--json"),
                ("fit", "-", "--json"), ("simulate", "model.json", "-", "-o", "-"), ("bode", "-")):
    done = run(*command, input=text)
    assert "/dev/fd" not in done.stdout + done.stderr, (command, done.stdout[:300], done.stderr[:300])
assert json.loads(run("import", "-", "--json", input=text).stdout)["file"] == "standard input"
refused = run("import", "-", input="time,drive,position\n0,1,x\n", status=1).stderr
assert refused.startswith("hyst: standard input: "), refused

# All that is wrong with all files, a line each.
write("flat.csv", T, 0.0 * U, Y)
for command in ("fit", "look", "diagnose"):
    lines = run(command, "flat.csv", "scope.csv", "none.csv", "wrong.csv", status=1).stderr.splitlines()
    told = [l for l in lines if l.startswith("hyst: ")]
    assert [l.split(": ")[1].split(":")[0] for l in told] == ["flat.csv", "none.csv", "wrong.csv"], lines
print("understood before it is used")
