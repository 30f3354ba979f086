# SPDX-License-Identifier: GPL-3.0-or-later
"""stream.py PAGE_FOLDER HYST AMPLIFIER RECORDING SCRATCH: the live page under a stream of 10 kHz, in Chromium.

First `hyst serve` itself, before the simulated amplifier of tests/device with a loop at 10 kHz, whose line is as quick as
this machine: each frame that the server reads comes to the page, and Stop to the amplifier. On a machine with nothing
else to do that is each sample; a busy one takes fewer, which is printed. Then a stub of the server, with the page's own
files, sends what `hyst serve` would if a line carried each sample of a loop at 10 kHz. Stop is pressed while the page draws that, and once more while it is a minute and more behind, on a processor
slowed down twenty times: it must not wait for what came before it. Then the page gets more frames than it keeps, twice,
and its memory must not grow. In the end the server falls silent. What the page took is compared with what was sent; no
time is measured. Exits with 77 where there is no Chromium, chromedriver, Selenium or websockets.
"""
import asyncio
import http
import json
import math
import mimetypes
import os
import shutil
import subprocess
import sys
import threading
import time

from chromium import drop_profile, open_chromium # ends here where there is none

try:
    import websockets
except ImportError:
    print("skipped: no websockets (python3-websockets)")
    sys.exit(77)

PATIENCE_S = 300 # for what surely comes, on a busy machine
RATE_HZ, BLOCK = 10000, 400 # a message every 40 ms; two periods of the sine
WAVE = [math.sin(2 * math.pi * 50 * k / RATE_HZ) for k in range(BLOCK)]
FRAMES = json.dumps({"drive": [round(50 + 40 * value, 4) for value in WAVE],
                     "position": [round(15 + 12 * value, 5) for value in WAVE],
                     "reference": [round(15 + 12.1 * value, 5) for value in WAVE]})[1:]
KEPT = 1 << 20 # MOST_ROWS of page.js
READABLE = ("limits", "faults", "faults_before", "warnings", "warnings_before")


class Server:
    """Serves the page, streams on demand, and keeps what the page sends in the order in which it came."""

    def __init__(self, folder):
        self.folder, self.frames, self.received, self.pages, self.silent = folder, 0, [], [], False
        self.loop = asyncio.new_event_loop()
        ready = threading.Event()
        threading.Thread(target=self.run, args=(ready,), daemon=True).start()
        ready.wait()

    def run(self, ready):
        async def begin():
            server = await websockets.serve(self.page, "127.0.0.1", 0, subprotocols=["hyst"], process_request=self.file,
                                            compression=None, max_size=None, ping_interval=None)
            self.address = f"http://127.0.0.1:{server.sockets[0].getsockname()[1]}/"
            ready.set()
        self.loop.run_until_complete(begin())
        self.loop.run_forever()

    async def file(self, path, _headers):
        name = path.lstrip("/") or "page.html"
        if name == "socket":
            return None
        path = os.path.join(self.folder, os.path.basename(name))
        if not os.path.isfile(path):
            return http.HTTPStatus.NOT_FOUND, [], b""
        with open(path, "rb") as file:
            return http.HTTPStatus.OK, [("Content-Type", mimetypes.guess_type(path)[0])], file.read()

    async def page(self, socket):
        await self.tell(socket, event="hello", folder="stub", simulated=True, drive_range=[0, 100], position_range=[-5, 40])
        await self.tell(socket, event="role", control=True, free=False)
        await self.tell(socket, event="line", connected=True, port="stub", board="stub", sample_rate_hz=RATE_HZ,
                        has_parameters=True, model_id="0x1", drive_v=[0, 100], position_um=[-5, 40])
        self.pages.append(socket)
        beats = asyncio.ensure_future(self.beat(socket))
        try:
            async for text in socket:
                self.received.append(json.loads(text))
        except websockets.ConnectionClosed:
            pass # as a page does that goes
        finally:
            beats.cancel()

    async def beat(self, socket):
        """By which a page knows that the server is there."""
        while True:
            if not self.silent:
                await self.tell(socket, event="beat")
            await asyncio.sleep(1)

    async def tell(self, socket, **event):
        await socket.send(json.dumps(event))

    async def blocks(self, count, pause_s):
        """So many blocks of the stream, and a snapshot after each, as the server sends them."""
        socket = self.pages[-1]
        for _ in range(count):
            t = self.frames / RATE_HZ
            head = json.dumps({"event": "stream", "t": t, "step": 1 / RATE_HZ, "first": self.frames, "lost": 0,
                               "restarted": False})
            await socket.send(f"{head[:-1]}, {FRAMES}")
            self.frames += BLOCK
            await self.tell(socket, event="live", t=t, reference=15, drive=50, position=15, error=0, mode="compensate",
                            state="playing", power="on", model_error=None, counters={}, **{name: [] for name in READABLE})
            if pause_s > 0:
                await asyncio.sleep(pause_s)

    def stream(self, count, pause_s=0.0):
        return asyncio.run_coroutine_threadsafe(self.blocks(count, pause_s), self.loop)


