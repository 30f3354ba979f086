# SPDX-License-Identifier: GPL-3.0-or-later
"""Sends single requests over a line that returns every answer, and counts the answers of two seconds each."""
import os
import select
import sys
import time
import tty


def crc(data):
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return value.to_bytes(2, "little")


def bytes_in_two_seconds(line, pdu):
    """How many bytes arrive after one request, when each that arrives is sent back."""
    frame = bytes([1]) + pdu
    os.write(line, frame + crc(frame))
    count = 0
    until = time.monotonic() + 2.0
    while time.monotonic() < until:
        if select.select([line], [], [], 0.05)[0]:
            heard = os.read(line, 256)
            count += len(heard)
            os.write(line, heard)
    return count


line = os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY)
tty.setraw(line)
failures = 0
for name, pdu, answer in (
    ("function 3", bytes([3, 0, 0, 0, 1]), 7),
    ("locked", bytes([6, 1, 4, 0, 1]), 5),
    ("unlock the parameters", bytes([6, 0x01, 0x3A, 0x50, 0x41]), 8),
    ("unlock the output", bytes([6, 0x01, 0x3A, 0x4F, 0x4E]), 8),
    ("function 6", bytes([6, 1, 4, 0, 1]), 8),
    ("function 16", bytes([16, 1, 4, 0, 1, 2, 0, 0]), 8),
    ("an exception", bytes([3, 0x30, 0, 0, 1]), 5),
    ("identification", bytes([43, 14, 4, 0]), 16),
):
    got = bytes_in_two_seconds(line, pdu)
    print(f"{name}: {got} bytes, one answer has {answer}")
    # An echo that a busy machine returns after the window of two silences is refused once more, and no oftener.
    failures += got != answer and (pdu[0] == 6 or got != answer + 5)
sys.exit(failures != 0)
