# SPDX-License-Identifier: GPL-3.0-or-later
"""What the server of the live page does with the files of its folder, and where there is no room for one."""
import asyncio
import os
import re
import resource
import shutil
import signal
import socket

from served import PATIENCE_S, Server, check


async def imported(page, folder):
    """A file that does not say what its displacement is: told, looked at, and imported with what it lacks."""
    with open(f"{folder}/scope.txt", "w", encoding="ascii") as file:
        file.write("s;CH1 (V);CH2 (V)\n")
        file.writelines(f"{k / 500:.3f};{3 * (k % 100)};{(k % 100) / 10:.2f}\n" for k in range(400))
    columns = {"file": "scope.txt", "drive": "CH1", "displacement": "CH2"}
    await page.do("import", **columns)
    ended = await page.job_ended()
    check(not ended["good"] and not ended["made"] and "--displacement-scale" in ended["text"], ended)
    await page.do("import", write=False, displacement_scale=5, **columns)
    ended = await page.job_ended()
    check(ended["good"] and not ended["made"] and "stroke 49.5 um" in ended["text"], ended)
    for name in ("scope.h5", "scope-2.h5"):
        await page.do("import", displacement_scale=5, drive_scale=2, sample_rate_hz=500, time="1", **columns)
        ended = await page.job_ended()
        check(ended["good"] and ended["made"] == [name] and "0 to 594 V" in ended["text"], ended)
    await page.until("files", lambda files: {("scope.txt", "measurements"), ("scope-2.h5", "recording")} <=
                     {(file["name"], file["kind"]) for file in files["files"]})
    for wrong, why in (({"file": "model.json"}, "no such measurements"), ({"file": "../scope.txt"}, "letters, digits"),
                       ({**columns, "drive": "V*"}, "several actuators"), ({**columns, "drive_scale": "2"}, "not a number"),
                       ({**columns, "write": 1}, "not true or false"), ({}, "letters, digits")):
        await page.do("import", **wrong)
        check(why in (await page.until("refused"))["why"], wrong)
    with open(f"{folder}/holes.txt", "w", encoding="ascii") as file:
        file.write("Time (s);Drive (V);Position (um)\n")
        file.writelines(f"{k / 500:.3f};{3 * (k % 100)};{(k % 100) / 10:.2f}\n" if k != 7 else
                        f"{k / 500:.3f};{3 * k};OL\n" for k in range(400))
    for fill in False, True:
        await page.do("import", file="holes.txt", write=False, fill_missing=fill)
        ended = await page.job_ended()
        check(ended["good"] == fill, ended)
    await page.do("import", file="holes.txt", write=False, fill_missing=True, drop_held=True)
    ended = await page.job_ended()
    check(not ended["good"] and "--drop-held has nothing to drop" in ended["text"], ended)
    await page.do("import", **{**columns, "drive": "--output=stolen.csv"}) # a name, whatever it looks like
    ended = await page.job_ended()
    check(not ended["good"] and "no column '--output=stolen.csv'" in ended["text"], ended)


