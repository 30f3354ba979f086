# SPDX-License-Identifier: GPL-3.0-or-later
"""One case: a law, an excitation, numbers of a lab, and what is hidden; as recordings and an answer."""
import types

import numpy as np

import effects
import excitations
import faults
import kinds
import signals
import unknown

OVERSAMPLING = 10
RATES_HZ = (200.0, 500.0, 1000.0, 2000.0, 5000.0, 10000.0, 20000.0)
RANGES_V = ((0.0, 100.0), (0.0, 150.0), (-20.0, 120.0), (0.0, 10.0), (-10.0, 10.0), (-150.0, 150.0), (20.0, 130.0))
STAGES = ("electronics", "drive", "widening", "position", "sensor", "converter")
STRENGTHS = (0.3, 1.0, 3.0, 10.0, 30.0)
NOISES = ("white", "white", "pink", "mixed", "outliers")


def log_uniform(rng, low, high):
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


class Lab:
    """Everything but what is hidden. `position(effects)` is the noise-free reading at the samples."""

    def __init__(self, rng, law, excitation, samples, not_held=False, rate_hz=None):
        self.rate_hz = rate_hz or float(rng.choice(RATES_HZ))
        self.dt, self.n = 1.0 / self.rate_hz, samples
        self.law_name, self.excitation_name = law, excitation
        low, high = RANGES_V[rng.integers(len(RANGES_V))]
        self.low_v, self.high_v = low, high
        self.centre_v, self.half_v = 0.5 * (low + high), 0.5 * (high - low)
        self.half_um = 0.5 * log_uniform(rng, 0.5, 300.0)
        self.centre_um = float(self.half_um * rng.choice([0.0, 1.0, rng.uniform(-3.0, 3.0)]))
        shape, edges = excitations.MAKERS[excitation](rng, samples)
        self.law = kinds.Scaled(law, rng)
        between = ("held", "line") if edges else ("held", "line", "smooth")
        self.between = str(rng.choice([b for b in between if not (not_held and b == "held")]))
        rest = int(rng.uniform(0.02, 0.08) * samples) if rng.random() < 0.5 else 0
        self.rest = rest
        fine = OVERSAMPLING
        t = (np.arange(samples * fine) / fine - rest) / (samples - rest)
        s = shape(np.clip(t, 0.0, 1.0))
        self.part = float(rng.uniform(0.6, 1.0)) if rng.random() < 0.3 else 1.0    # not all of the range
        drive = self.centre_v + self.half_v * self.part * s
        digits = 6 - int(np.floor(np.log10(self.half_v)))
        self.digits_v = digits
        sampled = np.round(drive[::fine], digits)
        if self.between == "held":
            drive = np.repeat(sampled, fine)
        elif self.between == "line":
            drive = np.interp(np.arange(samples * fine) / fine, np.arange(samples), sampled)
        self.drive, self.sampled, self.h = drive, sampled, self.dt / fine
        self.duration = samples * self.dt
        self.at = np.arange(samples) * fine + (fine - 1 if self.between == "held" else 0)
        self.past = self.make_past(rng, (drive[0] - self.centre_v) / self.half_v)
        self.plain_memory = None

    def make_past(self, rng, first):
        kind = rng.random()
        if self.excitation_name == "mid_loop" or kind < 0.2:
            self.past_kind = "unknown swings"
            inner = rng.uniform(-1.0, 1.0, int(rng.integers(2, 7))).tolist()
            return [-1.0, 1.0, *inner]
        if kind < 0.7:
            self.past_kind = "the whole range"
            return [-1.0, 1.0, -1.0]
        self.past_kind = "demagnetised"
        swings = (0.97 ** np.arange(120)) * np.where(np.arange(120) % 2, 1.0, -1.0)
        return [-1.0, 1.0, *swings.tolist(), 0.0]

    def context(self):
        return types.SimpleNamespace(dt=self.dt, duration=self.duration, half_v=self.half_v, centre_v=self.centre_v,
                                     half_um=self.half_um, centre_um=self.centre_um, sampled=self.sampled)

    def position(self, acts=(), fine=False):
        """acts: (stage, function of the passage) in any order."""
        held = self.between == "held"
        p = effects.Passage(self.drive, self.h, OVERSAMPLING, held, self.centre_v, self.half_v, self.duration,
                            self.drive)
        before = [act for stage, act in acts if stage in ("electronics", "drive")]
        for act in before:
            act(p)
        widening = [act for stage, act in acts if stage == "widening"]
        path = (p.x - self.centre_v) / self.half_v
        if not before and not widening:
            if self.plain_memory is None:
                self.plain_memory = self.law(self.past, path)
            whole = self.plain_memory
        else:
            seen = (widening[0](p) - self.centre_v) / self.half_v if widening else None
            whole = self.law(self.past, path, seen)
        p.x, p.centre, p.half = self.centre_um + self.half_um * whole, self.centre_um, self.half_um
        for stage in STAGES[3:]:
            for kind, act in acts:
                if kind == stage and stage != "converter":
                    act(p)
        if fine:
            return p
        x = p.x[self.at]
        for kind, act in acts:
            if kind == "converter":
                p.x = x
                act(p)
                x = p.x
        return x

    def answer(self):
        return {"law": self.law_name, "law_numbers": self.law.numbers, "excitation": self.excitation_name,
                "rate_hz": self.rate_hz, "samples": self.n, "between_samples": self.between, "past": self.past_kind,
                "rest_samples": self.rest, "range_v": [self.low_v, self.high_v], "part_of_range": self.part,
                "stroke_um": 2.0 * self.half_um,
                "drive_v": [float(self.sampled.min()), float(self.sampled.max())]}


