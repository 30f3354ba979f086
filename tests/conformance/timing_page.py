# SPDX-License-Identifier: MIT
"""timing_page.py LINES TIMING.json TIMING.md MACHINE COMPILER: what the cost programs printed, as JSON and as the page's tables.

A table of the page stands between "<!-- begin NAME -->" and "<!-- end NAME -->"; all other text is left alone.
"""
import json
import math
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


def main(lines, json_path, page_path, machine, compiler):
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
    with open(json_path, "w", encoding="utf-8") as out:
        json.dump({"machine": machine, "compiler": compiler, "loop": loop, "host": host,
                   "kernels": [{"what": p[0], "size": int(p[1]), "worst_instructions": int(p[2]), "mean_instructions": int(p[3]),
                                "worst_error_q31": int(p[4]), "rms_error_q31": int(p[5]) / 1000, "rms_signal_q31": int(p[6])}
                               for p in peers]}, out, indent=1)
        out.write("\n")
    page = open(page_path, encoding="utf-8").read()
    for name, text in tables.items():
        page, found = re.subn(rf"(<!-- begin {name} -->\n).*?(<!-- end {name} -->)", lambda m: m[1] + text + "\n" + m[2], page,
                              flags=re.S)
        if found != 1:
            sys.exit(f"{page_path}: no place for table '{name}'")
    with open(page_path, "w", encoding="utf-8") as out:
        out.write(page)


main(*sys.argv[1:])
