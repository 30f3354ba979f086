# SPDX-License-Identifier: GPL-3.0-or-later
"""Effects of every block that can be a finding, on a fine grid. Definitions are those of docs/MODELS.md and
docs/IDENTIFICATION.md; the computation shares nothing with the host tool.

An effect has a stage, the numbers it draws and the one that its size sets. `Passage` is what it acts on.
"""
import numpy as np

import signals


class Passage:
    """A signal on its way: `x` on the fine grid (V before the hysteresis, um behind it)."""

    def __init__(self, x, h, oversampling, held, centre, half, duration, drive, preload=0.0):
        self.x, self.h, self.oversampling, self.held = x, h, oversampling, held
        self.centre, self.half = centre, half            # of the range of x: V, or um
        self.duration, self.drive, self.preload = duration, drive, preload
        self.t = np.arange(len(x)) * h

    def smoothed(self, x):
        self.x, self.held = x, False


class Effect:
    def __init__(self, stage, draw, act, low, high, laws=None, excitations=None, not_held=False):
        self.stage, self.draw, self.act, self.low, self.high = stage, draw, act, low, high
        self.laws, self.excitations, self.not_held = laws, excitations, not_held


def sign(rng):
    return float(rng.choice([-1.0, 1.0]))


def transport_delay(p, n):
    p.x = signals.delayed(p.x, p.h, n["delay_s"], p.held)


def low_pass(p, n):
    p.smoothed(signals.low_pass(p.x, p.h, 1.0 / (2.0 * np.pi * n["cutoff_hz"]), p.held))


def slew(p, n):
    p.smoothed(signals.slewed(p.x, p.h, n["limit_v_per_s"], n["limit_v_per_s"]))


def saturation(p, n):
    p.x = np.clip(p.x, n["low_v"], n["high_v"])


def asymmetric(p, n):
    s = (p.x - p.centre) / p.half
    p.x = p.x + p.half * n["asymmetry"] * (s * s - 1.0)


def widened(p, n):
    """What a part with thresholds sees when they grow by beta times the rate: the play of that half width."""
    rate = np.abs(np.diff(p.x, prepend=p.x[0])) / p.h
    growth = (n["beta_s"] * rate).tolist()
    now, out = float(p.x[0]), np.empty(len(p.x))
    for k, u in enumerate(p.x.tolist()):
        g = growth[k]
        now = u - g if now < u - g else u + g if now > u + g else now
        out[k] = now
    return out


def interleaved(p, n):
    """y(t) = h(t) + g y(t - T) s(t - T), T one sample."""
    late = p.oversampling
    s = n["bilinear_gain"] * (p.drive - n["center_v"]) / n["half_range_v"]
    y = np.array(p.x)
    y[:late] = p.x[:late] / (1.0 - s[0])
    for first in range(late, len(y), late):
        last = min(first + late, len(y))
        y[first:last] += y[first - late:last - late] * s[first - late:last - late]
    p.x = y


def relaxations(p, shortest, decades, a_decade, growth):
    """Growth of what comes in by `growth` a decade of time, by relaxations evenly over the logarithm."""
    out = np.zeros(len(p.x))
    for i in range(decades * a_decade):
        tau = shortest * 10.0 ** ((i + 0.5) / a_decade)
        out += signals.low_pass(p.x, p.h, tau, p.held) - p.x[0]
    return growth / a_decade * out


def creep(p, n):
    p.x = p.x + relaxations(p, 0.1, 4, 8, n["gamma_per_decade"])


def dielectric_loss(p, n):
    growth = 2.0 * np.log(10.0) / np.pi * n["loss_tangent"]
    whole = p.x - p.x[0] + relaxations(p, 1e-4, 6, 4, growth)
    p.x = p.x[0] + whole / (1.0 + 6.0 * growth)


def leakage(p, n):
    p.x = p.x + p.x[0] - signals.low_pass(p.x, p.h, n["time_constant_s"], p.held)


def gain_drift(p, n):
    p.x = n["center_um"] + (p.x - n["center_um"]) * (1.0 + n["gain_per_s"] * p.t)


