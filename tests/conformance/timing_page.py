# SPDX-License-Identifier: MIT
"""timing_page.py LINES TIMING.json TIMING.md MACHINE COMPILER FLAGS HOST_COMPILER HOST_FLAGS: what the cost programs
printed, as JSON, as the page's tables, and as two pictures beside it (pictures/timing-sample.svg, timing-peers.svg).
timing_page.py LINES TIMING.md: only the tables and pictures of instruction counts; what is the host's stays as it is.
timing_page.py --check BUDGET TIMING.md: fails when the page's worst counts are not those of the budget.

A table of the page stands between "<!-- begin NAME -->" and "<!-- end NAME -->"; all other text is left alone.
"""
import json
import math
import os
import re
import sys

FAMILIES = {
    "play": ("play operators", "prandtl_ishlinskii", False),
    "play_rate": ("play operators, rate-dependent", "prandtl_ishlinskii", True),
    "preisach": ("Preisach, intervals", "preisach", False),
    "bouc_wen": ("Bouc-Wen, cells", "bouc_wen", False),
    "modified_play": ("modified play, divisions", "modified_play", False),
}
PEERS = {
    "play_bank_this_library": "play bank inverse, this library",
    "play_bank_loop_integer": "the same as a loop over the operators, integers",
    "play_bank_loop_single_precision": "the same loop, single precision on the FPU",
    "biquads_this_library": "biquad cascade, this library",
    "biquads_single_precision": "the same in single precision (direct form 2 transposed)",
}


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|:--|" + "--:|" * (len(head) - 1)]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows])


def decibels(error, signal):
    return f"{20 * math.log10(signal / error):.0f}" if error > 0 else "exact"


def text(x, y, words, anchor="start"):
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{words}</text>'


def picture(path, width, height, what, parts):
    with open(path, "w", encoding="utf-8") as out:
        out.write(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}"'
                  f' role="img" font-family="sans-serif" font-size="12">\n<title>{what}</title>\n'
                  f'<rect width="{width}" height="{height}" fill="#fff"/>\n' + "\n".join(parts) + "\n</svg>\n")


def sample_picture(path, loop):
    """A bar for each line of the sample's table that has neither curves nor cells: the compensator's part, and the rest."""
    shown = [c for c in loop if not c["curves_and_inertia"] and c["creep_cells"] == 0 and c["biquads"] in (0, 4)]
    names = {(family, rate): name for name, family, rate in FAMILIES.values()}
    most = max(c["worst_instructions"] for c in shown)
    left, scale, step = 320, 420 / most, 18
    parts = [f'<rect x="{left}" y="8" width="12" height="12" fill="#1f6fb2"/>', text(left + 18, 18, "compensator"),
             f'<rect x="{left + 120}" y="8" width="12" height="12" fill="#b9c7d4"/>',
             text(left + 138, 18, "the rest of the sample's interrupt")]
    for i, c in enumerate(shown):
        y = 30 + step * i
        own, all_of_it = scale * c["worst_compensator_instructions"], scale * c["worst_instructions"]
        name = f'{names[c["family"], c["rate_dependent"]]}: {c["operators"]}, {c["biquads"]} sections'
        parts += [text(left - 8, y + 11, name, "end"),
                  f'<rect x="{left}" y="{y}" width="{all_of_it:.1f}" height="13" fill="#b9c7d4"/>',
                  f'<rect x="{left}" y="{y}" width="{own:.1f}" height="13" fill="#1f6fb2"/>',
                  text(left + all_of_it + 6, y + 11, c["worst_instructions"])]
    picture(path, 800, 40 + step * len(shown), "Worst instructions of a sample, by family", parts)


