# SPDX-License-Identifier: GPL-3.0-or-later
"""protocol.py HYST AMPLIFIER RECORDING SCRATCH: what the server of the live page lets in, and what it does with it.

Without a browser, against the simulated amplifier of tests/device. Exits with 77 without python3-websockets.
"""
import asyncio
import glob
import os
import shutil
import signal
import subprocess
import sys
import time

from served import PATIENCE_S, TIMEOUT_S, Server, check
from folder import disks, exchanged, imported, odd_folder, uploaded
from guards import (bad_messages, crowd, http_is_guarded, odd_texts, only_loopback, sockets_are_guarded,
                    too_long)

RANGES = {"drive_range": [0, 100], "position_range": [0, 100]}


async def roles(server, first):
    second = await server.connect()
    role = await second.until("role")
    check(not role["control"] and not role["free"], f"the second page: {role}")
    await second.until("line", lambda line: line["connected"])
    await second.until("live")
    for what in ("record", "track", "push", "clear", "fit", "compile", "diagnose", "upload", "cancel", "take"):
        await second.do(what, **RANGES)
        refusal = await second.until("refused")
        check(refusal["do"] == what and "control" in refusal["why"], f"{what} by the second page: {refusal}")
    await second.do("show", name="recording.csv")
    shown = await second.until("recording")
    check(len(shown["drive"]) == len(shown["displacement"]) <= 4000 and shown["samples"] > 4000, "what is shown")
    # Stop is everybody's, and passes before the work.
    await first.do("record", waveform="sine", frequency=0.2, cycles=1000, **RANGES)
    await second.until("run", lambda run: run["running"] and run.get("what") == "playing")
    await second.do("stop")
    stopped = await second.until("stopped")
    check("why" not in stopped or stopped["why"] is None, stopped)
    ended = await first.run_ended()
    check(not ended["good"] and "stopped" in ended["why"] and "parked" in ended["why"], ended)
    # When the first has gone, the second may take its place.
    await first.connection.close()
    await second.until("role", lambda role: role["free"])
    await second.do("take")
    await second.until("role", lambda role: role["control"])
    return second, stopped["seconds"]


async def busy(page):
    """What may run beside what, and a job that is cancelled."""
    await page.do("record", waveform="sine", frequency=0.2, cycles=1000, **RANGES)
    await page.until("run", lambda run: run.get("what") == "playing")
    await page.do("record", waveform="sine", **RANGES)
    check("busy" in (await page.until("refused"))["why"], "two runs at once")
    await page.do("diagnose", recordings=["recording.csv"])
    await page.until("job", lambda job: job["running"])
    await page.do("fit", recordings=["recording.csv"])
    check("runs" in (await page.until("refused"))["why"], "two jobs at once")
    begun = time.monotonic()
    await page.do("stop")
    await page.run_ended()
    await page.until("stopped")
    took_s = time.monotonic() - begun
    await page.do("cancel")
    ended = await page.job_ended()
    check(ended["cancelled"] and not ended["good"], ended)
    return took_s


async def whole_way(page, folder, hyst):
    await page.do("record", waveform="triangle", frequency=5, cycles=2, frames=1000, name="mine", **RANGES)
    ended = await page.run_ended()
    check(ended["good"] and ended["made"] == ["mine.csv"], ended)
    await page.until("files", lambda files: any(file["name"] == "mine.csv" for file in files["files"]))
    subprocess.run([hyst, "import", f"{folder}/mine.csv", "-o", f"{folder}/long.h5"], check=True, capture_output=True)
    await page.do("record", waveform="triangle", frequency=5, cycles=2, frames=1000, name="mine", condition=False)
    ended = await page.run_ended()
    check(ended["made"] == ["mine-2.csv"], f"a name that is taken: {ended}")
    await page.until("files", lambda files: {"name": "long.h5", "kind": "recording"}.items() <=
                     next((file for file in files["files"] if file["name"] == "long.h5"), {}).items())
    await page.do("fit", recordings=["mine.csv"])
    ended = await page.job_ended()
    check(ended["good"] and ended["made"] == ["model.json"] and "NRMSE" in ended["text"], ended)
    await page.do("compile", model="model.json")
    ended = await page.job_ended()
    check(ended["good"] and ended["made"] == ["model.image"], ended)
    await page.do("push", image="model.image")
    check((await page.run_ended())["good"], "push")
    await page.do("track", waveform="sine", frequency=5, cycles=2, frames=500, mode="both", condition=False)
    ended = await page.run_ended()
    check(ended["good"] and ended["made"] == ["track-linear.csv", "track-compensate.csv"] and
          [track["mode"] for track in ended["result"]["tracks"]] == ["linear", "compensate"], ended)
    await page.do("simulate", model="model.json", recording="mine.csv")
    ended = await page.job_ended()
    check(ended["made"] == ["simulated.csv"], ended)
    await page.do("report", model="model.json", recording="mine.csv", before="track-linear.csv",
                  after="track-compensate.csv")
    ended = await page.job_ended()
    # The simulated actuator follows its drive one to one: a job that fails, with its line.
    check(not ended["good"] and not ended["made"] and "is the reference itself" in ended["text"], ended)
    await page.do("look", recordings=["mine.csv"])
    check("mine.csv" in (await page.job_ended())["text"], "look")
    await page.do("look", recordings=["long.h5"])
    check("long.h5" in (await page.job_ended())["text"], "look at HDF5")
    await imported(page, folder)
    await page.do("clear")
    check((await page.run_ended())["good"], "clear")


