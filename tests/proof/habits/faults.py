# SPDX-License-Identifier: GPL-3.0-or-later
"""Faults of recordings: what happens between the sensor and the file. Each acts on a finished recording.

A fault changes the columns and returns its numbers. What shifts time is made so large that it changes the recording by
three times the noise or more.
"""
import numpy as np

import signals


class Recording:
    """What is sampled. `at(t)` is the position at times t, noise-free; drive is the column."""

    def __init__(self, drive, at, dt, noise, step):
        self.drive, self.at, self.dt, self.noise, self.step = np.array(drive), at, dt, np.array(noise), step
        self.t = np.arange(len(drive)) * dt
        self.y = at(self.t) + self.noise
        self.stroke = float(np.ptp(self.at(self.t)))

    def converted(self):
        self.y = self.step * np.round(self.y / self.step)


def moving_by(r, late):
    return signals.rms(r.at(r.t - late) - r.at(r.t)) / signals.rms(r.noise)


def lag_for(r, strength, most=12.0):
    """A time shift that is worth so much; at most `most` samples."""
    low, high = 0.01 * r.dt, most * r.dt
    for _ in range(40):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if moving_by(r, middle) < strength else (low, middle)
    return middle


def two_clocks(rng, r, strength):
    """The sensor's clock is fast or slow; its driver skips or repeats a sample when it is one off."""
    total = max(3.0 * r.dt, 2.0 * lag_for(r, strength)) * float(rng.choice([-1.0, 1.0]))
    rate = total / r.t[-1]
    drift = rate * r.t
    late = drift - np.round(drift / r.dt) * r.dt
    r.y = r.at(r.t - late) + r.noise
    return {"parts_per_million": 1e6 * rate, "jumps": int(abs(np.round(drift[-1] / r.dt)))}


def dropped_samples(rng, r, strength):
    """The position loses samples at one to three instants; from there on it is early beside the drive."""
    at = np.sort(rng.uniform(0.15, 0.85, int(rng.integers(1, 4)))) * len(r.t)
    count = int(max(1, round(lag_for(r, strength) / r.dt)))
    late = -count * r.dt * np.searchsorted(at, np.arange(len(r.t)), side="right")
    r.y = r.at(r.t - late) + r.noise
    return {"samples": count, "at_s": [float(r.dt * int(np.ceil(x))) for x in at]}


def repeated_samples(rng, r, strength):
    """Blocks of the position are written twice: late from there on."""
    at = np.sort(rng.uniform(0.15, 0.85, int(rng.integers(1, 4)))).dot(1.0) * len(r.t)
    count = int(max(2, round(lag_for(r, strength) / r.dt)))
    y = list(r.y)
    for place in sorted((int(x) for x in at), reverse=True):
        y[place:place] = y[place - count:place]
    r.y = np.array(y[:len(r.t)])
    return {"samples": count, "at_s": [float(r.dt * int(x)) for x in at]}


def stuck_samples(rng, r, strength):
    """The sensor's interface misses reads: the last value stays for a while, here and there."""
    runs = []
    for place in np.sort(rng.integers(10, len(r.t) - 60, int(rng.integers(4, 12)))):
        length = int(rng.integers(5, 50))
        r.y[place:place + length] = r.y[place]
        runs.append(int(place))
    ends = np.flatnonzero(np.diff(r.y, prepend=np.nan, append=np.nan) != 0)     # two runs may touch
    return {"runs": len(runs), "longest": int(np.max(np.diff(ends)))}


def missing_codes(rng, r, strength):
    gap = max(8.0 * signals.rms(r.noise), 0.01 * r.stroke)
    places = np.quantile(r.y, rng.uniform(0.1, 0.9, 5))
    for place in places:
        inside = np.abs(r.y - place) < 0.5 * gap
        r.y[inside] = place + 0.5 * gap * np.where(r.y[inside] < place, -1.0, 1.0)
    return {"gap_um": gap, "gaps": len(places)}


def clipped_converter(rng, r, strength):
    part = float(rng.uniform(0.02, 0.12))
    if rng.random() < 0.5:
        level = r.y.max() - part * r.stroke
        r.y = np.minimum(r.y, level)
        return {"high_um": float(level)}
    level = r.y.min() + part * r.stroke
    r.y = np.maximum(r.y, level)
    return {"low_um": float(level)}


def outliers(rng, r, strength):
    """Wrong readings: far off, or zeros of a bus that failed."""
    hit = rng.random(len(r.t)) < float(np.exp(rng.uniform(np.log(5e-4), np.log(5e-3))))
    hit[rng.integers(10, len(r.t) - 10, 4)] = True
    if rng.random() < 0.5:
        r.y[hit] = 0.0 if abs(np.mean(r.y)) > 0.1 * r.stroke else r.y.max() + 0.3 * r.stroke
        kind = "one value"
    else:
        r.y[hit] += rng.choice([-1.0, 1.0], hit.sum()) * rng.uniform(0.1, 0.6, hit.sum()) * r.stroke
        kind = "far off"
    return {"samples": int(hit.sum()), "kind": kind}


def gain_range(rng, r, strength):
    """A range switch in mid-record: another gain and offset from one instant on."""
    at = int(rng.uniform(0.25, 0.75) * len(r.t))
    gain = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.01, 0.06))
    offset = float(rng.uniform(-0.03, 0.03) * r.stroke)
    r.y[at:] = r.y[at:] * (1.0 + gain) + offset
    return {"at_s": float(at * r.dt), "gain": 1.0 + gain, "offset_um": offset}


def jitter(rng, r, strength):
    size = lag_for(r, strength, 1.5)
    r.y = r.at(r.t + size * rng.standard_normal(len(r.t))) + r.noise
    return {"rms_s": float(size)}


def half_sample(rng, r, strength):
    """Both converters are read in turn: the position is early or late by a part of a sample."""
    part = float(rng.choice([-0.5, 0.5]))
    r.y = r.at(r.t - part * r.dt) + r.noise
    return {"late_s": part * r.dt}


def early(rng, r, strength):
    """The drive column is written after the fact: the position is early, which no delay of physics is."""
    late = -max(lag_for(r, strength), 0.4 * r.dt)
    r.y = r.at(r.t - late) + r.noise
    return {"late_s": float(late)}


def rounded_stamps(rng, r, strength):
    """Time is written with too few digits: the column t has steps of several samples."""
    step = float(10.0 ** np.ceil(np.log10(2.5 * r.dt)))
    r.t = step * np.floor(r.t / step + 1e-9)
    return {"step_s": step}


def swapped(rng, r, strength):
    r.drive, r.y = r.y, r.drive
    return {}


def inverted(rng, r, strength):
    r.y = -r.y
    return {}


def wrong_scale(rng, r, strength):
    """mV for V, nm for um, mm for um: a thousand times too large or too small, and no longer what an actuator does."""
    if rng.random() < 0.5:
        r.drive = r.drive * 1e3
        return {"column": "drive", "factor": 1e3}
    factor = 1e3 if r.stroke > 4.0 else 1e-3
    r.y = r.y * factor
    r.step *= factor
    return {"column": "displacement", "factor": factor}


FAULTS = {f.__name__: f for f in (two_clocks, dropped_samples, repeated_samples, stuck_samples, missing_codes,
                                  clipped_converter, outliers, gain_range, jitter, half_sample, early, rounded_stamps,
                                  swapped, inverted, wrong_scale)}
FAULTS["file_offsets"] = None  # of two files: made in record.py
# What shifts time shows only where the position moves between samples
NEED_MOTION = {"two_clocks", "jitter", "half_sample", "early", "dropped_samples", "repeated_samples"}
