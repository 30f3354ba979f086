# SPDX-License-Identifier: GPL-3.0-or-later
"""Effects that no catalogue has. Each is drawn once (`rng`, context) and returns a function of passage and size."""
import numpy as np

import signals


def relaxation_of_one_time(rng, c):
    tau = c.duration * float(np.exp(rng.uniform(np.log(0.01), np.log(0.05))))
    return lambda p, size: p.smoothed(p.x + size * (signals.low_pass(p.x, p.h, tau, p.held) - p.x))


def gain_step(rng, c):
    at, s = float(rng.uniform(0.3, 0.8)) * c.duration, float(rng.choice([-1.0, 1.0]))

    def act(p, size):
        p.x = np.where(p.t < at, p.x, p.x * (1.0 + s * size))
    return act


def antiresonance(rng, c):
    """A zero pair just below the poles: a second, coupled mode."""
    hz = float(rng.uniform(0.02, 0.08)) / c.dt

    def act(p, size):
        w0, w1, zeta = 2 * np.pi * hz, 2 * np.pi * hz * (1.0 + size), 0.02
        pole = complex(-zeta * w1, w1 * np.sqrt(1.0 - zeta * zeta))
        # (s^2 + 2 z w0 s + w0^2) / (s^2 + 2 z w1 s + w1^2) (w1 / w0)^2: 1 at rest
        gain = (w1 / w0) ** 2
        residue = gain * (pole * pole + 2 * zeta * w0 * pole + w0 * w0) / (pole - pole.conjugate())
        p.smoothed(gain * p.x + 2.0 * np.real(residue * signals.pole(p.x, p.h, pole, p.held)))
    return act


def stiffening_mode(rng, c):
    """A mode whose frequency doubles towards the ends of the stroke."""
    zeta = 0.03

    def act(p, size):
        w = 2.0 * np.pi / (2.0 * c.dt * size)
        steps = max(1, int(np.ceil(w * 2.0 * p.h / 0.12)))
        h, q, v = p.h / steps, float(p.x[0]), 0.0
        out = np.empty(len(p.x))
        for k, x in enumerate(p.x.tolist()):
            for _ in range(steps):
                s = (q - p.centre) / p.half
                v += h * (w * w * (1.0 + 3.0 * s * s) * (x - q) - 2.0 * zeta * w * v)
                q += h * v
            out[k] = q
        p.smoothed(out)
    return act


def lost_contact(rng, c):
    part = float(rng.uniform(0.15, 0.35))

    def act(p, size):
        corner = p.x.min() + part * (p.x.max() - p.x.min())
        p.x = p.x - size * np.minimum(0.0, p.x - corner)
    return act


def backlash(rng, c):
    def act(p, size):
        r, now, out = size * p.half, float(p.x[0]), np.empty(len(p.x))
        for k, x in enumerate(p.x.tolist()):
            now = x - r if now < x - r else x + r if now > x + r else now
            out[k] = now
        p.x = out
    return act


def stiction(rng, c):
    """Sticks until it is pulled hard enough, then slips all the way."""
    def act(p, size):
        r, now, out = size * p.half, float(p.x[0]), np.empty(len(p.x))
        for k, x in enumerate(p.x.tolist()):
            now = x if abs(x - now) > r else now
            out[k] = now
        p.x = out
    return act


def squared_rate(rng, c):
    top = np.max(np.abs(np.diff(c.sampled))) / c.dt

    def act(p, size):
        late = signals.low_pass(p.drive, p.h, 0.5 * c.dt, p.held)
        p.x = p.x + size * p.half * (np.gradient(late, p.h) / top) ** 2
    return act


def wandering_tone(rng, c):
    hz, turns, phase = float(rng.uniform(0.05, 0.3)) / c.dt, float(rng.uniform(1.0, 4.0)), float(rng.uniform(0, 6.28))

    def act(p, size):
        rate = hz * (1.0 + 0.15 * np.sin(2 * np.pi * turns * p.t / c.duration + phase))
        p.x = p.x + size * p.half * np.sin(2 * np.pi * np.cumsum(rate) * p.h)
    return act


def telegraph(rng, c):
    edges = np.sort(rng.uniform(0.0, c.duration, int(rng.integers(6, 30))))
    return lambda p, size: setattr(p, "x", p.x + size * p.half * (np.searchsorted(edges, p.t) % 2))


def two_slew_limits(rng, c):
    """Sources more current than it sinks. Acts on the drive."""
    top = np.max(np.abs(np.diff(c.sampled))) / c.dt
    return lambda p, size: p.smoothed(signals.slewed(p.x, p.h, 10.0 * top, top / (1.0 + size)))


def periodic_temperature(rng, c):
    """The air conditioning goes on and off."""
    cycles, phase = float(rng.uniform(2.3, 6.7)), float(rng.uniform(0.0, 1.0))

    def act(p, size):
        square = ((cycles * p.t / c.duration + phase) % 1.0 < 0.4) - 0.4
        p.x = p.x + size * p.half * signals.low_pass(square, p.h, 0.08 * c.duration)
    return act


def level_dependent_lag(rng, c):
    """The capacitance of the load grows with the voltage. Acts on the drive."""
    def act(p, size):
        now, out = float(p.x[0]), np.empty(len(p.x))
        for k, x in enumerate(p.x.tolist()):
            tau = size * c.dt * (1.0 + 0.8 * (now - p.centre) / p.half)
            now += (x - now) * -np.expm1(-p.h / tau) if tau > 0 else x - now
            out[k] = now
        p.smoothed(out)
    return act


def depolarised(rng, c):
    """From one instant on there is less gain, an offset and a bend."""
    at = float(rng.uniform(0.35, 0.7)) * c.duration

    def act(p, size):
        s = (p.x - p.centre) / p.half
        p.x = np.where(p.t < at, p.x, p.x - size * p.half * (0.6 + 0.5 * s - 0.4 * s * s))
    return act


# Name: maker, stage, least and largest size, what it would not be seen with
UNKNOWN = {
    "relaxation_of_one_time": (relaxation_of_one_time, "position", 1e-4, 0.5),
    "gain_step": (gain_step, "position", 1e-5, 0.5),
    "antiresonance": (antiresonance, "position", 1e-3, 1.0),
    "stiffening_mode": (stiffening_mode, "position", 1.6, 30.0),
    "lost_contact": (lost_contact, "position", 1e-4, 0.9),
    "backlash": (backlash, "position", 1e-5, 0.2),
    "stiction": (stiction, "position", 1e-5, 0.2),
    "squared_rate": (squared_rate, "sensor", 1e-5, 0.5),
    "wandering_tone": (wandering_tone, "sensor", 1e-5, 0.5),
    "telegraph": (telegraph, "sensor", 1e-5, 0.5),
    "two_slew_limits": (two_slew_limits, "electronics", 0.02, 30.0),
    "periodic_temperature": (periodic_temperature, "sensor", 1e-5, 0.5),
    "level_dependent_lag": (level_dependent_lag, "electronics", 0.02, 30.0),
    "depolarised": (depolarised, "sensor", 1e-5, 0.5),
}
NEEDS_MOTION = {"squared_rate", "two_slew_limits", "level_dependent_lag"}  # not with a held drive