def self_heating(p, n):
    """Gain and length follow the heat of lost work. The branch that is under way loses in proportion to how far it has
    come from the turn that it began at; a turn that it passes is forgotten, as a hysteresis forgets it."""
    power, turns, now = np.zeros(len(p.x)), [float(p.drive[0])], float(p.drive[0])
    for k, u in enumerate(p.drive.tolist()):
        if u != now:
            if (u > now) == (now < turns[-1]):  # it turns round
                turns.append(now)
            while len(turns) > 2 and (turns[-2] - u) * (u - now) <= 0.0:
                del turns[-2:]
            power[k] = abs(u - now) * abs(0.5 * (u + now) - turns[-1])
            now = u
    heat = signals.low_pass(power / p.h / (4.0 * n["half_range_v"] ** 2), p.h, n["time_constant_s"])
    p.x = p.x * (1.0 + n["gain_per_hz"] * heat) + n["expansion_um_per_hz"] * heat


def resonance(p, n):
    p.smoothed(signals.second_order(p.x, p.h, n["frequency_hz"], n["damping_ratio"], p.held))


def two_modes(p, n):
    """A sum over modes; what comes in is the static stroke."""
    lower = signals.second_order(p.x, p.h, n["lower_hz"], n["lower_damping"], p.held)
    upper = signals.second_order(p.x, p.h, n["upper_hz"], n["upper_damping"], p.held)
    p.smoothed(lower + n["upper_share"] * (upper - lower))


def static_nonlinearity(p, n):
    s = (p.x - p.centre) / p.half
    p.x = p.x + p.half * s * s * (n["quadratic"] + n["cubic"] * s)


def thermal_drift(p, n):
    p.x = p.x + n["drift_um"] * -np.expm1(-p.t / n["time_constant_s"])


def mains(p, n):
    p.x = p.x + n["amplitude_um"] * np.sin(2.0 * np.pi * n["frequency_hz"] * p.t + n["phase_rad"])


def quantisation(p, n):
    p.x = n["step_um"] * np.round(p.x / n["step_um"])


# Draws: the context has dt (s), duration (s), half_v, half_um, centre_um, sampled (V). They return a function of size.
def draw_delay(rng, c):
    return lambda size: {"delay_s": size * c.dt}


def draw_cutoff(rng, c):
    return lambda size: {"cutoff_hz": 1.0 / (2.0 * np.pi * size * c.dt)}


def draw_slew(rng, c):
    rate = np.sort(np.abs(np.diff(c.sampled)) / c.dt)
    return lambda size: {"limit_v_per_s": float(rate[-1] / (1.0 + size))}


def draw_rails(rng, c):
    low, high, both = float(np.min(c.sampled)), float(np.max(c.sampled)), rng.random()
    side = rng.random() < 0.5

    def at(size):
        span = high - low
        cut_low = size * span if both < 0.3 or side else -1.0 * span
        cut_high = size * span if both < 0.3 or not side else -1.0 * span
        return {"low_v": low + cut_low, "high_v": high - cut_high}
    return at


def draw_asymmetry(rng, c):
    s = sign(rng)
    return lambda size: {"asymmetry": s * size, "center_v": c.centre_v, "half_range_v": c.half_v}


def draw_beta(rng, c):
    rate = np.max(np.abs(np.diff(c.sampled))) / c.dt
    return lambda size: {"beta_s": float(size * c.half_v / rate)}


def draw_interleaved(rng, c):
    s = sign(rng)
    return lambda size: {"bilinear_gain": s * size, "center_v": c.centre_v, "half_range_v": c.half_v}


def draw_creep(rng, c):
    return lambda size: {"gamma_per_decade": size}


def draw_loss(rng, c):
    return lambda size: {"loss_tangent": size}


def draw_leakage(rng, c):
    return lambda size: {"time_constant_s": c.duration / size}


def draw_gain_drift(rng, c):
    s = sign(rng)
    centre = 0.0 if rng.random() < 0.5 else float(c.centre_um + c.half_um * rng.uniform(-1.0, 1.0))
    return lambda size: {"gain_per_s": s * size / c.duration, "center_um": centre}


def draw_self_heating(rng, c):
    s, t, tau = sign(rng), sign(rng), c.duration * float(np.exp(rng.uniform(np.log(0.05), np.log(0.3))))
    hz = np.mean(np.abs(np.diff(c.sampled))) / c.dt / (4.0 * c.half_v)
    part = float(rng.choice([0.0, 1.0, rng.random()]))
    return lambda size: {"gain_per_hz": s * size * part / hz, "half_range_v": c.half_v, "time_constant_s": tau,
                         "expansion_um_per_hz": t * size * (1.0 - part) * c.half_um / hz}


