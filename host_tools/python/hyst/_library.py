# SPDX-License-Identifier: GPL-3.0-or-later
"""The engine's shared library, by ctypes: one wheel then serves every Python, and no compiler sees Python's headers.

host_tools/interface/hyst_interface.h is the manual. PROTOTYPES repeats its declarations; tests/python compares them.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import operator
import os
import signal
import threading
from ctypes import POINTER, c_char_p, c_double, c_int, c_size_t, c_ubyte, c_uint, c_ulong, c_void_p
from typing import Any, Callable, Iterator, Optional

import numpy as np
from numpy.typing import NDArray

INTERFACE = 1
PROGRESS = ctypes.CFUNCTYPE(c_int, c_void_p, c_char_p, c_double)
Progress = Callable[[str, float], Optional[bool]]
Array = NDArray[np.float64]

_texts, _doubles = POINTER(c_char_p), POINTER(c_double)
# Name: result, arguments. c_void_p: a handle, or a text that is ours to free.
PROTOTYPES: dict[str, tuple[Any, list[Any]]] = {
    "interface_version": (c_uint, []),
    "version": (c_char_p, []),
    "error": (c_char_p, []),
    "free": (None, [c_void_p]),
    "on_progress": (None, [PROGRESS, c_void_p]),
    "cancel": (None, [c_int]),
    "recording_read": (c_void_p, [c_char_p, c_char_p]),
    "recording_make": (c_void_p, [c_char_p, c_double, c_size_t]),
    "recording_import": (c_void_p, [c_char_p, c_size_t, c_size_t, _texts, _texts, POINTER(_doubles), c_char_p]),
    "recording_set_column": (c_int, [c_void_p, c_char_p, _doubles]),
    "recording_column": (_doubles, [c_void_p, c_char_p]),
    "recording_samples": (c_size_t, [c_void_p]),
    "recording_sample_rate_hz": (c_double, [c_void_p]),
    "recording_start_s": (c_double, [c_void_p]),
    "recording_set_start_s": (None, [c_void_p, c_double]),
    "recording_name": (c_char_p, [c_void_p]),
    "recording_understood": (c_char_p, [c_void_p]),
    "recording_keys": (c_void_p, [c_void_p]),
    "recording_set_key": (c_int, [c_void_p, c_char_p, c_char_p]),
    "recording_extras": (c_void_p, [c_void_p]),
    "recording_extra": (_doubles, [c_void_p, c_size_t]),
    "recording_aligned": (c_void_p, [c_void_p]),
    "recording_span": (c_void_p, [c_void_p, c_double, c_double]),
    "recording_write": (c_int, [c_void_p, c_char_p]),
    "recording_free": (None, [c_void_p]),
    "model_read": (c_void_p, [c_char_p]),
    "model_from_json": (c_void_p, [c_char_p]),
    "model_to_json": (c_void_p, [c_void_p]),
    "model_write": (c_int, [c_void_p, c_char_p]),
    "model_free": (None, [c_void_p]),
    "look": (c_void_p, [POINTER(c_void_p), c_size_t, POINTER(c_void_p)]),
    "bode": (c_void_p, [c_void_p, c_void_p, c_char_p]),
    "columns_check": (c_int, [POINTER(c_void_p), c_size_t, c_char_p]),
    "families": (c_void_p, []),
    "fit": (c_void_p, [POINTER(c_void_p), c_size_t, c_char_p]),
    "simulate": (c_int, [c_void_p, c_double, c_size_t, _doubles, c_char_p, _doubles]),
    "compile": (c_void_p, [c_void_p, c_char_p, POINTER(c_size_t), POINTER(c_void_p)]),
    "diagnose": (c_void_p, [POINTER(c_void_p), c_size_t, c_void_p]),
    "diagnose_at_most": (c_void_p, [POINTER(c_void_p), c_size_t, c_void_p, c_size_t]),
    "diagnosis_sure": (c_size_t, [c_void_p, c_void_p, c_size_t, c_ulong]),
    "diagnosis_save": (c_int, [c_void_p, c_char_p]),
    "diagnosis_json": (c_void_p, [c_void_p]),
    "diagnosis_text": (c_void_p, [c_void_p]),
    "diagnosis_set_title": (None, [c_void_p, c_char_p]),
    "diagnosis_report": (c_int, [c_void_p, c_char_p]),
    "diagnosis_model": (c_void_p, [c_void_p]),
    "diagnosis_column": (_doubles, [c_void_p, c_size_t, c_char_p]),
    "diagnosis_from": (c_size_t, [c_void_p, c_size_t]),
    "diagnosis_free": (None, [c_void_p]),
    "device_open": (c_void_p, [c_char_p]),
    "device_close": (None, [c_void_p]),
    "device_cancel": (None, [c_void_p, c_int]),
    "device_record": (c_void_p, [c_void_p, c_char_p]),
    "device_track": (c_void_p, [c_void_p, c_char_p, POINTER(c_void_p)]),
    "device_kept": (c_void_p, [c_void_p, c_size_t]),
    "device_left_fault": (c_void_p, [c_void_p]),
    "device_push": (c_void_p, [c_void_p, POINTER(c_ubyte), c_size_t]),
    "device_pull": (c_void_p, [c_void_p, POINTER(c_size_t)]),
    "device_stop": (c_void_p, [c_void_p]),
    "device_park": (c_void_p, [c_void_p]),
    "device_off": (c_void_p, [c_void_p]),
    "device_now": (c_void_p, [c_void_p]),
    "device_watch": (c_void_p, [c_void_p, c_char_p, POINTER(c_void_p)]),
    "device_info": (c_void_p, [c_void_p]),
}


class Error(Exception):
    """What is wrong with an input, a file or the amplifier, in one line."""

    recordings: tuple[Any, ...] = ()  # those that Amplifier.record or track had complete when it failed


class Cancelled(Error):
    """Somebody asked the work to end: hyst.cancel(), or a progress function that returned False."""


def _load() -> Any:
    name = "libhyst_interface.so"
    path = os.environ.get("HYST_INTERFACE_LIBRARY") or os.path.join(os.path.dirname(os.path.abspath(__file__)), name)
    try:
        loaded = ctypes.CDLL(path)
    except OSError as reason:
        raise ImportError(f"the engine of hyst cannot be loaded: {reason}") from None

    class Functions:
        pass

    for function, (result, arguments) in PROTOTYPES.items():
        prototype = getattr(loaded, "hyst_host_" + function)
        prototype.restype, prototype.argtypes = result, arguments
        setattr(Functions, function, staticmethod(prototype))
    found = Functions.interface_version()  # type: ignore[attr-defined]
    if found != INTERFACE:
        raise ImportError(f"{path} has version {found} of the interface, this package needs {INTERFACE}")
    return Functions


lib = _load()


def version() -> str:
    """Version of the engine, "0.1.0"."""
    return str(lib.version().decode())


def failure() -> Error:
    """The last failure of this thread, to be raised."""
    line = lib.error().decode(errors="replace")
    return Cancelled(line) if line.startswith("interrupted") else Error(line)


def checked(result: Any) -> Any:
    """The result of a function that says 0 or NULL where it has failed."""
    if not result:
        raise failure()
    return result


def text(memory: Any) -> str:
    """A text that is ours, freed."""
    checked(memory)
    try:
        return ctypes.string_at(memory).decode(errors="replace")
    finally:
        lib.free(memory)


def parsed(json_text: str) -> dict[str, Any]:
    """A JSON object."""
    found: dict[str, Any] = json.loads(json_text)
    return found


def as_path(path: Any) -> bytes:
    """A path as the engine takes it; it would take what is before a NUL for the whole."""
    try:
        encoded = os.fsencode(path)
    except TypeError:
        raise Error(f"a path is a {type(path).__name__}: {path!r}") from None
    if b"\0" in encoded:
        raise Error(f"a path with a NUL in it: {path!r}")
    return encoded


class Held:
    """What the engine holds for Python. Only _handle_of leads from an argument to the engine's memory."""

    _made_by = ""
    _handle: Any

    @classmethod
    def _checked(cls, item: Any) -> Any:
        """The item, which has to be one of this class: its memory would be taken for what it is not."""
        if not isinstance(item, cls):
            raise Error(f"{type(item).__name__} is no {cls.__name__.lower()}: {cls._made_by}")
        return item

    @classmethod
    def _handle_of(cls, item: Any) -> Any:
        return cls._checked(item)._handle

    @classmethod
    def _handles_of(cls, items: list[Any]) -> Any:
        return (c_void_p * len(items))(*[cls._handle_of(item) for item in items])

    def __reduce_ex__(self, _protocol: Any) -> Any:
        """A copy would be freed twice, and in another process the memory is not there."""
        raise TypeError(f"a hyst.{type(self).__name__} cannot be copied or pickled")