def strength_of(change, without, noise_um):
    """rms of the change over rms of the noise, after gain and offset are fitted again."""
    left = signals.refit_left(change, [np.ones(len(change)), without - without.mean()])
    return signals.rms(left) / noise_um


def size_for(measure, wanted, low, high):
    """Size at which measure(size) is wanted, within 3 %; the largest size if that is too small for it."""
    at_high = measure(high)
    if at_high < wanted:
        return high, at_high
    a, b = np.log(low), np.log(high)
    fa, fb = None, np.log(at_high)
    best = (np.inf, high, at_high)
    for trial in range(16):
        if fa is None or trial % 3 == 2 or not np.isfinite(fa):
            middle = 0.5 * (a + b)
        else:
            middle = a + (b - a) * np.clip((np.log(wanted) - fa) / max(fb - fa, 1e-9), 0.05, 0.95)
        got = measure(float(np.exp(middle)))
        if abs(got / wanted - 1.0) < best[0]:
            best = (abs(got / wanted - 1.0), float(np.exp(middle)), got)
        if best[0] < 0.03:
            break
        if got < wanted:
            a, fa = middle, np.log(max(got, 1e-12))
        else:
            b, fb = middle, np.log(got)
    return best[1], best[2]


def readings(rng, lab, clean, noise_um, step_um):
    kind = str(rng.choice(NOISES))
    y = clean + noise_um * signals.noise(rng, kind, lab.n)
    return kind, step_um * np.round(y / step_um)


def converter(rng, noise_um, span_um):
    """12 to 24 bits over a range somewhat larger than the stroke, with steps of at most half of the noise's rms."""
    least = max(12, int(np.ceil(np.log2(span_um / (0.5 * noise_um)))))
    bits = int(rng.integers(min(least, 24), 25))
    return bits, span_um / 2.0 ** bits


class Hidden:
    """An effect of the catalogue or of none, drawn; `acts(size)` for Lab.position."""

    def __init__(self, rng, name, lab):
        self.name, self.seed = name, int(rng.integers(1 << 31))
        self.fresh = np.random.default_rng(self.seed)
        if name in effects.KNOWN:
            e = effects.KNOWN[name]
            self.stage, self.low, self.high = e.stage, e.low, e.high
            at = e.draw(self.fresh, lab.context())
            self.numbers = at
            self.acts = lambda size: [(e.stage, lambda p: e.act(p, at(size)))]
        else:
            make, self.stage, self.low, self.high = unknown.UNKNOWN[name]
            act = make(self.fresh, lab.context())
            self.numbers = lambda size: {"size": size}
            self.acts = lambda size: [(self.stage, lambda p: act(p, size))]


