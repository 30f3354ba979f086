# SPDX-License-Identifier: GPL-3.0-or-later
"""completion_zsh.py HYST SCRIPT: what an interactive zsh completes when the tabulator key is pressed. Skipped (77) without zsh.

SCRIPT is installed as _hyst in a folder of fpath, as `cmake --install` does it. Each case is typed into a zsh on a terminal
of its own; then Ctrl-A turns the line into the arguments of printf, so that the completed words come back.
"""
import os
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True  # not beside the sources
from completion_cases import Cases  # noqa: E402
from interactive_shell import Shell  # noqa: E402

hyst, script = sys.argv[1], os.path.abspath(sys.argv[2])
if shutil.which("zsh") is None:
    print("skipped: zsh is not installed")
    sys.exit(77)
subprocess.run(["zsh", "-n", script], check=True)
cases = Cases(hyst)
folder = cases.folder
functions = os.path.join(folder.name, "functions")
os.mkdir(functions)
shutil.copy(script, os.path.join(functions, "_hyst"))
shell = Shell(["zsh", "-f", "-i"], folder.name)
# A long line, so that nothing that is typed wraps; no questions, no menus.
for number, line in enumerate((f"PATH={os.path.dirname(os.path.abspath(hyst))}:$PATH; stty cols 1000; bindkey -e",
                               f"fpath=({functions} $fpath); unsetopt BEEP AUTO_MENU; unset zle_bracketed_paste",
                               f"autoload -Uz compinit; compinit -u -d {folder.name}/dump; LISTMAX=1000")):
    shell.run(line, number)

cases.expect_typed(shell)

# Every option of every command: of its name without the last letter, where that can be no other's.
checked = 0
for command in cases.commands:
    names = cases.options(command)
    for name in names:
        if sum(other.startswith(name[:-1]) for other in names) == 1:
            got = shell.complete(f"hyst {command} {name[:-1]}")
            cases.expect(f"{command} {name}", [word.rstrip("=") for word in got], [command, name])
            checked += 1
shell.end()
cases.end(checked)
