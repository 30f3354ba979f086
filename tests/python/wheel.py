# SPDX-License-Identifier: GPL-3.0-or-later
"""wheel.py: `pip install .` of the tree into a virtual environment, and what it installs, used from another folder.

pip brings the build's backend from the package index. Without a network that cannot be tried: exit 77, skipped.
"""
import os
import shutil
import subprocess
import sys

SOURCE = os.environ["HYST_SOURCE"]
FOLDER = os.path.join(os.environ["HYST_TEST_FOLDER"], "wheel")
environment = {name: value for name, value in os.environ.items()
               if name not in ("PYTHONPATH", "HYST_INTERFACE_LIBRARY", "PYTHONDONTWRITEBYTECODE")}
python = os.path.join(FOLDER, "venv", "bin", "python")


def run(*arguments, **options):
    return subprocess.run(arguments, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment,
                          check=False, cwd=FOLDER, **options)


def done(result, what):
    if result.returncode != 0:
        print(result.stdout[-4000:])
        sys.exit(f"FAIL: {what}")
    return result.stdout


shutil.rmtree(FOLDER, ignore_errors=True)
os.makedirs(FOLDER)
done(run(sys.executable, "-m", "venv", "--system-site-packages", "venv"), "no virtual environment")
pip = (python, "-m", "pip", "--disable-pip-version-check")
if run(*pip, "download", "--quiet", "--no-deps", "--dest", "reached", "scikit-build-core>=0.10").returncode != 0:
    print("skipped: pip reaches no package index")
    sys.exit(77)
done(run(*pip, "wheel", "--no-deps", "--wheel-dir", "wheels", SOURCE), "pip wheel .")
wheel, = os.listdir(os.path.join(FOLDER, "wheels"))
if not (wheel.startswith("hyst-") and "-py3-none-linux_" in wheel):
    sys.exit(f"FAIL: {wheel}: it should serve every Python 3")
done(run(*pip, "install", "--no-deps", os.path.join("wheels", wheel)), "pip install")
listed = done(run(*pip, "show", "--files", "hyst"), "pip show")
for name in ("hyst/py.typed", "hyst/libhyst_interface.so", "hyst/amplifier.py"):
    if name not in listed:
        sys.exit(f"FAIL: {name} is not in the wheel")
script = """
import hyst, sys
recording = hyst.read(sys.argv[1])
model = hyst.fit(recording)
print(hyst.__file__, hyst.__version__, model.blocks, round(model.nrmse_percent, 1))
"""
said = done(run(python, "-c", script, os.path.join(SOURCE, "docs", "tutorial", "recording.csv")), "import hyst")
if FOLDER not in said or "['prandtl_ishlinskii'] 2.0" not in said:
    sys.exit(f"FAIL: {said}")
print(wheel, said)
