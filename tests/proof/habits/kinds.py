# SPDX-License-Identifier: GPL-3.0-or-later
"""The fifteen laws with random numbers of their kind, and the one table that says which set a law, an excitation and an
effect without a name belong to. Nothing of one set appears in another."""
import numpy as np

from laws import Density, Duhem, Leaky, Master, Moving, Plays, Stepwise, masing

SETS = ("building", "calibration", "last")
LAW_SETS = {
    "play_exponential": "building", "play_free": "calibration", "generalised_pi": "last",
    "preisach_skewed": "building", "bouc_wen": "calibration", "dahl": "last",
    "coleman_hodgdon": "building", "krasnoselskii_pokrovskii": "calibration", "jiles_atherton": "last",
    "maxwell_slip": "building", "ramberg_osgood": "calibration", "everett_lognormal": "last",
    "moving_preisach": "building", "bouc_wen_asymmetric": "calibration", "leaky_paths": "last",
}
EXCITATION_SETS = {
    "triangles": "building", "raster": "calibration", "stairs": "last",
    "two_sines": "building", "multisine": "calibration", "noise": "last",
    "chirp": "building", "set_points": "calibration", "decay": "last",
    "mid_loop": "building", "combination": "calibration", "sines": "last",
    "reversal_curves": "building", "one_sine": "calibration", "bursts": "last",
}
UNKNOWN_SETS = {  # self_heating has a block by now (effects.LATER); its place in the plans stays
    "relaxation_of_one_time": "building", "gain_step": "calibration", "self_heating": "last",
    "antiresonance": "building", "stiffening_mode": "calibration", "lost_contact": "last",
    "backlash": "building", "stiction": "calibration", "squared_rate": "last",
    "wandering_tone": "building", "telegraph": "calibration", "two_slew_limits": "last",
    "periodic_temperature": "building", "level_dependent_lag": "calibration", "depolarised": "last",
}


def of_set(table, name):
    return [kind for kind, where in table.items() if where == name]


def loop_width(rng):
    """Height of the widest loop over the stroke."""
    return float(rng.uniform(0.04, 0.2))


