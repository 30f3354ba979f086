# SPDX-License-Identifier: GPL-3.0-or-later
"""Diagnosis: which physics a model of the recordings leaves out."""

from __future__ import annotations

import json
import math
import os
from dataclasses import dataclass, field
from typing import Any, Sequence

from ._library import Array, Error, Held, Progress, as_path, checked, column_out, lib, long_work, text, whole
from .model import Model, check_columns, listed
from .recording import Recording


@dataclass(frozen=True)
class Parameter:
    """A number of a block, with one standard error."""

    value: float | list[float]
    error: float | list[float | None] | None  # None: the recordings do not determine it
    unit: str

    def __str__(self) -> str:
        if isinstance(self.value, list):
            return f"{len(self.value)} values in {self.unit}"
        unit = "" if self.unit == "1" else " " + self.unit
        if not isinstance(self.error, float) or not self.error > 0.0:
            return f"{self.value:.4g}{unit}"
        power = math.floor(math.log10(self.error))  # one digit of the error, two if the first is 1 or 2
        places = max(0, -power + (self.error < 2.95 * 10.0**power))
        return f"{self.value:.{places}f} +- {self.error:.{places}f}{unit}"


@dataclass(frozen=True)
class Where:
    """Where an effect shows: intervals [from, to]; an empty list: nowhere in particular."""

    time_s: list[list[float]] = field(default_factory=list)
    frequency_hz: list[list[float]] = field(default_factory=list)
    drive_v: list[list[float]] = field(default_factory=list)
    drive_rate_v_per_s: list[list[float]] = field(default_factory=list)
    loop: str = "everywhere"


@dataclass(frozen=True)
class Finding:
    """One effect that the model left out. place "recording": a fault of the recording itself."""

    block: str
    place: str
    certainty: str  # detected, isolated, named
    confidence: float
    parameters: dict[str, Parameter]
    confusable_with: list[str]
    error_before_percent: float  # held out; beside the operator alone where it was found there
    error_after_percent: float
    where: Where
    explanation: str
    separating_excitation: str | None


@dataclass(frozen=True)
class Unseen:
    """A block that was not found, and what it would have had to be like."""

    block: str
    testable: bool
    smallest_um: float | None
    reason: str | None
    probe: str | None


@dataclass(frozen=True)
class Errors:
    """NRMSE in percent of the peak-to-peak displacement."""

    fitted_percent: float
    held_out_percent: float


