# SPDX-License-Identifier: GPL-3.0-or-later
"""Linear systems in continuous time and noises, on an even grid. Nothing here knows the host tool.

A signal between two instants of the grid is either a straight line or, of a converter that holds (`held`), the value at
the later instant. Each recursion is the exact solution for that. Before the first instant the signal has been what it
is there for ever.
"""
import numpy as np


def scan(factor, given):
    """x[k] = factor x[k-1] + given[k], x[-1] = 0, by doubling: as many passes as it takes until factor^(2^n) is 0."""
    x, power, reach = np.array(given), factor, 1
    while reach < len(x) and abs(power) > 1e-18:
        x[reach:] = x[reach:] + power * x[:-reach]
        power, reach = power * power, 2 * reach
    return x


def pole(u, h, p, held=False):
    """z' = p z + u, begun at rest: z[0] = -u[0] / p. The pole may be complex."""
    from_rest = u - u[0]
    ph = p * h
    e = np.exp(ph)
    if held:
        given = (np.expm1(ph) / p) * from_rest
        given[0] = 0.0
        return scan(e, given.astype(type(e * 1.0))) - u[0] / p
    # u = u0 + (u1 - u0) t / h within a step: weights of its two ends
    if abs(ph) < 1e-3:
        late = h * (0.5 + ph / 6.0 + ph * ph / 24.0)
        early = h * (0.5 + ph / 3.0 + ph * ph / 8.0)
    else:
        late = (np.expm1(ph) - ph) / (p * ph)
        early = (e * ph - np.expm1(ph)) / (p * ph)
    given = late * from_rest
    given[1:] += early * from_rest[:-1]
    given[0] = 0.0
    return scan(e, given) - u[0] / p


def low_pass(u, h, tau, held=False):
    """tau x' = u - x."""
    return pole(u, h, -1.0 / tau, held) / tau


def second_order(u, h, hz, zeta, held=False):
    """x'' = w^2 (u - x) - 2 zeta w x', below critical damping: a mode, or a low pass of second order."""
    w = 2.0 * np.pi * hz
    p = complex(-zeta * w, w * np.sqrt(1.0 - zeta * zeta))
    return 2.0 * np.real(w * w / (p - p.conjugate()) * pole(u, h, p, held))


def delayed(u, h, late, held=False):
    """u(t - late); a negative one is early."""
    at = np.arange(len(u)) - late / h
    if held:
        return u[np.clip(np.ceil(at - 1e-9).astype(int), 0, len(u) - 1)]
    return np.interp(at, np.arange(len(u)), u)


def slewed(u, h, up, down):
    """Rate limits, which may differ: the only way is step by step."""
    most, least, now, out = up * h, -down * h, float(u[0]), np.empty(len(u))
    for k, wanted in enumerate(u.tolist()):
        change = wanted - now
        now += most if change > most else least if change < least else change
        out[k] = now
    return out


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


def white(rng, n):
    return rng.standard_normal(n)


def pink(rng, n, exponent=1.0):
    """1/f^exponent in power, from one period of the record up, of unit rms."""
    spectrum = np.fft.rfft(rng.standard_normal(2 * n))
    f = np.arange(len(spectrum), dtype=float)
    f[0] = 1.0
    spectrum *= f ** (-0.5 * exponent)
    spectrum[0] = 0.0
    x = np.fft.irfft(spectrum)[:n]
    x -= x.mean()
    return x / rms(x)


def noise(rng, kind, n):
    """Unit rms. `outliers`: white, with some samples in a thousand at three to five times the noise."""
    if kind == "white":
        x = white(rng, n)
    elif kind == "pink":
        x = pink(rng, n)
    elif kind == "mixed":
        x = np.sqrt(0.6) * white(rng, n) + np.sqrt(0.4) * pink(rng, n)
    elif kind == "outliers":
        x = white(rng, n)
        hit = rng.random(n) < 0.005
        x[hit] = rng.choice([-1.0, 1.0], hit.sum()) * rng.uniform(3.0, 5.0, hit.sum())
    else:
        raise ValueError(kind)
    return x / rms(x)


def refit_left(change, columns):
    """What of `change` is left when the weights of the columns are fitted again (least squares, scaled columns)."""
    a = np.column_stack(columns)
    a = a / np.maximum(np.sqrt(np.sum(a * a, axis=0)), 1e-300)
    return change - a @ np.linalg.lstsq(a, change, rcond=1e-10)[0]