class Page:
    def __init__(self, scratch, server):
        self.browser = open_chromium(scratch, "--js-flags=--expose-gc", "--enable-precise-memory-info")
        self.browser.set_script_timeout(PATIENCE_S)
        self.server = server
        self.browser.get(server.address)
        self.until("the page is connected", lambda: self.script("return document.body.dataset.line") == "connected")
        # What the page has taken of the stream when it sends something.
        self.script("""window.sent = [];
            const send = WebSocket.prototype.send;
            WebSocket.prototype.send = function (text) { sent.push([JSON.parse(text).do, stream.next || 0]); send.call(this, text); };""")

    def script(self, text):
        return self.browser.execute_script(text)

    def fail(self, why):
        print(f"FAIL: {why}\nreceived: {self.server.received}\nsent: {self.script('return window.sent')}\n"
              f"taken: {self.taken()} of {self.server.frames}, banner: {self.script('return banner.textContent')}, "
              f"message: {self.script('return byId(`message`).textContent')}")
        for entry in self.browser.get_log("browser"):
            print(entry["message"])
        sys.exit(1)

    def until(self, what, condition):
        end = time.monotonic() + PATIENCE_S
        while not condition():
            if time.monotonic() > end:
                self.fail(f"waited in vain: {what}")
            time.sleep(0.05)

    def taken(self):
        return self.script("return stream.next || 0")

    def until_taken(self):
        self.until("the page has taken all frames", lambda: self.taken() == self.server.frames)
        if self.script("return Number(document.body.dataset.gaps || 0)") != 0:
            self.fail("the page shows gaps where there were none")

    def middle_of_stop(self):
        middle = self.script("""const b = document.getElementById("stop").getBoundingClientRect();
            return [(b.left + b.right) / 2, (b.top + b.bottom) / 2]""")
        if not self.script(f"return document.elementFromPoint({middle[0]}, {middle[1]}).closest('#stop') !== null"):
            self.fail("Stop is not in view")
        return middle

    def press(self, middle):
        """As a mouse does it: the browser's own way to the page, past what scripts of the test would wait for."""
        for kind in "mousePressed", "mouseReleased":
            self.browser.execute_cdp_cmd("Input.dispatchMouseEvent", {
                "type": kind, "x": middle[0], "y": middle[1], "button": "left", "clickCount": 1})

    def memory(self):
        """Bytes of the page's objects, and how many elements it has."""
        return self.script("gc(); return [performance.memory.usedJSHeapSize, document.querySelectorAll('*').length]")


