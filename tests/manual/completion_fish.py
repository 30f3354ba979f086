# SPDX-License-Identifier: GPL-3.0-or-later
"""completion_fish.py HYST SCRIPT: what fish completes, by its `complete -C`. Skipped (77) without fish."""
import os
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True  # not beside the sources
from completion_cases import Cases  # noqa: E402

hyst, script = sys.argv[1], os.path.abspath(sys.argv[2])
if shutil.which("fish") is None:
    print("skipped: fish is not installed")
    sys.exit(77)
subprocess.run(["fish", "-n", script], check=True)
cases = Cases(hyst)
folder = cases.folder
path = os.path.dirname(os.path.abspath(hyst))


def complete(lines):
    """What fish offers for each of the lines, without the descriptions."""
    asked = "".join(f"echo =; complete -C '{line}'\n" for line in lines)
    run = subprocess.run(["fish", "--no-config", "-c", f"set -x PATH {path} $PATH\nsource {script}\n{asked}"],
                         stdout=subprocess.PIPE, text=True, check=True, cwd=folder.name,
                         env={**os.environ, "HOME": folder.name, "LC_ALL": "C.UTF-8"})
    return [{line.split("\t")[0] for line in answer.split("\n") if line} for answer in run.stdout.split("=\n")[1:]]


for (typed, wanted), got in zip(cases.TYPED.items(), complete(cases.TYPED), strict=True):
    completed = {wanted[-1]} - {typed.split()[-1]}  # it lists completions of the last word only
    cases.expect(typed, {word.rstrip("=") for word in got}, completed)

# Every command, and every option of each.
cases.expect("commands", complete(["hyst "])[0], {*cases.commands, "help"})
options = 0
for command, got in zip(cases.commands, complete([f"hyst {command} --" for command in cases.commands]), strict=True):
    wanted = set(cases.options(command))
    cases.expect(f"options of {command}", {word.rstrip("=") for word in got}, wanted)
    options += len(wanted)
cases.end(options)