def peers_picture(path, peers):
    """Worst instructions of the inverse against the number of operators, both by their logarithms."""
    kinds = [(kind, colour) for kind, colour in zip(PEERS, ("#1f6fb2", "#b2521f", "#5a8f29")) if kind.startswith("play")]
    points = {kind: [(int(p[1]), int(p[2])) for p in peers if p[0] == kind] for kind, _ in kinds}
    every = [point for line in points.values() for point in line]
    sizes, decades = sorted({n for n, _ in every}), range(2, 1 + math.ceil(math.log10(max(c for _, c in every))))

    def place(n, cost):
        return (60 + 440 * math.log(n / sizes[0]) / math.log(sizes[-1] / sizes[0]),
                270 - 240 * (math.log10(cost) - decades[0]) / (decades[-1] - decades[0]))

    parts = [text(280, 308, "operators", "middle"), text(60, 18, "worst instructions of the inverse and the memory")]
    for d in decades:
        y = place(sizes[0], 10 ** d)[1]
        parts += [f'<path d="M60 {y:.1f}H500" stroke="#ddd"/>', text(52, y + 4, 10 ** d, "end")]
    parts += [text(place(n, 100)[0], 290, n, "middle") for n in sizes]
    for i, (kind, colour) in enumerate(kinds):
        line = " ".join(f"{x:.1f},{y:.1f}" for x, y in (place(*point) for point in points[kind]))
        parts += [f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2"/>',
                  f'<path d="M520 {40 + 22 * i}h20" stroke="{colour}" stroke-width="2"/>', text(546, 44 + 22 * i, PEERS[kind])]
    picture(path, 840, 320, "The inverse beside plain loops", parts)


