# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of the proof, from the numbers of proof.json."""
import pathlib
import statistics
import sys



def text(proportion):
    if proportion["of"] == 0:
        return "none"
    part, low, high = (100 * proportion[key] for key in ("part", "low", "high"))
    return f"{proportion['hits']}/{proportion['of']} = {part:.1f} % ({low:.0f} to {high:.0f})"


def table(heads, rows):
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    lines += [f"| {' | '.join(text(cell) if isinstance(cell, dict) else str(cell) for cell in row)} |" for row in rows]
    return "\n".join(lines) + "\n"


def aims(result):
    return table(("aim", "wanted", "measured", "reached"), [
        (row["aim"] + (f" ({row['note']})" if row["note"] else ""), f"{100 * row['wanted']:.0f} %", row,
         "yes" if row["reached"] else "**no**") for row in result["aims"]])


def against(result, key, head):
    return table((head, "detected", "right group", "right name", "other names"), [
        (f"{row['from']:g} " + (f"to {row['to']:g}" if row["to"] else "and more"), row["detected"], row["in_group"],
         row["named"], row["other_names"]) for row in result[key]])


def confusion(result):
    def instead(row):
        others = sorted(((n, name) for name, n in row["said"].items() if name != row["block"]), reverse=True)
        return ", ".join(f"{name} {n}" for n, name in others)
    return table(("hidden", "right name", "right group", "instead"),
                 [(row["block"], row["named"], row["in_group"], instead(row)) for row in result["by_block"]])


def attributes(result):
    titles = {"source": "hysteresis", "excitation": "excitation", "noise_correlation": "correlation of the noise"}
    return "\n".join(table((title, "right name", "right group", "silent nulls"), [
        (row[key], row["named"], row["in_group"], row["silent"]) for row in result[f"by_{key}"]])
        for key, title in titles.items())


def parameters(result):
    def row_of(key):
        rows = [row for row in result["parameters"] if (row["block"], row["parameter"]) == key]
        sized = [abs(row["in_sigmas"]) for row in rows if row["in_sigmas"] is not None]
        relative = [abs(row["relative"]) for row in rows if row["relative"] is not None]
        return (" ".join(key), len(rows), f"{sum(error <= 3.0 for error in sized)}/{len(sized)}",
                f"{statistics.median(sized):.2g}" if sized else "",
                f"{100 * statistics.median(relative):.2g} %" if relative else "")
    keys = sorted({(row["block"], row["parameter"]) for row in result["parameters"]})
    return table(("parameter", "right names", "within 3 standard errors", "median error in standard errors",
                  "median relative error"), [row_of(key) for key in keys])


def gain(result):
    numbers = result["held_out_gain"]
    if numbers is None:
        return ""
    return (f"Held-out error before over after, {numbers['cases']} cases with a name in the right group: median "
            f"{numbers['median']:.3g}, least {numbers['least']:.3g}, most {numbers['most']:.3g}; smaller in "
            f"{text(numbers['smaller'])}.\n")


def failures(result):
    parts = ["In brackets: strength, and what of it a bank of ten plays cannot imitate.\n"]
    for title, lines in result["failures"].items():
        parts.append(f"**{title}** ({len(lines)}):\n")
        parts.append("\n".join(f"* {line}" for line in lines) + "\n")
    return "\n".join(parts)


def make_page(result):
    kinds = ", ".join(f"{n} {kind}" for kind, n in sorted(result["kinds"].items()))
    return "\n".join((
        f"{sum(result['kinds'].values())} cases, seed {result['seed']}: {kinds}. SHA-256 of the sealed answers:",
        f"`{result['answers_sha256']}`. The tool took {result['seconds']:.0f} s for all, one after another on "
        f"{result['processors']} processors; {sum(case['processor_s'] for case in result['cases']):.0f} s of processor "
        "time. Intervals are Wilson's, 95 %.\n",
        "## Aims, worst first\n", aims(result),
        "## Against strength\n",
        "Single effects of the catalogue. *Beyond a bank*: what no hysteresis of another shape imitates. *Other "
        "names*: a name outside of the effect's group, anywhere in the reply.\n",
        against(result, "by_strength", "strength"), against(result, "by_visible", "beyond a bank"),
        "## Confusion\n",
        "From 1 times the noise upward: what comes first in the reply, worst first.\n", confusion(result),
        "From 1 times the noise upward, and nulls:\n", attributes(result),
        "## Numbers\n", gain(result), parameters(result),
        "## What went wrong\n", failures(result)))


def replace_page(source, target, writer="scripts/prove"):
    """Puts the text of a file between the markers of `writer` in another one."""
    begin, end = f"<!-- written by {writer} -->", f"<!-- end of what {writer} writes -->"
    page, target = pathlib.Path(source).read_text(), pathlib.Path(target)
    before = target.read_text()
    if begin not in before or end not in before:
        sys.exit(f"{target}: no markers to write between")
    head, tail = before.split(begin, 1)[0], before.split(end, 1)[1]
    target.write_text(f"{head}{begin}\n\n{page}\n{end}{tail}")
