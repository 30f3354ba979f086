# SPDX-License-Identifier: GPL-3.0-or-later
"""completion.py HYST SCRIPT: what an interactive bash completes when the tabulator key is pressed.

Each case is typed into a bash on a terminal of its own, which has loaded SCRIPT; then Ctrl-A turns the line into the
argument of printf, so that the completed words come back one a line.
"""
import os
import subprocess
import sys

sys.dont_write_bytecode = True  # not beside the sources
from completion_cases import Cases  # noqa: E402
from interactive_shell import Shell  # noqa: E402

hyst, script = sys.argv[1], os.path.abspath(sys.argv[2])
cases = Cases(hyst)
folder = cases.folder
shell = Shell(["bash", "--norc", "--noprofile", "-i"], folder.name)
for number, line in enumerate((f"PATH={os.path.dirname(os.path.abspath(hyst))}:$PATH", "bind 'set bell-style none'",
                               "bind 'set show-all-if-ambiguous off'", "bind 'set enable-bracketed-paste off'",
                               f"source '{script}'")):
    shell.run(line, number)


def candidates(typed):
    """All that the script offers, asked as bash asks it."""
    words = typed.split(" ")
    code = (f"source '{script}'; COMP_WORDS=(\"$@\"); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); _hyst; "
            "printf '%s\\n' \"${COMPREPLY[@]}\"")
    run = subprocess.run(["bash", "-c", code, "bash", *words], stdout=subprocess.PIPE, text=True, check=True, cwd=folder.name)
    return set(run.stdout.split())


cases.expect_typed(shell)

# Every command, and every option of each.
cases.expect("commands", candidates("hyst "), {*cases.commands, "help", "--help", "--version"})
options = 0
for command in cases.commands:
    wanted = set(cases.options(command))
    cases.expect(f"options of {command}", candidates(f"hyst {command} --"), wanted)
    options += len(wanted)
cases.expect("an offset is no file", candidates("hyst record --offset "), set())
shell.end()
cases.end(options)
