# SPDX-License-Identifier: GPL-3.0-or-later
"""foreign_terminal.py HYST MODEL: hyst bench leaves alone a terminal that is not its emulator's.

When an emulator ends, another program may get its pseudo-terminal's number. Here the emulator is a program that names
the terminal of this test, which has one program's text in it: somebody's shell.
"""
import os
import pty
import re
import select
import signal
import stat
import subprocess
import sys
import tempfile
import termios
import unittest

HYST, MODEL = sys.argv[1:3]


def waiting(terminal):
    """What has been written to it, of the master's side."""
    text = b""
    while select.select([terminal], [], [], 0.2)[0]:
        text += os.read(terminal, 4096)
    return text


class ForeignTerminal(unittest.TestCase):
    def setUp(self):
        self.master, self.slave = pty.openpty()
        self.name = os.ttyname(self.slave)
        self.settings = termios.tcgetattr(self.slave)
        self.folder = tempfile.TemporaryDirectory()

    def tearDown(self):
        os.close(self.master)
        os.close(self.slave)
        self.folder.cleanup()

    def emulator(self, lines):
        """A program in place of qemu-system-arm."""
        path = os.path.join(self.folder.name, "emulator")
        with open(path, "w", encoding="utf-8") as file:
            file.write("#!/bin/sh\n" + lines)
        os.chmod(path, os.stat(path).st_mode | stat.S_IXUSR)
        return path

    def bench(self, emulator):
        return [HYST, "bench", "--image", MODEL, "--model", MODEL, "--qemu", emulator]

    def expect_untouched(self):
        self.assertEqual(waiting(self.master), b"")
        self.assertEqual(termios.tcgetattr(self.slave), self.settings)

    def test_a_terminal_of_somebody_else(self):
        emulator = self.emulator(f"echo 'char device redirected to {self.name} (label serial0)'\nexec sleep 20\n")
        done = subprocess.run(self.bench(emulator), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True, check=False, timeout=60)
        self.assertNotEqual(done.returncode, 0)
        self.assertEqual(done.stdout, "")
        self.assertEqual(done.stderr.count("\n"), 1)
        self.assertIn(f"{self.name} is not the emulator's pseudo-terminal", done.stderr)
        self.expect_untouched()

    def test_an_emulator_that_has_ended(self):
        emulator = self.emulator(f"echo 'char device redirected to {self.name} (label serial0)'\n")
        done = subprocess.run(self.bench(emulator), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True, check=False, timeout=60)
        self.assertNotEqual(done.returncode, 0)
        self.assertEqual(done.stderr.count("\n"), 1)
        self.expect_untouched()

    def test_the_terminal_that_it_was_started_from(self):
        """In the background of a terminal, its streams elsewhere, nothing of it comes there, nor does it stop."""
        emulator = self.emulator(f"echo 'char device redirected to {self.name} (label serial0)'\nexec sleep 20\n")
        output = os.path.join(self.folder.name, "output")
        child, terminal = pty.fork()
        if child == 0:  # a session whose terminal this is; this process stays in its foreground
            before = termios.tcgetattr(0)
            with open(output, "w", encoding="utf-8") as file:
                status = subprocess.run(self.bench(emulator), stdin=subprocess.DEVNULL, stdout=file, stderr=file,
                                        check=False, preexec_fn=lambda: os.setpgid(0, 0)).returncode
            os._exit(10 * (termios.tcgetattr(0) != before) + (0 if status > 0 else 1))
        try:
            text = b""
            while select.select([terminal], [], [], 60)[0]:
                try:
                    more = os.read(terminal, 4096)
                except OSError:  # the other side has ended
                    break
                if not more:
                    break
                text += more
            _, status = os.waitpid(child, 0)
        finally:
            os.close(terminal)
        self.assertEqual(text, b"")
        self.assertEqual(os.waitstatus_to_exitcode(status), 0)
        with open(output, encoding="utf-8") as file:
            self.assertRegex(file.read(), re.escape(self.name))
        self.expect_untouched()


if __name__ == "__main__":
    signal.alarm(240)
    unittest.main(argv=sys.argv[:1])