def options(**values: Any) -> bytes:
    """Those that are not None, as JSON, which has no NaN."""
    given = {key: value for key, value in values.items() if value is not None}
    try:
        return json.dumps(given, default=_plain, allow_nan=False).encode()
    except ValueError:
        raise Error(f"an option is no finite number: {given}") from None


def whole(name: str, value: Any, least: int = 0) -> int:
    """A whole number for the engine: ctypes would make the largest one of -1."""
    try:
        number = operator.index(value)
    except TypeError:
        number = least - 1
    if not least <= number < 2**63:
        raise Error(f"{name}={value!r}: a whole number from {least} on")
    return number


def real(name: str, value: Any) -> float:
    """A number for the engine."""
    try:
        return float(value)
    except (TypeError, ValueError):
        raise Error(f"{name}={value!r}: a number") from None


def range_of(name: str, ends: Any) -> list[float] | None:
    """Two numbers, low and high, for options; None for None."""
    try:
        low, high = (None, None) if ends is None else (float(end) for end in ends)
    except (TypeError, ValueError):
        raise Error(f"{name}={ends!r}: a range is (low, high)") from None
    return None if low is None or high is None else [low, high]


def _plain(value: Any) -> Any:
    """A number of numpy as one of Python."""
    if isinstance(value, (np.generic, np.ndarray)) and value.ndim == 0:
        return value.item()
    raise TypeError(f"an option is a {type(value).__name__}: {value!r}")


