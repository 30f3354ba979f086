# SPDX-License-Identifier: GPL-3.0-or-later
"""The amplifier at a serial port, and an emulated one."""

from __future__ import annotations

import contextlib
import ctypes
import itertools
import json
import os
import subprocess
import threading
import time
import warnings
from dataclasses import dataclass, field
from types import TracebackType
from typing import Any, Callable, Iterator

import hyst_command

from ._library import Cancelled, Error, Held, Progress, interruptible, lib, options, parsed, range_of, text, turn
from .model import Model, compile
from .recording import Recording


@dataclass(frozen=True)
class Track:
    """How well the amplifier followed a reference in one mode."""

    mode: str  # linear, compensate
    worst_um: float
    worst_at_s: float
    rms_um: float
    nrmse_percent: float  # RMS error over the reference's peak to peak
    peak_to_peak_um: float
    made_of: dict[str, float]  # offset and gain, delay, noise, and the rest
    recording: Recording = field(repr=False)

    def plot(self, axes: Any = None) -> Any:
        """Reference and position, and the error, over time. Returns the two axes. Needs matplotlib."""
        if axes is None:
            from matplotlib import pyplot

            _, axes = pyplot.subplots(2, 1, figsize=(9, 5), layout="constrained", sharex=True)
        shown = self.recording
        assert shown.reference is not None, "a track has one"
        error = 1000.0 * (shown.displacement - shown.reference)
        axes[0].plot(shown.time, shown.reference, color="#888888", linewidth=1.0, label="reference")
        axes[0].plot(shown.time, shown.displacement, linewidth=0.8, label=self.mode)
        axes[0].set(ylabel="um")
        axes[0].legend()
        axes[1].plot(shown.time, error, linewidth=0.8, label=f"{self.mode}, NRMSE {self.nrmse_percent:.2g} %")
        axes[1].set(xlabel="time, s", ylabel="error, nm")
        axes[1].legend()
        return axes


@dataclass(frozen=True)
class ModelWarning:
    """The model is no longer true: what the amplifier recorded before and after it noticed."""

    warned_s: float  # when, in the recording
    limit_um: float  # on the root mean square of position less reference
    usual_um: float  # what that was when the watch began
    recording: Recording = field(repr=False)


