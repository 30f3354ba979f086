# SPDX-License-Identifier: GPL-3.0-or-later
"""The measurement that every file here holds, and the list of these files."""
import numpy as np

RATE, ROWS = 1000.0, 400
K = np.arange(ROWS)
T = K / RATE
# Triangles of 0 to 100 V; the displacement lags behind by a play of 8 V and bends a little.
U = 100.0 * np.abs((K / 100.0 + 1.0) % 2.0 - 1.0)
Y = np.zeros(ROWS)
_w = 0.0
for _k in range(ROWS):
    _w = max(U[_k] - 8.0, min(U[_k] + 8.0, _w))
    Y[_k] = 0.12 * _w + 0.02 * U[_k] + 1e-4 * U[_k] ** 2
REF = 0.15 * U

EXPORTS = []


def export(name, arguments="", refused=None, tolerance=1e-6, **options):
    """arguments: of `hyst import`. refused: what the line has to say. start: time of the first sample. says, says_not:
    parts of what is printed. keys: lines of the recording's header."""

    def register(write):
        EXPORTS.append((name, write, arguments.split(), refused, tolerance, options))
        return write

    return register


def rows(*columns, separator=",", comma=False, form="%.9g", end="\n"):
    lines = []
    for values in zip(*columns):
        fields = [(form % value).replace(".", "," if comma else ".") for value in values]
        lines.append(separator.join(fields))
    return end.join(lines) + end


def text(path, content, encoding="utf-8"):
    with open(path, "wb") as file:
        file.write(content.encode(encoding))