def scale(law, width):
    """Scales the part with memory so that the loop over the whole range is `width` of the stroke high in the middle,
    less if a branch would otherwise be nearly flat or fall somewhere. Returns the stroke and the width."""
    n = 400
    way = np.concatenate([np.linspace(-1.0, 1.0, n + 1), np.linspace(1.0, -1.0, n + 1)[1:]])
    h = law.with_memory([-1.0, 1.0, -1.0], way)
    height, stroke = float(h[n + n // 2] - h[n // 2]), float(h[n] - h[0])
    slopes = np.diff(h) / np.diff(way)
    if height > 0.0:
        width = min(width, 0.6 * height / abs(stroke))
    for _ in range(40):
        factor = 2.0 * width / (height - width * stroke)
        mean = 1.0 + 0.5 * factor * stroke
        if np.min(1.0 + factor * slopes) > 0.15 * mean:
            break
        width *= 0.85
    else:
        raise ValueError("no monotone hysteresis")
    return factor, 2.0 + factor * stroke, width


class Scaled:
    """A law of stroke 2 (from -1 to 1 and back) and reversible slope `reversible`."""

    def __init__(self, name, rng):
        for _ in range(50):
            self.law, self.numbers = MAKERS[name](rng)
            try:
                self.factor, self.stroke, self.width = scale(self.law, loop_width(rng))
                break
            except ValueError:
                continue
        self.name = name
        self.numbers["width"] = float(self.width)

    def __call__(self, past, path, widened=None):
        memory = self.law.with_memory(past, path if widened is None else widened)
        return 2.0 * (path + self.factor * memory) / self.stroke


def play_exponential(rng):
    n, rate = 200, float(rng.uniform(1.0, 8.0))
    r = (np.arange(n) + 0.5) / n
    return Plays(r, np.exp(-rate * r) / n, 1.0), {"plays": n, "rate": rate}


def play_free(rng):
    n = int(rng.integers(9, 40))
    r = np.sort(rng.uniform(0.004, 0.95, n))
    return Plays(r, rng.exponential(1.0, n), 1.0), {"plays": n}


def generalised_pi(rng):
    n = int(rng.integers(30, 80))
    r = (np.arange(n) + 0.5) / n * 0.8
    bend_up, bend_down = rng.uniform(0.5, 1.6, 2)
    shift_up, shift_down = rng.uniform(-0.25, 0.25, 2)
    up = np.tanh(bend_up * (1.0 + shift_up)) - np.tanh(bend_up * (shift_up - 1.0))
    down = np.tanh(bend_down * (1.0 + shift_down)) - np.tanh(bend_down * (shift_down - 1.0))

    def curve(u):
        rising = 2.0 * np.tanh(bend_up * (u + shift_up)) / up
        falling = 2.0 * np.tanh(bend_down * (u + shift_down)) / down
        # both envelopes agree at the ends, so that the loop closes
        rising = rising - 2.0 * np.tanh(bend_up * (1.0 + shift_up)) / up + 1.0
        falling = falling - 2.0 * np.tanh(bend_down * (1.0 + shift_down)) / down + 1.0
        return np.minimum(rising, falling), np.maximum(rising, falling)

    law = Plays(r, np.exp(-rng.uniform(1.0, 4.0) * r), 1.0, curve)
    return law, {"plays": n, "bend": [float(bend_up), float(bend_down)], "shift": [float(shift_up), float(shift_down)]}


def preisach_skewed(rng):
    at, spread, tilt = rng.uniform(0.05, 0.35), rng.uniform(0.1, 0.35), rng.uniform(-1.2, 1.2)
    middle, width = rng.uniform(-0.3, 0.3), rng.uniform(0.4, 1.0)

    def density(r, c):
        return np.exp(-0.5 * ((r - at) / spread) ** 2 - 0.5 * ((c - middle) / width) ** 2) * np.exp(tilt * c)

    return Density(density, 1.0), {"r0": float(at), "sr": float(spread), "tilt": float(tilt), "c0": float(middle),
                                   "sc": float(width)}


def everett_lognormal(rng):
    median, spread, lean = rng.uniform(0.08, 0.4), rng.uniform(0.5, 1.1), rng.uniform(-0.8, 0.8)
    width = rng.uniform(0.3, 1.0)

    def density(r, c):
        safe = np.maximum(r, 1e-9)
        return np.exp(-0.5 * (np.log(safe / median) / spread) ** 2) / safe * \
            np.exp(-0.5 * ((c - 0.3 * lean * r) / width) ** 2) * (1.0 + 0.5 * np.tanh(3.0 * lean * c))

    return Density(density, 1.0), {"median": float(median), "sigma": float(spread), "lean": float(lean),
                                   "sc": float(width)}


def krasnoselskii_pokrovskii(rng):
    """Kernels whose branches are ramps and no steps: the plane smeared along both switching drives."""
    ramp, rate, slope = rng.uniform(0.15, 0.5), rng.uniform(1.0, 5.0), rng.uniform(-0.6, 0.6)

    def density(r, c):
        out = 0.0
        for a in (0.125, 0.375, 0.625, 0.875):       # a ramp is a row of relays side by side, at the same half width
            shifted = c - ramp * (a - 0.5)
            out = out + np.exp(-rate * r) * np.clip(1.0 + slope * shifted, 0.05, None) * (np.abs(shifted) < 1.0)
        return out

    return Density(density, 1.0), {"ramp": float(ramp), "rate": float(rate), "slope": float(slope)}


def moving_preisach(rng):
    plane, numbers = preisach_skewed(rng)
    feedback = float(rng.uniform(0.2, 0.6) * rng.choice([-1.0, 1.0]))
    plane.scale = 0.5 / max(1e-9, float(plane.everett(1.0, -1.0)))
    return Moving(plane, feedback), dict(numbers, feedback=feedback)


def bouc_wen(rng):
    n, beta = float(rng.choice([1.0, 1.5, 2.0])), float(rng.uniform(1.5, 6.0))
    gamma = beta * float(rng.uniform(-0.5, 0.9))

    def slope(h, s):
        return 1.0 - np.abs(h) ** n * (gamma + beta * np.sign(h * s))

    def limit(s):
        top = (1.0 / (gamma + beta)) ** (1.0 / n)
        return (None, top) if s > 0 else (-top, None)

    return Master(slope, 1.0, 1.0, limit), {"exponent": n, "beta": beta, "gamma": gamma}


def bouc_wen_asymmetric(rng):
    n, beta = float(rng.choice([1.0, 1.4, 2.0])), float(rng.uniform(1.5, 6.0))
    gamma, delta = beta * rng.uniform(-0.3, 0.5), beta * rng.uniform(-0.3, 0.3)

    def slope(h, s):
        return 1.0 - np.abs(h) ** n * (gamma + beta * np.sign(h * s) + delta * s)

    def limit(s):
        top = (1.0 / (gamma + beta + delta * s)) ** (1.0 / n)
        return (None, top) if s > 0 else (-top, None)

    return Master(slope, 1.0, 1.0, limit), {"exponent": n, "beta": beta, "gamma": float(gamma), "delta": float(delta)}


def dahl(rng):
    p, stiffness = float(rng.choice([0.5, 0.7, 1.5, 2.0, 3.0])), float(rng.uniform(1.5, 6.0))

    def slope(h, s):
        return np.abs(1.0 - h * s) ** p * np.sign(1.0 - h * s)

    inner = Master(slope, 1.0, 1.0, lambda s: (None, 1.0 - 1e-6) if s > 0 else (-1.0 + 1e-6, None))
    for direction, (h, path) in inner.tables.items():
        inner.tables[direction] = h, path / stiffness
    return inner, {"exponent": p, "stiffness": stiffness}


def coleman_hodgdon(rng):
    a, bend, top = float(rng.uniform(1.5, 6.0)), float(rng.uniform(0.3, 1.5)), float(rng.uniform(-0.3, 0.3))
    less, tilt = float(rng.uniform(0.3, 0.9)), float(rng.uniform(-0.3, 0.3))

    def f(u):
        return np.tanh(bend * u) / bend + top * u * u

    def g(u):
        return less / np.cosh(bend * u) ** 2 * (1.0 + tilt * np.tanh(u)) * 0.5

    return Duhem(a, f, g, 1.0, 1.0), {"a": a, "bend": bend, "top": top, "less": less, "tilt": tilt}


def jiles_atherton(rng):
    shape, pinning, coupling = float(rng.uniform(0.3, 0.8)), float(rng.uniform(0.1, 0.4)), float(rng.uniform(0.0, 0.2))
    back = float(rng.uniform(0.05, 0.4))

    def langevin(x):
        return 1.0 / np.tanh(x) - 1.0 / x if abs(x) > 0.02 else x / 3.0 - x ** 3 / 45.0

    def steep(x):
        return 1.0 / (x * x) - 1.0 / np.sinh(x) ** 2 if 0.02 < abs(x) < 300.0 else 1.0 / 3.0 - x * x / 15.0

    def slope(u, m, s):
        x = (u + coupling * m) / shape
        lacking = langevin(x) - m
        moved = max(0.0, lacking * s) / (pinning - coupling * lacking * s) if lacking * s > 0.0 else 0.0
        turning = back * steep(x) / shape
        return ((1.0 - back) * moved + turning) / (1.0 - coupling * turning)

    return Stepwise(slope, 1.0, 1.0), {"shape": shape, "pinning": pinning, "coupling": coupling, "reversible": back}


def maxwell_slip(rng):
    """Springs that slip, few of them, driven by a force: branches of straight pieces, which are that curve twice."""
    n = int(rng.integers(4, 11))
    at = np.sort(rng.uniform(0.01, 0.9, n))
    soft = np.cumsum(rng.uniform(0.2, 1.0, n))

    def initial(u):
        out = 0.0
        for corner, more in zip(at, np.diff(soft, prepend=0.0)):
            out = out + more * np.maximum(np.abs(u) - corner, 0.0)
        return np.sign(u) * out

    return masing(initial, 1.0), {"elements": n}


def ramberg_osgood(rng):
    m = float(rng.uniform(1.4, 3.0))
    return masing(lambda u: np.sign(u) * np.abs(u) ** m, 1.0), {"exponent": m}


def leaky_paths(rng):
    n = int(rng.integers(3, 7))
    lengths = np.sort(np.exp(rng.uniform(np.log(0.05), np.log(1.5), n)))
    weights = -rng.uniform(0.2, 1.0, n)     # less slope just after a turn is what a piezo has
    products = rng.uniform(-0.3, 0.3, n) / lengths
    return Leaky(lengths, weights, products, 1.0), {"lengths": [round(float(x), 4) for x in lengths]}


MAKERS = {f.__name__: f for f in (
    play_exponential, play_free, generalised_pi, preisach_skewed, bouc_wen, dahl, coleman_hodgdon,
    krasnoselskii_pokrovskii, jiles_atherton, maxwell_slip, ramberg_osgood, everett_lognormal, moving_preisach,
    bouc_wen_asymmetric, leaky_paths)}
# A law whose elements have thresholds can have them grow with the rate.
WITH_THRESHOLDS = {"play_exponential", "play_free", "preisach_skewed", "krasnoselskii_pokrovskii", "maxwell_slip",
                   "ramberg_osgood", "everett_lognormal"}
