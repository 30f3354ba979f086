# SPDX-License-Identifier: GPL-3.0-or-later
"""Models: fit, simulate, save, compile."""

from __future__ import annotations

import ctypes
import json
import math
import os
from typing import Any, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from ._library import (Array, Cancelled, Error, Held, Progress, as_path, checked, column_in, lib, long_work, options,
                       parsed, range_of, real, text, whole)
from .recording import Recording


class Model(Held):
    """A chain of blocks with numbers in them: what `hyst fit` writes, format hyst-model-1."""

    _made_by = "hyst.fit or hyst.Model.load makes one"

    def __init__(self, description: dict[str, Any]) -> None:
        """From the JSON object that docs/FORMATS.md describes."""
        if not isinstance(description, Mapping):
            raise Error(f"{type(description).__name__} is no description of a model: hyst.Model.load reads a file")
        self._handle = checked(lib.model_from_json(json.dumps(description).encode()))

    @classmethod
    def _of(cls, handle: Any) -> Model:
        self = cls.__new__(cls)
        self._handle = checked(handle)
        return self

    def __del__(self) -> None:
        if getattr(self, "_handle", None):
            lib.model_free(self._handle)

    def __repr__(self) -> str:
        return "<hyst.Model " + " -> ".join(self.blocks) + ">"

    @property
    def json(self) -> dict[str, Any]:
        """The whole model; a change of it does not change the model."""
        return parsed(text(lib.model_to_json(self._handle)))

    @property
    def blocks(self) -> list[str]:
        """The names of its blocks, from the drive to the sensor."""
        return [block["block"] for block in self.json["chain"]]

    @property
    def sample_rate(self) -> float:
        """Hz: of the recording that it was made from."""
        return float(self.json["sample_rate_hz"])

    @property
    def fit(self) -> dict[str, Any]:
        """Facts about the fit: errors, ranges, notes. Empty for a model that was not fitted."""
        return self.json.get("fit") or {}

    @property
    def nrmse_percent(self) -> float:
        """RMS error over the peak-to-peak displacement, of the samples that the fit has not seen."""
        return self.fit.get("held_out_nrmse_percent") or float("nan")

    def simulate(self, drive: ArrayLike, sample_rate: float | None = None, *, preload: float = 0.0,
                 seed: int = 1) -> Array:
        """The position in um for this drive in V, from rest at its first value.

        preload: a constant force in N, for a model that has one. seed: of a block of noise.
        """
        pointer, array = column_in(drive)
        position = np.empty_like(array)
        rate = self.sample_rate if sample_rate is None else real("sample_rate", sample_rate)
        said = options(preload_n=real("preload", preload), seed=whole("seed", seed))
        checked(lib.simulate(self._handle, rate, len(array), pointer, said,
                             position.ctypes.data_as(ctypes.POINTER(ctypes.c_double))))
        return position

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the file that every command of hyst reads."""
        checked(lib.model_write(self._handle, as_path(path)))

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Model:
        """Reads what save, `hyst fit` or `hyst diagnose` wrote."""
        return Model._of(lib.model_read(as_path(path)))


def listed(recordings: Recording | Sequence[Recording]) -> list[Recording]:
    several: list[Any]
    try:
        several = [recordings] if isinstance(recordings, Recording) else list(recordings)
    except TypeError:
        several = [recordings]
    return [Recording._checked(recording) for recording in several]


def simulate(model: Model, drive: Recording | ArrayLike, sample_rate: float | None = None, *, preload: float = 0.0,
             seed: int = 1) -> Array:
    """The position in um that the model says for the drive of a recording, or for this drive in V, as `hyst simulate`
    does. sample_rate in Hz is for a drive; a recording has its own. The rest is as of Model.simulate."""
    Model._checked(model)
    if isinstance(drive, Recording):
        if sample_rate is not None:
            raise Error("sample_rate is for an array: a recording has its own")
        told = drive.keys.get("preload_n")
        force = float(told) if told is not None and preload == 0.0 else preload
        return model.simulate(drive.aligned().drive, drive.sample_rate, preload=force, seed=seed)
    return model.simulate(drive, sample_rate, preload=preload, seed=seed)


def families() -> dict[str, str]:
    """The families that hyst.fit takes, and what each is."""
    return {family["name"]: family["text"] for family in json.loads(text(lib.families()))}


def check_columns(recordings: list[Recording]) -> None:
    """Raises hyst.Error if drive and displacement of one of them are exchanged."""
    hint = b"exchange them, or say columns_are_right=True"
    checked(long_work(lambda: lib.columns_check(Recording._handles_of(recordings), len(recordings), hint)))


def fit(
    recordings: Recording | Sequence[Recording],
    family: str = "prandtl_ishlinskii",
    *,
    operators: int | None = None,
    creep: bool = False,
    use_all: bool = False,
    columns_are_right: bool = False,
    compared: dict[str, Model | Error] | None = None,
    progress: Progress | None = None,
) -> Model:
    """Identifies a model of one family, as `hyst fit` does. Several recordings make one fit.

    The last third of each is held out, and Model.nrmse_percent is the error there. operators: their number; None: found
    by validation. creep: find creep too. use_all: fit once more to all samples. progress(what, fraction) is called as
    the work comes on; if it returns False, the work ends with hyst.Cancelled. A recording with drive and displacement
    exchanged is refused, unless columns_are_right.

    family "all": every family, and the model with the least error of those that hold for more than the recorded sine.
    compared: a dictionary that then receives the model of each family, or the hyst.Error that says why there is none.
    """
    several = listed(recordings)
    if not columns_are_right:
        check_columns(several)

    def fit_one(name: str) -> Model:
        said = options(family=name, operators=operators, creep=creep, use_all=use_all)
        return Model._of(long_work(lambda: lib.fit(Recording._handles_of(several), len(several), said), progress))

    if family != "all":
        return fit_one(family)
    each: dict[str, Model | Error] = {}
    for name in families():
        try:
            each[name] = fit_one(name)
        except Cancelled:
            raise
        except Error as failure:
            each[name] = failure
    if compared is not None:
        compared.clear()
        compared.update(each)
    one_sine = {known["name"] for known in json.loads(text(lib.families())) if known["one_sine"]}
    fitted = {name: model for name, model in each.items() if isinstance(model, Model)}
    if not fitted:
        raise Error(f"no family fits: {next(iter(each.values()))}")
    if one_sine.issuperset(fitted):
        raise Error(f"what fits these recordings holds for one sine only; choose it by name if that is enough: "
                    f"{', '.join(fitted)}")
    general = {name: model.nrmse_percent for name, model in fitted.items() if name not in one_sine}
    return fitted[min(general, key=lambda name: (math.isnan(general[name]), general[name]))]


def compile(
    model: Model,
    *,
    sample_rate: float | None = None,
    drive_range: tuple[float, float] | None = None,
    position_range: tuple[float, float] | None = None,
    delay: float | None = None,
    frequency: float | None = None,
    preload: float | None = None,
    follow: str | None = None,
    filters: bool = True,
    report: dict[str, Any] | None = None,
) -> bytes:
    """The parameter image that makes the amplifier undo the model: what `hyst compile` writes.

    sample_rate: of the amplifier's loop in Hz. drive_range, position_range: what the ends of its converters stand for,
    in V and um. delay in s, frequency in Hz, preload in N. follow: "reading" or "position". report: a dictionary that
    receives what the command says with --json.
    """
    length, told = ctypes.c_size_t(), ctypes.c_void_p()
    said = options(sample_rate_hz=sample_rate, drive_range_v=range_of("drive_range", drive_range),
                   position_range_um=range_of("position_range", position_range), delay_s=delay, frequency_hz=frequency,
                   preload_n=preload, follow=follow, filters=filters)
    image = checked(lib.compile(Model._handle_of(model), said, ctypes.byref(length), ctypes.byref(told)))
    try:
        answer = json.loads(text(told.value))
        if report is not None:
            report.clear()
            report.update(answer)
        return ctypes.string_at(image, length.value)
    finally:
        lib.free(image)
