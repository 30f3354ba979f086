# SPDX-License-Identifier: GPL-3.0-or-later
"""amplifier.py AMPLIFIER: hyst.Amplifier against the command, at the simulated amplifier of tests/device."""
import json
import os
import subprocess
import sys
import threading
import time
import unittest
import warnings

import hyst

HYST, FOLDER = os.environ["HYST"], os.environ["HYST_TEST_FOLDER"]
AMPLIFIER = sys.argv.pop()
TIMEOUT_S = 2  # for an answer, on a busy machine
RANGES = {"drive_range": (0, 100), "position_range": (0, 100)}
os.makedirs(FOLDER, exist_ok=True)
os.chdir(FOLDER)


class AtTheAmplifier(unittest.TestCase):
    def setUp(self):
        self.device = subprocess.Popen([AMPLIFIER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.port = self.device.stdout.readline().split()[1]

    def tearDown(self):
        self.device.stdin.close()
        self.device.wait()
        self.device.stdout.close()

    def amplifier(self):
        return hyst.Amplifier(self.port, timeout=TIMEOUT_S)

    def command(self, name, *arguments):
        return subprocess.run([HYST, name, "--port", self.port, "--timeout", str(TIMEOUT_S), *arguments], check=True,
                              stdout=subprocess.PIPE, text=True).stdout

    def test_info_is_that_of_the_command(self):
        with self.amplifier() as amplifier:
            amplifier.record("sine", frequency=50, cycles=1, **RANGES)  # which gives it an image
            told = amplifier.info()
        said = json.loads(self.command("info", "--json"))
        self.assertEqual(told["format"], "hyst-info-1")
        self.assertEqual(told["image"]["drive_range_v"][0], 0.0)
        for part in ("format", "amplifier", "image"):
            self.assertEqual(told[part], said[part])
        for part in ("now", "counters"):
            self.assertEqual(told[part].keys(), said[part].keys())
        self.assertLess(told["counters"]["samples"], said["counters"]["samples"])

    def of_the_command(self, *arguments):
        self.command("record", "--drive-range", "0:100", "--position-range", "0:100", "--no-condition", *arguments,
                     "-o", "command.csv")
        return hyst.read("command.csv")

    def expect_the_same(self, arguments, **options):
        """The same waveform in as many samples; the drives are those of two runs, to a code."""
        with self.amplifier() as amplifier:
            mine = amplifier.record(condition=False, **options, **RANGES)
        said = self.of_the_command(*arguments)
        self.assertEqual(mine.keys["waveform"], said.keys["waveform"])
        self.assertEqual(len(mine.drive), len(said.drive))
        self.assertLess(abs(mine.drive - said.drive).max(), 0.01)
        return mine

    def test_a_sweep_is_that_of_the_command(self):
        arguments = ("--waveform", "sweep", "--frequency", "5", "--end-frequency", "80", "--sweep-time", "0.5")
        options = {"waveform": "sweep", "frequency": 5, "end_frequency": 80, "sweep_time": 0.5}
        logarithmic = self.expect_the_same(arguments, **options)
        linear = self.expect_the_same((*arguments, "--linear"), linear=True, **options)
        shorter = min(len(logarithmic.drive), len(linear.drive))
        self.assertGreater(abs(logarithmic.drive[:shorter] - linear.drive[:shorter]).max(), 10)

    def test_a_multisine_is_that_of_the_command(self):
        arguments = ("--waveform", "multisine", "--frequency", "10", "--end-frequency", "200", "--cycles", "3")
        options = {"waveform": "multisine", "frequency": 10, "end_frequency": 200, "cycles": 3}
        many = self.expect_the_same((*arguments, "--tones", "9"), tones=9, **options)
        few = self.expect_the_same((*arguments, "--tones", "2"), tones=2, **options)
        self.assertGreater(abs(many.drive - few.drive).max(), 1)

    def test_a_track_of_a_sweep(self):
        with self.amplifier() as amplifier:
            amplifier.record("sine", frequency=50, cycles=1, condition=False, **RANGES)
            track = amplifier.track("sweep", "linear", frequency=5, end_frequency=40, sweep_time=0.5, amplitude=20,
                                    offset=50, condition=False)
        self.assertIn("sweep", track.recording.keys["waveform"])
        self.assertIn("40", track.recording.keys["waveform"])

    def play(self, silence="30"):
        """Leaves it playing in mode compensate. Its actuator follows the drive one to one, as a new image has it."""
        with self.amplifier() as amplifier:
            amplifier.record("sine", frequency=50, cycles=1, condition=False, **RANGES)
        self.command("play", "--waveform", "sine", "--frequency", "20", "--amplitude", "20", "--offset", "50",
                     "--no-condition", "--silence", silence)

    def fails_to_disarm(self, run):
        """What is kept of a run whose requests to disarm are all lost."""
        with self.amplifier() as amplifier:
            amplifier.record("sine", frequency=50, cycles=1, condition=False, **RANGES)
            self.device.stdin.write("disarms 3\n")  # as many as are tried
            self.device.stdin.flush()
            with self.assertRaisesRegex(hyst.Error, "is complete, but the amplifier was not disarmed") as raised:
                run(amplifier)
            good = amplifier.record("sine", frequency=50, cycles=1, condition=False, **RANGES)
        self.assertEqual(len(good.drive), 200)
        return raised.exception.recordings

    def test_a_complete_recording_is_kept_if_the_amplifier_cannot_be_disarmed(self):
        (kept,) = self.fails_to_disarm(lambda amplifier: amplifier.record("sine", frequency=10, cycles=2, **RANGES))
        self.assertEqual(len(kept.drive), 2000)
        (kept,) = self.fails_to_disarm(lambda amplifier: amplifier.track("sine", "both", frequency=10, cycles=2))
        self.assertEqual(len(kept.reference), 2000)

    def test_what_fails_before_it_is_complete_keeps_nothing(self):
        with self.amplifier() as amplifier:
            amplifier.record("sine", frequency=50, cycles=1, condition=False, **RANGES)
            with self.assertRaises(hyst.Error) as raised:
                amplifier.record("sine", frequency=1e9, cycles=2, **RANGES)
        self.assertEqual(raised.exception.recordings, ())

    def moves_the_sensor_by(self, micrometres):
        self.device.stdin.write(f"{round(micrometres / 100 * 65536)}\n")
        self.device.stdin.flush()

    def test_a_watch_without_a_warning(self):
        self.play()
        with self.amplifier() as amplifier:
            self.assertIsNone(amplifier.watch(seconds=3))
            before = amplifier.now()
            self.assertEqual((before["mode"], before["state"]), ("compensate", "playing"))

    def test_a_watch_warns(self):
        self.play()
        with self.amplifier() as amplifier:
            later = threading.Timer(1.0, self.moves_the_sensor_by, (5.0,))
            later.start()
            warning = amplifier.watch(limit=1.0, time=0.3, before=0.8, after=0.4)
            later.join()
            self.assertEqual(amplifier.now()["state"], "playing")
        self.assertEqual(warning.limit_um, 1.0)
        self.assertLess(warning.usual_um, 0.1)
        recording = warning.recording
        self.assertAlmostEqual(recording.time[-1] - recording.time[0], 1.2, delta=0.01)
        self.assertAlmostEqual(warning.warned_s, 0.8, delta=0.01)
        error = recording.displacement - recording.reference
        # Above the limit for 0.3 s, which are three blocks of 0.102 s; the first of them may have begun before.
        moved_s = recording.time[abs(error) > 2.5][0] - recording.time[0]
        self.assertTrue(0.2 <= warning.warned_s - moved_s <= 0.42, moved_s)
        self.assertAlmostEqual(error[-1], 5.0, delta=0.1)
        self.assertLess(abs(error[0]), 0.1)

    def test_a_watch_is_cancelled_from_another_thread(self):
        self.play()
        with self.amplifier() as amplifier:
            threading.Timer(1.0, amplifier.cancel).start()
            with self.assertRaises(hyst.Cancelled):
                amplifier.watch()
            self.assertEqual(amplifier.now()["state"], "playing")  # it has moved nothing, and stops nothing

    def in_another_thread(self, amplifier):
        """A run of 40 s of the amplifier's time that has begun to play. Returns what it comes to, and its thread."""
        outcome, playing = [], threading.Event()

        def heard(what, _fraction):
            if what == "playing":
                playing.set()

        def work():
            try:
                outcome.append(amplifier.record("sine", frequency=1, cycles=400, condition=False, progress=heard, **RANGES))
            except hyst.Error as failure:
                outcome.append(failure)

        thread = threading.Thread(target=work)
        thread.start()
        self.assertTrue(playing.wait(60))
        return outcome, thread

    def expect_cancelled(self, outcome, thread):
        thread.join()
        self.assertIsInstance(outcome[0], hyst.Cancelled, outcome)
        self.assertIn("the drive is stopped and parked", str(outcome[0]))

    def test_what_ends_a_run_in_another_thread_ends_it_at_once(self):
        def cancel_and_look(amplifier):
            amplifier.cancel()
            return amplifier.now()

        def cancel_and_park(amplifier):
            amplifier.cancel()
            return amplifier.park()

        ends = hyst.Amplifier.stop, hyst.Amplifier.park, cancel_and_look, cancel_and_park
        with self.amplifier() as amplifier:
            for end in ends:
                outcome, thread = self.in_another_thread(amplifier)
                told = end(amplifier)
                self.expect_cancelled(outcome, thread)
                self.assertEqual(told["state"], "parked")

    def test_a_run_that_waits_is_cancelled_too(self):
        with self.amplifier() as amplifier:
            outcome, thread = self.in_another_thread(amplifier)
            waiting = []

            def wait():
                try:
                    waiting.append(amplifier.record("sine", frequency=1, cycles=400, **RANGES))
                except hyst.Error as failure:
                    waiting.append(failure)

            second = threading.Thread(target=wait)
            second.start()
            time.sleep(0.3)
            amplifier.stop()
            self.expect_cancelled(outcome, thread)
            second.join()
            self.assertEqual(str(waiting[0]), "interrupted before it began")

    def test_closing_ends_a_run_first(self):
        amplifier = self.amplifier()
        outcome, thread = self.in_another_thread(amplifier)
        amplifier.close()
        self.expect_cancelled(outcome, thread)
        self.assertEqual(json.loads(self.command("info", "--json"))["now"]["state"], "parked")
        with self.assertRaisesRegex(hyst.Error, "the amplifier's port is closed"):
            amplifier.now()

    def test_leaving_the_block_ends_a_run(self):
        with self.amplifier() as amplifier:
            outcome, thread = self.in_another_thread(amplifier)
        self.expect_cancelled(outcome, thread)

    def test_a_progress_function_does_not_work_with_the_amplifier(self):
        calls = hyst.Amplifier.now, hyst.Amplifier.stop, hyst.Amplifier.close, lambda _: hyst.fit([])
        with self.amplifier() as amplifier:
            for call in calls:
                with self.assertRaisesRegex(hyst.Error, "a progress function cannot do this|no recordings"):
                    amplifier.record("sine", frequency=1, cycles=400, progress=lambda *_: call(amplifier), **RANGES)
                self.assertEqual(amplifier.now()["state"], "parked")

    def test_ranges_that_contradict_the_image_are_told(self):
        with self.amplifier() as amplifier:
            first = amplifier.record("sine", frequency=50, cycles=1, condition=False, **RANGES)
            with self.assertWarnsRegex(UserWarning, "--drive-range 0:200, where the image in force says 0:100 V"):
                second = amplifier.record("sine", frequency=50, cycles=1, condition=False, drive_range=(0, 200))
        self.assertNotIn("contradiction", first.keys)
        self.assertIn("0:200", second.keys["contradiction"])

    def test_the_fault_that_a_run_leads_out_of_is_told(self):
        runs = (lambda amplifier: amplifier.record("sine", frequency=50, cycles=1, condition=False),
                lambda amplifier: amplifier.track("sine", frequency=50, cycles=1, condition=False), hyst.Amplifier.stop)
        for run in runs:
            self.play("0.2")
            time.sleep(0.6)  # without a request: its communication timeout passes
            with self.amplifier() as amplifier:
                with self.assertWarnsRegex(UserWarning, r"^the amplifier had tripped \(communication timeout\)") as told:
                    run(amplifier)
                self.assertEqual(os.path.basename(told.filename), "amplifier.py")
                self.assertEqual(os.path.dirname(os.path.abspath(told.filename)), os.path.dirname(os.path.abspath(__file__)))
                with warnings.catch_warnings():
                    warnings.simplefilter("error")
                    run(amplifier)

    def test_a_run_that_is_refused_leads_out_of_no_fault(self):
        self.play("0.2")
        time.sleep(0.6)
        with self.amplifier() as amplifier, warnings.catch_warnings():
            warnings.simplefilter("error")
            with self.assertRaisesRegex(hyst.Error, "cannot be played"):
                amplifier.record("sine", frequency=6000)

    def of_the_future(self):
        """The amplifier, with a register map of a version that is unknown here."""
        self.device.stdin.write("map\n")
        self.device.stdin.flush()
        self.assertEqual(self.device.stdout.readline(), "map\n")
        return self.amplifier()

    def test_what_makes_safe_takes_any_register_map(self):
        unknown = {"mode": None, "state": None}
        for halt, left in (hyst.Amplifier.stop, "idle"), (hyst.Amplifier.park, "parked"):
            self.play()
            amplifier = self.of_the_future()
            self.assertEqual(halt(amplifier), unknown)
            amplifier.close()
            self.assertEqual(json.loads(self.command("info", "--json"))["now"]["state"], left)
        self.play()
        with self.of_the_future():
            pass
        self.command("park", "--off")
        self.assertEqual(json.loads(self.command("info", "--json"))["now"]["amplifier_state"], "off")

    def test_all_else_wants_a_register_map_that_is_known(self):
        calls = (hyst.Amplifier.now, hyst.Amplifier.info, hyst.Amplifier.pull, lambda amplifier: amplifier.push(image),
                 lambda amplifier: amplifier.record("sine", frequency=50, **RANGES),
                 lambda amplifier: amplifier.track("sine", frequency=50), lambda amplifier: amplifier.watch(seconds=1))
        self.play()
        with self.amplifier() as amplifier:
            image = amplifier.pull()
        with self.of_the_future() as amplifier:
            for call in calls:
                with self.assertRaisesRegex(hyst.Error, r"register map version 5 is unknown here \(known: 4\): upgrade hyst$"):
                    call(amplifier)

    def test_what_cannot_be_played_is_refused_before_it_moves(self):
        with self.amplifier() as amplifier:
            amplifier.record("sine", frequency=50, cycles=1, condition=False, **RANGES)
            for options in {"frequency": 5000}, {"frequency": 6000}, {"frequency": 1e9}:
                with self.assertRaisesRegex(hyst.Error, "^[^;]* cannot be played at 10000 samples per second: only below half of that$"):
                    amplifier.record("sine", **options)
            with self.assertRaisesRegex(hyst.Error, "^[^;]*fewer than two samples$"):
                amplifier.track("sine", frames=1)
            with self.assertRaisesRegex(hyst.Error, "^--frames -1: 0 or more$"):
                amplifier.track("sine", frames=-1)

    def test_a_progress_function_ends_a_run_and_no_signal_did(self):
        with self.amplifier() as amplifier:
            with self.assertRaisesRegex(hyst.Cancelled, r"^interrupted \(by the program\); the drive is stopped and parked$"):
                amplifier.record("sine", frequency=1, cycles=400, condition=False, progress=lambda *_: False, **RANGES)

    def test_the_end_of_the_block_switches_off(self):
        self.play()
        with self.amplifier():
            pass
        with self.amplifier() as amplifier:
            self.assertEqual(amplifier.info()["now"]["amplifier_state"], "off")

    def test_ranges_that_go_down_are_refused(self):
        with self.amplifier() as amplifier:
            for ends in (100, 0), (0, 0), (5, 5):
                with self.assertRaisesRegex(hyst.Error, f"drive_range_v: from {ends[0]} to {ends[1]} is no range"):
                    amplifier.record("sine", frequency=50, drive_range=ends, position_range=(0, 100))
            with self.assertRaisesRegex(hyst.Error, r"drive_range=100: a range is \(low, high\)"):
                amplifier.record("sine", frequency=50, drive_range=100)
            with self.assertRaisesRegex(hyst.Error, "no finite number"):
                amplifier.record("sine", frequency=float("nan"))
            with self.assertRaisesRegex(hyst.Error, "Recording is no image"):
                amplifier.push(hyst.Recording([0.0, 1.0], [0.0, 1.0], sample_rate=10))
            with self.assertRaisesRegex(hyst.Error, "nowhere.image: No such file"):
                amplifier.push("nowhere.image")

    def test_what_is_wrong_is_said_as_the_command_says_it(self):
        with self.amplifier() as amplifier:
            with self.assertRaisesRegex(hyst.Error, "tones"):
                amplifier.record("multisine", frequency=10, end_frequency=200, tones=17, **RANGES)
            with self.assertRaisesRegex(hyst.Error, "end-frequency"):
                amplifier.record("sweep", frequency=10, end_frequency=-1, **RANGES)
            with self.assertRaisesRegex(hyst.Error, "--times 1: must be above 1"):
                amplifier.watch(times=1)
            with self.assertRaisesRegex(hyst.Error, "--for -5: must not be negative"):
                amplifier.watch(seconds=-5)
            with self.assertRaisesRegex(hyst.Error, "the record up to 600 s"):
                amplifier.watch(after=1000)


unittest.main()