def column_in(values: Any) -> tuple[Any, Array]:
    """A pointer to the values as doubles, and the array that holds them. What is masked is no number (NaN)."""
    try:
        if np.iscomplexobj(values):
            raise Error("complex numbers: a column has real ones")
        if isinstance(values, np.ma.MaskedArray):
            values = np.where(np.ma.getmaskarray(values), np.nan, values.data)  # type: ignore[no-untyped-call]
        if np.asarray(values).dtype.kind in "Mm":
            raise Error("dates, or differences of times: a column has numbers, and time= takes these")
        array = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as reason:
        raise Error(f"a column that cannot be taken for numbers: {reason}") from None
    if array.ndim != 1:
        raise Error(f"an array of {array.ndim} dimensions: a column has one")
    return array.ctypes.data_as(_doubles), array


def times_in(values: Any) -> tuple[Any, Array]:
    """The same of times in s. Of dates (numpy's, pandas' or Python's) they are those since the first one."""
    array = np.asarray(values)
    if array.dtype.kind == "O" and array.ndim == 1 and array.size > 0 and hasattr(array[0], "total_seconds"):
        array = np.array([one.total_seconds() for one in array])
    elif array.dtype.kind == "O" and array.ndim == 1 and array.size > 0 and hasattr(array[0], "toordinal"):
        array = np.array([(one - array[0]).total_seconds() for one in array])
    elif array.dtype.kind in "Mm" and array.size > 0:  # whole counts of ns, us, ..: their differences are exact
        array = (array - array[:1] if array.dtype.kind == "M" else array) / np.timedelta64(1, "s")
    else:
        return column_in(values)
    return column_in(array)


def column_out(pointer: Any, samples: int) -> Array | None:
    """A copy of a column, which nobody changes by mistake; None for NULL."""
    if not pointer:
        return None
    array = np.ctypeslib.as_array(pointer, shape=(samples,)).copy()
    array.flags.writeable = False
    return array


_one_at_a_time = threading.Lock()
_thread = threading.local()  # works: it is one of interruptible, which calls nothing of Python but a progress function
OWN_FAULTS = {signal.SIGSEGV, signal.SIGBUS, signal.SIGFPE, signal.SIGILL, signal.SIGABRT}


def cancel() -> None:
    """Asks the fit or diagnosis that is running in this process to end. It then raises Cancelled."""
    lib.cancel(1)


@contextlib.contextmanager
def turn(lock: Any) -> Iterator[None]:
    """Holds the lock. What calls a progress function holds one until that returns: waiting there would never end."""
    if getattr(_thread, "works", False):
        raise Error("a progress function cannot do this: the work that calls it has to end first (return False ends it)")
    with lock:
        yield


def long_work(work: Callable[[], Any], progress: Progress | None = None) -> Any:
    """A fit or a diagnosis: one at a time, and hyst.cancel ends it."""
    with turn(_one_at_a_time):
        lib.cancel(0)
        try:
            return interruptible(work, lambda: lib.cancel(1), progress)
        finally:
            lib.cancel(0)


def interruptible(work: Callable[[], Any], end: Callable[[], Any], progress: Progress | None = None) -> Any:
    """Runs `work` in a thread of its own, so that Ctrl-C comes through at once, whatever the engine is doing.

    Python's handler of signals runs only between two instructions of the main thread, and a call into the engine is
    one instruction. Here the main thread waits for a lock instead, which a signal interrupts. It must be the thread
    that the signal finds, so the one that works, and those that it starts, block all that may come from outside.
    After an interrupt `end` requests the work's end, and that is waited for: no thread is left behind.
    """
    outcome: dict[str, Any] = {}

    def report(_context: Any, what: bytes, fraction: float) -> int:
        try:
            return 1 if progress is not None and progress(what.decode(), fraction) is False else 0
        except BaseException as reason:  # it belongs to whoever called, not to ctypes
            outcome.setdefault("raised", reason)
            return 1

    listener = PROGRESS(report) if progress is not None else PROGRESS(0)

    def run() -> None:
        _thread.works = True
        try:
            signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals() - OWN_FAULTS)
            lib.on_progress(listener, None)
            outcome["result"] = work()
            if not outcome["result"]:
                outcome.setdefault("raised", failure())
        except BaseException as reason:
            outcome.setdefault("raised", reason)
        finally:
            done.set()

    done = threading.Event()  # not Thread.join: interrupted, it takes a thread that runs for one that has ended
    threading.Thread(target=run, name="hyst", daemon=True).start()
    interrupted: BaseException | None = None
    while not done.is_set():
        try:
            done.wait()
        except BaseException as reason:  # KeyboardInterrupt, or what another handler of signals raises
            interrupted = reason
            end()
    if interrupted is not None:
        raise interrupted
    if "raised" in outcome:
        raise outcome["raised"]
    return outcome["result"]