class Amplifier(Held):
    """The amplifier at a serial port. Use it with `with`: however that ends, the drive is stopped and parked, and the amplifier off.

        with hyst.Amplifier("/dev/ttyUSB0") as amplifier:
            recording = amplifier.record(waveform="triangle", cycles=6)

    Ctrl-C and exceptions end a run within a few requests, park, and switch the stage off. So do stop(), park(), close() and cancel() in
    another thread: the run raises Cancelled. When the process is killed the amplifier parks by itself: while something
    plays, its communication timeout is armed. A recording that was complete before its run failed, as where the amplifier
    could not be disarmed, is in `recordings` of the Error.
    """

    def __init__(self, port: str, *, baud: int = 115200, parity: str = "none", slave: int = 1,
                 timeout: float = 0.5) -> None:
        """Opens the port. parity: none, even or odd. timeout in s, to wait for each answer, which is tried three times.

        An amplifier whose register map has another version can be stopped, parked and switched off. All else raises Error,
        with the side to upgrade.
        """
        self._handle: Any = None
        self._lock = threading.Lock()  # of what works with the amplifier: one at a time
        self._alive = threading.RLock()  # of the handle: it is not freed while a cancel is on its way
        self._cancels = 0
        said = options(port=os.fspath(port), baud=baud, parity=parity, slave=slave, timeout_s=float(timeout))

        def connect() -> Any:
            self._handle = lib.device_open(said)  # here, so that an interrupt meanwhile loses no port
            return self._handle

        with turn(self._lock):
            interruptible(connect, lambda: None)

    def __enter__(self) -> Amplifier:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None,
                 trace: TracebackType | None) -> None:
        try:
            if self._handle is not None:
                self._halt(lib.device_off)
        except Error as failure:
            if value is None:
                raise
            warnings.warn(f"while {kind.__name__ if kind else 'an error'} went on: {failure}", stacklevel=2)
        finally:
            self.close()

    def __del__(self) -> None:
        self._free()  # nothing runs: it would hold this object

    def close(self) -> None:
        """Closes the port. What runs in another thread is ended, parks, and is waited for. What the amplifier was left
        playing it goes on playing: `with` parks it before."""
        if getattr(self, "_handle", None) is None:
            return
        with self._after_what_runs(), self._alive:
            self._free()

    def _free(self) -> None:
        handle, self._handle = getattr(self, "_handle", None), None
        if handle is not None:
            lib.device_close(handle)

    def record(
        self,
        waveform: str | None = None,
        *,
        frequency: float | None = None,
        amplitude: float | None = None,
        offset: float | None = None,
        cycles: int | None = None,
        steps: int | None = None,
        end_frequency: float | None = None,
        sweep_time: float | None = None,
        linear: bool | None = None,
        tones: int | None = None,
        probe: str | None = None,
        slew_rate: float | None = None,
        drive_range: tuple[float, float] | None = None,
        position_range: tuple[float, float] | None = None,
        condition: bool = True,
        progress: Progress | None = None,
    ) -> Recording:
        """Drives the actuator directly and records what it does, as `hyst record` does.

        waveform: "sine", "triangle", "staircase", "sweep" or "multisine", in V and Hz. A sweep goes from frequency to
        end_frequency in sweep_time seconds, by equal factors unless linear; a multisine has so many tones from
        frequency up to end_frequency. Or probe: a block's name or "all", an excitation for
        hyst.diagnose. drive_range, position_range: what the ends of the converters stand for, in V and um; an
        amplifier without an image has to be given them. Where the image in force says otherwise, a warning and the key
        "contradiction" of the recording tell. condition: sweep the whole drive range first.
        """
        said = options(waveform=waveform, frequency_hz=frequency, amplitude_v=amplitude, offset_v=offset,
                       cycles=cycles, steps=steps, end_frequency_hz=end_frequency, sweep_s=sweep_time, linear=linear,
                       tones=tones, probe=probe, slew_rate_v_per_s=slew_rate,
                       drive_range_v=range_of("drive_range", drive_range),
                       position_range_um=range_of("position_range", position_range),
                       condition=condition)
        recording = Recording._of(self._run_long(lambda handle: lib.device_record(handle, said), progress))
        if "contradiction" in recording.keys:
            warnings.warn(f"{recording.keys['contradiction']}: the recording has the former", stacklevel=2)
        return recording

    def track(
        self,
        waveform: str,
        mode: str = "compensate",
        *,
        frequency: float | None = None,
        amplitude: float | None = None,
        offset: float | None = None,
        cycles: int | None = None,
        steps: int | None = None,
        end_frequency: float | None = None,
        sweep_time: float | None = None,
        linear: bool | None = None,
        tones: int | None = None,
        frames: int | None = None,
        condition: bool = True,
        progress: Progress | None = None,
    ) -> Track | tuple[Track, Track]:
        """Lets the amplifier follow a reference in um, and measures the error, as `hyst track` does.

        waveform and its numbers: as of record. mode: "linear" (no model), "compensate", or "both": then the answer is (linear, compensate). frames: rows of
        the recording at most; fewer are read sooner.
        """
        said = options(waveform=waveform, mode=mode, frequency_hz=frequency, amplitude_um=amplitude, offset_um=offset,
                       cycles=cycles, steps=steps, end_frequency_hz=end_frequency, sweep_s=sweep_time, linear=linear,
                       tones=tones, frames=frames, condition=condition)
        recordings = (ctypes.c_void_p * 2)()
        answer = self._run_long(lambda handle: lib.device_track(handle, said, recordings), progress)
        told = json.loads(text(answer))["tracks"]
        tracks = tuple(_track(each, Recording._of(recordings[i])) for i, each in enumerate(told))
        return tracks if len(tracks) == 2 else tracks[0]  # type: ignore[return-value]

    def push(self, image: bytes | Model | str | os.PathLike[str]) -> dict[str, Any]:
        """Puts an image into the amplifier and reads it back: bytes of hyst.compile, a file, or a model.

        A model is compiled with the rate and ranges that it knows. What the amplifier refuses changes nothing.
        """
        if isinstance(image, Model):
            image = compile(image)
        elif not isinstance(image, (bytes, bytearray)):
            image = _content(image)
        buffer = (ctypes.c_ubyte * len(image)).from_buffer_copy(image)
        return parsed(text(self._run(lambda handle: lib.device_push(handle, buffer, len(buffer)))))

    def pull(self) -> bytes:
        """The image in force, as push takes it: what `hyst pull` writes into a file."""
        length = ctypes.c_size_t()
        image = self._run(lambda handle: lib.device_pull(handle, ctypes.byref(length)))
        try:
            return ctypes.string_at(image, length.value)
        finally:
            lib.free(image)

    def stop(self) -> dict[str, str | None]:
        """Ends what plays. The drive stays on, and holds its level. Returns its mode and state, each None where the
        register map has another version.

        A run in another thread ends at once, and raises Cancelled. As after every run that does not come to its end, the
        amplifier is parked then.
        """
        return self._halt(lib.device_stop)

    def park(self) -> dict[str, str | None]:
        """Takes the drive to rest. Returns as stop does. A run in another thread ends at once, and raises Cancelled."""
        return self._halt(lib.device_park)

    def now(self) -> dict[str, Any]:
        """Mode, state, reference, drive in V and position in um of this moment: of sample number `sample`."""
        return parsed(text(self._run(lib.device_now)))

    def watch(
        self,
        *,
        limit: float | None = None,
        times: float | None = None,
        time: float | None = None,
        before: float | None = None,
        after: float | None = None,
        seconds: float | None = None,
    ) -> ModelWarning | None:
        """Waits until the model is no longer true, as `hyst watch` does, and returns what was recorded around that.

        Moves nothing: the amplifier works in mode compensate, by `hyst play`. First it is measured what error is usual.
        limit: in um, else so many `times` that (2); time: how long above it (0.5 s); before, after: what is recorded
        (1.2 s each). None: no warning came in so many `seconds` of the amplifier's time.

            warning = amplifier.watch(seconds=3600)
            if warning:
                print(hyst.diagnose(warning.recording, model))

        Only this call keeps the amplifier's communication timeout (`hyst play --silence`) from passing: a diagnosis
        that takes longer belongs into another process, as `hyst watch` does it.
        """
        said = options(limit_um=limit, times=times, time_s=time, before_s=before, after_s=after, for_s=seconds)
        record = ctypes.c_void_p()
        answer = self._run_long(lambda handle: lib.device_watch(handle, said, ctypes.byref(record)))
        told = json.loads(text(answer))
        if not told["warned"]:
            return None
        return ModelWarning(told["warned_s"], told["limit_um"], told["usual_um"], Recording._of(record.value))

    def info(self) -> dict[str, Any]:
        """The amplifier, the image in force, what it does now, and its counters, as `hyst info --json` says it.

            amplifier.info()["image"]["hysteresis"]
        """
        return parsed(text(self._run(lib.device_info)))

    def monitor(self, interval: float = 0.5, count: int | None = None) -> Iterator[dict[str, Any]]:
        """now() each `interval` seconds, as `hyst monitor` prints it; count: so many times, or until the loop ends.

            for now in amplifier.monitor(0.1, count=50):
                print(now["time_s"], now["position_um"])
        """
        begin = time.monotonic()
        for number in itertools.count() if count is None else range(count):
            time.sleep(max(0.0, begin + number * interval - time.monotonic()))
            yield self.now()

    def cancel(self) -> None:
        """From another thread: ends the record, track or watch that runs or waits to. A run parks; each raises Cancelled.

        It does not wait for that, as stop() and park() do.
        """
        with self._alive:
            self._cancels += 1
            if self._handle is not None:
                lib.device_cancel(self._handle, 1)

    @contextlib.contextmanager
    def _after_what_runs(self) -> Iterator[None]:
        """Ends it, and holds the amplifier when it has ended."""
        self.cancel()
        with turn(self._lock):
            yield

    def _halt(self, command: Callable[[Any], Any]) -> dict[str, str | None]:
        fault = ""
        try:
            with self._after_what_runs():
                try:
                    return parsed(text(self._work(command)))
                finally:
                    fault = self._left_fault()
        finally:
            _warn_of(fault)

    def _run(self, work: Callable[[Any], Any]) -> Any:
        with turn(self._lock):
            return self._work(work)

    def _run_long(self, work: Callable[[Any], Any], progress: Progress | None = None) -> Any:
        """What a cancel ends, also one that comes while this waits for its turn."""
        before, fault = self._cancels, ""
        try:
            with turn(self._lock):
                try:
                    return self._work(work, progress, before)
                except Error as failure:
                    failure.recordings = self._complete()
                    raise
                finally:
                    fault = self._left_fault()
        finally:
            _warn_of(fault)

    def _left_fault(self) -> str:
        """The fault that what has ended led the amplifier out of, if any. In its turn."""
        line = None if self._handle is None else lib.device_left_fault(self._handle)
        return "" if line is None else text(line)

    def _complete(self) -> tuple[Recording, ...]:
        """What the run that failed had recorded in full. In its turn."""
        if self._handle is None:
            return ()
        kept = (lib.device_kept(self._handle, index) for index in range(2))
        return tuple(Recording._of(handle) for handle in kept if handle is not None)

    def _work(self, work: Callable[[Any], Any], progress: Progress | None = None, before: int | None = None) -> Any:
        """In its turn. A cancel counts before it sets the flag: either the count has changed, or the flag stays set."""
        handle = self._handle
        if handle is None:
            raise Error("the amplifier's port is closed")
        lib.device_cancel(handle, 0)
        if before is not None and before != self._cancels:
            raise Cancelled("interrupted before it began")
        return interruptible(lambda: work(handle), lambda: lib.device_cancel(handle, 1), progress)


