#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The laws against what they are by definition, the filters against their frequency response, sets and seeds."""
import pathlib
import sys
import unittest

sys.dont_write_bytecode = True
HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import numpy as np  # noqa: E402

import effects  # noqa: E402
import excitations  # noqa: E402
import kinds  # noqa: E402
import laws  # noqa: E402
import signals  # noqa: E402

SEED = 20261123


def some_path(rng, n=600):
    t = np.linspace(0.0, 1.0, n)
    return 0.7 * np.sin(2 * np.pi * rng.uniform(2, 4) * t) + 0.3 * np.sin(2 * np.pi * rng.uniform(9, 14) * t + 1.0)


class Laws(unittest.TestCase):
    def test_rate_independent(self):
        """A path travelled at another speed, with rests, gives the same output at the same places."""
        for name in kinds.MAKERS:
            rng = np.random.default_rng(SEED)
            law, path = kinds.Scaled(name, rng), some_path(rng)
            plain = law([-1.0, 1.0, 0.2], path)
            stay = rng.integers(1, 6, len(path))
            slower = law([-1.0, 1.0, 0.2], np.repeat(path, stay))[np.cumsum(stay) - 1]
            between = np.interp(np.arange(5 * len(path) - 4) / 5.0, np.arange(len(path)), path)
            finer = law([-1.0, 1.0, 0.2], between)[::5]
            with self.subTest(law=name, seed=SEED):
                self.assertLess(np.max(np.abs(plain - slower)), 1e-12)
                # Runge and Kutta's steps are those of the path: 0.03 of the half range here, 2e-4 in recordings
                self.assertLess(np.max(np.abs(plain - finer)), 1e-4 if name == "jiles_atherton" else 1e-12)

    def test_remembers_and_rises(self):
        """Every law lags behind its drive: the falling branch lies above the rising one; and no branch falls."""
        for name in kinds.MAKERS:
            for k in range(4):
                law = kinds.Scaled(name, np.random.default_rng([SEED, k]))
                way = np.concatenate([np.linspace(-1, 1, 401), np.linspace(1, -1, 401)[1:]])
                y = law([-1.0, 1.0, -1.0], way)
                with self.subTest(law=name, k=k):
                    self.assertGreater(y[600] - y[200], 0.01)
                    self.assertGreater(np.min(np.diff(y) / np.diff(way)), 0.05)
                    self.assertAlmostEqual(y[400] - y[0], 2.0, delta=0.03)

    def test_plays_are_plays(self):
        rng = np.random.default_rng(SEED)
        law, _ = kinds.play_free(rng)
        path = some_path(rng)
        z, out = np.zeros(len(law.r)), []
        for u in [0.9, *path]:
            z = np.maximum(u - law.r, np.minimum(u + law.r, z))
            out.append(law.w @ z)
        self.assertLess(np.max(np.abs(law.with_memory([0.9], path) - out[1:])), 1e-12)

    def test_plane_is_relays(self):
        """Relays switched one by one, on the middles of the table's own cells: equal where the drive is on edges."""
        rng = np.random.default_rng(SEED)
        def density(r, c):
            return np.exp(-3.0 * r) * (1.0 + 0.4 * c)
        plane = laws.Density(density, 1.0)
        n = plane.CELLS
        edge = np.linspace(-1.6, 1.6, n + 1)
        middle = 0.5 * (edge[1:] + edge[:-1])
        high, low = np.meshgrid(middle, middle, indexing="ij")
        mass, state = np.where(high > low, density(0.5 * (high - low), 0.5 * (high + low)), 0.0), np.zeros((n, n))
        path = edge[rng.integers(40, n - 40, 300)]
        relays = []
        for u in path:
            state[high < u] = 1.0
            state[low > u] = 0.0
            relays.append(float(np.sum(mass * state)))
        got = plane.with_memory([path[0]], path)
        off = (got - got[0]) - (np.array(relays) - relays[0])
        self.assertLess(np.max(np.abs(off)), 1e-9 * np.sum(mass))

    def test_master_curves_are_integrals(self):
        """Bouc-Wen and Dahl integrated step by step."""
        for name in ("bouc_wen", "bouc_wen_asymmetric"):
            rng = np.random.default_rng(SEED)
            law, numbers = kinds.MAKERS[name](rng)
            n, beta, gamma, delta = (numbers.get(k, 0.0) for k in ("exponent", "beta", "gamma", "delta"))
            path = np.interp(np.arange(40 * 300) / 40.0, np.arange(300), some_path(rng, 300))
            h, out = 0.0, []
            for du in np.diff(path, prepend=path[0]):
                def slope(x):
                    return du * (1.0 - abs(x) ** n * (gamma + beta * np.sign(x * du) + delta * np.sign(du)))
                h += slope(h + 0.5 * slope(h))
                out.append(h)
            self.assertLess(np.max(np.abs(law.with_memory([path[0]], path) - out)), 2e-5, name)

    def test_duhem_is_an_integral(self):
        law, _ = kinds.coleman_hodgdon(np.random.default_rng(SEED))
        u = np.linspace(0.3, -0.6, 20001)
        law.begin(0.3)
        start = law.h
        got = law.branch(0.3, u[1:])[-1] / law.weight
        rng = np.random.default_rng(SEED)      # the same numbers again, for the slopes
        a, bend, top = float(rng.uniform(1.5, 6.0)), float(rng.uniform(0.3, 1.5)), float(rng.uniform(-0.3, 0.3))
        less, tilt = float(rng.uniform(0.3, 0.9)), float(rng.uniform(-0.3, 0.3))
        h = start
        for x, du in zip(0.5 * (u[1:] + u[:-1]), np.diff(u)):
            f = np.tanh(bend * x) / bend + top * x * x
            g = less / np.cosh(bend * x) ** 2 * (1.0 + tilt * np.tanh(x)) * 0.5
            h += du * (-a * (f - h) + g)
        self.assertAlmostEqual(got, h, delta=2e-4)

    def test_growing_thresholds_are_a_play_in_front(self):
        rng = np.random.default_rng(SEED)
        law, _ = kinds.play_free(rng)
        path = some_path(rng)
        p = effects.Passage(path, 1e-3, 10, False, 0.0, 1.0, 1.0, path)
        seen = effects.widened(p, {"beta_s": 2e-3})
        growth = 2e-3 * np.abs(np.diff(path, prepend=path[0])) / 1e-3
        z, out = np.clip(0.0, path[0] - law.r, path[0] + law.r), []
        for u, g in zip(path, growth):
            z = np.maximum(u - law.r - g, np.minimum(u + law.r + g, z))
            out.append(law.w @ z)
        self.assertGreater(np.max(np.abs(seen - path)), 0.01)
        self.assertLess(np.max(np.abs(law.with_memory([], seen) - out)), 1e-12)