async def uploaded(server, page, folder):
    """Files that a page gives: whole under a name that is free, or not at all; by the page in control alone."""
    async def announce(name, data):
        await page.do("upload", name=name, bytes=len(data))
        return await page.until("upload")

    async def put(name, data):
        """The name that it has here."""
        told = await announce(name, data)
        check(server.post(told["to"], data) == 200, f"{name} is refused")
        ended = await page.until("uploaded")
        check(ended["name"] == told["name"], ended)
        return ended

    def kept(name):
        with open(f"{folder}/{name}", "rb") as file:
            return file.read()

    before = set(os.listdir(folder))
    text = b"s;CH1 (V);CH2 (um)\n" + b"".join(b"%.3f;%d;%.2f\n" % (k / 500, 3 * (k % 100), (k % 100) / 10) for k in range(400))
    long = os.urandom(1 << 20) * 40 # which no socket and no disk takes at once
    named = {"scope.tsv": "scope.tsv", "Messung 3 (neu).CSV": "Messung_3_neu_.CSV", "../../etc/x.csv": "file.._.._etc_x.csv",
             ".hidden.csv": "file.hidden.csv", "\u00e4\u00f6.npz.gz": "file_.npz.gz", "a" + 9 * ".csv": "a" + 9 * ".csv", "scope.csv.gz": "scope.csv.gz",
             "x" * 300 + ".csv": "x" * 100 + ".csv", "-o.csv": "file-o.csv", "long.dat": "long.dat"}
    for wished, name in named.items():
        data = long if wished == "long.dat" else text
        ended = await put(wished, data)
        check(ended["good"] and ended["name"] == name and kept(name) == data, f"{wished}: {ended}")
    check((await put("scope.tsv", text))["name"] == "scope-2.tsv" and kept("scope.tsv") == text, "a name that is taken")
    check((await put("scope.csv.gz", text))["name"] == "scope-2.csv.gz", "a name with two endings that is taken")
    with open(f"{folder}/model.json", "rb") as file:
        model = file.read()
    check((await put("better.json", model))["good"], "a model")
    ended = await put("package.json", b'{"name": "other"}')
    check(not ended["good"] and "not a model" in ended["why"], ended)
    await page.do("import", file="Messung_3_neu_.CSV", write=False, drive="CH1", displacement="CH2")
    ended = await page.job_ended()
    check(ended["good"] and "stroke 9.9 um" in ended["text"], ended)

    # What is refused when it is announced.
    for members, why in (({}, "empty"), ({"name": "a.csv"}, "empty"), ({"name": "a.csv", "bytes": -1}, "empty"),
                         ({"name": "a.csv", "bytes": "1"}, "not a number"), ({"name": "a.csv", "bytes": 2e9}, "at most 1 GB"),
                         ({"name": "a.csv", "bytes": 1e300}, "at most 1 GB"), ({"name": 7, "bytes": 1}, "not a text"),
                         ({"name": "a.html", "bytes": 1}, "ending"), ({"name": "a.exe", "bytes": 1}, "ending"),
                         ({"name": "csv", "bytes": 1}, "ending"), ({"name": ".csv", "bytes": 1}, "ending"), ({"name": "", "bytes": 1}, "ending"), ({"name": "a.csv/", "bytes": 1}, "ending")):
        await page.do("upload", **members)
        check(why in (await page.until("refused"))["why"], f"{members} is not refused with {why}")

    # What is refused when it comes: nothing of it is kept.
    to = (await announce("wrong.csv", text))["to"]
    for what, status in {"an unknown key": server.post("upload/" + "0" * 32, text), "no key": server.post("upload/", text),
                         "another length": server.post(to, text + b"1"), "a foreign origin": server.post(to, text, Origin="http://evil.example"),
                         "a foreign host": server.post(to, text, Host="evil.example")}.items():
        check(status in (403, None), f"{what} gets {status}")
    for no_origin in ({"Origin": ""}, {"Origin": "null"}):
        check(server.post(to, text, **no_origin) in (403, None), f"{no_origin} is let in")
    check(server.post(to, text) == 200, "the key is used up by refusals")
    check((await page.until("uploaded"))["good"], "after the refusals")
    check(server.post(to, text) in (403, None), "a key is good twice")
    earlier = (await announce("earlier.csv", text))["to"]
    await announce("later.csv", text)
    check(server.post(earlier, text) in (403, None), "a key that a later one has replaced")

    # Half of a file, and a second one meanwhile.
    to = (await announce("half.csv", long))["to"]
    half = socket.create_connection(("127.0.0.1", server.port), PATIENCE_S)
    half.sendall(f"POST /{server.token}/{to} HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nOrigin: {server.origin}\r\n"
                 f"Content-Length: {len(long)}\r\n\r\n".encode() + long[:len(long) // 2])
    await page.do("upload", name="second.csv", bytes=9)
    check("another file comes" in (await page.until("refused"))["why"], "two files at once")
    half.close()
    ended = await page.until("uploaded")
    check(not ended["good"] and "before all of it came" in ended["why"], ended)

    # Made by another meanwhile: not replaced.
    to = (await announce("mine.dat", text))["to"]
    with open(f"{folder}/mine.dat", "wb") as file:
        file.write(b"mine")
    server.post(to, text)
    ended = await page.until("uploaded")
    check(not ended["good"] and "made meanwhile" in ended["why"] and kept("mine.dat") == b"mine", ended)
    made = set(named.values()) | {"scope-2.tsv", "scope-2.csv.gz", "better.json", "wrong.csv", "mine.dat"}
    check(set(os.listdir(folder)) - before == made, f"{set(os.listdir(folder)) - before} is in the folder, not {made}")
    for name in made:
        os.remove(f"{folder}/{name}")


async def exchanged(page, folder):
    """Columns that look exchanged are refused; a page may insist."""
    with open(f"{folder}/recording.csv", encoding="ascii") as file, open(f"{folder}/turned.csv", "w", encoding="ascii") as turned:
        for line in file:
            cells = line.rstrip("\n").split(",")
            if line[0] not in "#t":
                cells[1], cells[2] = cells[2], cells[1]
            turned.write(",".join(cells) + "\n")
    for insist in (False, True):
        await page.do("fit", recordings=["turned.csv"], columns_are_right=insist)
        ended = await page.job_ended()
        check(ended["good"] is insist and ("--columns-are-right" in ended["text"]) is not insist, ended)
    os.remove(f"{folder}/{ended['made'][0]}")
    for what in ("fit", "diagnose"):
        await page.do(what, recordings=["turned.csv"], columns_are_right="yes")
        check("not true or false" in (await page.until("refused"))["why"], f"columns_are_right of {what}: yes")


async def odd_folder(hyst, port, scratch, recording):
    """The folder's name is no UTF-8: the page comes, shows what is of it, and works in it."""
    folder = os.path.join(os.fsencode(scratch), b"lat\xe4in")
    os.makedirs(folder)
    shutil.copy(recording, os.path.join(folder, b"recording.csv"))
    server = Server(hyst, port, folder)
    try:
        page = await server.connect()
        hello = await page.until("hello")
        check(hello["folder"].endswith("/lat\ufffdin"), hello)
        await page.do("look", recordings=["recording.csv"])
        ended = await page.job_ended()
        check(ended["good"] and "recording.csv: " in ended["text"], ended)
    finally:
        server.process.send_signal(signal.SIGINT)
        server.process.wait(PATIENCE_S)


def small_files():
    """In the server before it begins: no file becomes longer than a recording would."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10000, resource.RLIM_INFINITY))


async def no_room(server, folder):
    """Said before anything moves, and nothing of a file is left."""
    page = await server.connect()
    await page.until("line", lambda line: line["connected"])
    runs = ("record", {"name": "room"}), ("record", {"name": "room", "probe": "creep"}), ("track", {"mode": "both"})
    for what, members in runs:
        await page.do(what, **{"waveform": "sine", "frequency": 5, "cycles": 1, "condition": False, **members})
        ended = await page.run_ended()
        check(not ended["good"] and ": no room for a recording of up to " in ended["why"], ended)
        check("parked" not in ended["why"], ended)
    await page.connection.close()
    left = [name for name in os.listdir(folder) if name.endswith(".part") or name.startswith("room")]
    check(not left, left)


async def gone_at_the_end(server, folder, spare):
    """The folder, as a disk that is pulled: what was measured is elsewhere, and the page says where."""
    page = await server.connect()
    await page.until("line", lambda line: line["connected"])
    before = set(os.listdir(folder))
    await page.do("record", name="gone", waveform="sine", frequency=1, cycles=20, condition=False)
    while set(os.listdir(folder)) == before:  # its room is taken first
        await asyncio.sleep(0.01)
    os.rename(folder, folder + "-away")
    try:
        ended = await page.run_ended()
    finally:
        os.rename(folder + "-away", folder)
    await page.connection.close()
    found = re.search(r"; what was recorded is in (\S+/gone\.csv);", ended["why"] or "")
    check(not ended["good"] and found and "the drive is stopped and parked" in ended["why"], ended)
    check(found[1].startswith(spare + "/") and os.path.getsize(found[1]) > 10000, found[1])


def disks(hyst, port, folder, scratch):
    spare = os.path.join(scratch, "spare")
    os.makedirs(spare)
    for begin, look in ((small_files, lambda server: no_room(server, folder)),
                        (None, lambda server: gone_at_the_end(server, folder, spare))):
        server = Server(hyst, port, folder, begin=begin, TMPDIR=spare)
        try:
            asyncio.run(look(server))
        finally:
            server.process.send_signal(signal.SIGINT)
            server.process.wait(PATIENCE_S)
