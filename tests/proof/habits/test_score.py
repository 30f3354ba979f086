#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The scoring against replies whose score is known: made here, no tool is asked."""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

sys.dont_write_bytecode = True
HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
from judge import Case, expected_curve  # noqa: E402
from share import macro, share  # noqa: E402


def answer(case, kind, effects=(), **more):
    return {"case": case, "kind": kind, "effects": list(effects), "law": "dahl", "excitation": "noise",
            "rate_hz": 1000.0, "samples": 1000, "between_samples": "line", "noise": "white",
            "noise_percent_of_stroke": 0.1, "past": "x",
            "converter_step_um": 0.001, "drive_v": [0.0, 100.0], "range_v": [0.0, 100.0],
            "files": [{"name": f"{case}.csv", "sha256": case}], **more}


def effect(name, strength=10.0, **parameters):
    return {"name": name, "strength": strength, "parameters": parameters, "stage": "position"}


def finding(block, certainty="named", confusable=(), place="mechanics", confidence=0.9, **parameters):
    return {"block": block, "certainty": certainty, "confusable_with": list(confusable), "place": place,
            "confidence": confidence,
            "parameters": {name: {"value": value, "sigma": sigma} for name, (value, sigma) in parameters.items()}}


class Made:
    """A set of answers and replies in a temporary folder."""

    def __init__(self, folder):
        self.folder, self.replies, self.answers = folder, folder / "replies", []
        self.replies.mkdir()

    def add(self, one, verdict="explained", findings=(), status=0, text=""):
        self.answers.append(one)
        name = one["case"]
        (self.replies / f"{name}.run").write_text(json.dumps(
            {"sha256": [file["sha256"] for file in one["files"]], "status": status, "elapsed_s": 1.0,
             "processor_s": 1.0}))
        (self.replies / f"{name}.txt").write_text(text)
        if status == 0:
            (self.replies / f"{name}.json").write_text(json.dumps({"verdict": verdict, "findings": list(findings)}))
        return Case(one, self.replies)

    def score(self):
        (self.folder / "answers.json").write_text(json.dumps({"cases": self.answers}))
        subprocess.run([sys.executable, HERE / "score", self.folder, "--replies", self.replies, "--output",
                        self.folder / "out"], check=True, stdout=subprocess.DEVNULL)
        return json.loads((self.folder / "out" / "score.json").read_text())