def rows_of(page, name):
    """The cells of a table's rows, without its two lines of head."""
    lines = re.search(rf"<!-- begin {name} -->\n(.*?)<!-- end {name} -->", page, re.S)[1].splitlines()[2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def check(budget_path, page_path):
    page = open(page_path, encoding="utf-8").read()
    keys = {name: key for key, (name, _, _) in FAMILIES.items()}
    shown = {}
    for name, size, sections, cells, curves, own, first, worst, _, adopting in rows_of(page, "sample"):
        case = f"{keys[name]} {size} {sections} {cells} {'curves' if curves else 'plain'}"
        shown.update({f"step {case}": own, f"begin {case}": first, f"sample {case}": worst, f"adopting {case}": adopting})
    shown.update({"adoption " + name.replace(" ", "_"): worst for name, _, worst in rows_of(page, "adoption")})
    lines = [line for line in open(budget_path, encoding="utf-8") if not line.startswith("#")]
    budget = {case: worst for case, worst in (line.rsplit(None, 1) for line in lines)
              if case.split()[0] in ("step", "begin", "sample", "adopting", "adoption")}
    wrong = sorted(case for case in budget.keys() | shown.keys() if budget.get(case) != shown.get(case))
    for case in wrong:
        print(f"{case}: {shown.get(case, 'nothing')} in {page_path}, {budget.get(case, 'nothing')} in {budget_path}")
    sys.exit(1 if wrong else 0)


def write_page(page_path, tables, loop, peers):
    pictures = os.path.join(os.path.dirname(page_path), "pictures")
    sample_picture(os.path.join(pictures, "timing-sample.svg"), loop)
    peers_picture(os.path.join(pictures, "timing-peers.svg"), peers)
    page = open(page_path, encoding="utf-8").read()
    for name, text in tables.items():
        page, found = re.subn(rf"(<!-- begin {name} -->\n).*?(<!-- end {name} -->)", lambda m: m[1] + text + "\n" + m[2], page,
                              flags=re.S)
        if found != 1:
            sys.exit(f"{page_path}: no place for table '{name}'")
    with open(page_path, "w", encoding="utf-8") as out:
        out.write(page)


def main(lines, json_path, page_path, machine, compiler, flags, host_compiler, host_flags):
    words = [line.split() for line in open(lines, encoding="utf-8")]
    steps = {tuple(w[1:6]): w[6:] for w in words if w[0] == "step"}
    samples = {tuple(w[1:6]): w[6:] for w in words if w[0] == "sample"}
    peers = [w[1:] for w in words if w[0] == "peer"]
    host = [{"what": w[1].replace("_", " "), "ours": float(w[2]), "peer": float(w[3]), "ratio": float(w[2]) / float(w[3]),
             "unit": w[4], "peer_is": w[5].replace("_", " ")} for w in words if w[0] == "host"]

    loop, rows = [], []
    for case, sample in samples.items():
        name, family, rate = FAMILIES[case[0]]
        worst = max(int(sample[0]), int(sample[2]))
        mean = max(int(sample[1]), int(sample[3]))
        loop.append({"family": family, "operators": int(case[1]), "rate_dependent": rate, "biquads": int(case[2]),
                     "creep_cells": int(case[3]), "curves_and_inertia": case[4] == "curves", "worst_instructions": worst,
                     "mean_instructions": mean, "worst_adopting_instructions": int(sample[4]),
                     "worst_compensator_instructions": int(steps[case][0])})
        rows.append([name, *case[1:4], "yes" if case[4] == "curves" else "", *steps[case][:3:2], worst, mean, sample[4]])
    tables = {
        "sample": table(["hysteresis", "", "IIR sections", "creep cells", "curves, inertia", "compensator", "its first sample",
                         "interrupt", "its mean", "adopting"], rows),
        "adoption": table(["from, to", "samples", "worst of them"],
                          [[w[1].replace("_", " "), w[2], w[3]] for w in words if w[0] == "adoption"]),
        "peers": table(["kernel", "operators or sections", "worst", "mean", "worst error", "signal to noise [dB]"],
                       [[PEERS[p[0]], p[1], p[2], p[3], p[4], decibels(int(p[5]) / 1000, int(p[6]))] for p in peers]),
    }
    tables["host"] = table(["what", "ours [million samples/s]", "beside it", "[million samples/s]", "ratio"],
                           [[h["what"], f"{h['ours'] / 1e6:.3g}", h["peer_is"], f"{h['peer'] / 1e6:.3g}",
                             f"{h['ratio']:.2g}" if h["ratio"] < 100 else f"{h['ratio']:.0f}"] for h in host])
    starts = [{"arguments": w[1], "cpu_ms": float(w[2])} for w in words if w[0] == "start"]
    diagnoses = [{"samples": int(w[1]), "used": int(w[2]), "cpu_s": float(w[3]), "elapsed_s": float(w[4]), "peak_mb": float(w[5]),
                  "load": float(w[6])}
                 for w in words if w[0] == "diagnose"]
    if json_path is None:
        write_page(page_path, {name: tables[name] for name in ("sample", "adoption", "peers")}, loop, peers)
        return
    tables["machine"] = f"On {machine.split(',')[0]}: {host_compiler},\n`{host_flags}`."
    tables["start"] = table(["run", "processor time [ms]"], [[f"`hyst {s['arguments']}`", f"{s['cpu_ms']:.1f}"] for s in starts])
    tables["diagnose"] = table(["samples", "of these used", "processor time [s]", "elapsed [s]", "with a load of", "peak memory [MB]"],
                               [[f"{d['samples']:,}", f"{d['used']:,}", f"{d['cpu_s']:.0f}", f"{d['elapsed_s']:.0f}",
                                 f"{d['load']:.0f}", f"{d['peak_mb']:.0f}"] for d in diagnoses])
    with open(json_path, "w", encoding="utf-8") as out:
        json.dump({"machine": machine, "compiler": compiler, "flags": flags, "host_compiler": host_compiler, "host_flags": host_flags,
                   "loop": loop, "host": host, "start": starts, "diagnose": diagnoses,
                   "kernels": [{"what": p[0], "size": int(p[1]), "worst_instructions": int(p[2]), "mean_instructions": int(p[3]),
                                "worst_error_q31": int(p[4]), "rms_error_q31": int(p[5]) / 1000, "rms_signal_q31": int(p[6])}
                               for p in peers]}, out, indent=1)
        out.write("\n")
    write_page(page_path, tables, loop, peers)


if sys.argv[1] == "--check":
    check(*sys.argv[2:])
elif len(sys.argv) == 3:
    main(sys.argv[1], None, sys.argv[2], *[""] * 5)
else:
    main(*sys.argv[1:])