class Diagnosis(Held):
    """The answer of hyst.diagnose. print() shows what the command shows."""

    def __init__(self, handle: Any, recordings: list[Recording]) -> None:
        self._handle = checked(handle)
        self.recordings = recordings
        self.json: dict[str, Any] = json.loads(text(lib.diagnosis_json(self._handle)))

    def __del__(self) -> None:
        if getattr(self, "_handle", None):
            lib.diagnosis_free(self._handle)

    def __repr__(self) -> str:
        return f"<hyst.Diagnosis {self.verdict}: {', '.join(f.block for f in self.findings) or 'nothing found'}>"

    def __str__(self) -> str:
        return text(lib.diagnosis_text(self._handle))

    @property
    def verdict(self) -> str:
        """nothing_missing, explained, partly_explained or unknown_physics, as the JSON has it."""
        return str(self.json["verdict"])

    @property
    def findings(self) -> list[Finding]:
        """What was found, faults of the recording first."""
        return [_finding(found) for found in self.json["findings"]]

    @property
    def unseen(self) -> list[Unseen]:
        """What was not found."""
        return [Unseen(each["block"], each["testable"], each["smallest_um"], each.get("reason"), each.get("probe"))
                for each in self.json["not_found"]]

    @property
    def before(self) -> Errors:
        """Of the chain that was given, or of the hysteresis alone, fitted."""
        return _errors(self.json["baseline"])

    @property
    def after(self) -> Errors:
        """Of the chain with everything that was found."""
        return _errors(self.json["remaining"])

    @property
    def noise_percent(self) -> float:
        """The noise, in the same measure; not a number where it is not known."""
        return _number(self.json["remaining"]["noise_floor_percent"])

    @property
    def model(self) -> Model:
        """The chain with everything that was found, fitted: what the command writes with -o."""
        return Model._of(lib.diagnosis_model(self._handle))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes that chain, as the command does with -o; print() and report() then say where it is."""
        checked(lib.diagnosis_save(self._handle, as_path(path)))

    def simulated(self, which: str = "after", recording: int = 0) -> Array:
        """The position in um as the chain says it, "before" or "after", of a recording."""
        if which not in ("before", "after"):
            raise ValueError("which: before or after")
        column = column_out(lib.diagnosis_column(self._handle, recording, which.encode()),
                            len(self.recordings[recording]))
        assert column is not None
        return column

    def first_counted(self, recording: int = 0) -> int:
        """The first sample that counts: the memory of the hysteresis is not determined before."""
        return int(lib.diagnosis_from(self._handle, recording))

    def report(self, path: str | os.PathLike[str], title: str | None = None) -> None:
        """Writes the page that `hyst diagnose --report` writes. title: its heading, for a lab book."""
        lib.diagnosis_set_title(self._handle, None if title is None else os.fsencode(title))
        checked(lib.diagnosis_report(self._handle, as_path(path)))

    def plot(self, recording: int = 0, axes: Any = None) -> Any:
        """The errors before and after over time, and over the drive. Returns the two axes. Needs matplotlib."""
        if axes is None:
            from matplotlib import pyplot

            _, axes = pyplot.subplots(1, 2, figsize=(9, 3.5), layout="constrained", sharey=True)
        shown = self.recordings[recording]
        counted = slice(self.first_counted(recording), None)
        for which, shade in (("before", "#c0504d"), ("after", "#1f6fb4")):
            error = 1000.0 * (shown.displacement - self.simulated(which, recording))
            axes[0].plot(shown.time[counted], error[counted], color=shade, linewidth=0.6, label=which)
            axes[1].plot(shown.drive[counted], error[counted], color=shade, linewidth=0.6)
        axes[0].set(xlabel="time, s", ylabel="error, nm", title=self.verdict.replace("_", " "))
        axes[1].set(xlabel="drive, V", title=", ".join(found.block for found in self.findings))
        axes[0].legend()
        return axes


def diagnose(
    recordings: Recording | Sequence[Recording],
    model: Model | None = None,
    *,
    samples: int | None = None,
    sure: int | bool = False,
    seed: int = 1,
    columns_are_right: bool = False,
    progress: Progress | None = None,
) -> Diagnosis:
    """Finds out which physics a model of the recordings leaves out, as `hyst diagnose` does.

    Several recordings are one question with one answer. Without a model it begins with the hysteresis that fits best.
    samples: at most so many are used, one window of each recording; it ends sooner then, and less is seen (None: 250000).
    sure: how sure the answer is, in its text and in json["sure"]: so many recordings of each kind are simulated like
    these, and asked (True: as many as end in about five minutes); seed: of their noise.
    A recording with drive and displacement exchanged is refused, unless columns_are_right.
    progress(what, fraction) is called as the work comes on; if it returns False, it ends with hyst.Cancelled.
    """
    several = [one.aligned() if "displacement_sampled_after_s" in one.keys else one for one in listed(recordings)]
    if not columns_are_right:
        check_columns(several)
    given = None if model is None else Model._handle_of(model)
    most = 0 if samples is None else whole("samples", samples, 1)
    each = 0 if sure is True else whole("sure", sure)
    whole("seed", seed)
    handle = long_work(lambda: lib.diagnose_at_most(Recording._handles_of(several), len(several), given, most), progress)
    if sure and handle:
        if not long_work(lambda: lib.diagnosis_sure(handle, given, each, seed), progress):
            lib.diagnosis_free(handle)
            checked(None)
    return Diagnosis(handle, several)


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def _errors(told: dict[str, Any]) -> Errors:
    return Errors(_number(told.get("nrmse_percent")), _number(told.get("held_out_nrmse_percent")))


def _finding(told: dict[str, Any]) -> Finding:
    where = told.get("where") or {}
    parameters = {name: Parameter(number.get("value"), number.get("sigma"), number.get("unit", ""))
                  for name, number in (told.get("parameters") or {}).items()}
    return Finding(
        block=told["block"],
        place=told["place"],
        certainty=told.get("certainty", "named"),
        confidence=_number(told.get("confidence")),
        parameters=parameters,
        confusable_with=list(told.get("confusable_with") or []),
        error_before_percent=_number(told.get("held_out_nrmse_percent_before")),
        error_after_percent=_number(told.get("held_out_nrmse_percent_after")),
        where=Where(where.get("time_s") or [], where.get("frequency_hz") or [], where.get("drive") or [],
                    where.get("drive_rate_v_per_s") or [], where.get("loop") or "everywhere"),
        explanation=told.get("explanation", ""),
        separating_excitation=told.get("separating_excitation"),
    )
