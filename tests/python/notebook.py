# SPDX-License-Identifier: GPL-3.0-or-later
"""notebook.py NOTEBOOK: runs its code cells, in order, as a kernel would; then what became of the day is looked at.

No kernel and no wall clock: every wait is one for the amplifier's own progress, so an emulator at half of real time is
only slower. Then, on an amplifier of the same kind, runs that are broken off have to leave it parked.
"""
import json
import os
import signal
import sys
import time

import hyst
import matplotlib

matplotlib.use("Agg")
SOURCE, FOLDER = os.environ["HYST_SOURCE"], os.path.join(os.environ["HYST_TEST_FOLDER"], "notebook")
os.makedirs(FOLDER, exist_ok=True)
failures = 0


def check(good, text):
    global failures
    if not good:
        print("FAIL:", text)
        failures += 1


def run(path):
    """The names that the notebook leaves behind."""
    with open(path, encoding="utf-8") as file:
        cells = [cell for cell in json.load(file)["cells"] if cell["cell_type"] == "code"]
    names = {"__name__": "__main__"}
    for number, cell in enumerate(cells, 1):
        begin = time.monotonic()
        exec(compile("".join(cell["source"]), f"cell {number}", "exec"), names)
        print(f"cell {number}: {time.monotonic() - begin:.1f} s", flush=True)
    check(len(cells) >= 8, f"only {len(cells)} cells")
    return names


def look_at_the_day(names):
    found = [finding.block for finding in names["diagnosis"].findings]
    check("resonance" in found, f"found {found}")
    linear, compensated, better = (names[n].nrmse_percent for n in ("linear", "compensated", "better"))
    check(compensated < linear, f"compensated {compensated} %, linear {linear} %")
    # Of one emulated day in which 1.62 % came down to 0.46 % and another in which to 0.86 %: the recordings differ, since
    # the host's requests meet the emulated time where they do. Without the resonance it stays at 1.62 %.
    check(better < 0.7 * compensated, f"better {better} %, compensated {compensated} %")
    check(len(names["recording"]) > 1000, "a short recording")
    again = hyst.read("recording.csv")
    check(abs(again.drive - names["recording"].drive).max() < 1e-9, "what was written is not what was recorded")
    check("resonance" in hyst.Model.load("better.json").blocks, "better.json has no resonance")
    try:
        names["amplifier"].now()
        check(False, "the port is open still")
    except hyst.Error as failure:
        check("closed" in str(failure), str(failure))


def broken_off(port, what, how, expected):
    """A run that `how` breaks off in the middle of its play; the next one finds the amplifier parked."""
    seen = []

    def progress(piece, fraction):
        if piece == "playing" and fraction < 1.0 and not seen:
            seen.append(fraction)
            return how()
        return None

    try:
        with hyst.Amplifier(port, timeout=5) as amplifier:
            amplifier.record("sine", frequency=1, cycles=30, condition=False, progress=progress)
        check(False, f"{what}: the run went on to its end")
    except expected as reason:
        print(f"{what}: {type(reason).__name__}: {reason}", flush=True)
    check(seen, f"{what}: it never played")
    with hyst.Amplifier(port, timeout=5) as amplifier:
        now = amplifier.now()
        check(now["state"] == "parked", f"{what}: {now}")


def wrong():
    raise ZeroDivisionError("of the caller")


def interrupt():
    os.kill(os.getpid(), signal.SIGINT)


def break_off():
    with hyst.EmulatedAmplifier(os.environ["HYST_FIRMWARE"], os.path.join(SOURCE, "docs", "tutorial", "actuator.json"),
                                "--drive-range", "0:100", "--position-range", "-5:40",
                                command=os.environ["HYST"]) as port:
        with hyst.Amplifier(port, timeout=5) as amplifier:
            try:
                amplifier.track("sine")
                check(False, "tracked without an image")
            except hyst.Error as failure:
                check("has no parameters" in str(failure), str(failure))
            amplifier.push(hyst.compile(hyst.Model.load("better.json"), sample_rate=10000))
            image = amplifier.pull()
            check(image == hyst.compile(hyst.Model.load("better.json"), sample_rate=10000), "pulled is not what was pushed")
            seen = list(amplifier.monitor(0.05, count=5))
            check(len(seen) == 5 and all(a["time_s"] < b["time_s"] for a, b in zip(seen, seen[1:])), f"monitor: {seen}")
            check(all(now["state"] == seen[0]["state"] and "position_um" in now for now in seen), f"monitor: {seen}")
            check(amplifier.stop()["state"] in ("idle", "parked"), "stop")
        broken_off(port, "Ctrl-C", interrupt, KeyboardInterrupt)
        broken_off(port, "an exception", wrong, ZeroDivisionError)


os.chdir(FOLDER)
look_at_the_day(run(sys.argv[1]))
break_off()
sys.exit(1 if failures else 0)
