# SPDX-License-Identifier: GPL-3.0-or-later
"""Proportions with their intervals."""
import math

Z = 1.959964


def share(hits, of):
    """Wilson's interval, 95 %."""
    if of == 0:
        return {"hits": 0, "of": 0, "part": None, "low": None, "high": None}
    p = hits / of
    middle = (p + Z * Z / (2 * of)) / (1 + Z * Z / of)
    half = Z * math.sqrt(p * (1 - p) / of + Z * Z / (4 * of * of)) / (1 + Z * Z / of)
    return {"hits": hits, "of": of, "part": p, "low": max(0.0, middle - half), "high": min(1.0, middle + half)}


def share_of(things, is_hit):
    things = list(things)
    return share(sum(1 for thing in things if is_hit(thing)), len(things))


def macro(things, key, is_hit):
    """Mean over the values of `key` of the share in each, so that a rare block weighs as much as a common one. The
    interval is normal, each share's variance being that of Agresti and Coull."""
    parts = {}
    for thing in things:
        parts.setdefault(key(thing), []).append(bool(is_hit(thing)))
    if not parts:
        return {"part": None, "low": None, "high": None, "over": 0}
    mean = sum(sum(x) / len(x) for x in parts.values()) / len(parts)
    variance = 0.0
    for x in parts.values():
        p = (sum(x) + 2.0) / (len(x) + 4.0)
        variance += p * (1.0 - p) / (len(x) + 4.0)
    half = Z * math.sqrt(variance) / len(parts)
    return {"part": mean, "low": max(0.0, mean - half), "high": min(1.0, mean + half), "over": len(parts)}


def text(s):
    if s["part"] is None:
        return "none"
    if "of" in s:
        return f"{s['hits']}/{s['of']} = {100 * s['part']:.1f} % ({100 * s['low']:.0f} to {100 * s['high']:.0f})"
    return f"{100 * s['part']:.1f} % ({100 * s['low']:.0f} to {100 * s['high']:.0f})"