def children(process):
    """The numbers of a process's children, in any of its threads."""
    found = []
    for path in glob.glob(f"/proc/{process}/task/*/children"):
        try:
            with open(path, encoding="ascii") as file:
                found += [int(number) for number in file.read().split()]
        except (FileNotFoundError, ProcessLookupError):
            pass # this thread has ended meanwhile
    return found


def processor_s(process):
    """Processor time that a process has used so far; None when it has ended."""
    try:
        with open(f"/proc/{process}/stat", encoding="ascii") as file:
            fields = file.read().rpartition(")")[2].split()
    except (FileNotFoundError, ProcessLookupError):
        return None
    return None if fields[0] == "Z" else (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def no_orphans(server):
    """A server that is killed in the middle of a job leaves no process behind: the job ends before its time."""
    page = await server.connect()
    await page.until("hello")
    for killed in (False, True):
        await page.do("diagnose", recordings=["recording.csv"])
        await page.until("job_progress")
        jobs = children(server.process.pid)
        check(len(jobs) == 1, f"processes of a diagnosis: {jobs}")
        begun = processor_s(jobs[0])
        if killed:
            server.process.kill()
            server.process.wait()
        used = begun
        while (now := processor_s(jobs[0])) is not None:
            used = now
            time.sleep(0.02)
        if killed:
            check(used - begun < 0.5 * whole, f"a job outlives its server by {used - begun:.2f} s of {whole:.2f} s")
        else:
            whole = used - begun
            await page.job_ended()


async def a_fault_before(server):
    """The run that leads out of it says which it was, and the next one nothing."""
    page = await server.connect()
    await page.until("line", lambda line: line["connected"])
    for note in ("the amplifier had tripped (communication timeout)", None):
        await page.do("record", waveform="sine", frequency=50, cycles=1, condition=False)
        ended = await page.run_ended()
        check(ended["good"] and (ended["note"] or "").startswith(note or "") and (note or ended["note"] is None), ended)


def terminal_hears_of_the_line(hyst, port, scratch):
    """What the page would say, where no page is open: the port is not there, and then it is."""
    link = os.path.join(scratch, "port")
    server = Server(hyst, link, scratch, subprocess.PIPE)
    try:
        said = server.process.stderr.readline()
        check(said.startswith("hyst serve: the line to the amplifier is cut") and link in said, said)
        os.symlink(port, link)
        said = server.process.stderr.readline()
        check(said == "hyst serve: the line to the amplifier is there\n", said)
    finally:
        server.process.send_signal(signal.SIGINT)
        rest = server.process.communicate(timeout=PATIENCE_S)[1]
        check(rest == "", rest)


async def day(server, folder, hyst):
    http_is_guarded(server)
    only_loopback(server)
    await sockets_are_guarded(server)
    first = await server.connect()
    hello = await first.until("hello")
    check(hello["folder"] == folder, hello)
    check((await first.until("role"))["control"], "the first page has no control")
    line = await first.until("line", lambda line: line["connected"])
    check(not line["has_parameters"], line)
    await first.do("track", mode="both")
    check("no parameters" in (await first.run_ended())["why"], "a track without parameters")
    await bad_messages(first)
    await odd_texts(first)
    await too_long(server)
    second, stop_s = await roles(server, first)
    busy_s = await busy(second)
    await whole_way(second, folder, hyst)
    await exchanged(second, folder)
    await uploaded(server, second, folder)
    check(not [name for name in os.listdir(folder) if name.endswith(".part")], "parts of files are left")
    await crowd(server)
    print(f"stop: taken by the amplifier after {1e3 * stop_s:.1f} ms; from the page, beside a diagnosis, "
          f"{1e3 * busy_s:.1f} ms")


def main():
    hyst, amplifier, recording, scratch = sys.argv[1:5]
    shutil.rmtree(scratch, ignore_errors=True)
    folder = os.path.join(scratch, "folder")
    os.makedirs(folder)
    shutil.copy(recording, os.path.join(folder, "recording.csv"))
    for path in (os.path.join(folder, "secret.txt"), os.path.join(scratch, "secret.csv")):
        shutil.copy(recording, path) # what would be shown, if it were let through
    device = subprocess.Popen([amplifier], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    server = None
    try:
        port = device.stdout.readline().split()[1]
        terminal_hears_of_the_line(hyst, port, scratch)
        asyncio.run(odd_folder(hyst, port, scratch, recording))
        server = Server(hyst, port, folder)
        asyncio.run(day(server, folder, hyst))
        server.process.send_signal(signal.SIGINT)
        status = server.process.wait(PATIENCE_S)
        check(status == 0, f"the server ended with {status}")
        subprocess.run([hyst, "play", "--port", port, "--timeout", TIMEOUT_S, "--waveform", "sine", "--mode", "linear",
                        "--no-condition", "--silence", "0.2"], check=True, capture_output=True)
        time.sleep(0.6) # without a request
        server = Server(hyst, port, folder)
        asyncio.run(a_fault_before(server))
        server.process.send_signal(signal.SIGINT)
        server.process.wait(PATIENCE_S)
        disks(hyst, port, folder, scratch)
        server = Server(hyst, port, folder)
        asyncio.run(no_orphans(server))
    finally:
        if server:
            server.process.kill()
        device.stdin.close()
        device.wait(PATIENCE_S)


main()
