# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of the completions share: what is typed and what it becomes, a folder with two recordings, what `hyst --help`
lists, and the count of failures."""
import os
import re
import subprocess
import sys
import tempfile


class Cases:
    LEAST_OPTIONS = 50
    # What is typed, and the words of the line after the tabulator key. The last one is no file name: nothing is completed.
    TYPED = {"hyst sim": ["simulate"],
             "hyst --ver": ["--version"],
             "hyst help comp": ["help", "compile"],
             "hyst fit --fam": ["fit", "--family"],
             "hyst fit --family bou": ["fit", "--family", "bouc_wen"],
             "hyst fit --family=bou": ["fit", "--family=bouc_wen"],
             "hyst fit rec": ["fit", "recording-one.csv"],
             "hyst fit recording-one.csv -o oth": ["fit", "recording-one.csv", "-o", "other.csv"],
             "hyst record --probe reso": ["record", "--probe", "resonance"],
             "hyst record -w tri": ["record", "-w", "triangle"],
             "hyst track --mode comp": ["track", "--mode", "compensate"],
             "hyst compile m.json --follow pos": ["compile", "m.json", "--follow", "position"],
             "hyst twin --spe": ["twin", "--speed"],
             "hyst track --no": ["track", "--no-condition"],
             "hyst record --offset oth": ["record", "--offset", "oth"]}

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

    def expect_typed(self, shell):
        """Types all cases into an interactive shell."""
        for typed, wanted in self.TYPED.items():
            self.expect(typed, [word.rstrip("=") for word in shell.complete(typed)], wanted)

    def end(self, checked):
        """Ends the test. checked: how many options were."""
        if checked < self.LEAST_OPTIONS:
            print(f"FAIL: only {checked} options")
            self.failures += 1
        print(f"{len(self.commands)} commands, {checked} options, {self.failures} failures")
        sys.exit(1 if self.failures else 0)
