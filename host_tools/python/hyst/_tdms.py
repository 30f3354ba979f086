# SPDX-License-Identifier: GPL-3.0-or-later
"""Columns of a LabVIEW TDMS file, by npTDMS."""

from __future__ import annotations

import math
import os
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._library import Array, Error

# What LabVIEW writes of a waveform's unit, by who wrote it.
UNIT_PROPERTIES = ("unit_string", "NI_UnitDescription", "Unit")


class Column(NamedTuple):
    name: str
    unit: str
    values: Array


class Table(NamedTuple):
    """columns: of one length. interval: s between samples as the file says it, or None. start: of the first in s."""

    columns: list[Column]
    interval: float | None
    start: float


def _seconds(values: NDArray[Any]) -> Array:
    """Time stamps as seconds since the first."""
    return np.asarray((values - values[0]) / np.timedelta64(1, "us") * 1e-6, dtype=np.float64)


def _column(name: str, channel: Any) -> Column | None:
    values = channel[:]
    unit = next((str(channel.properties[key]) for key in UNIT_PROPERTIES if channel.properties.get(key)), "")
    if values.dtype.kind == "M":
        return Column(name, "s", _seconds(values))
    return Column(name, unit, np.ascontiguousarray(values, dtype=float)) if values.dtype.kind in "iufb" else None


def _waveform(channels: list[Any], path: str) -> tuple[float | None, float]:
    """Interval and start, on which all channels that have them agree."""
    intervals = {channel.properties["wf_increment"] for channel in channels if channel.properties.get("wf_increment")}
    starts = {channel.properties.get("wf_start_offset", 0.0) for channel in channels}
    if not intervals:
        return None, 0.0
    interval = float(next(iter(intervals)))
    if any(not math.isclose(interval, other, rel_tol=1e-9) for other in intervals):
        raise Error(f"{path}: its channels have different sample intervals: {', '.join(f'{i:g} s' for i in sorted(intervals))}")
    return interval, float(next(iter(starts))) if len(starts) == 1 else 0.0


def read_table(path: str | os.PathLike[str], group: str | None) -> Table:
    """The longest channels of a group; of the only one that has any, where group is None."""
    name = os.fspath(path)
    try:
        import nptdms
    except ImportError:
        raise Error(f"{name}: LabVIEW TDMS files are read by npTDMS: pip install nptdms") from None
    try:
        file = nptdms.TdmsFile.read(name)
    except (OSError, ValueError, KeyError, EOFError, NotImplementedError) as reason:
        raise Error(f"{name}: {str(reason) or type(reason).__name__}") from None
    groups = {found.name: [channel for channel in found.channels() if len(channel) > 0] for found in file.groups()}
    groups = {key: channels for key, channels in groups.items() if channels}
    if group is None and len(groups) > 1:
        raise Error(f"{name}: several groups: say group= one of {', '.join(groups)}")
    if not groups or (group is not None and group not in groups):
        raise Error(f"{name}: no channels{'' if group is None else f' in a group {group!r}'}; its groups: "
                    f"{', '.join(groups) or 'none'}")
    channels = groups[group if group is not None else next(iter(groups))]
    most = max(map(len, channels))
    channels = [channel for channel in channels if len(channel) == most]
    columns = [column for channel in channels if (column := _column(channel.name, channel)) is not None]
    if not columns:
        raise Error(f"{name}: no channel of numbers")
    return Table(columns, *_waveform(channels, name))
