# SPDX-License-Identifier: GPL-3.0-or-later
"""contact_sheet.py SCREENSHOTS PICTURES: the day in pictures of docs/LIVE.md, from what browser.py has taken.

Two sheets, for a wide page and one of 390 px, of the screenshots in the order in which they were taken; each has its
name below. None that shows the folder's place on the machine is among them.
"""
import glob
import os
import re
import sys

from PIL import Image, ImageDraw, ImageFont

GAP, CAPTION = 12, 26
COLOURS = 256 # with fewer the traces lose theirs
SHEETS = {"live-wide.png": (2, 620, ("tracked", "ripple", "second-viewer", "bench")),
          "live-narrow.png": (5, 300, ("narrow-dark", "line-cut", "line-is-back", "diagnosing", "diagnosis"))}


def sheet(folder, across, width, names):
    taken = {re.fullmatch(r"\d+-(.*)\.png", os.path.basename(path))[1]: path
             for path in glob.glob(os.path.join(folder, "[0-9]*.png"))}
    pictures = [Image.open(taken[name]).convert("RGB") for name in names]
    pictures = [one.resize((width, round(one.height * width / one.width)), Image.LANCZOS) for one in pictures]
    cell = max(one.height for one in pictures) + CAPTION + GAP
    down = -(-len(names) // across)
    made = Image.new("RGB", (across * (width + GAP) + GAP, down * cell + GAP), "#808890") # light and dark ones stand out
    font = ImageFont.truetype("DejaVuSans.ttf", 15)
    for i, (name, one) in enumerate(zip(names, pictures)):
        left, top = GAP + i % across * (width + GAP), GAP + i // across * cell
        made.paste(one, (left, top))
        ImageDraw.Draw(made).text((left, top + one.height + 5), f"{i + 1}  {name.replace('-', ' ')}", "white", font)
    return made.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)


def main():
    folder, pictures = sys.argv[1:3]
    for name, (across, width, names) in SHEETS.items():
        path = os.path.join(pictures, name)
        sheet(folder, across, width, names).save(path, optimize=True)
        print(f"{path}: {os.path.getsize(path) / 1000:.0f} kB")


main()