def draw_mode(rng, c):
    zeta = float(np.exp(rng.uniform(np.log(0.008), np.log(0.08))))
    return lambda size: {"frequency_hz": 1.0 / (c.dt * 2.0 * size), "damping_ratio": zeta}


def draw_two_modes(rng, c):
    zeta, ratio = np.exp(rng.uniform(np.log(0.008), np.log(0.08), 2)), float(rng.uniform(1.6, 4.0))
    share = float(rng.uniform(0.1, 0.5))

    def at(size):
        hz = 1.0 / (c.dt * 2.0 * size)
        return {"lower_hz": hz / ratio, "lower_damping": float(zeta[0]), "upper_hz": hz,
                "upper_damping": float(zeta[1]), "upper_share": share}
    return at


def draw_curve(rng, c):
    s, part = sign(rng), float(rng.choice([0.0, 1.0, rng.random()]))
    return lambda size: {"quadratic": s * size * part, "cubic": s * size * (1.0 - part), "center_um": c.centre_um,
                         "half_range_um": c.half_um}


def draw_thermal(rng, c):
    s, tau = sign(rng), c.duration * float(np.exp(rng.uniform(np.log(0.15), np.log(1.0))))
    return lambda size: {"drift_um": s * size * c.half_um, "time_constant_s": tau}


def draw_hum(rng, c):
    mains_hz = [50.0, 60.0, 100.0, 120.0, 150.0, 180.0]
    possible = [hz for hz in mains_hz if hz < 0.4 / c.dt and hz * c.duration > 5.0] or [0.17 / c.dt]
    hz = float(rng.choice(possible)) * (1.0 + 5e-4 * float(rng.standard_normal()))
    phase = float(rng.uniform(0.0, 6.28))
    return lambda size: {"frequency_hz": hz, "amplitude_um": size * c.half_um, "phase_rad": phase}


def draw_steps(rng, c):
    return lambda size: {"step_um": size * c.half_um}


CATALOGUE = {
    "transport_delay": Effect("electronics", draw_delay, transport_delay, 0.02, 40.0, not_held=True),
    "amplifier_bandwidth": Effect("electronics", draw_cutoff, low_pass, 0.02, 40.0),
    "amplifier_slew_limit": Effect("electronics", draw_slew, slew, 0.02, 60.0),
    "amplifier_saturation": Effect("electronics", draw_rails, saturation, 1e-4, 0.3),
    "asymmetric_hysteresis": Effect("drive", draw_asymmetry, asymmetric, 1e-4, 0.3),
    "rate_dependent_hysteresis": Effect("widening", draw_beta, widened, 1e-4, 0.6, laws=True, not_held=True),
    "interleaved_hysteresis": Effect("position", draw_interleaved, interleaved, 1e-4, 0.3),
    "creep": Effect("position", draw_creep, creep, 1e-4, 0.1),
    "dielectric_loss": Effect("position", draw_loss, dielectric_loss, 1e-4, 0.1),
    "charge_leakage": Effect("position", draw_leakage, leakage, 1e-4, 20.0),
    "gain_drift": Effect("position", draw_gain_drift, gain_drift, 1e-4, 0.5),
    "resonance": Effect("position", draw_mode, resonance, 1.3, 200.0),
    "sensor_bandwidth": Effect("sensor", draw_cutoff, low_pass, 0.02, 40.0),
    "static_nonlinearity": Effect("sensor", draw_curve, static_nonlinearity, 1e-4, 0.3),
    "thermal_drift": Effect("sensor", draw_thermal, thermal_drift, 1e-5, 1.0),
    "mains_interference": Effect("sensor", draw_hum, mains, 1e-5, 0.5),
    "quantisation": Effect("converter", draw_steps, quantisation, 1e-5, 0.5),
}
# Two kinds of their own, so that the plans of the sets that were published stay what they are: richer forms of one of
# these, which the tool asks in its place, and blocks that came later.
RICHER = {
    "two_modes": Effect("position", draw_two_modes, two_modes, 1.3, 60.0),
}
LATER = {
    "self_heating": Effect("position", draw_self_heating, self_heating, 1e-4, 1.0, not_held=True),
}
KNOWN = {**CATALOGUE, **RICHER, **LATER}