def text_of(t, drive, y, rate_hz, digits_v, step_um, header=()):
    digits_y = max(0, min(9, 2 - int(np.floor(np.log10(step_um)))))
    digits_t = max(4, int(np.ceil(np.log10(rate_hz))) + 3)
    lines = [f"# sample_rate_hz: {rate_hz:g}", "# drive_unit: V", "# displacement_unit: um", *header,
             "t,drive,displacement"]
    form = f"%.{digits_t}f,%.{max(0, digits_v)}f,%.{digits_y}f"
    lines += [form % row for row in zip(t.tolist(), drive.tolist(), y.tolist())]
    return "\n".join(lines) + "\n"


def make_case(seed, which_set, kind, name, law, excitation, strength, most_samples):
    """Returns ({file suffix: text}, answer). The same arguments give the same bytes."""
    rng = np.random.default_rng(seed)
    samples = int(rng.integers(min(6000, most_samples // 2), most_samples + 1))
    if kind == "fault":
        return make_fault(rng, name, law, excitation, samples, which_set)
    not_held = name in unknown.NEEDS_MOTION or (name in effects.KNOWN and effects.KNOWN[name].not_held)
    if name == "preload":
        return make_preload(rng, law, excitation, samples // 3, which_set, strength)
    lab = Lab(rng, law, excitation, samples, not_held)
    clean = lab.position()
    stroke = float(np.ptp(clean))
    answer = {"kind": kind, "set": which_set, **lab.answer(), "effects": []}
    most_percent = 0.5 if kind == "null" else min(0.5, 5.0 / strength)
    noise_um = log_uniform(rng, 0.005, most_percent) / 100.0 * stroke
    if kind != "null":
        hidden = Hidden(rng, name, lab)
        made = {}

        def measure(size):
            made[size] = lab.position(hidden.acts(size))
            return strength_of(made[size] - clean, clean, noise_um)
        size, got = size_for(measure, strength, hidden.low, hidden.high)
        if abs(got / strength - 1.0) > 0.03:       # the effect is as large as it gets: let the noise be less
            noise_um *= got / strength
            if not 0.002 * stroke / 100.0 < noise_um < 0.7 * stroke / 100.0:
                return None
            got = strength_of(made[size] - clean, clean, noise_um)
        answer["effects"] = [{"name": name, "strength": got, "parameters": hidden.numbers(size), "stage": hidden.stage}]
        change = made[size] - clean
        beyond = signals.refit_left(change, [clean - clean.mean(), *bank(lab.sampled, 24)])
        answer["effects"][0]["beyond_24_plays"] = signals.rms(beyond) / noise_um
        clean = made[size] if hidden.stage != "converter" else clean
    bits, step_um = converter(rng, noise_um, 1.3 * stroke)
    if name == "quantisation":      # a coarse converter instead: it rounds what the noise has been added to
        step_um = hidden.numbers(size)["step_um"]
    noise_kind, y = readings(rng, lab, clean, noise_um, step_um)
    answer.update({"noise": noise_kind, "noise_um": noise_um, "noise_percent_of_stroke": 100.0 * noise_um / stroke,
                   "bits": bits, "converter_step_um": step_um})
    t = np.arange(lab.n) * lab.dt
    return {"": text_of(t, lab.sampled, y, lab.rate_hz, lab.digits_v, step_um)}, answer


def make_preload(rng, law, excitation, samples, which_set, strength):
    """The same drive under three forces, each noted in its file."""
    lab = Lab(rng, law, excitation, samples)
    clean = lab.position()
    stroke = float(np.ptp(clean))
    noise_um = log_uniform(rng, 0.005, min(0.5, 5.0 / strength)) / 100.0 * stroke
    forces = [0.0, float(rng.uniform(5.0, 15.0)), float(rng.uniform(20.0, 40.0))]
    whole = np.tile(clean, 3)
    pressed = np.repeat(forces, samples)
    size, got = size_for(lambda c: strength_of(whole / (1.0 + c * pressed) - whole, whole, noise_um), strength,
                         1e-7, 0.05)
    bits, step_um = converter(rng, noise_um, 1.3 * stroke)
    noise_kind = str(rng.choice(NOISES))
    texts = {}
    for suffix, force in zip("abc", forces):
        y = clean / (1.0 + size * force) + noise_um * signals.noise(rng, noise_kind, samples)
        texts[f"-{suffix}"] = text_of(np.arange(samples) * lab.dt, lab.sampled, step_um * np.round(y / step_um),
                                      lab.rate_hz, lab.digits_v, step_um, [f"# preload_n: {force:g}"])
    return texts, {"kind": "single", "set": which_set, **lab.answer(), "noise": noise_kind, "noise_um": noise_um,
                   "noise_percent_of_stroke": 100.0 * noise_um / stroke, "bits": bits, "converter_step_um": step_um,
                   "effects": [{"name": "preload", "strength": got, "parameters": {"compliance_per_n": size},
                                "stage": "position"}]}


def bank(drive, plays):
    """Columns of free play operators (a constant and the drive among them), begun at the first sample."""
    u = (drive - 0.5 * (drive.max() + drive.min())) / max(1e-12, 0.5 * np.ptp(drive))
    r = (np.arange(plays) + 0.5) / plays
    law_z = np.clip(0.0, u[0] - r, u[0] + r)
    z = np.empty((len(u), plays))
    for k, x in enumerate(u.tolist()):
        law_z = np.minimum(np.maximum(law_z, x - r), x + r)
        z[k] = law_z
    return [np.ones(len(u)), u, *z.T]


def make_fault(rng, name, law, excitation, samples, which_set):
    lab = Lab(rng, law, excitation, samples, not_held=name in faults.NEED_MOTION)
    p = lab.position(fine=True)
    stroke = float(np.ptp(p.x))
    strength = float(rng.choice([3.0, 10.0, 30.0]))
    noise_um = log_uniform(rng, 0.01, min(0.2, 5.0 / strength)) / 100.0 * stroke
    bits, step_um = converter(rng, noise_um, 1.3 * stroke)
    noise_kind = str(rng.choice(("white", "pink", "mixed")))
    late = (OVERSAMPLING - 1) * lab.h if lab.between == "held" else 0.0
    at = (lambda t: np.interp(t + late, p.t, p.x))
    answer = {"kind": "fault", "set": which_set, **lab.answer(), "effects": [], "noise": noise_kind,
              "noise_um": noise_um, "noise_percent_of_stroke": 100.0 * noise_um / stroke, "bits": bits,
              "converter_step_um": step_um}
    if name == "file_offsets":
        return two_files(rng, lab, p.x[lab.at], noise_um, noise_kind, step_um, answer)
    r = faults.Recording(lab.sampled, at, lab.dt, noise_um * signals.noise(rng, noise_kind, lab.n), step_um)
    whole = r.y.copy()
    numbers = faults.FAULTS[name](rng, r, strength)
    if name in faults.NEED_MOTION and signals.rms(r.y - whole) < 2.9 * noise_um:
        return None
    if name != "missing_codes" and name != "swapped":
        r.converted()
    changed = r.y - whole
    answer["effects"] = [{"name": name, "strength": float(signals.rms(changed) / noise_um), "parameters": numbers,
                          "stage": "recording"}]
    digits_v = lab.digits_v if name not in ("swapped", "wrong_scale") else 9
    return {"": text_of(r.t, r.drive, r.y, lab.rate_hz, digits_v, min(r.step, step_um))}, answer


def two_files(rng, lab, clean, noise_um, noise_kind, step_um, answer):
    """Two days: the record in two halves, whose zero differs."""
    offset = float(rng.uniform(0.05, 0.4) * np.ptp(clean) * rng.choice([-1.0, 1.0]))
    y = clean + noise_um * signals.noise(rng, noise_kind, lab.n)
    cut = lab.n // 2
    y[cut:] += offset
    y = step_um * np.round(y / step_um)
    t = np.arange(lab.n) * lab.dt
    answer["effects"] = [{"name": "file_offsets", "strength": abs(offset) / noise_um,
                          "parameters": {"offset_um": offset}, "stage": "recording"}]
    return {"-a": text_of(t[:cut], lab.sampled[:cut], y[:cut], lab.rate_hz, lab.digits_v, step_um),
            "-b": text_of(t[:lab.n - cut], lab.sampled[cut:], y[cut:], lab.rate_hz, lab.digits_v, step_um)}, answer
