#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sets: the same seed gives the same bytes, none mixes with another, an effect is as strong as its answer says."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.dont_write_bytecode = True
HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import numpy as np  # noqa: E402

import effects  # noqa: E402
import faults  # noqa: E402
import kinds  # noqa: E402
import record  # noqa: E402
import signals  # noqa: E402

SEED, SAMPLES = 7, 3000


def generate(folder, which_set, seed, wanted):
    subprocess.run([HERE / "generate", "--set", which_set, "--seed", str(seed), "--kinds", wanted, "--samples",
                    str(SAMPLES), folder], check=True, stdout=subprocess.DEVNULL)
    return json.loads((folder / "answers.json").read_text()), (folder / "answers.sha256").read_text()


def columns(text):
    rows = [line.split(",") for line in text.splitlines() if not line.startswith(("#", "t"))]
    return np.array(rows, float).T


class Sets(unittest.TestCase):
    def test_seeds_and_sets(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            wanted = "null=2,single=3,fault=2,unknown=2"
            for which in kinds.SETS:
                first, hash_of_first = generate(root / f"{which}-1", which, SEED, wanted)
                for case in first["cases"]:
                    self.assertEqual(kinds.LAW_SETS[case["law"]], which)
                    self.assertEqual(kinds.EXCITATION_SETS[case["excitation"]], which)
                    if case["kind"] == "unknown":
                        self.assertEqual(kinds.UNKNOWN_SETS[case["effects"][0]["name"]], which)
            again, hash_of_again = generate(root / "last-2", "last", SEED, wanted)
            self.assertEqual(hash_of_first, hash_of_again)      # it holds the hash of every recording
            for case in again["cases"]:
                for file in case["files"]:
                    path = pathlib.Path("recordings") / file["name"]
                    self.assertEqual((root / "last-1" / path).read_bytes(), (root / "last-2" / path).read_bytes())
            self.assertNotEqual(hash_of_first, generate(root / "last-3", "last", SEED + 1, wanted)[1])


class Strengths(unittest.TestCase):
    def lab(self, seed, name, law, way):
        """The laboratory that make_case draws from this seed, to simulate what it is without the effect."""
        rng = np.random.default_rng(seed)
        samples = int(rng.integers(min(6000, SAMPLES // 2), SAMPLES + 1))
        effect = effects.KNOWN.get(name)
        return record.Lab(rng, law, way, samples, effect is not None and effect.not_held)

    def test_of_every_effect(self):
        """Read from the recording itself: what differs from the clean simulation is noise and effect, squares added."""
        for index, name in enumerate([None, *effects.KNOWN]):
            law, way, made = "preisach_skewed", "sines", None
            for attempt in range(20):       # the first laboratory in which it can be so strong
                seed = [SEED, index, attempt]
                made = record.make_case(seed, "building", "single" if name else "null", name, law, way, 3.0, SAMPLES)
                if made is not None:
                    break
            texts, answer = made
            without = self.lab(seed, name, law, way).position()
            _, _, y = columns(texts[""])
            changed = signals.refit_left(y - without, [np.ones(len(y)), without - without.mean()])
            strength = answer["effects"][0]["strength"] if name else 0.0
            with self.subTest(effect=name, seed=seed):
                if name:
                    self.assertAlmostEqual(strength, 3.0, delta=0.1)
                measured = signals.rms(changed) / answer["noise_um"]
                # The sum of two rms of some 2000 samples, 1/f noise among them, varies by a tenth
                self.assertAlmostEqual(measured, np.hypot(strength, 1.0), delta=0.12 * np.hypot(strength, 1.0))

    def test_faults_do_what_they_say(self):
        made = {}
        for index, name in enumerate(faults.FAULTS):
            for attempt in range(40):
                case = record.make_case([SEED, 100 + index, attempt], "building", "fault", name, "maxwell_slip",
                                        "two_sines", 0.0, SAMPLES)
                if case is not None:
                    made[name] = case
                    break
        self.assertEqual(set(made), set(faults.FAULTS))
        t, u, y = columns(made["clipped_converter"][0][""])
        numbers = made["clipped_converter"][1]["effects"][0]["parameters"]
        end = y.max() if "high_um" in numbers else y.min()
        self.assertGreater(np.mean(np.abs(y - end) < 1e-9), 0.02)
        t, u, y = columns(made["stuck_samples"][0][""])
        runs = np.diff(np.flatnonzero(np.diff(y, prepend=np.nan, append=np.nan) != 0))
        self.assertEqual(runs.max(), made["stuck_samples"][1]["effects"][0]["parameters"]["longest"])
        t, u, y = columns(made["swapped"][0][""])
        self.assertGreater(np.sum(np.diff(u) != 0), 0.9 * len(u))       # the drive column is noisy
        t, u, y = columns(made["inverted"][0][""])
        self.assertLess(np.corrcoef(u, y)[0, 1], -0.9)
        t, u, y = columns(made["rounded_stamps"][0][""])
        self.assertTrue(np.any(np.diff(t) == 0))
        self.assertEqual(set(made["file_offsets"][0]), {"-a", "-b"})


if __name__ == "__main__":
    print(f"seed {SEED}")
    unittest.main()
