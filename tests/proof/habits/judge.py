# SPDX-License-Identifier: GPL-3.0-or-later
"""One case: what it hides beside what the tool replied, and whether that is right. All rules of the score are here.

A finding is a name from the catalogue, a fault of the recording (place "recording") or an empirical term: a block whose
name begins with `empirical_`, which is no name and never false. It offers a set: its block and `confusable_with`. It is
*right* if something hidden is in that set, *firm* if the set has one member and the certainty is "named".
"""
import json
import re

GROUPS = {"transport_delay": "lag", "amplifier_bandwidth": "lag", "sensor_bandwidth": "lag", "low_pass_2": "lag",
          "amplifier_low_pass_2": "lag", "sensor_low_pass_2": "lag", "second_order_low_pass": "lag",
          "creep": "slow", "dielectric_loss": "slow", "charge_leakage": "slow", "gain_drift": "slow",
          "thermal_drift": "slow", "self_heating": "slow",
          "two_modes": "resonance",
          "asymmetric_hysteresis": "shape", "static_nonlinearity": "shape", "interleaved_hysteresis": "shape"}
# Other words for a fault of the recording that are as right, as patterns over the block's name.
FAULT_WORDS = {
    "two_clocks": r"two_clocks|clock|sample_rate", "dropped_samples": r"dropped|lost|gap|slip",
    "repeated_samples": r"repeated|duplicat|slip|dropped|inserted",
    "stuck_samples": r"stuck|repeated|frozen|held_reading",
    "missing_codes": r"missing_code", "clipped_converter": r"clip|rail|saturat", "outliers": r"outlier|spike|zero_read",
    "gain_range": r"gain_range|range|re.?zero|gain_switch|step", "jitter": r"jitter",
    "half_sample": r"half_sample|apart|skew|signed_delay|early|sampl(e|ing)_offset|time_shift|channel",
    "early": r"early|signed_delay|skew|apart|sampl(e|ing)_offset|time_shift|half_sample|channel",
    "rounded_stamps": r"stamp|round|time_column", "swapped": r"swap|column", "inverted": r"invert|sign",
    "wrong_scale": r"scale|unit", "file_offsets": r"file_offset"}
# A clear refusal names a fault, too: what such a message has to say.
REFUSALS = {"inverted": r"sign|invert|falls where", "swapped": r"swap|column|exchang",
            "wrong_scale": r"scale|unit|range|mV|nm|thousand|micromet|volt",
            "rounded_stamps": r"stamp|round|time|column t\b|interval|step"}
NOTHING, FAILED = "nothing missing", "no reply"


def group_of(block):
    return GROUPS.get(block, block)


