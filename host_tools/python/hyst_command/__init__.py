# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `hyst` that pip installs: the program that lies beside this file takes this process's place.

Not a part of the package `hyst`, so that the command starts without numpy.
"""

import os
import sys

_BUNDLED = os.path.join(os.path.dirname(os.path.abspath(__file__)), "hyst")


def path() -> str:
    """Of the program. Without one beside this file, as in the sources, it is the `hyst` of the PATH."""
    return _BUNDLED if os.access(_BUNDLED, os.X_OK) else "hyst"


def main() -> None:
    os.execv(_BUNDLED, ["hyst", *sys.argv[1:]])
