# SPDX-License-Identifier: GPL-3.0-or-later
"""protocol.py HYST AMPLIFIER RECORDING SCRATCH: what the server of the live page lets in, and what it does with it.

Without a browser, against the simulated amplifier of tests/device. Exits with 77 without python3-websockets.
"""
import asyncio
import glob
import http.client
import json
import os
import re
import resource
import shutil
import signal
import socket
import subprocess
import sys
import time

try:
    import websockets
except ImportError:
    print("skipped: no websockets (python3-websockets)")
    sys.exit(77)

PATIENCE_S = 120 # for what surely comes, on a busy machine
TIMEOUT_S = "2"  # for an answer of the amplifier there
RANGES = {"drive_range": [0, 100], "position_range": [0, 100]}


def check(good, what):
    if not good:
        sys.exit(f"FAIL: {what}")


class Server:
    def __init__(self, hyst, port, folder, stderr=None, begin=None, **environment):
        self.process = subprocess.Popen([hyst, "serve", "--port", port, "--timeout", TIMEOUT_S, "--folder", folder,
                                         "--json"], stdout=subprocess.PIPE, stderr=stderr, text=True, preexec_fn=begin,
                                        env={**os.environ, **environment})
        said = json.loads(self.process.stdout.readline())
        check(said["format"] == "hyst-serve-1", said)
        found = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/([0-9a-f]{32})/", said["page"])
        check(found, said)
        self.port, self.token = int(found[1]), found[2]
        self.origin = f"http://127.0.0.1:{self.port}"

    def post(self, path, body, **headers):
        """The status; None: the connection was closed."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        try:
            connection.request("POST", f"/{self.token}/{path}", body, {"Origin": self.origin, **headers})
            return connection.getresponse().status
        except (ConnectionError, http.client.BadStatusLine):
            return None
        finally:
            connection.close()

    def get(self, path, method="GET", **headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        connection.request(method, path, headers=headers)
        answer = connection.getresponse()
        body = answer.read()
        connection.close()
        return answer, body

    async def connect(self, token=None, origin="own", host=None, protocol="hyst", path="socket"):
        own = self.origin if origin == "own" else origin
        headers = {"Host": host} if host else {}
        uri = f"ws://{host or f'127.0.0.1:{self.port}'}/{token or self.token}/{path}"
        return Page(await websockets.connect(uri, origin=own, subprotocols=[protocol] if protocol else None,
                                             extra_headers=headers if not host else {}, max_size=None,
                                             max_queue=None, # else a page that does not read cannot close, for 30 s
                                             **({"host": "127.0.0.1", "port": self.port} if host else {})))


class Page:
    def __init__(self, connection):
        self.connection = connection

    async def do(self, what, **members):
        await self.connection.send(json.dumps({"do": what, **members}))

    async def until(self, event, condition=lambda message: True):
        end = time.monotonic() + PATIENCE_S
        while True:
            left = end - time.monotonic()
            try:
                message = json.loads(await asyncio.wait_for(self.connection.recv(), max(left, 0.01)))
            except asyncio.TimeoutError:
                sys.exit(f"FAIL: no {event} came")
            if message["event"] == event and condition(message):
                return message

    async def run_ended(self):
        return await self.until("run", lambda message: not message["running"])

    async def job_ended(self):
        return await self.until("job", lambda message: not message["running"])


def http_is_guarded(server):
    page = f"/{server.token}/"
    answer, body = server.get(page)
    check(answer.status == 200 and b"<title>hyst live" in body, "the page does not come")
    check("default-src 'none'" in answer.getheader("content-security-policy", ""), "the page has no policy")
    for name in ("page.css", "page.js", "plot.js"):
        answer, part = server.get(page + name)
        check(answer.status == 200 and len(part) > 1000, f"{name} does not come")
        for text in (body, part):
            outside = re.search(rb"(?:src|href|url|import)\s*[=(]\s*[\"']?(?:https?:)?//", text)
            check(not outside, f"{name} has something from elsewhere: {outside}")
    own = f"127.0.0.1:{server.port}"
    wrong = server.token[:-1] + ("0" if server.token[-1] != "0" else "1")
    refused = {
        "no token": ("/", {}), "a wrong token": (f"/{wrong}/", {}), "half a token": (f"/{server.token[:16]}/", {}),
        "a wrong token for a file": (f"/{wrong}/file/recording.csv", {}),
        "a foreign host": (page, {"Host": f"evil.example:{server.port}"}),
        "the host without its port": (page, {"Host": "127.0.0.1"}),
        "a foreign origin": (page, {"Host": own, "Origin": "http://evil.example"}),
        "a sandboxed origin": (page, {"Host": own, "Origin": "null"}),
        "an origin that only begins well": (page, {"Host": own, "Origin": f"http://{own}.evil.example"})}
    for what, (path, headers) in refused.items():
        status = server.get(path, **headers)[0].status
        check(status == 403, f"{what} gets {status}")
    check(server.get(page, Host=f"localhost:{server.port}")[0].status == 200, "localhost is refused")
    for path in ("file/../secret.csv", "file/%2e%2e/secret.csv", "file/..%2fsecret.csv", "file/secret.txt", "file/",
                 "file/absent.csv", "page.c", "file//etc/passwd"):
        status = server.get(page + path)[0].status
        check(status in (403, 404), f"{path} gets {status}")
    answer, body = server.get(page + "file/recording.csv")
    check(answer.status == 200 and body.startswith(b"#"), "a recording does not come")
    status = server.get(page, method="POST")[0].status
    check(status >= 400, f"POST gets {status}")


def only_loopback(server):
    addresses = {found[4][0] for found in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)}
    for address in addresses - {"127.0.0.1"}:
        if address.startswith("127."):
            continue
        try:
            socket.create_connection((address, server.port), 2).close()
            sys.exit(f"FAIL: it listens on {address}")
        except OSError:
            pass


async def sockets_are_guarded(server):
    wrong = "0" * 32
    for what, members in {"a wrong token": {"token": wrong}, "a foreign origin": {"origin": "http://evil.example"},
                          "no origin": {"origin": None}, "a foreign host": {"host": f"evil.example:{server.port}"},
                          "an unknown protocol": {"protocol": "other"}, "no protocol": {"protocol": None}}.items():
        try:
            page = await server.connect(**members)
            await asyncio.wait_for(page.connection.recv(), PATIENCE_S)
        except (websockets.WebSocketException, ConnectionError, EOFError, asyncio.IncompleteReadError):
            continue
        sys.exit(f"FAIL: {what} is let in")


async def bad_messages(page):
    for text in ("", "{", "[]", "7", '"stop"', '{"do": 7}', '{"do": null}', '{"do": "format"}', '{"do": "record", "cycles": -1}',
                 '{"do": "record", "cycles": 1e99}', '{"do": "record", "frequency": "1"}', '{"do": "record", "waveform": "noise"}',
                 '{"do": "record", "waveform": "sweep", "end_frequency": -1}', '{"do": "record", "linear": 1}',
                 '{"do": "record", "name": "../x"}', '{"do": "record", "name": "-o"}', '{"do": "record", "probe": "nothing"}',
                 '{"do": "record", "drive_range": [1]}', '{"do": "record", "drive_range": [2, 1]}',
                 '{"do": "track", "mode": "fast"}', '{"do": "push"}', '{"do": "push", "image": "../../x.image"}',
                 '{"do": "fit"}', '{"do": "fit", "recordings": []}', '{"do": "fit", "recordings": [7]}',
                 '{"do": "fit", "recordings": ["absent.csv"]}', '{"do": "fit", "recordings": ["/etc/passwd"]}',
                 '{"do": "compile", "model": "recording.csv"}', '{"do": "show", "name": "..."}', '{"do": "show", "name": "../secret.csv"}',
                 '{"do": "show", "name": "secret.txt"}', '{"do": "fit", "recordings": ["../secret.csv"]}',
                 '{"do": "stop", "do": "stop"}',
                 '{"do": "record", "name": "' + 200 * "x" + '"}', "\x00", '{"do": "st\\u0000op"}', 9 * "[" + 9 * "]"):
        await page.connection.send(text)
        message = None
        while message is None or message["event"] in ("live", "stream", "beat", "line", "files", "role"):
            message = json.loads(await asyncio.wait_for(page.connection.recv(), PATIENCE_S))
            # One that only the work itself can refuse.
            if message["event"] == "run" and (message["running"] or message.get("good") is False):
                message = message if not message["running"] else None
        check(message["event"] == "refused" or message.get("good") is False, f"{text!r} is answered by {message}")


async def too_long(server):
    page = await server.connect()
    try:
        await page.connection.send('{"do": "' + 100000 * "x" + '"}')
        while True:
            await asyncio.wait_for(page.connection.recv(), PATIENCE_S)
    except websockets.ConnectionClosed:
        return


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


async def odd_texts(page):
    """What is refused is cut in its text, at any byte: whole characters go to the page, and U+FFFD for half of one."""
    for text in ("\u00e4" * 120, "x" + "\u00e4" * 120, "\u20ac" * 80, "x" + "\U0001d11e" * 60):
        for what, members in ((text, {}), ("upload", {"name": text, "bytes": 1}), ("show", {"name": text}),
                              ("record", {"name": text}), ("upload", {"name": text + ".csv", "bytes": -1})):
            await page.do(what, **members)
            refused = await page.until("refused")
            check(refused["do"] == what and text[:10] in refused["why"], refused)


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


async def crowd(server):
    pages = [await server.connect() for _ in range(7)]
    try:
        await server.connect()
    except (websockets.WebSocketException, ConnectionError, EOFError):
        for page in pages:
            await page.connection.close()
        return
    sys.exit("FAIL: a ninth page is let in")


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
