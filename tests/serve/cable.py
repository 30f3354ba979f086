# SPDX-License-Identifier: GPL-3.0-or-later
"""A line to the amplifier that can be cut."""
import os
import struct
import sys
import threading
import time
import tty

TRIES = 120 # of what is surely heard at last, on a busy machine: a second each


class Cable:
    """A pseudo-terminal before the amplifier's. Cut, it swallows what is sent, and the test may be the master."""

    def __init__(self, port):
        self.far = os.open(port, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self.far)
        self.near, self.held = os.openpty()
        tty.setraw(self.held)
        self.port = os.ttyname(self.held)
        self.cut, self.heard = False, b""
        for ends in ((self.near, self.far), (self.far, self.near)):
            threading.Thread(target=self.carry, args=ends, daemon=True).start()

    def carry(self, source, sink):
        while True:
            try:
                data = os.read(source, 4096)
                if not self.cut:
                    os.write(sink, data)
                elif source == self.far:
                    self.heard += data
            except OSError: # the amplifier has ended
                return

    def write_register(self, address, value):
        """While it is cut: again until the amplifier has taken it, whose answer is then the request."""
        frame = struct.pack(">BBHH", 1, 6, address, value)
        check = 0xFFFF
        for byte in frame:
            check ^= byte
            for _ in range(8):
                check = check >> 1 ^ (0xA001 if check & 1 else 0)
        frame += struct.pack("<H", check)
        for _ in range(TRIES):
            self.heard = b""
            os.write(self.far, frame)
            for _ in range(20):
                time.sleep(0.05)
                if frame in self.heard:
                    return
        sys.exit(f"FAIL: register {address:#06x} does not take {value:#06x}: {self.heard.hex()}")
