# SPDX-License-Identifier: GPL-3.0-or-later
"""orphans.py: a Python process, and a server, that are killed leave no emulated amplifier behind."""
import glob
import json
import os
import signal
import subprocess
import sys
import threading
import time
import unittest

import hyst

HYST, SOURCE, FIRMWARE = os.environ["HYST"], os.environ["HYST_SOURCE"], os.environ["HYST_FIRMWARE"]
ACTUATOR = os.path.join(SOURCE, "docs", "tutorial", "actuator.json")
RANGES = ("--drive-range", "0:100", "--position-range", "-5:40")
PATIENCE_S = 60.0
SESSION = f"""
import hyst, sys, time
port = hyst.EmulatedAmplifier({FIRMWARE!r}, {ACTUATOR!r}, *{RANGES!r}, command={HYST!r}).__enter__()
print(port, flush=True)
time.sleep(600)
"""


def descendants(process):
    """Numbers of the processes below this one."""
    found = []
    for path in glob.glob(f"/proc/{process}/task/*/children"):
        try:
            with open(path, encoding="ascii") as file:
                numbers = file.read().split()
        except (FileNotFoundError, ProcessLookupError):
            continue  # this thread has ended meanwhile
        for child in map(int, numbers):
            found += [child, *descendants(child)]
    return found


def running(process):
    try:
        with open(f"/proc/{process}/stat", encoding="ascii") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"  # a zombie has ended: nobody waited for it yet
    except (FileNotFoundError, ProcessLookupError):
        return False


class Orphans(unittest.TestCase):
    def expect_none_after_kill(self, parent, least):
        below = descendants(parent.pid)
        self.assertGreaterEqual(len(below), least)
        parent.send_signal(signal.SIGKILL)
        parent.wait()
        parent.stdout.close()
        until = time.monotonic() + PATIENCE_S
        while any(map(running, below)):
            self.assertLess(time.monotonic(), until, "processes are left")
            time.sleep(0.05)

    def test_of_a_python_that_is_killed(self):
        parent = subprocess.Popen([sys.executable, "-c", SESSION], stdout=subprocess.PIPE, text=True)
        self.assertIn("/dev/pts/", parent.stdout.readline())
        self.expect_none_after_kill(parent, 2)  # hyst bench and the emulator

    def test_of_a_server_that_is_killed(self):
        parent = subprocess.Popen([HYST, "serve", "--bench", "--json", "--image", FIRMWARE, "--model", ACTUATOR, *RANGES],
                                  stdout=subprocess.PIPE, text=True)
        self.assertIn("page", json.loads(parent.stdout.readline()))
        self.expect_none_after_kill(parent, 1)

    def test_none_ends_with_the_thread_that_started_it(self):
        bench = hyst.EmulatedAmplifier(FIRMWARE, ACTUATOR, *RANGES, command=HYST)
        ports = []
        thread = threading.Thread(target=lambda: ports.append(bench.__enter__()))
        thread.start()
        thread.join()
        with hyst.Amplifier(ports[0], timeout=5) as amplifier:
            amplifier.park()
        below = descendants(os.getpid())
        self.assertGreaterEqual(len(below), 2)
        bench.__exit__()
        self.assertEqual([process for process in below if running(process)], [])


unittest.main(verbosity=1)
