# SPDX-License-Identifier: GPL-3.0-or-later
"""Recordings: uniformly sampled drive and displacement."""

from __future__ import annotations

import ctypes
import json
import math
import os
from types import MappingProxyType
from typing import Any, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from ._library import Array, Error, Held, as_path, checked, column_in, column_out, lib, options, parsed, real, text, times_in
from ._tdms import read_table

UNITS = {
    "drive": "V",
    "displacement": "um",
    "reference": "um",
    "voltage": "V",
    "current": "A",
    "temperature": "degC",
}


def _no_column(name: str) -> Error:
    return Error(f"a recording has no column '{name}': it has {', '.join(UNITS)}")


class Recording(Held):
    """Drive in V and displacement in um of one run, sampled uniformly.

    Recording(drive, displacement, sample_rate=10000) or Recording(drive, displacement, time=t). t is in s, or dates or
    differences of times of numpy, pandas or datetime; of dates the recording begins at 0 s. Time stamps are
    treated as those of a file: jitter is resampled, and understood says so; a gap, or a rate that changes, is refused.
    Further columns: reference (um), voltage (V), current (A), temperature (degC), as keywords. keys: the header of the
    file, for example {"preload_n": "20"}.

    The columns are arrays that cannot be written to: a recording is what was measured.
    """

    _made_by = "hyst.read or hyst.Recording makes one"

    def __init__(
        self,
        drive: ArrayLike,
        displacement: ArrayLike,
        *,
        sample_rate: float | None = None,
        time: ArrayLike | None = None,
        name: str = "recording",
        start: float = 0.0,
        keys: Mapping[str, Any] | None = None,
        **columns: ArrayLike,
    ) -> None:
        given = {"drive": drive, "displacement": displacement, **columns}
        for column in given:
            if column not in UNITS:
                raise _no_column(column)
        if (sample_rate is None) == (time is None):
            raise Error("either sample_rate or time")
        arrays = {column: column_in(values) for column, values in given.items()}
        lengths = {column: len(array) for column, (_, array) in arrays.items()}
        if time is not None:
            arrays = {"time": times_in(time), **arrays}
            lengths["time"] = len(arrays["time"][1])
        if len(set(lengths.values())) != 1:
            raise Error("columns of different lengths: " + ", ".join(f"{n} of {c}" for c, n in lengths.items()))
        samples = lengths["drive"]
        if time is not None:
            units = [UNITS.get(column, "s") for column in arrays]
            self._handle = checked(_import(name, list(arrays), units, list(arrays.values()), None))
        else:
            self._handle = checked(lib.recording_make(name.encode(), real("sample_rate", sample_rate), samples))
            for column, (pointer, _) in arrays.items():
                checked(lib.recording_set_column(self._handle, column.encode(), pointer))
            lib.recording_set_start_s(self._handle, real("start", start))
        for key, value in (keys or {}).items():
            checked(lib.recording_set_key(self._handle, str(key).encode(), str(value).encode()))
        self._columns: dict[str, Array | None] = {}
        self._extra: dict[str, Array] | None = None

    @classmethod
    def _of(cls, handle: Any) -> Recording:
        self = cls.__new__(cls)
        self._handle = checked(handle)
        self._columns = {}
        self._extra = None
        return self

    def __del__(self) -> None:
        if getattr(self, "_handle", None):
            lib.recording_free(self._handle)

    def __len__(self) -> int:
        return int(lib.recording_samples(self._handle))

    def __repr__(self) -> str:
        return f"<hyst.Recording {self.name}: {len(self)} samples at {self.sample_rate:.6g} Hz>"

    def column(self, name: str) -> Array | None:
        """A column by name, or None where the recording has none of that name."""
        if name not in UNITS:
            raise _no_column(name)
        if name not in self._columns:
            self._columns[name] = column_out(lib.recording_column(self._handle, name.encode()), len(self))
        return self._columns[name]

    @property
    def drive(self) -> Array:
        """V."""
        return self.column("drive")  # type: ignore[return-value]

    @property
    def displacement(self) -> Array:
        """um."""
        return self.column("displacement")  # type: ignore[return-value]

    @property
    def reference(self) -> Array | None:
        """um; where the position was to be."""
        return self.column("reference")

    @property
    def time(self) -> Array:
        """s."""
        return self.start + np.arange(len(self)) / self.sample_rate

    @property
    def sample_rate(self) -> float:
        """Hz."""
        return float(lib.recording_sample_rate_hz(self._handle))

    @property
    def start(self) -> float:
        """Time of the first sample in s."""
        return float(lib.recording_start_s(self._handle))

    @property
    def name(self) -> str:
        """The path that it was read from."""
        return str(lib.recording_name(self._handle).decode(errors="replace"))

    @property
    def understood(self) -> str:
        """What a file of another format, or arrays with time stamps, were taken for, a line for each column; else ""."""
        return str(lib.recording_understood(self._handle).decode(errors="replace"))

    @property
    def keys(self) -> Mapping[str, str]:
        """What the header says beside rate and units; to be read. hyst.Recording(.., keys={**old.keys, ..}) has others."""
        return MappingProxyType(parsed(text(lib.recording_keys(self._handle))))

    @property
    def extra(self) -> dict[str, Array]:
        """Further columns of the file, by name: used by nothing, kept by write, in the units of extra_units.

        They are as the file has them, and may hold values that are no numbers.
        """
        if self._extra is None:
            listed = json.loads(text(lib.recording_extras(self._handle)))
            self._extra = {}
            for place, column in enumerate(listed):
                values = column_out(lib.recording_extra(self._handle, place), len(self))
                assert values is not None
                self._extra[column["name"]] = values
        return dict(self._extra)

    @property
    def extra_units(self) -> dict[str, str]:
        """The units of the further columns as the file states them; "" where it does not."""
        return {column["name"]: column["unit"] for column in json.loads(text(lib.recording_extras(self._handle)))}

    def aligned(self) -> Recording:
        """With the drive at the instants at which the position was sampled, as the key displacement_sampled_after_s says.

        What fit and diagnose use. Rows at an end that have no drive at their instant are dropped. Without the key, or
        once it is done, nothing changes.
        """
        return Recording._of(lib.recording_aligned(self._handle))

    def span(self, from_s: float = -math.inf, to_s: float = math.inf) -> Recording:
        """What was recorded from from_s on and before to_s, by its own times."""
        return Recording._of(checked(lib.recording_span(self._handle, real("from_s", from_s), real("to_s", to_s))))

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes a file that every command of hyst reads: CSV, or HDF5 where the name ends in .h5, .hdf5 or .nc.

        The further columns (extra) are kept.
        """
        checked(lib.recording_write(self._handle, as_path(path)))

    def to_xarray(self) -> Any:
        """An xarray.Dataset of all columns over the coordinate time, with units in attrs. Needs xarray."""
        import xarray

        data = {name: ("time", self.column(name), {"units": unit}) for name, unit in UNITS.items()
                if self.column(name) is not None}
        units = self.extra_units
        data.update({name: ("time", values, {"units": units[name]} if units[name] else {})
                     for name, values in self.extra.items()})
        time = ("time", self.time, {"units": "s"})
        return xarray.Dataset(data, {"time": time},
                              {"name": self.name, "sample_rate_hz": self.sample_rate, **self.keys})

    def plot(self, axes: Any = None) -> Any:
        """Displacement over drive, and both over time. Returns the two axes. Needs matplotlib."""
        if axes is None:
            from matplotlib import pyplot

            _, axes = pyplot.subplots(1, 2, figsize=(9, 3.5), layout="constrained")
        axes[0].plot(self.drive, self.displacement, linewidth=0.8)
        axes[0].set(xlabel="drive, V", ylabel="displacement, um")
        axes[1].plot(self.time, self.displacement, linewidth=0.8)
        axes[1].set(xlabel="time, s", ylabel="displacement, um")
        return axes


def _import(name: str, columns: Sequence[str], units: Sequence[str], arrays: Sequence[tuple[Any, Array]],
            said: bytes | None) -> Any:
    """arrays: of column_in, all of one length."""
    count = len(columns)
    doubles = ctypes.POINTER(ctypes.c_double)
    return lib.recording_import(
        name.encode(),
        len(arrays[0][1]),
        count,
        (ctypes.c_char_p * count)(*[column.encode() for column in columns]),
        (ctypes.c_char_p * count)(*[unit.encode() for unit in units]),
        (doubles * count)(*[pointer for pointer, _ in arrays]),
        said,
    )


def _read_tdms(path: str | os.PathLike[str], group: str | None, said: dict[str, Any]) -> Recording:
    table = read_table(path, group)
    by_waveform = table.interval is not None and said["time"] is None and said["sample_rate_hz"] is None
    if by_waveform:
        said = {**said, "time": "none", "sample_rate_hz": 1.0 / table.interval}  # type: ignore[operator]
    recording = Recording._of(_import(os.fspath(path), [column.name for column in table.columns],
                                      [column.unit for column in table.columns],
                                      [column_in(column.values) for column in table.columns],
                                      options(file=os.fspath(path), **said)))
    if by_waveform:
        lib.recording_set_start_s(Recording._handle_of(recording), table.start)
    return recording


def read(
    path: str | os.PathLike[str],
    *,
    time: str | int | None = None,
    sample_rate: float | None = None,
    columns: Mapping[str, str | int] | None = None,
    scales: Mapping[str, float] | None = None,
    group: str | None = None,
    fill_missing: bool = False,
) -> Recording:
    """Reads a recording: the project's CSV, any file that `hyst import` takes, or LabVIEW TDMS (needs npTDMS).

    What a foreign file does not say, the keywords say, as the options of that command do: columns={"drive": "CH1"}
    (name or number of a column), scales={"drive": 20.0} (V or um per unit: per V where that is mV), time="t" or "none",
    sample_rate in Hz.
    fill_missing: rows without a number are put on straight lines between their neighbours, and understood says so.
    Recording.understood tells what the columns were taken for. group: of a TDMS file with several.
    """
    said = {"time": None if time is None else str(time), "sample_rate_hz": sample_rate, "column": columns,
            "scale": scales, "fill_missing": fill_missing or None}
    if as_path(path).lower().endswith(b".tdms"):
        return _read_tdms(path, group, said)
    if group is not None:
        raise Error("group= belongs to a TDMS file")
    nothing = all(value is None for value in said.values())
    return Recording._of(lib.recording_read(as_path(path), None if nothing else options(**said)))