class Case:
    def __init__(self, answer, folder, oracle=None):
        self.oracle = oracle        # what free plays leave, over the noise, if that was computed
        self.answer, self.name, self.kind = answer, answer["case"], answer["kind"]
        self.truth = answer["effects"]
        self.hidden = [effect["name"] for effect in self.truth]
        self.strength = max((effect["strength"] for effect in self.truth), default=0.0)
        self.beyond = max((effect.get("beyond_24_plays", effect["strength"]) for effect in self.truth), default=0.0)
        self.block = self.hidden[0] if self.hidden else None
        run = folder / f"{self.name}.run"
        self.run = json.loads(run.read_text()) if run.exists() else {}
        self.asked = self.run.get("sha256") == [file["sha256"] for file in answer["files"]]
        text = folder / f"{self.name}.txt"
        self.text = text.read_text(errors="replace") if text.exists() else ""
        self.reply = self.read(folder / f"{self.name}.json") if self.run.get("status") == 0 else None
        self.findings = [f for f in (self.reply or {}).get("findings", [])]
        self.verdict = self.reply["verdict"] if self.reply else FAILED
        self.names = [f for f in self.findings if not f["block"].startswith("empirical_")]

    @staticmethod
    def read(path):
        try:
            reply = json.loads(path.read_text())
            return reply if "verdict" in reply and isinstance(reply.get("findings"), list) else None
        except (OSError, ValueError):
            return None

    # --- findings

    @staticmethod
    def offered(finding):
        return {finding["block"], *finding.get("confusable_with", [])}

    @classmethod
    def is_firm(cls, finding):
        return len(cls.offered(finding)) == 1 and finding.get("certainty") == "named"

    @staticmethod
    def is_fault(finding):
        return finding.get("place") == "recording"

    def also_true(self, finding):
        """True though nobody hid it: the steps of the converter, and outliers where the noise has them."""
        if finding["block"] == "quantisation":
            found = finding["parameters"].get("step_um", {}).get("value")
            return found is not None and abs(found / self.answer["converter_step_um"] - 1.0) < 0.03
        return self.is_fault(finding) and self.answer["noise"] == "outliers" and \
            re.search(FAULT_WORDS["outliers"], finding["block"]) is not None

    def is_right(self, finding):
        offered = self.offered(finding)
        if self.kind == "fault" and self.is_fault(finding):
            return any(re.search(FAULT_WORDS[self.block], block) for block in offered)
        return bool(offered & set(self.hidden)) or self.also_true(finding)

    def in_its_group(self, finding):
        groups = {group_of(block) for block in self.hidden}
        return self.is_right(finding) or group_of(finding["block"]) in groups

    # --- the case

    def alarms(self):
        """Names that nothing justifies, for nulls."""
        return [f for f in self.names if not self.also_true(f)]

    def silent(self):
        return self.reply is not None and not self.alarms() and self.verdict in (NOTHING, "explained")

    def right_name(self):
        return any(f["block"] in self.hidden for f in self.names)

    def right_firm_name(self):
        return any(f["block"] in self.hidden and self.is_firm(f) for f in self.names)

    def right_group(self):
        return any(self.in_its_group(f) for f in self.names)

    def false_names(self):
        """Names outside the group of what is hidden whose set does not hold it either. What a fault of the recording
        makes look like physics is false as well."""
        return [f for f in self.names if not self.in_its_group(f)]

    def fault_named(self):
        if self.kind != "fault":
            return False
        if any(self.is_fault(f) and self.is_right(f) for f in self.findings):
            return True
        refusal = REFUSALS.get(self.block)
        return self.run.get("status") == 1 and refusal is not None and re.search(refusal, self.text) is not None

    def explained_away(self):
        return self.verdict in ("explained", NOTHING)

    def said(self):
        if self.names:
            return self.names[0]["block"]
        return {"explained": NOTHING}.get(self.verdict, self.verdict)

    def good(self):
        if self.kind == "null":
            return self.silent()
        if self.kind == "fault":
            return self.fault_named()
        if self.kind == "unknown":  # one of them has a block by now, and may be named
            return self.reply is not None and (not self.explained_away() or self.right_name())
        return self.right_group() and not self.false_names()

    def describe(self):
        a = self.answer
        hidden = ", ".join(f"{e['name']} ({e['strength']:.3g}, "
                           f"beyond plays {e.get('beyond_24_plays', e['strength']):.2g})"
                           for e in self.truth) or "nothing"
        said = " + ".join(("" if self.is_firm(f) else "?") + f["block"] for f in self.names) or "no name"
        left = self.left_over_noise()
        left = f", left {left:.2f} of the noise" if left is not None else ""
        where = f"{self.kind}, {a['law']}, {a['excitation']}, {a['rate_hz']:g} Hz, {a['between_samples']}"
        return (f"{self.name} ({where}, {a['noise']} {a['noise_percent_of_stroke']:.3f} %): {hidden} -> {said}; "
                f"{self.verdict}{left}{self.cause()}")

    def left_over_noise(self):
        percent = (self.reply or {}).get("remaining", {}).get("held_out_nrmse_percent")
        return percent / self.answer["noise_percent_of_stroke"] if percent else None

    def cause(self):
        """What can be said of a failure from the answer, the reply and the oracle, without a look into the tool."""
        left = self.left_over_noise()
        if left is None:
            return ""
        if self.kind in ("single", "unknown") and self.beyond < 1.0:
            return ": free plays imitate it"
        if self.oracle is not None and left > 1.3:
            stiff = self.oracle < 0.8 * left
            return f": {'the hysteresis is too stiff, ' if stiff else ''}free plays leave {self.oracle:.2f}"
        if left <= 1.3 and self.verdict == "unknown physics":
            return f": unknown although the noise is reached ({self.answer['noise']})"
        return ""


# Numbers of a curve, in terms of the range and the middle to which the finding refers.

def expected_curve(hidden, found):
    """A sensor's quadratic and cubic about the middle of the finding; the gain there is the hysteresis' own."""
    q, k, half, middle = (hidden[name] for name in ("quadratic", "cubic", "half_range_um", "center_um"))
    found_half, reading = (found[name]["value"] for name in ("half_range_um", "center_um"))
    s = 0.0
    for _ in range(20):
        s -= (s + q * s**2 + k * s**3 - (reading - middle) / half) / (1.0 + 2.0 * q * s + 3.0 * k * s**2)
    slope = 1.0 + 2.0 * q * s + 3.0 * k * s**2
    return {"quadratic": found_half / half * (q + 3.0 * k * s) / slope**2,
            "cubic": (found_half / half)**2 * k / slope**3}


def expected(effect, name, finding):
    hidden, found = effect["parameters"], finding["parameters"]
    if effect["name"] == "static_nonlinearity" and {"half_range_um", "center_um"} <= found.keys():
        return expected_curve(hidden, found)[name]
    value = hidden[name]
    if name in ("asymmetry", "bilinear_gain") and "half_range_v" in found:
        value *= found["half_range_v"]["value"] / hidden["half_range_v"]
    return value


def parameter_errors(cases):
    """Of every right name, each number beside the hidden one."""
    rows = []
    for case in cases:
        for effect in case.truth:
            for finding in (f for f in case.names if f["block"] == effect["name"] and not case.is_fault(f)):
                for name, hidden in effect["parameters"].items():
                    found = finding.get("parameters", {}).get(name)
                    if name.startswith(("half_range", "center", "phase")) or not isinstance(found, dict) \
                            or not isinstance(found.get("value"), (int, float)) or not isinstance(hidden, (int, float)):
                        continue
                    if name in ("low_v", "high_v") and not 0.0 < rail_depth(case.answer, effect, name):
                        continue
                    true, sigma = expected(effect, name, finding), found.get("sigma")
                    error = found["value"] - true
                    rows.append({"case": case.name, "block": effect["name"], "parameter": name, "true": true,
                                 "found": found["value"], "sigma": sigma, "in_sigmas": error / sigma if sigma else None,
                                 "relative": error / true if true else None})
    return rows


def rail_depth(answer, effect, name):
    """How far the drive would go beyond a rail; a rail that the drive does not reach is no number."""
    value = effect["parameters"][name]
    low, high = answer["drive_v"]
    return value - low if name == "low_v" else high - value