class EmulatedAmplifier:
    """`hyst bench`: the amplifier's firmware under emulation, with a simulated actuator. For trying things out.

        with hyst.EmulatedAmplifier(None, "actuator.json") as port, hyst.Amplifier(port, timeout=5) as amplifier:
            ...

    image: the firmware of the board `bench`; None: that of the command. command: None is the one that pip installed
    with this package, else the `hyst` of the PATH. Needs qemu-system-arm in the PATH. arguments: more options of the
    command. It ends with this process, however that ends.
    """

    def __init__(self, image: str | os.PathLike[str] | None, model: str | os.PathLike[str], *arguments: str,
                 command: str | os.PathLike[str] | None = None) -> None:
        own_image = [] if image is None else ["--image", os.fspath(image)]
        self._arguments = [hyst_command.path() if command is None else os.fspath(command), "bench", "--attached", "--json",
                           *own_image, "--model", os.fspath(model), *arguments]
        self._process: subprocess.Popen[str] | None = None

    def __enter__(self) -> str:
        try:
            self._process = subprocess.Popen(self._arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                             stderr=subprocess.PIPE, text=True,
                                             start_new_session=True)  # Ctrl-C is for the run, and not for the emulator
        except OSError as reason:
            raise Error(f"the emulated amplifier: cannot run {self._arguments[0]}: {reason.strerror}") from None
        assert self._process.stdout is not None and self._process.stderr is not None
        line = self._process.stdout.readline()
        if not line:
            said = self._process.stderr.read().strip()
            self._process.wait()
            raise Error(said or "the emulated amplifier did not start")
        return str(json.loads(line)["port"])

    def __exit__(self, *_: Any) -> None:
        assert self._process is not None
        self._process.terminate()
        self._process.communicate()


def _warn_of(fault: str) -> None:
    """Where the method was called that called the one that calls this."""
    if fault:
        warnings.warn(fault, stacklevel=4)


def _content(path: Any) -> bytes:
    if not isinstance(path, (str, os.PathLike)):
        raise Error(f"{type(path).__name__} is no image: hyst.compile makes one; or a file, or a model")
    try:
        with open(path, "rb") as file:
            return file.read()
    except OSError as reason:
        raise Error(f"{os.fspath(path)}: {reason.strerror}") from None


def _track(told: dict[str, Any], recording: Recording) -> Track:
    nrmse = told["nrmse_percent"]
    return Track(told["mode"], told["max_error_um"], told["max_error_at_s"], told["rms_error_um"],
                 float("nan") if nrmse is None else nrmse, told["peak_to_peak_um"], told["made_of"], recording)
