# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of the completions share: a folder with two recordings, what `hyst --help` lists, and the count of failures."""
import os
import re
import subprocess
import sys
import tempfile


class Cases:
    LEAST_OPTIONS = 50

    def __init__(self, hyst):
        self.hyst = hyst
        self.failures = 0
        self.folder = tempfile.TemporaryDirectory()
        for name in ("recording-one.csv", "other.csv"):
            open(os.path.join(self.folder.name, name), "w").close()
        self.commands = re.findall(r"^  ([a-z]+) ", self.printed("--help"), re.M)

    def printed(self, *arguments):
        return subprocess.run([self.hyst, *arguments], stdout=subprocess.PIPE, text=True, check=True).stdout

    def options(self, command):
        """The long names that the help of a command lists."""
        return re.findall(r"^  (?:-[a-z], )?(--[a-z-]+)", self.printed(command, "--help"), re.M)

    def expect(self, what, got, wanted):
        if got != wanted:
            print(f"FAIL: {what}: {got}, expected {wanted}")
            self.failures += 1

    def end(self, checked):
        """Ends the test. checked: how many options were."""
        if checked < self.LEAST_OPTIONS:
            print(f"FAIL: only {checked} options")
            self.failures += 1
        print(f"{len(self.commands)} commands, {checked} options, {self.failures} failures")
        sys.exit(1 if self.failures else 0)
