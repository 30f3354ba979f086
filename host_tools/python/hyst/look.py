# SPDX-License-Identifier: GPL-3.0-or-later
"""What recordings hold before any model: the look, and the frequency response."""

from __future__ import annotations

import ctypes
import json
from dataclasses import dataclass
from typing import Any, Sequence

import numpy as np

from ._library import Array, checked, lib, options, text
from .diagnosis import Finding, _finding, _number
from .model import Model, listed
from .recording import Recording


@dataclass(frozen=True)
class Look:
    """What recordings hold, and what is wrong with them. print() shows what `hyst look` does."""

    json: dict[str, Any]  # format hyst-look-1 of docs/FORMATS.md: "recordings" and "faults"
    faults: list[Finding]  # of the recordings: place "recording"
    _text: str

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return "<hyst.Look " + (", ".join(fault.block for fault in self.faults) or "no faults") + ">"


@dataclass(frozen=True)
class Response:
    """A frequency response from drive to position: one value a frequency."""

    frequency_hz: Array
    gain_um_per_v: Array
    gain_sigma: Array  # standard errors; nan: not known
    phase_deg: Array
    phase_sigma_deg: Array
    coherence: Array
    lag_s: Array


@dataclass(frozen=True)
class Bode:
    """The frequency response of a recording, and of a model under the same drive."""

    measured: Response
    model: Response | None
    method: str  # "periods" or "local polynomials"

    def plot(self) -> Any:
        """Gain and phase; a matplotlib array of two axes."""
        import matplotlib.pyplot as plt

        _, axes = plt.subplots(2, 1, sharex=True, layout="constrained")
        for name, response in (("measured", self.measured), ("model", self.model)):
            if response is not None:
                axes[0].loglog(response.frequency_hz, response.gain_um_per_v, ".-", label=name)
                axes[1].semilogx(response.frequency_hz, response.phase_deg, ".-")
        axes[0].set(ylabel="gain, um/V")
        axes[1].set(xlabel="frequency, Hz", ylabel="phase, degrees")
        axes[0].legend()
        return axes


def look(recordings: Recording | Sequence[Recording]) -> Look:
    """What is in recordings, and what is wrong with them, before any model, as `hyst look` says it."""
    several = listed(recordings)
    printed = ctypes.c_void_p()
    told = json.loads(text(lib.look(Recording._handles_of(several), len(several), ctypes.byref(printed))))
    return Look(told, [_finding(fault) for fault in told["faults"]], text(printed.value))


def _response(points: list[dict[str, Any]]) -> Response:
    return Response(**{name: np.array([_number(point[name]) for point in points])
                       for name in Response.__dataclass_fields__})


def bode(recording: Recording | None = None, model: Model | None = None, *, bias: float | None = None,
         amplitude: float | None = None, sample_rate: float | None = None) -> Bode:
    """The frequency response of a recording, and of a model under its drive, as `hyst bode` estimates it.

    Without a recording it is that of the model for small signals: a sum of sines about bias (V) with a peak of
    amplitude (V), at sample_rate (Hz); what is left out comes from the model.
    """
    given = options(bias_v=bias, amplitude_v=amplitude, sample_rate_hz=sample_rate)
    told = json.loads(text(checked(lib.bode(None if recording is None else Recording._handle_of(recording),
                                            None if model is None else Model._handle_of(model), given))))
    modelled = told.get("model")
    return Bode(_response(told["points"]), _response(modelled) if modelled else None, told["method"])
