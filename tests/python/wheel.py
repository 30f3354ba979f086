# SPDX-License-Identifier: GPL-3.0-or-later
"""wheel.py: `pip install .` of the tree into a bare virtual environment, and what it installs, used from another folder.

The package's engine, the command `hyst` with its live page, and the emulated amplifier, with nothing of the tree or of
the build in the PATH. pip brings the build's backend and numpy from the package index. Without a network that cannot be
tried: exit 77, skipped.
"""
import json
import os
import shutil
import subprocess
import sys
import urllib.error
import urllib.request

SOURCE = os.environ["HYST_SOURCE"]
FOLDER = os.path.join(os.environ["HYST_TEST_FOLDER"], "wheel")
ACTUATOR = os.path.join(SOURCE, "docs", "tutorial", "actuator.json")
RANGES = ("--drive-range", "0:100", "--position-range", "-5:40")
scripts = os.path.join(FOLDER, "venv", "bin")
environment = {name: value for name, value in os.environ.items()
               if name not in ("PYTHONPATH", "HYST_INTERFACE_LIBRARY", "PYTHONDONTWRITEBYTECODE", "HYST")}
environment["PATH"] = scripts + ":/usr/bin:/bin"
python, hyst = os.path.join(scripts, "python"), os.path.join(scripts, "hyst")


def run(*arguments, **options):
    return subprocess.run(arguments, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          env={**environment, **options}, check=False, cwd=FOLDER)


def done(result, what):
    if result.returncode != 0:
        print(result.stdout[-4000:])
        sys.exit(f"FAIL: {what}")
    return result.stdout


def check(holds, what):
    if not holds:
        sys.exit(f"FAIL: {what}")


def install():
    shutil.rmtree(FOLDER, ignore_errors=True)
    os.makedirs(FOLDER)
    done(run(sys.executable, "-m", "venv", "venv"), "no virtual environment")
    pip = (python, "-m", "pip", "--disable-pip-version-check")
    if run(*pip, "download", "--quiet", "--no-deps", "--dest", "reached", "scikit-build-core>=0.10").returncode != 0:
        print("skipped: pip reaches no package index")
        sys.exit(77)
    # What the compiler makes of the sources the other tests see: here it need not take its time.
    done(run(*pip, "wheel", "--no-deps", "--config-settings=cmake.define.CMAKE_C_FLAGS_RELEASE=-O0", "--wheel-dir", "wheels",
             SOURCE), "pip wheel .")
    wheel, = os.listdir(os.path.join(FOLDER, "wheels"))
    check(wheel.startswith("hyst-") and "-py3-none-linux_" in wheel, f"{wheel}: it should serve every Python 3")
    done(run(*pip, "install", os.path.join("wheels", wheel)), "pip install")
    listed = done(run(*pip, "show", "--files", "hyst"), "pip show")
    for name in ("hyst/py.typed", "hyst/libhyst_interface.so", "hyst/amplifier.py", "hyst_command/hyst", "bin/hyst"):
        check(name in listed, f"{name} is not in the wheel")
    return wheel


def use_package():
    script = """
import hyst, sys
recording = hyst.read(sys.argv[1])
model = hyst.fit(recording)
print(hyst.__file__, hyst.__version__, model.blocks, round(model.nrmse_percent, 1))
"""
    said = done(run(python, "-c", script, os.path.join(SOURCE, "docs", "tutorial", "recording.csv")), "import hyst")
    check(FOLDER in said and "['prandtl_ishlinskii'] 2.0" in said, said)


def use_command():
    """From a folder that is not the tree's: a version, a twin's refusal, and the page with its files."""
    version = done(run(hyst, "--version"), "hyst --version")
    check(version.startswith("hyst "), version)
    twin = run(hyst, "twin", ACTUATOR)
    check(twin.returncode == 2 and "hyst twin --help" in twin.stdout, f"hyst twin: {twin.stdout}")


def get(address):
    try:
        with urllib.request.urlopen(address, timeout=60) as answer:
            return answer.status, answer.read()
    except urllib.error.HTTPError as error:
        return error.code, b""


def open_page(*arguments):
    """The page and its files come from the program; a foreign token is refused; it ends when it is told to."""
    with subprocess.Popen([hyst, "serve", "--json", *arguments], stdout=subprocess.PIPE, text=True, env=environment,
                          cwd=FOLDER) as server:
        try:
            page = json.loads(server.stdout.readline())["page"]
            for name, holds in (("", b"page.js"), ("page.js", b"WebSocket"), ("page.css", b"{"), ("plot.js", b"canvas")):
                status, body = get(page + name)
                check(status == 200 and holds in body, f"{name or 'the page'}: {status}")
            check(get(page.rstrip("/") + "0/")[0] == 403, "a foreign token is let in")
        finally:
            server.terminate()
        check(server.wait(60) == 0, "the server did not end well")


EMULATED = """
import hyst, sys
with hyst.EmulatedAmplifier(None, sys.argv[1], *sys.argv[2:]) as port, hyst.Amplifier(port, timeout=5) as amplifier:
    print(amplifier.info()["amplifier"]["board"])
"""


def emulate():
    """The firmware that was built with the wheel, by the command and from Python. Without one: a line that says so."""
    firmware = os.path.join(os.path.dirname(done(run(python, "-c", "import hyst_command; print(hyst_command.path())"),
                                                 "hyst_command").strip()), "bench.elf")
    if shutil.which("arm-none-eabi-gcc", path=environment["PATH"]):
        check(os.path.exists(firmware), "bench.elf is not in the wheel, and its compiler is here")
        said = done(run(python, "-c", EMULATED, ACTUATOR, *RANGES), "hyst.EmulatedAmplifier")
        check("emulated" in said, said)
        open_page("--bench", "--model", ACTUATOR, *RANGES)
        os.rename(firmware, firmware + ".away")
    for command in (("bench",), ("serve", "--bench")):
        refused = run(hyst, *command, "--model", ACTUATOR, *RANGES)
        check(refused.returncode == 1 and "give one with --image ELF" in refused.stdout and refused.stdout.count("\n") == 1,
              f"without firmware: {refused.stdout}")


made = install()
use_package()
use_command()
emulate()
print(made)
