# SPDX-License-Identifier: GPL-3.0-or-later
"""contact_sheet.py SCREENSHOTS PICTURES: the day in pictures of docs/LIVE.md, from what browser.py has taken.

Two sheets of all screenshots in the order in which they were taken, for a wide page and one of 390 px; each has its number
in the day and its name below.
"""
import glob
import os
import re
import sys

from PIL import Image, ImageDraw, ImageFont

GAP, CAPTION = 12, 26
COLOURS = 256 # with fewer the traces lose theirs
SHEETS = {"live-wide.png": (3, 460, lambda size: size[0] > 500), "live-narrow.png": (7, 210, lambda size: size[0] <= 500)}


def sheet(folder, across, width, belongs):
    taken = [(re.fullmatch(r"(\d+)-(.*)\.png", os.path.basename(path)).groups(), Image.open(path).convert("RGB"))
             for path in sorted(glob.glob(os.path.join(folder, "[0-9]*.png")))]
    names = [name for name, one in taken if belongs(one.size)]
    pictures = [one.resize((width, round(one.height * width / one.width)), Image.LANCZOS) for _, one in taken if belongs(one.size)]
    cell = max(one.height for one in pictures) + CAPTION + GAP
    down = -(-len(names) // across)
    made = Image.new("RGB", (across * (width + GAP) + GAP, down * cell + GAP), "#808890") # light and dark ones stand out
    font = ImageFont.truetype("DejaVuSans.ttf", 13)
    for i, (name, one) in enumerate(zip(names, pictures)):
        left, top = GAP + i % across * (width + GAP), GAP + i // across * cell
        made.paste(one, (left, top))
        ImageDraw.Draw(made).text((left, top + one.height + 5), f"{int(name[0])}  {name[1].replace('-', ' ')}", "white", font)
    return made.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)


def main():
    folder, pictures = sys.argv[1:3]
    for name, (across, width, belongs) in SHEETS.items():
        path = os.path.join(pictures, name)
        sheet(folder, across, width, belongs).save(path, optimize=True)
        print(f"{path}: {os.path.getsize(path) / 1000:.0f} kB")


main()
