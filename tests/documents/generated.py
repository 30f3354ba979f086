#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What documents hold of tables of the program is what the program writes.

generated.py SOURCE-FOLDER MANUAL-FOLDER [--update]

docs/THRESHOLDS.md is a whole page; the table of stages stands in docs/DIAGNOSIS.md between two comments.
"""
import pathlib
import subprocess
import sys

BEGIN, END = "<!-- begin stages -->\n", "<!-- end stages -->\n"


def main():
    source, manual = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    page, stages = manual / "THRESHOLDS.md", (manual / "STAGES.md").read_text(encoding="utf-8")
    wrapped = manual / "THRESHOLDS.wrapped.md"
    wrapped.write_bytes(page.read_bytes())
    subprocess.run([source / "tests/lint/wrap", "--written", wrapped], check=True)
    document = source / "docs/DIAGNOSIS.md"
    before, rest = document.read_text(encoding="utf-8").split(BEGIN)
    written = {source / "docs/THRESHOLDS.md": wrapped.read_text(encoding="utf-8"),
               document: before + BEGIN + stages + END + rest.split(END)[1]}
    status = 0
    for path, text in written.items():
        if "--update" in sys.argv:
            path.write_text(text, encoding="utf-8")
        elif not path.exists() or path.read_text(encoding="utf-8") != text:
            print(f"{path}: not what hyst_manual writes; build the target documents_update")
            status = 1
    return status


if __name__ == "__main__":
    sys.exit(main())