class RealServer:
    """`hyst serve` before the simulated amplifier, which has an image in force."""

    def __init__(self, hyst, amplifier, recording, scratch):
        self.frames, self.received = "as many as come", "not looked at"
        self.amplifier = subprocess.Popen([amplifier, str(RATE_HZ // 1000)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        port = self.amplifier.stdout.readline().split()[1]
        for arguments in (["fit", recording, "--operators", "4", "-o", f"{scratch}/model.json"],
                          ["compile", f"{scratch}/model.json", "--sample-rate", str(RATE_HZ), "-o", f"{scratch}/model.image"],
                          ["push", f"{scratch}/model.image", "--port", port]):
            subprocess.run([hyst, *arguments], check=True, stdout=subprocess.DEVNULL)
        self.process = subprocess.Popen([hyst, "serve", "--port", port, "--folder", scratch, "--json"],
                                        stdout=subprocess.PIPE, text=True)
        self.address = json.loads(self.process.stdout.readline())["page"]

    def close(self):
        self.process.terminate()
        self.process.wait(PATIENCE_S)
        self.amplifier.stdin.close()
        self.amplifier.wait(PATIENCE_S)


def each_frame_of_the_real_server(page):
    page.until("the server streams", lambda: page.taken() > 0)
    page.script("window.heard = { frames: 0, loop: 0, from: performance.now() }; const on = handlers.stream;"
                "handlers.stream = (e) => { heard.frames += e.drive.length; heard.loop += e.drive.length * e.step; on(e); };")
    page.until("5 s of the loop are taken", lambda: page.script("return heard.loop") >= 5)
    frames, loop, seconds = page.script("return [heard.frames, heard.loop, (performance.now() - heard.from) / 1000]")
    print(f"hyst serve: {frames} frames of {loop:.1f} s of the loop in {seconds:.1f} s: {frames / seconds:.0f} a second, "
          f"one of {loop * RATE_HZ / frames:.1f} samples", flush=True)
    # Behind a loss on the line, or where it is late, the server says so and goes on with half as many.
    gaps, losses = (page.script(f"return Number(document.body.dataset.{name} || 0)") for name in ("gaps", "losses"))
    if gaps != losses:
        page.fail(f"{gaps} gaps, and {losses} losses that the server knows of")
    if page.script("return rows.count") < frames:
        page.fail("frames are not in the traces")
    page.press(page.middle_of_stop())
    page.until("the amplifier takes the stop", lambda: "took it after" in page.script("return byId('message').textContent"))


def real_server(*arguments):
    server = RealServer(*arguments)
    try:
        page = Page(arguments[-1], server)
        try:
            each_frame_of_the_real_server(page)
        finally:
            page.browser.quit()
    finally:
        server.close()


def stop_while_it_draws(page, server):
    """At 10 kHz: one second of it is drawn, then Stop is pressed while it goes on."""
    middle = page.middle_of_stop()
    going = server.stream(20 * RATE_HZ // BLOCK, BLOCK / RATE_HZ)
    page.until("a second of the stream is taken", lambda: page.taken() >= RATE_HZ)
    page.press(middle)
    page.until("Stop comes to the server", lambda: server.received)
    going.result(PATIENCE_S)
    page.until_taken()
    if server.received != [{"do": "stop"}]:
        page.fail("not just Stop came")
    if page.script("return rows.count") != server.frames:
        page.fail("a frame is not in the traces")
    low, high = page.script("return [Math.min(...plots.position.series[1].y.filter((v) => v !== null)),"
                            "Math.max(...plots.position.series[1].y)]")
    if abs(low - 3) > 0.01 or abs(high - 27) > 0.01:
        page.fail(f"the position goes from 3 to 27 um, the trace from {low} to {high}")


def stop_while_it_is_behind(page, server):
    """Stop overtakes a backlog. Where the page has worked that off before the press, the next one is larger."""
    middle = page.middle_of_stop()
    page.browser.execute_cdp_cmd("Emulation.setCPUThrottlingRate", {"rate": 20})
    for seconds in (15, 60, 240):
        server.received.clear()
        page.script("sent.length = 0")
        before = server.frames
        going = server.stream(seconds * RATE_HZ // BLOCK)
        page.press(middle)
        page.until("Stop comes to the server", lambda: server.received)
        going.result(PATIENCE_S)
        page.browser.execute_cdp_cmd("Emulation.setCPUThrottlingRate", {"rate": 1})
        page.until_taken()
        (what, taken), = page.script("return sent")
        print(f"Stop was sent when {taken - before} of {server.frames - before} frames were taken", flush=True)
        if what == "stop" and server.received == [{"do": "stop"}] and taken < server.frames:
            return
        page.browser.execute_cdp_cmd("Emulation.setCPUThrottlingRate", {"rate": 20})
    page.fail("Stop came after everything else")


def memory_stays(page, server):
    """More frames than are kept, and again: what the second lot would add if it were kept is far more than what may be
    left of a collection. Each frame has four numbers of 4 bytes or more."""
    more = KEPT + KEPT // 8
    def fill():
        server.stream(more // BLOCK).result(PATIENCE_S)
        page.until_taken()
        return page.memory()
    first, second = fill(), fill()
    print(f"{more} frames more: from {first[0] / 1e6:.1f} to {second[0] / 1e6:.1f} MB, {second[1]} elements", flush=True)
    if second[0] - first[0] > 0.1 * more * 16 or second[1] != first[1]:
        page.fail(f"memory and elements grow from {first} to {second}")
    kept = page.script("return rows.count")
    if not KEPT // 2 <= kept <= KEPT:
        page.fail(f"{kept} frames are kept")
    if page.script("return rows.t[rows.count - 1]") != (server.frames - 1) / RATE_HZ:
        page.fail("the last frame is not the last of the traces")


def silence_is_noticed(page, server):
    """A server that is stuck sends nothing, and its connection stays open: the page must not show old values as new."""
    opened = len(server.pages)
    server.silent = True
    page.until("the page closes the connection and tries again", lambda: len(server.pages) > opened)
    server.silent = False
    page.until("it is connected again", lambda: page.script("return document.body.dataset.server") == "open")


def main():
    folder, hyst, amplifier, recording, scratch = sys.argv[1:6]
    shutil.rmtree(scratch, ignore_errors=True)
    os.makedirs(scratch)
    real_server(hyst, amplifier, recording, scratch)
    server = Server(folder)
    page = Page(scratch, server)
    try:
        stop_while_it_draws(page, server)
        stop_while_it_is_behind(page, server)
        memory_stays(page, server)
        silence_is_noticed(page, server)
        page.browser.save_screenshot(f"{scratch}/stream.png")
    finally:
        page.browser.quit()
    drop_profile(scratch)


main()
