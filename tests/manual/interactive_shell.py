# SPDX-License-Identifier: GPL-3.0-or-later
"""An interactive shell on a terminal of its own, for the tests of completion."""
import os
import pty
import re
import select
import sys
import time


class Shell:
    """prompt: a pattern that the prompt matches, at the end of what the shell writes."""

    def __init__(self, command, folder, prompt=r"ready> (?:\x1b\[\?2004h)?$"):
        self.name, self.prompt = command[0], prompt
        self.pid, self.terminal = pty.fork()
        if self.pid == 0:
            os.chdir(folder)
            os.environ.update(PS1="ready> ", TERM="dumb", LC_ALL="C.UTF-8", HISTFILE="")
            os.execvp(command[0], command)
        self.read_until(self.prompt)

    def read_until(self, pattern, seconds=20.0):
        """What the shell writes until the pattern matches; a shell that says nothing is a failure, not a hang."""
        text = ""
        end = time.monotonic() + seconds
        while not re.search(pattern, text):
            ready = select.select([self.terminal], [], [], max(0.0, end - time.monotonic()))[0]
            if not ready:
                sys.exit(f"FAIL: {self.name} did not answer; so far: {text!r}")
            text += os.read(self.terminal, 65536).decode(errors="replace")
        return text

    def send(self, text):
        os.write(self.terminal, text.encode())

    def run(self, line, mark):
        """Runs a line that prints nothing. mark: distinguishes its prompt from the one before."""
        self.send(f"{line}; echo set-$(({mark} + 0))\n")
        self.read_until(rf"set-{mark}\s[^$]*{self.prompt}")

    def complete(self, typed):
        """The words of the line after the tabulator key, without the first."""
        self.send(typed + "\t" + "\x01printf '<%s>' \x05 END\n")
        answer = self.read_until(rf"<END>[^>]*{self.prompt}")
        return re.findall(r"<([^<>]*)>", answer[answer.rindex(f"<{typed.split()[0]}>"):])[1:-1]

    def end(self):
        self.send("exit\n")
        os.waitpid(self.pid, 0)
