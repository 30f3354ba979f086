# SPDX-License-Identifier: GPL-3.0-or-later
"""document.py DOCUMENT: its ```pycon blocks print what they show. Numbers may differ by 1 %."""
import doctest
import os
import re
import shutil
import sys

NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?")


class Checker(doctest.OutputChecker):
    def check_output(self, want, got, optionflags):
        if super().check_output(want, got, optionflags):
            return True
        shown, printed = NUMBER.findall(want), NUMBER.findall(got)
        same = NUMBER.sub("#", " ".join(want.split())) == NUMBER.sub("#", " ".join(got.split()))
        return same and all(abs(float(a) - float(b)) <= 0.01 * abs(float(a)) for a, b in zip(shown, printed))


with open(sys.argv[1], encoding="utf-8") as file:
    text = file.read()
folder = os.path.join(os.environ["HYST_TEST_FOLDER"], "document")
os.makedirs(os.path.join(folder, "docs"), exist_ok=True)
shutil.copytree(os.path.join(os.environ["HYST_SOURCE"], "docs", "tutorial"), os.path.join(folder, "docs", "tutorial"),
                dirs_exist_ok=True)
os.chdir(folder)
blocks = re.findall(r"^```pycon\n(.*?)^```$", text, re.M | re.S)
test = doctest.DocTestParser().get_doctest("".join(blocks), {}, "PYTHON.md", sys.argv[1], 0)
runner = doctest.DocTestRunner(Checker(), optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
import numpy

numpy.set_printoptions(precision=5)
failed, tried = runner.run(test)
print(f"{len(blocks)} blocks, {tried} commands, {failed} failures")
sys.exit(1 if failed or tried < 15 else 0)
