# SPDX-License-Identifier: GPL-3.0-or-later
"""Who and what the server of the live page does not let in."""
import asyncio
import json
import re
import socket
import sys

import websockets

from served import PATIENCE_S, check


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


async def odd_texts(page):
    """What is refused is cut in its text, at any byte: whole characters go to the page, and U+FFFD for half of one."""
    for text in ("\u00e4" * 120, "x" + "\u00e4" * 120, "\u20ac" * 80, "x" + "\U0001d11e" * 60):
        for what, members in ((text, {}), ("upload", {"name": text, "bytes": 1}), ("show", {"name": text}),
                              ("record", {"name": text}), ("upload", {"name": text + ".csv", "bytes": -1})):
            await page.do(what, **members)
            refused = await page.until("refused")
            check(refused["do"] == what and text[:10] in refused["why"], refused)


async def too_long(server):
    page = await server.connect()
    try:
        await page.connection.send('{"do": "' + 100000 * "x" + '"}')
        while True:
            await asyncio.wait_for(page.connection.recv(), PATIENCE_S)
    except websockets.ConnectionClosed:
        return


async def crowd(server):
    pages = [await server.connect() for _ in range(7)]
    try:
        await server.connect()
    except (websockets.WebSocketException, ConnectionError, EOFError):
        for page in pages:
            await page.connection.close()
        return
    sys.exit("FAIL: a ninth page is let in")
