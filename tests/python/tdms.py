# SPDX-License-Identifier: GPL-3.0-or-later
"""tdms.py: LabVIEW TDMS files, which npTDMS writes here and hyst.read reads.

npTDMS is in no package of Debian 12: pip brings it into a virtual environment. Without a network that cannot be tried:
exit 77, skipped.
"""
import hashlib
import os
import shutil
import subprocess
import sys

FOLDER = os.path.join(os.environ["HYST_TEST_FOLDER"], "tdms")
if len(sys.argv) == 1:
    shutil.rmtree(FOLDER, ignore_errors=True)
    os.makedirs(FOLDER)
    subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", os.path.join(FOLDER, "venv")], check=True)
    python = os.path.join(FOLDER, "venv", "bin", "python")
    without = subprocess.run([python, __file__, "without"], check=False).returncode
    if without != 0:
        sys.exit(without)
    if subprocess.run([python, "-m", "pip", "--disable-pip-version-check", "install", "--quiet", "--no-deps", "nptdms",
                       "packaging"], check=False).returncode != 0:
        print("skipped: pip reaches no package index")
        sys.exit(77)
    sys.exit(subprocess.run([python, __file__, "with"], check=False).returncode)

import hyst  # noqa: E402
import numpy as np  # noqa: E402

os.chdir(FOLDER)
K = np.arange(400.0)
U = 100.0 * np.abs((K / 100.0 + 1.0) % 2.0 - 1.0)
Y = 0.12 * U + 1e-4 * U**2


def line_of(path, **options):
    try:
        hyst.read(path, **options)
    except hyst.Error as failure:
        assert "\n" not in str(failure), failure
        return str(failure)
    raise SystemExit(f"FAIL: {path} was read")


if sys.argv[1] == "without":
    try:
        import nptdms  # noqa: F401
    except ImportError:
        assert "pip install nptdms" in line_of("any.tdms")
    sys.exit(0)

from nptdms import ChannelObject, TdmsWriter  # noqa: E402


def write(path, channels):
    """channels: (group, name, values, properties)."""
    with TdmsWriter(path) as file:
        file.write_segment([ChannelObject(group, name, values, properties=properties)
                            for group, name, values, properties in channels])


def expect(recording, rate=1000.0, start=0.0, drive=U, position=Y):
    assert abs(recording.sample_rate - rate) < 1e-6 and abs(recording.start - start) < 1e-9, recording
    assert np.allclose(recording.drive, drive, atol=1e-9), recording
    assert np.allclose(recording.displacement, position, atol=1e-9), recording


waveform = {"wf_increment": 1e-3, "wf_start_offset": 0.25, "wf_samples": 1}
write("waveform.tdms", [("run", "drive", U, {**waveform, "unit_string": "V"}),
                        ("run", "position", 1000.0 * Y, {**waveform, "unit_string": "nm"}),
                        ("run", "gain", np.array([20.0]), {})])
recording = hyst.read("waveform.tdms")
expect(recording, start=0.25)
assert "'position' in nm" in recording.understood, recording.understood
recording.write("waveform.h5")
with open("waveform.tdms", "rb") as file, open("waveform.h5", "rb") as written:
    assert f"{hashlib.sha256(file.read()).hexdigest()}  waveform.tdms".encode() in written.read()
expect(hyst.read("waveform.h5"), start=0.25)

stamps = np.datetime64("2026-11-23T08:00:00.000000", "us") + (1000 * K).astype("timedelta64[us]")
write("stamps.tdms", [("run", "time", stamps, {}), ("run", "AO", U / 20.0, {"NI_UnitDescription": "V"}),
                      ("run", "AI", (1000 * Y).round().astype("int32"), {})])
expect(hyst.read("stamps.tdms", columns={"drive": "AO", "displacement": "AI"}, scales={"drive": 20.0, "displacement": 1e-3}),
       position=(1000 * Y).round() / 1000)

write("groups.tdms", [(group, name, factor * values, waveform) for group, factor in (("left", 1.0), ("right", 0.5))
                      for name, values in (("drive", U), ("position", Y))])
assert "say group= one of left, right" in line_of("groups.tdms")
expect(hyst.read("groups.tdms", group="right"), start=0.25, drive=0.5 * U, position=0.5 * Y)
assert "no channels in a group 'middle'" in line_of("groups.tdms", group="middle")
write("rates.tdms", [("run", "drive", U, {"wf_increment": 1e-3}), ("run", "position", Y, {"wf_increment": 2e-3})])
assert "different sample intervals" in line_of("rates.tdms")
write("plain.tdms", [("run", "drive", U, {}), ("run", "position", Y, {})])
assert "sample rate" in line_of("plain.tdms")
expect(hyst.read("plain.tdms", sample_rate=500.0), rate=500.0)
with open("groups.tdms", "rb") as file:
    whole = file.read()
for name, part in (("cut.tdms", whole[:100]), ("other.tdms", b"TDSm" + bytes(60)), ("empty.tdms", b"")):
    with open(name, "wb") as file:
        file.write(part)
    assert name in line_of(name)
assert "No such file" in line_of("missing.tdms")
print("TDMS: waveforms, time stamps, groups, and what is refused")