class Signals(unittest.TestCase):
    def test_frequency_responses(self):
        h, hz = 1e-3, 1.3
        t = np.arange(20000) * h
        s, wave = 2j * np.pi * hz, np.exp(2j * np.pi * hz * t)
        w = 2.0 * np.pi * 9.0
        for got, response in ((signals.low_pass(wave.imag, h, 0.05), 1.0 / (1.0 + 0.05 * s)),
                              (signals.second_order(wave.imag, h, 9.0, 0.1), w * w / (s * s + 0.2 * w * s + w * w)),
                              (signals.delayed(wave.imag, h, 0.0123), np.exp(-0.0123 * s))):
            # straight lines between instants are (w h)^2 / 12 = 6e-6 smaller than the sine
            self.assertLess(np.max(np.abs(got - np.imag(response * wave))[5000:]), 1e-5)

    def test_held_steps(self):
        """A step into a low pass of a held drive: the exponential of the time since the step."""
        u = np.concatenate([np.zeros(5), np.ones(50)])
        got = signals.low_pass(u, 0.01, 0.1, held=True)
        self.assertLess(np.max(np.abs(got[5:] - (1.0 - np.exp(-0.1 * np.arange(1, 51))))), 1e-12)

    def test_noise_has_unit_rms(self):
        for kind in ("white", "pink", "mixed", "outliers"):
            self.assertAlmostEqual(signals.rms(signals.noise(np.random.default_rng(SEED), kind, 5000)), 1.0, delta=1e-9)


class Sets(unittest.TestCase):
    def test_thirds(self):
        for table, makers in ((kinds.LAW_SETS, kinds.MAKERS), (kinds.EXCITATION_SETS, excitations.MAKERS)):
            self.assertEqual(set(table), set(makers))
        for table in (kinds.LAW_SETS, kinds.EXCITATION_SETS, kinds.UNKNOWN_SETS):
            for name in kinds.SETS:
                self.assertEqual(len(kinds.of_set(table, name)), 5)

    def test_excitations_stay_inside(self):
        for name, maker in excitations.MAKERS.items():
            for k in range(3):
                f, _ = maker(np.random.default_rng([SEED, k]), 5000)
                x = f(np.arange(50000) / 50000.0)
                self.assertLess(np.max(np.abs(x)), 1.25, name)
                self.assertGreater(np.ptp(x), 0.1, name)


if __name__ == "__main__":
    print(f"seed {SEED}")
    unittest.main()
