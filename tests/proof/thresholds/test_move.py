#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""test_move.py MOVE TABLE: every threshold is moved, by a fifth of what the table says; the same seed moves alike."""
import pathlib
import re
import subprocess
import sys
import tempfile

ROW = re.compile(r"THRESHOLD\((\w+), (\w+), ([^\"]*?), (?=\")")
FIFTH = {"WHOLE": lambda v: v, "BELOW_ONE": lambda v: 1.0 - v, "ABOVE_ONE": lambda v: v - 1.0}


def rows(text):
    return {name: (how, eval(value)) for name, how, value in ROW.findall(text)}  # arithmetic of our own table


def main():
    move, table = sys.argv[1:3]
    before = rows(pathlib.Path(table).read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as folder:
        texts = []
        for name, seed in (("one", 1), ("again", 1), ("other", 2)):
            path = pathlib.Path(folder) / name
            subprocess.run([sys.executable, move, str(seed), table, path], check=True)
            texts.append(path.read_text(encoding="utf-8"))
    assert texts[0] == texts[1] and texts[0] != texts[2]
    after = rows(texts[0])
    assert after.keys() == before.keys() and len(before) > 50
    for name, (how, value) in before.items():
        part = (after[name][1] - value) / FIFTH[how](value)
        assert abs(abs(part) - 0.2) < 1e-9, (name, how, value, after[name])
        assert how == "WHOLE" or (how == "BELOW_ONE") == (value < 1.0), (name, how, value)


if __name__ == "__main__":
    main()
