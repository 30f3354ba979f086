#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Known additions: as strong as they say, on a recording made here; an inverted amplifier gives the measured drive
back; and the score by the difference against replies whose score is known."""
import importlib.machinery
import importlib.util
import os
import pathlib
import sys
import tempfile
import unittest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.dont_write_bytecode = True
HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import numpy as np  # noqa: E402

import signals  # noqa: E402
from test_score import answer, effect, finding, Made  # noqa: E402

SEED = 5


def program(name):
    loader = importlib.machinery.SourceFileLoader(name, str(HERE / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


inject, score_injected = program("inject"), program("score_injected")


def base():
    """Three sines of 1 Hz and more, with a hysteresis of plays, and white noise of 0.1 %."""
    t = np.arange(6000) / 200.0
    u = 50.0 + 40.0 * np.sin(2 * np.pi * 1.0 * t) + 8.0 * np.sin(2 * np.pi * 0.31 * t)
    z, memory = [], np.zeros(20)
    for x in u:
        memory = np.maximum(x - np.arange(1, 21), np.minimum(x + np.arange(1, 21), memory))
        z.append(memory.mean())
    y = 0.1 * u + 0.05 * np.array(z)
    return inject.Base("made", u, y + 0.012 * np.random.default_rng(SEED).standard_normal(len(y)), 200.0)


class Additions(unittest.TestCase):
    def test_the_noise_is_seen(self):
        self.assertAlmostEqual(base().noise_um, 0.012, delta=0.0012)    # 6000 samples, robust: within some per cent

    def test_strengths_behind(self):
        b = base()
        for index, name in enumerate(inject.BEHIND):
            _, y, _, got = inject.behind(b, name, np.random.default_rng([SEED, index]), 10.0)
            change = signals.refit_left(y - b.y, [np.ones(b.n), b.calm - b.calm.mean()])
            with self.subTest(effect=name):
                self.assertGreater(signals.rms(change), 0.0)
                self.assertAlmostEqual(signals.rms(change) / b.noise_um, got, delta=1e-6 * got)
                if name not in ("creep", "dielectric_loss"):      # at most 0.1 of them: too little in some recordings
                    self.assertAlmostEqual(got, 10.0, delta=0.4)

    def test_amplifiers_before(self):
        """What the written drive becomes behind the amplifier is the measured one."""
        b = base()
        inside = slice(400, -400)
        for name in inject.BEFORE:
            commanded, y, n, got = inject.before(b, name, np.random.default_rng(SEED), 10.0)
            if name == "transport_delay":
                back = signals.delayed(commanded, b.dt, n["delay_s"])
            elif name == "amplifier_bandwidth":
                back = signals.low_pass(commanded, b.dt, 1.0 / (2.0 * np.pi * n["cutoff_hz"]))
            else:
                s = (commanded - b.centre_v) / b.half_v
                back = commanded + n["asymmetry"] * b.half_v * (s * s - 1.0)
            with self.subTest(effect=name):
                known = len(commanded)      # a delayed drive ends before the recording does
                self.assertGreater(known, 0.99 * b.n)
                np.testing.assert_array_equal(y, b.y[:known])
                self.assertAlmostEqual(got, 10.0, delta=0.4)
                # the rate of the drive is that of its straight lines: a few per cent of what was changed
                changed = signals.rms((commanded - b.drive[:known])[inside])
                self.assertLess(signals.rms((back - b.drive[:known])[inside]), 0.05 * changed)


class Differences(unittest.TestCase):
    def test_scored_by_the_difference(self):
        with tempfile.TemporaryDirectory() as folder:
            made = Made(pathlib.Path(folder))

            def case(k, kind, effects, *findings, held_out=0.1):
                one = answer(f"case-{k}", kind, effects, base="stack", peak_to_peak_um=10.0)
                made.add(one, "explained", findings)
                found = score_injected.Injected(one, made.replies)
                found.reply["remaining"] = {"held_out_nrmse_percent": held_out}
                return found
            plain = case(0, "real", [], finding("creep", gamma_per_decade=(0.01, 0.001)))
            old = finding("creep", gamma_per_decade=(0.01, 0.001))

            def compared(k, effects, *findings, **more):
                found = case(k, "single", effects, *findings, **more)
                found.compare(plain)
                return found
            mode = [effect("resonance", frequency_hz=30.0)]
            self.assertTrue(compared(1, mode, old, finding("resonance")).found_name())
            self.assertFalse(compared(2, mode, old).found())
            beside = compared(3, mode, old, finding("resonance"), finding("mains_interference"), held_out=0.2)
            self.assertEqual(len(beside.false_new()), 1)        # the old creep is not new
            self.assertFalse(beside.modelled())
            more = [effect("creep", gamma_per_decade=0.02)]
            self.assertTrue(compared(4, more, finding("creep", gamma_per_decade=(0.03, 0.001))).found_name())
            self.assertFalse(compared(5, more, old).found())
            late = [effect("transport_delay", delay_s=0.01)]
            self.assertTrue(compared(6, late, old, finding("sensor_bandwidth", cutoff_hz=(15.9, 0.1))).found())
            self.assertFalse(compared(7, late, old, finding("sensor_bandwidth", cutoff_hz=(15.9, 0.1))).found_name())


if __name__ == "__main__":
    print(f"seed {SEED}")
    unittest.main()
