# SPDX-License-Identifier: GPL-3.0-or-later
"""The score as a page of tables, as a list of failures, and as pictures."""
import collections
import math
import textwrap

import pictures
from judge import group_of
from share import text


def wrapped(line):
    """As documents are: at most 120 characters."""
    return textwrap.wrap(line, 118, subsequent_indent="  " if line.startswith("* ") else "", break_long_words=False,
                         break_on_hyphens=False)


def lines_of(result):
    out = [*wrapped(result["headline"]), "", "Proportions with Wilson's interval, 95 %. Macro: the mean over blocks.", "",
           "### Aims, worst first", "", "| aim | wanted | measured | macro | reached |", "|---|---|---|---|---|"]
    for row in result["aims"]:
        over = text(row["macro"]) if row["macro"] else ""
        out.append(f"| {row['aim']} | {100 * row['wanted']:g} % | {text(row)} | {over} | "
                   f"{'yes' if row['reached'] else '**no**'} |")
    out += ["", "### Completeness against strength (single effects)", "",
            "| strength | not called nothing | right group | right name | firm and right | a false name |",
            "|---|---|---|---|---|---|"]
    for row in result["completeness"]:
        upper = f"{row['to']:g}" if row["to"] else "more"
        out.append(f"| {row['from']:g} to {upper} | " + " | ".join(
            text(row[key]) for key in ("called_missing", "right_group", "right_name", "firm", "false")) + " |")
    r = result["reliability"]
    out += ["", "### Reliability of `confidence`", ""]
    if r["findings"]:
        out += [f"{r['findings']} findings; mean distance from the diagonal {100 * r['mean_error']:.1f} %, Brier score "
                f"{r['brier']:.3f}.", "", "| confidence | mean | right |", "|---|---|---|"]
        out += [f"| {row['from']:g} to {row['to']:.3g} | {row['mean']:.3f} | {text(row)} |"
                for row in r["rows"] if row["of"]]
    out += ["", "### By block (single: from 3 times the noise), worst first", "",
            "| hidden | kind | as wanted | right name | first said |", "|---|---|---|---|---|"]
    for row in result["by_block"]:
        said = ", ".join(f"{name} {n}" for name, n in row["said"].items())
        out.append(f"| {row['block']} | {row['kind']} | {text(row['good'])} | {text(row['name'])} | {said} |")
    for key, rows in result["by"].items():
        out += ["", f"| {key} | silent nulls | right group | false names |", "|---|---|---|---|"]
        out += [f"| {row['value']} | {text(row['silent'])} | {text(row['right_group'])} | {text(row['false'])} |"
                for row in rows]
    out += ["", "### Numbers", "",
            "| parameter | right names | within 3 | median in standard errors | median relative |",
            "|---|---|---|---|---|"]
    table = collections.defaultdict(list)
    for row in result["parameters"]:
        table[f"{row['block']} {row['parameter']}"].append(row)
    for name, rows in sorted(table.items()):
        sized = sorted(abs(x["in_sigmas"]) for x in rows if x["in_sigmas"] is not None)
        sizes = sorted(abs(x["relative"]) for x in rows if x["relative"] is not None)
        out.append(f"| {name} | {len(rows)} | {sum(1 for x in sized if x <= 3)}/{len(sized)} | "
                   f"{f'{sized[len(sized) // 2]:.2g}' if sized else ''} | "
                   f"{f'{100 * sizes[len(sizes) // 2]:.2g} %' if sizes else ''} |")
    t = result["time"]
    out += ["", f"Processor time a question: median {t['median_s']:.1f} s, 95 % {t['p95_s']:.1f} s, most "
            f"{t['most_s']:.1f} s; per 100,000 samples at the 95th percentile {t['p95_per_100000_s']:.1f} s.", "",
            "### Failures", ""]
    out += [f"* {title}: {len(found)}" for title, found in result["failures"].items()]
    return out


def failures_of(result):
    out = ["# Every failure", "", *wrapped(result["headline"]), "",
           "In brackets: strength, and what of it a refit of gain and 24 free plays cannot imitate. A question mark: a",
           "name with a reservation. Behind the last colon: what can be said of the cause from outside of the tool."]
    for title, found in result["failures"].items():
        out += ["", f"## {title} ({len(found)})", "", *(part for line in found for part in wrapped(f"* {line}"))]
    return out


def draw(cases, result, folder):
    singles = [c for c in cases if c.kind == "single" and c.strength >= 2.85]
    rows = sorted({c.block for c in singles}, key=lambda b: (group_of(b), b))
    said = {c.said() for c in singles}
    columns = rows + sorted(said - set(rows))
    counts = {row: collections.Counter(c.said() for c in singles if c.block == row) for row in rows}
    title = "Hidden, from 3 times the noise (rows); said first (columns)"
    (folder / "confusion.svg").write_text(pictures.confusion(rows, columns, counts, title))
    middle = [0.3, 1.0, 3.0, 10.0, 30.0]
    labels = {"right_group": "right group", "right_name": "right name", "firm": "firm and right",
              "false": "a false name"}
    series = {label: [(x, row[key]) for x, row in zip(middle, result["completeness"])] for key, label in labels.items()}
    (folder / "completeness.svg").write_text(pictures.curves(
        series, middle, lambda x: math.log(x / 0.2) / math.log(200.0), "rms of the change over rms of the noise",
        "share of recordings", "Completeness against strength"))
    points = [(row["mean"], row) for row in result["reliability"]["rows"] if row["of"]]
    (folder / "reliability.svg").write_text(pictures.curves(
        {"findings": points}, (0.0, 0.2, 0.4, 0.6, 0.8, 1.0), lambda x: x, "confidence told", "share that is right",
        "Reliability", diagonal=True))
