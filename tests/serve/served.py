# SPDX-License-Identifier: GPL-3.0-or-later
"""A `hyst serve` that a test has begun, and a page of it without a browser. Exits with 77 without python3-websockets."""
import asyncio
import http.client
import json
import os
import re
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