class Scores(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.made = Made(pathlib.Path(self.temporary.name))

    def tearDown(self):
        self.temporary.cleanup()

    def test_a_null(self):
        add, null = self.made.add, lambda k: answer(f"case-{k}", "null")
        self.assertTrue(add(null(1), "nothing missing").silent())
        self.assertFalse(add(null(2), "unknown physics").silent())
        self.assertFalse(add(null(3), "unknown physics").alarms())
        self.assertTrue(add(null(4), "explained", [finding("creep")]).alarms())
        self.assertFalse(add(null(5), status=1).silent())
        # true though nobody hid it: the converter's steps; outliers where the noise has them, and only there
        self.assertTrue(add(null(6), "explained", [finding("quantisation", step_um=(0.001, 1e-6))]).silent())
        self.assertFalse(add(null(7), "explained", [finding("quantisation", step_um=(0.002, 1e-6))]).silent())
        spikes = [finding("outliers", place="recording")]
        self.assertFalse(add(answer("case-8", "null", noise="outliers"), "nothing missing", spikes).alarms())
        self.assertTrue(add(null(9), "nothing missing", spikes).alarms())
        # an empirical term is no name, but silent it is not
        tone = add(null(10), "unknown physics", [finding("empirical_tone")])
        self.assertFalse(tone.alarms())
        self.assertFalse(tone.silent())

    def test_a_single_effect(self):
        def said(k, *findings):
            hidden = [effect("creep", gamma_per_decade=0.01)]
            return self.made.add(answer(f"case-{k}", "single", hidden), "explained", findings)
        right = said(1, finding("creep"))
        self.assertTrue(right.right_name() and right.right_firm_name() and right.right_group())
        self.assertFalse(right.false_names())
        group = said(2, finding("thermal_drift"))
        self.assertTrue(group.right_group() and not group.right_name() and not group.false_names())
        self.assertFalse(group.is_right(group.names[0]))
        set_of = said(3, finding("resonance", confusable=["creep"]))
        self.assertTrue(set_of.right_group() and set_of.is_right(set_of.names[0]) and not set_of.false_names())
        self.assertFalse(set_of.is_firm(set_of.names[0]))
        self.assertFalse(said(4, finding("resonance")).right_group())
        beside = said(5, finding("creep"), finding("mains_interference"))
        self.assertTrue(beside.right_group())
        self.assertEqual(len(beside.false_names()), 1)
        self.assertFalse(said(6, finding("creep", certainty="detected")).right_firm_name())
        self.assertFalse(said(6, finding("creep", certainty="isolated")).right_firm_name())  # more than noise remains
        self.assertFalse(said(7).right_group())

    def test_a_fault(self):
        def said(k, name, **more):
            return self.made.add(answer(f"case-{k}", "fault", [effect(name)]), **more)
        self.assertTrue(said(1, "two_clocks", findings=[finding("two_clocks", place="recording")]).fault_named())
        self.assertFalse(said(2, "two_clocks", findings=[finding("jitter", place="recording")]).fault_named())
        self.assertFalse(said(3, "two_clocks", findings=[finding("two_clocks", place="sensor")]).fault_named())
        self.assertTrue(said(4, "inverted", status=1, text="falls where the drive rises: turn the sign").fault_named())
        self.assertFalse(said(5, "inverted", status=1, text="no such file").fault_named())
        self.assertFalse(said(6, "two_clocks", status=1, text="two clocks").fault_named())

    def test_stale_replies_are_not_scored(self):
        one = answer("case-1", "null")
        self.made.add(one, "nothing missing")
        self.assertFalse(Case(dict(one, files=[{"name": "case-1.csv", "sha256": "other"}]), self.made.replies).asked)

    def test_the_whole(self):
        """Ten cases: each aim counted by hand."""
        add = self.made.add
        add(answer("case-0", "null"), "nothing missing")
        add(answer("case-1", "null"), "unknown physics")
        add(answer("case-2", "null"), "explained", [finding("creep", confidence=0.6)])
        add(answer("case-3", "single", [effect("creep", gamma_per_decade=0.01)]), "explained",
            [finding("creep", confidence=0.99, gamma_per_decade=(0.0102, 0.0001))])
        hardly = dict(effect("creep", 3.0, gamma_per_decade=0.01), beyond_24_plays=0.5)
        add(answer("case-4", "single", [hardly]), "explained",
            [finding("thermal_drift", confusable=["creep"], confidence=0.99)])
        mode = {"frequency_hz": 100.0, "damping_ratio": 0.02}
        add(answer("case-5", "single", [effect("resonance", 30.0, **mode)]), "unknown physics")
        add(answer("case-6", "single", [effect("resonance", 0.3, **mode)]), "nothing missing")
        add(answer("case-7", "fault", [effect("jitter")]), "explained", [finding("sensor_bandwidth", confidence=0.99)])
        add(answer("case-8", "unknown", [effect("backlash")]), "explained", [finding("preload")])
        add(answer("case-9", "unknown", [effect("stiction")]), "partly explained")
        result = self.made.score()
        got = {row["aim"]: (row["hits"], row["of"]) for row in result["aims"]}
        self.assertEqual(got["nulls without any name"], (2, 3))
        self.assertEqual(got["nulls are silent: no name, and the verdict says so"], (1, 3))
        self.assertEqual(got["from 3 times the noise: the right group"], (2, 3))
        self.assertEqual(got["from 3 times the noise, once of it beyond free plays: the right group"], (1, 2))
        self.assertEqual(got["what no catalogue has, beyond free plays: not explained away"], (1, 2))
        self.assertEqual(got["from 3 times the noise: nothing false beside it"], (3, 3))
        self.assertEqual(got["names without reservation are right"], (1, 3))      # creep of a null, creep, the fault's
        self.assertEqual(got["sets hold what is there"], (1, 1))
        self.assertEqual(got["faults of the recording are named"], (0, 1))
        self.assertEqual(got["what no catalogue has is not explained away"], (1, 2))
        self.assertEqual(got["numbers of right names within 3 standard errors"], (1, 1))
        self.assertEqual(got["from 10 times the noise: not without a finding"], (2, 3))
        self.assertEqual(got["a reply (refusals of faulty recordings aside)"], (10, 10))
        group = next(row for row in result["aims"] if row["aim"] == "from 3 times the noise: the right group")
        self.assertAlmostEqual(group["macro"]["part"], 0.5)                        # creep 2 of 2, resonance 0 of 1
        top = result["reliability"]["rows"][-1]
        self.assertEqual((top["hits"], top["of"]), (2, 3))
        self.assertAlmostEqual(top["mean"], 0.99)
        for name in ("confusion.svg", "completeness.svg", "reliability.svg", "SCORE.md"):
            self.assertGreater((self.made.folder / "out" / name).stat().st_size, 500)
        for name in ("confusion", "completeness", "reliability"):
            xml.etree.ElementTree.parse(self.made.folder / "out" / f"{name}.svg")
        listed = "\n".join(line for lines in result["failures"].values() for line in lines)
        for case in ("case-1", "case-2", "case-5", "case-7", "case-8"):
            self.assertIn(case, listed)
        self.assertNotIn("case-3", listed)


class Numbers(unittest.TestCase):
    def test_wilson(self):
        s = share(8, 10)
        self.assertAlmostEqual(s["low"], 0.4902, places=4)     # textbook values of Wilson's interval for 8 of 10
        self.assertAlmostEqual(s["high"], 0.9433, places=4)
        self.assertIsNone(share(0, 0)["part"])

    def test_macro_weighs_blocks_alike(self):
        things = [("a", True)] * 9 + [("b", False)]
        self.assertAlmostEqual(macro(things, lambda x: x[0], lambda x: x[1])["part"], 0.5)

    def test_curve_about_another_middle(self):
        """The same polynomial read about another point, and with the gain there taken out, is the same curve."""
        hidden = {"quadratic": 0.1, "cubic": 0.05, "half_range_um": 10.0, "center_um": 2.0}
        found = {"half_range_um": {"value": 8.0}, "center_um": {"value": 3.0}}
        new = expected_curve(hidden, found)

        def read(y):
            s = (y - 2.0) / 10.0
            return y + 10.0 * s * s * (0.1 + 0.05 * s)
        low, high = 2.0, 4.0
        for _ in range(60):      # the position whose reading is 3
            middle = 0.5 * (low + high)
            low, high = (middle, high) if read(middle) < 3.0 else (low, middle)
        d = 1e-3
        slope = (read(middle + d) - read(middle - d)) / (2 * d)
        second = (read(middle + d) - 2 * read(middle) + read(middle - d)) / d**2
        self.assertAlmostEqual(new["quadratic"], 8.0 * second / 2.0 / slope**2, places=5)


if __name__ == "__main__":
    unittest.main()
