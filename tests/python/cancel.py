# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl-C in the middle of a fit or a diagnosis ends it, measured in the processor's time and not the clock's."""
import os
import signal
import threading
import time
import unittest

import hyst

RECORDING = os.path.join(os.environ["HYST_SOURCE"], "docs", "tutorial", "recording.csv")
# What goes on after the request is a column or two of what was being worked out. Several times what was seen, since on
# a machine with much to do the main thread has to wait for its turn to ask.
MOST_AFTER_S = 1.0


def interrupt(_number, _frame):
    raise KeyboardInterrupt


def cost_of(work):
    """Seconds of all processors together, and whether it was interrupted."""
    begin = time.process_time()
    try:
        work()
        interrupted = False
    except KeyboardInterrupt:
        interrupted = True
    return time.process_time() - begin, interrupted


class Cancelling(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        signal.signal(signal.SIGPROF, interrupt)  # comes when the process has worked for so long
        cls.recording = hyst.read(RECORDING)
        cls.model = hyst.fit(cls.recording)

    def check(self, work, parts):
        whole_s, _ = cost_of(work)
        times = 0
        for part in parts:
            signal.setitimer(signal.ITIMER_PROF, part * whole_s)
            try:
                cost_s, interrupted = cost_of(work)
            finally:
                signal.setitimer(signal.ITIMER_PROF, 0)
            if interrupted:  # it may have been through already, when the machine was slow at first and then fast
                times += 1
                left_s = (1.0 - part) * whole_s
                after_s = cost_s - part * whole_s
                print(f"asked after {part * whole_s:.2f} s of {whole_s:.2f} s: {after_s:.3f} s more")
                self.assertLess(after_s, min(MOST_AFTER_S, 0.5 * left_s))
        self.assertGreaterEqual(times, 1)

    def test_a_diagnosis(self):
        self.check(lambda: hyst.diagnose(self.recording), (0.05, 0.2, 0.4, 0.6))

    def test_a_diagnosis_of_a_given_chain(self):
        self.check(lambda: hyst.diagnose(self.recording, self.model), (0.15, 0.5))

    def test_a_fit(self):
        self.check(lambda: hyst.fit([self.recording] * 12, family="preisach"), (0.3,))

    def test_from_another_thread_at_any_time_of_the_look(self):
        begin = time.monotonic()
        hyst.diagnose(self.recording, self.model)
        whole_s = time.monotonic() - begin
        cancelled = 0
        for part in range(1, 31):
            asks = threading.Timer(0.006 * part * whole_s, hyst.cancel)
            asks.start()
            try:
                hyst.diagnose(self.recording, self.model)
            except hyst.Cancelled:
                cancelled += 1
            asks.join()
        self.assertGreaterEqual(cancelled, 15)

    def test_by_the_progress_function(self):
        heard = []

        def stop(what, fraction):
            heard.append(what)
            return not what.startswith("diagnosing: ") or fraction < 0.3

        with self.assertRaisesRegex(hyst.Cancelled, "^interrupted$"):
            hyst.diagnose(self.recording, progress=stop)
        self.assertIn("diagnosing: search", heard)

    def test_what_the_progress_function_raises_is_raised(self):
        def wrong(_what, _fraction):
            raise RuntimeError("of the caller")

        with self.assertRaisesRegex(RuntimeError, "of the caller"):
            hyst.diagnose(self.recording, progress=wrong)

    def test_a_progress_function_that_calls_long_work_is_refused(self):
        with self.assertRaisesRegex(hyst.Error, "^a progress function cannot do this: .*return False ends it"):
            hyst.diagnose(self.recording, progress=lambda *_: hyst.fit(self.recording))

    def test_a_progress_function_may_go_on_after_it_was_refused(self):
        def stubborn(_what, _fraction):
            with self.assertRaises(hyst.Error):
                hyst.fit(self.recording)

        self.check(lambda: hyst.diagnose(self.recording, progress=stubborn), (0.3,))

    def test_the_next_one_is_whole_again(self):
        self.assertEqual(hyst.fit(self.recording).json, self.model.json)


if __name__ == "__main__":
    unittest.main(verbosity=1)
