# SPDX-License-Identifier: MIT
"""recordings.py SCRIPT SCRATCH: scripts/recordings converts, compares checksums, and leaves nothing behind that is wrong.

The network is not used. Where HYST_RECORDINGS names the real recordings, they are brought from there.
"""
import importlib.machinery
import importlib.util
import io
import os
import pathlib
import shutil
import subprocess
import sys

import numpy

script, scratch = sys.argv[1], pathlib.Path(sys.argv[2]) / "scratch"
loader = importlib.machinery.SourceFileLoader("recordings", script)
sys.dont_write_bytecode = True
module = importlib.util.module_from_spec(importlib.util.spec_from_loader("recordings", loader))
loader.exec_module(module)
failures = 0


def expect(what, good, shown=""):
    global failures
    if not good:
        print(f"FAIL: {what}", shown)
        failures += 1


def run(*arguments):
    return subprocess.run([sys.executable, script, "--output", str(scratch / "out"), *arguments],
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def data_of(lines):
    return [line for line in lines if not line.startswith("#")]


# Conversions: values of distinct columns, so that a column that is mistaken shows.
seven = b"1.5\t0\t0\t0\t-7.25\t8\t9\n1.6\t0\t0\t0\t-7.5\t8\t9\n"
expect("stack", data_of(module.stack([seven])) == ["t,drive,displacement", "0.0000,1.5,-7.25", "0.0050,1.6,-7.5"])
eleven = b"1.5\t1\t2\t3\t-7.25\t5\t6\t7\t0.5\t9\t10\n"
expect("stack, test", data_of(module.stack_test([eleven]))[1:] == ["0.0000,1.5,-7.25,0.5"])
expect("smart", data_of(module.smart([b",0,-1.6174316,3\n,0.0002,2,4\n"]))[1:] == ["0.0000,3.0000,-1.617432",
                                                                                  "0.0002,4.0000,2.000000"])
arrays = []
for scale in (1.0, 1e-6): # sample, channel, realisation, period
    values = scale * numpy.arange(2 * 3 * 2 * 2, dtype=float).reshape(2, 3, 2, 2)
    file = io.BytesIO()
    numpy.save(file, values)
    arrays.append(file.getvalue())
# Channels are 4 apart, samples 12, periods 1; of the realisations the first.
expect("mirror", data_of(module.mirror(arrays))[1:] == [
    f"{k / 6400:.8f}," + ",".join(f"{at + c:.6f}" for c in (0, 4, 8)) + "," + ",".join(f"{at + c:.5f}" for c in (0, 4, 8))
    for k, at in enumerate((0, 12, 1, 13))])

shutil.rmtree(scratch, ignore_errors=True)
(scratch / "empty").mkdir(parents=True)
result = run("--from", str(scratch / "empty"))
expect("an empty folder", result.returncode == 1 and result.stderr.count("not there") == len(module.RECORDINGS), result.stderr)
(scratch / "stack-p885-1hz.csv").write_text("t,drive,displacement\n0,0,0\n")
(scratch / "Test_Vi_Do_Di.dat").write_bytes(eleven)
result = run("--from", str(scratch))
for name in ("stack-p885-1hz.csv", "Test_Vi_Do_Di.dat"):
    expect(f"another {name}", result.returncode == 1 and f"{name}: SHA-256" in result.stderr, result.stderr)
expect("nothing is left of it", not (scratch / "out").exists() or not list((scratch / "out").iterdir()))
result = run("--site", (scratch / "empty").as_uri())
expect("no network: one line, and what to do", result.returncode == 1 and result.stderr.count("\n") == 1 and
       "--from FOLDER" in result.stderr, result.stderr)
result = run("--list")
expect("the list", result.returncode == 0 and result.stdout.count("\n  licence  ") == len(module.RECORDINGS), result.stdout)
result = run("--exports", "--list")
expect("the list of exports", result.returncode == 0 and result.stdout.count("\n  licence  ") == len(module.EXPORTS))
result = run("--exports", "--from", str(scratch / "empty"))
expect("no exports", result.returncode == 1 and result.stderr.count("not there") == len(module.EXPORTS), result.stderr)
(scratch / "scope_0.csv").write_text("x-axis,1\nsecond,Volt\n")
result = run("--exports", "--from", str(scratch))
expect("another export", result.returncode == 1 and "scope_0.csv: SHA-256" in result.stderr, result.stderr)
expect("nothing is left of that", not (scratch / "out" / "exports").exists())

if "HYST_RECORDINGS" in os.environ:
    result = run("--from", os.environ["HYST_RECORDINGS"])
    expect("the real ones", result.returncode == 0 and len(list((scratch / "out").iterdir())) == len(module.RECORDINGS),
           result.stderr)
    result = run("--from", str(scratch / "empty"))
    expect("they stay", result.returncode == 0 and result.stdout.count("there already") == len(module.RECORDINGS))
else:
    print("HYST_RECORDINGS is not set: the real recordings were not brought")
print(f"{failures} failures")
sys.exit(1 if failures else 0)
