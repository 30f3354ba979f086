# SPDX-License-Identifier: GPL-3.0-or-later
"""hyst: identify, diagnose and linearise a piezo actuator's hysteresis.

The engine is that of the command `hyst`, called through its C interface, in this process. Arrays go in, numpy arrays
and dataclasses come out, in V, um, A, degC, s and Hz:

    import hyst
    recording = hyst.read("recording.csv")
    model = hyst.fit(recording)
    diagnosis = hyst.diagnose(recording, model)
    print(diagnosis.verdict, [finding.block for finding in diagnosis.findings])

What is wrong with an input raises hyst.Error, whose text is the one line that the command prints. Ctrl-C ends a fit or
a diagnosis within about a second; so does hyst.cancel() from another thread, which raises hyst.Cancelled.
"""

from ._library import Cancelled, Error, cancel, version
from .amplifier import Amplifier, EmulatedAmplifier, ModelWarning, Track
from .diagnosis import Diagnosis, Errors, Finding, Parameter, Unseen, Where, diagnose
from .look import Bode, Look, Response, bode, look
from .model import Model, compile, families, fit, simulate
from .recording import Recording, read

__version__ = version()
Error.__module__ = Cancelled.__module__ = "hyst"  # so that a traceback names them as a program does

__all__ = [
    "Amplifier",
    "Bode",
    "Cancelled",
    "Diagnosis",
    "EmulatedAmplifier",
    "Error",
    "Errors",
    "Finding",
    "Look",
    "Model",
    "ModelWarning",
    "Parameter",
    "Recording",
    "Response",
    "Track",
    "Unseen",
    "Where",
    "bode",
    "cancel",
    "compile",
    "diagnose",
    "families",
    "fit",
    "look",
    "read",
    "simulate",
    "version",
]
