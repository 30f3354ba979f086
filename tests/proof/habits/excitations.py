# SPDX-License-Identifier: GPL-3.0-or-later
"""What labs drive an actuator with, as a function of time in parts of the recording (0 to 1), in half ranges.

Each maker returns (function of time, whether it has edges). A drive with edges is never called smooth between samples.
"""
import numpy as np


def triangle(turns):
    """From -1, turns in half periods."""
    return 2.0 * np.abs(turns / 2.0 - np.floor(turns / 2.0 + 0.5)) * 2.0 - 1.0


def through(levels, times):
    return lambda t: np.interp(t, times, levels)


def triangles(rng, n):
    sizes = np.sort(rng.uniform(0.2, 1.0, int(rng.integers(2, 6))))
    sizes[-1] = rng.uniform(0.9, 1.0)
    if rng.random() < 0.4:
        sizes = sizes[::-1]
    levels, times, at = [0.0], [0.0], 0.0
    for speed in np.geomspace(1.0, rng.uniform(1.0, 8.0), int(rng.integers(1, 4))):
        for size in sizes:
            for _ in range(int(rng.integers(1, 4))):
                for level in (size, -size):
                    at += abs(level - levels[-1]) / speed
                    levels.append(level)
                    times.append(at)
    at += abs(levels[-1])
    return through(levels + [0.0], np.array(times + [at]) / at), False


def raster(rng, n):
    lines = int(rng.integers(12, 60))
    back = rng.uniform(0.08, 0.5)
    slow = rng.uniform(0.1, 0.6)

    def f(t):
        turn = t * lines
        part = turn - np.floor(turn)
        saw = np.where(part < 1.0 - back, part / (1.0 - back), (1.0 - part) / back)
        return (1.0 - slow) * (2.0 * saw - 1.0) + slow * (2.0 * t - 1.0)
    return f, False


def stairs(rng, n):
    steps = int(rng.integers(5, 14))
    up = np.linspace(-1.0, 1.0, steps)
    levels = np.concatenate([up, up[-2::-1]])
    levels = np.concatenate([levels, levels[1:]] if rng.random() < 0.5 else [levels])
    edge = rng.uniform(2.0, 30.0) / n
    return held(levels, edge), True


def held(levels, edge):
    """Levels of equal duration with ramps between."""
    count = len(levels)
    edge = min(edge, 0.3 / count)
    times, values = [], []
    for k, level in enumerate(levels):
        times += [k / count + (edge if k else 0.0), (k + 1) / count]
        values += [level, level]
    return through(values, times)


def two_sines(rng, n):
    slow, ratio = rng.uniform(2.0, 8.0), rng.uniform(7.0, 40.0)
    small = rng.uniform(0.05, 0.4)
    a, b = rng.uniform(0.0, 2.0 * np.pi, 2)

    def f(t):
        turn = 2 * np.pi * slow * t
        return (1.0 - small) * np.sin(turn + a) + small * np.sin(ratio * turn + b)
    return f, False


def multisine(rng, n):
    lines = np.unique(np.round(np.geomspace(2, rng.uniform(min(80.0, n / 40.0), n / 40.0), int(rng.integers(10, 40)))))
    phase = rng.uniform(0.0, 2.0 * np.pi, len(lines))
    size = lines ** -rng.uniform(0.0, 0.8)
    periods = int(rng.integers(1, 4))

    def raw(t):
        out = 0.0
        for line, a, p in zip(lines, size, phase):
            out = out + a * np.sin(2 * np.pi * np.round(line / periods + 0.5) * periods * t + p)
        return out
    top = 1.02 * np.max(np.abs(raw(np.linspace(0.0, 1.0, 8 * n))))
    return lambda t: raw(t) / top, False


def noise(rng, n):
    """Low-passed noise, as a sum of many lines."""
    top = rng.uniform(min(60.0, n / 60.0), n / 60.0)
    lines = np.arange(1, int(top * 1.5))
    size = 1.0 / (1.0 + (lines / top * rng.uniform(1.5, 4.0)) ** 4)
    spectrum = size * rng.standard_normal(len(lines)) * np.exp(2j * np.pi * rng.random(len(lines)))
    grid = 1 << int(np.ceil(np.log2(16 * n)))
    x = np.fft.irfft(np.concatenate([[0.0], spectrum]), grid)
    x /= 1.02 * np.max(np.abs(x))
    at = np.arange(grid + 1) / grid
    return lambda t: np.interp(t, at, np.append(x, x[0])), False


def chirp(rng, n):
    low = rng.uniform(1.0, 4.0)
    high = low * np.exp(rng.uniform(np.log(10.0), np.log(max(10.0, n / 60.0 / low))))
    size, offset = rng.uniform(0.2, 0.9), rng.uniform(-0.1, 0.1)
    rate = np.log(high / low)
    # cycles of a logarithmic sweep over the recording; the highest has at least 25 samples a period
    top = min(1.0, n / 25.0 / high)
    return lambda t: offset + size * np.sin(2 * np.pi * top * low * np.expm1(rate * t) / rate), False


