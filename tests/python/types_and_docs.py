#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""types_and_docs.py: what editors and type checkers find in the package.

Every public name and every public member of it has a docstring of its own. mypy --strict (pyproject.toml) finds nothing in
the package, nothing in a program that uses it rightly, and each line of one that does not; without mypy that is skipped.
"""
import dataclasses
import inspect
import os
import shutil
import subprocess
import sys
import unittest

import hyst

SOURCE = os.environ["HYST_SOURCE"]
FOLDER = os.path.join(os.environ["HYST_TEST_FOLDER"], "types")
RIGHT = '''import hyst

recording = hyst.read("recording.csv", columns={"drive": "CH1"}, scales={"drive": 20.0})
model: hyst.Model = hyst.fit([recording, recording], family="preisach")
position = model.simulate(recording.drive, sample_rate=recording.sample_rate)
worst: float = float(abs(position - recording.displacement).max())
further: dict[str, str] = {name: recording.extra_units[name] for name in recording.extra}
diagnosis = hyst.diagnose(recording, model, progress=lambda what, fraction: fraction < 0.5)
numbers: list[float | list[float]] = [number.value for found in diagnosis.findings for number in found.parameters.values()]
with hyst.Amplifier("/dev/ttyUSB0") as amplifier:
    amplifier.push(hyst.compile(diagnosis.model, sample_rate=10000))
'''
WRONG = '''import hyst

hyst.read(3)
hyst.read("recording.csv").drives
hyst.fit("recording.csv")
hyst.read("recording.csv").sample_rate.upper()
hyst.diagnose(hyst.read("a.csv"), progress=3)
hyst.Recording([0.0, 1.0])
'''


def undocumented():
    """Names without a docstring that somebody has written: that of a dataclass is made, if there is none."""
    for name in hyst.__all__:
        public = getattr(hyst, name)
        made = name + str(inspect.signature(public)).replace(" -> None", "") if dataclasses.is_dataclass(public) else None
        if not (public.__doc__ or "").strip() or public.__doc__ == made:
            yield name
        if not inspect.isclass(public):
            continue
        for member, value in vars(public).items():
            function = value.fget if isinstance(value, property) else getattr(value, "__func__", value)
            if not member.startswith("_") and inspect.isfunction(function) and not (function.__doc__ or "").strip():
                yield f"{name}.{member}"


def complaints():
    """What mypy says of the package and of both programs, in one run: most of its time goes into numpy's types."""
    for name, text in (("right.py", RIGHT), ("wrong.py", WRONG)):
        with open(os.path.join(FOLDER, name), "w", encoding="utf-8") as file:
            file.write(text)
    package = os.path.join(SOURCE, "host_tools", "python")
    done = subprocess.run([shutil.which("mypy"), "--config-file", os.path.join(SOURCE, "pyproject.toml"), "--cache-dir", "cache",
                           "--no-error-summary", "--hide-error-context", os.path.join(package, "hyst"),
                           os.path.join(package, "hyst_command"), "right.py", "wrong.py"], capture_output=True, text=True,
                          cwd=FOLDER, env={**os.environ, "MYPYPATH": package}, check=False)
    assert done.returncode == 1, done.stdout + done.stderr
    return done.stdout.splitlines()


class Docs(unittest.TestCase):
    def test_every_public_name_has_a_docstring(self):
        self.assertEqual(list(undocumented()), [])
        self.assertTrue(hyst.__doc__)
        self.assertGreater(len(hyst.__all__), 20)

    def test_all_that_is_public_is_listed(self):
        own = {name for name, value in vars(hyst).items() if not name.startswith("_") and not inspect.ismodule(value)}
        self.assertEqual(own, set(hyst.__all__))


@unittest.skipUnless(shutil.which("mypy"), "no mypy here")
class Types(unittest.TestCase):
    def test_the_package_and_programs_that_use_it(self):
        os.makedirs(FOLDER, exist_ok=True)
        found = complaints()
        wrong = {int(line.split(":")[1]) for line in found if line.startswith("wrong.py:") and ": error: " in line}
        self.assertEqual([line for line in found if not line.startswith("wrong.py:")], [])
        self.assertEqual(wrong, set(range(3, len(WRONG.splitlines()) + 1)), found)


if __name__ == "__main__":
    sys.exit(unittest.main())