def set_points(rng, n):
    levels = rng.uniform(-1.0, 1.0, int(rng.integers(12, 50)))
    levels[rng.permutation(len(levels))[:2]] = [-1.0, 1.0]
    return held(levels, rng.uniform(1.0, 60.0) / n), True


def decay(rng, n):
    turns = rng.uniform(8.0, 40.0)
    rate = rng.uniform(1.0, 3.5)
    shape = triangle if rng.random() < 0.4 else (lambda x: np.sin(np.pi * x))
    return lambda t: np.exp(-rate * t) * shape(2.0 * turns * t + 0.5), False


def mid_loop(rng, n):
    """Cut out of what was going on: swings about a level that wanders."""
    turns, size, level = rng.uniform(6.0, 30.0), rng.uniform(0.2, 0.6), rng.uniform(-0.3, 0.3)
    slow, phase, start = rng.uniform(0.5, 2.0), rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.0, 2.0 * np.pi)

    def f(t):
        wander = level + 0.3 * np.sin(2 * np.pi * slow * t + phase)
        return wander + size * (0.6 + 0.4 * np.sin(2 * np.pi * 0.7 * t)) * np.sin(2 * np.pi * turns * t + start)
    return f, False


def combination(rng, n):
    """Sweep of the range, rest, stairs, swings that grow faster."""
    high = rng.uniform(20.0, max(21.0, n / 300.0))
    stair = held(rng.uniform(-0.8, 0.8, 6), 0.004)
    low_at, high_at = 0.18, 0.75

    def f(t):
        sweep = triangle(t / low_at * 2.0 + 0.0)
        swing = 0.6 * np.sin(2 * np.pi * high * np.clip(t - high_at, 0.0, None) ** 2 / 0.25)
        return np.where(t < low_at, sweep, np.where(t < 0.3, -1.0 + (t - low_at) / 0.12 * 1.0 * (t < 0.3),
                        np.where(t < high_at, stair(np.clip((t - 0.3) / (high_at - 0.3), 0, 1)), swing)))
    return f, True


def sines(rng, n):
    """Sines of several frequencies and amplitudes, one after another, with rests."""
    blocks = int(rng.integers(3, 7))
    hz = np.sort(rng.uniform(4.0, 60.0, blocks)) * blocks / 4.0
    size = rng.uniform(0.25, 1.0, blocks)
    size[0] = 1.0
    rest = rng.uniform(0.0, 0.25)

    def f(t):
        block = np.minimum((t * blocks).astype(int), blocks - 1)
        inside = np.clip((t * blocks - block) / (1.0 - rest), 0.0, 1.0)
        cycles = np.maximum(1.0, np.round(hz / blocks * (1.0 - rest)))[block]
        return size[block] * np.sin(2 * np.pi * cycles * inside)
    return f, False


def reversal_curves(rng, n):
    """First-order reversal curves: from the top down to ever lower levels."""
    low = np.linspace(0.8, -1.0, int(rng.integers(6, 16)))
    levels = [-1.0, 1.0]
    for level in low:
        levels += [float(level), 1.0]
    times = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(levels)))])
    return through(levels, times / times[-1]), False


def one_sine(rng, n):
    turns, size, phase = rng.uniform(8.0, 40.0), rng.uniform(0.6, 1.0), rng.uniform(0.0, 2 * np.pi)
    return lambda t: size * np.sin(2 * np.pi * turns * t + phase), False


def bursts(rng, n):
    """Packets of a sine with pauses, at several bias levels."""
    count, turns = int(rng.integers(4, 10)), int(rng.integers(4, 12))
    level, size = rng.uniform(-0.5, 0.5, count), rng.uniform(0.15, 0.5, count)
    level[0], size[0] = 0.0, 1.0
    on = rng.uniform(0.4, 0.7)

    def f(t):
        block = np.minimum((t * count).astype(int), count - 1)
        inside = t * count - block
        before = level[np.maximum(block - 1, 0)]
        ramp = np.clip(inside / 0.1, 0.0, 1.0)
        bias = before + (level[block] - before) * (3.0 - 2.0 * ramp) * ramp * ramp
        packet = np.clip((inside - 0.1) / on, 0.0, 1.0)
        return bias + size[block] * np.sin(np.pi * packet) ** 2 * np.sin(2 * np.pi * turns * packet)
    return f, False


MAKERS = {f.__name__: f for f in (triangles, raster, stairs, two_sines, multisine, noise, chirp, set_points, decay,
                                  mid_loop, combination, sines, reversal_curves, one_sine, bursts)}
