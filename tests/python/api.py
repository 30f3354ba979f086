# SPDX-License-Identifier: GPL-3.0-or-later
"""The package against the command: the same numbers, and the same line where an input is wrong."""
import copy
import ctypes
import dataclasses
import datetime
import hashlib
import json
import os
import pickle
import re
import subprocess
import sys
import unittest

import hyst
import numpy as np
from hyst import _library

HYST, SOURCE, FOLDER = os.environ["HYST"], os.environ["HYST_SOURCE"], os.environ["HYST_TEST_FOLDER"]
RECORDING = os.path.join(SOURCE, "docs", "tutorial", "recording.csv")
os.makedirs(FOLDER, exist_ok=True)
os.chdir(FOLDER)


def command(*arguments):
    done = subprocess.run([HYST, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        raise hyst.Error(done.stderr.strip().removeprefix("hyst: "))
    return done.stdout


def without_origin(page):
    """A page without the section that says when and by which command it was made."""
    rest, sections = re.subn(r'<section class="origin">.*?</section>\n', "", page, flags=re.S)
    assert sections == 1
    return rest


def line_of(function, *arguments, **options):
    """The line of the failure."""
    try:
        function(*arguments, **options)
    except hyst.Error as failure:
        return str(failure)
    return "no failure"


def sha256(name):
    with open(name, "rb") as file:
        return hashlib.sha256(file.read()).hexdigest()


def document(name):
    with open(name, encoding="utf-8") as file:
        return json.load(file)


class Prototypes(unittest.TestCase):
    C_TYPES = {
        "unsigned": ctypes.c_uint,
        "int": ctypes.c_int,
        "double": ctypes.c_double,
        "size_t": ctypes.c_size_t,
        "void": None,
        "const char *": ctypes.c_char_p,
        "const char *const *": ctypes.POINTER(ctypes.c_char_p),
        "double *": ctypes.POINTER(ctypes.c_double),
        "const double *": ctypes.POINTER(ctypes.c_double),
        "const double *const *": ctypes.POINTER(ctypes.POINTER(ctypes.c_double)),
        "size_t *": ctypes.POINTER(ctypes.c_size_t),
        "const unsigned char *": ctypes.POINTER(ctypes.c_ubyte),
        "char **": ctypes.POINTER(ctypes.c_void_p),
        "hyst_host_progress_t *": _library.PROGRESS,
        "unsigned long": ctypes.c_ulong,
    }

    def c_type(self, text):
        text = re.sub(r"\s+", " ", text).strip()
        text = re.sub(r"^hyst_host_recording_t \*\w+\[[12]\]$", "hyst_host_recording_t *const *", text)
        if text in self.C_TYPES:
            return self.C_TYPES[text]
        if re.fullmatch(r"(const )?hyst_host_\w+_t \*const \*", text):
            return ctypes.POINTER(ctypes.c_void_p)
        # A handle, or a text that is the caller's.
        self.assertRegex(text, r"^((const )?hyst_host_\w+_t|char|unsigned char|void) \*$")
        return ctypes.c_void_p

    def test_are_those_of_the_header(self):
        with open(os.path.join(SOURCE, "host_tools", "interface", "hyst_interface.h"), encoding="utf-8") as file:
            header = re.sub(r"/\*.*?\*/", "", file.read(), flags=re.S)
        declared = {}
        for result, name, arguments in re.findall(r"^HYST_HOST\s+([^;]*?)\bhyst_host_(\w+)\(([^;]*)\);", header, re.M):
            types = [] if arguments == "void" else [re.sub(r"\w+$", "", a.strip()) for a in arguments.split(",")]
            declared[name] = (self.c_type(result), [self.c_type(t) for t in types])
        self.assertGreater(len(declared), 30)
        self.assertEqual(set(declared), set(_library.PROTOTYPES))
        for name, prototype in declared.items():
            self.assertEqual(_library.PROTOTYPES[name], prototype, name)


class Recordings(unittest.TestCase):
    def test_one_of_arrays_is_the_one_of_the_file(self):
        read = hyst.read(RECORDING)
        made = hyst.Recording(read.drive, read.displacement, sample_rate=read.sample_rate, start=read.start,
                              keys=read.keys)
        made.write("made.csv")
        again = hyst.read("made.csv")
        np.testing.assert_array_equal(again.drive, read.drive)
        np.testing.assert_array_equal(again.displacement, read.displacement)
        self.assertEqual(again.keys, read.keys)
        self.assertEqual(len(again.time), len(read))
        self.assertIsNone(read.reference)

    def test_time_stamps_are_understood(self):
        time = np.arange(400) / 250.0
        drive = 50 + 50 * np.sin(2 * np.pi * time)
        made = hyst.Recording(drive, 0.1 * drive, time=time, temperature=np.full(400, 21.0))
        self.assertAlmostEqual(made.sample_rate, 250.0)
        np.testing.assert_array_equal(made.column("temperature"), np.full(400, 21.0))
        gap = np.concatenate([time[:200], time[200:] + 1.0])
        self.assertIn("gap", line_of(hyst.Recording, drive, drive, time=gap))
        jitter = time + np.random.default_rng(1).uniform(-0.0012, 0.0012, 400)
        self.assertIn("resampled to even ones", hyst.Recording(drive, 0.1 * drive, time=jitter).understood)
        self.assertIn("the sample rate changes: from row 1 on",
                      line_of(hyst.Recording, drive, 0.1 * drive, time=np.logspace(-2, 3, 400)))

    def test_what_is_said_of_columns_leaves_the_header_its_keys(self):
        read = hyst.read(RECORDING, columns={"drive": "drive"})
        self.assertEqual(read.keys["drive_converter_v"], hyst.read(RECORDING).keys["drive_converter_v"])
        self.assertNotIn("drive_unit", read.keys)

    def test_dates_and_differences_are_times(self):
        drive = 50 + 50 * np.sin(2 * np.pi * np.arange(400) / 250.0)
        date = datetime.datetime(2026, 11, 30, 23, 59, 59, tzinfo=datetime.timezone.utc)
        steps = [datetime.timedelta(microseconds=4000 * k) for k in range(400)]
        for time in (np.datetime64("2026-11-30T23:59:59") + 4000000 * np.arange(400).astype("m8[ns]"),
                     [date + step for step in steps], np.array(steps, dtype="m8[us]"), steps):
            made = hyst.Recording(drive, 0.1 * drive, time=time)
            self.assertAlmostEqual(made.sample_rate, 250.0)
            self.assertEqual(made.time[0], 0.0)
        dates = np.datetime64("2026-11-30") + np.arange(400).astype("m8[s]")
        self.assertIn("dates, or differences of times", line_of(hyst.Recording, dates, drive, sample_rate=10))
        dates[7] = np.datetime64("NaT")
        self.assertIn("row 8: no time", line_of(hyst.Recording, drive, drive, time=dates))

    def test_columns_cannot_be_written_to(self):
        with self.assertRaises(ValueError):
            hyst.read(RECORDING).drive[0] = 1.0

    def test_keys_cannot_be_written_to(self):
        recording = hyst.Recording([0.0, 1.0], [0.0, 1.0], sample_rate=10, keys={"drive_between_samples": "line"})
        with self.assertRaises(TypeError):
            recording.keys["drive_between_samples"] = "held"
        other = hyst.Recording(recording.drive, recording.displacement, sample_rate=10,
                               keys={**recording.keys, "drive_between_samples": "held"})
        self.assertEqual(other.keys, {"drive_between_samples": "held"})

    def test_a_bad_key_of_a_file_is_refused_where_it_is_read(self):
        with open("banana.csv", "w", encoding="utf-8") as file:
            file.write("# sample_rate_hz: 10\n# drive_between_samples: banana\nt,drive,displacement\n0,0,0\n0.1,1,1\n")
        self.assertIn("drive_between_samples is 'banana', not held, line or smooth", line_of(hyst.read, "banana.csv"))

    def test_a_foreign_file_is_told_what_its_columns_are(self):
        with open("foreign.csv", "w", encoding="utf-8") as file:
            file.write("seconds;CH1;CH2\n" + "".join(f"{k / 100};{k % 50};{k % 50 * 2}\n" for k in range(300)))
        read = hyst.read("foreign.csv", columns={"drive": "CH2", "displacement": 2}, scales={"drive": 20.0})
        self.assertEqual(read.drive[10], 400.0)
        self.assertEqual(read.displacement[10], 10.0)
        self.assertIn("CH2", read.understood)

    def test_what_a_user_mistypes_is_answered_with_what_there_is(self):
        columns = "drive, displacement, reference, voltage, current, temperature"
        with self.assertRaisesRegex(hyst.Error, f"no column 'position': it has {columns}"):
            hyst.read(RECORDING, columns={"position": 2})
        with self.assertRaisesRegex(hyst.Error, f"no column 'position': it has {columns}"):
            hyst.Recording([0.0, 1.0], [0.0, 1.0], sample_rate=10, position=[0.0, 1.0])
        with self.assertRaisesRegex(hyst.Error, f"no column 'position': it has {columns}"):
            hyst.read(RECORDING).column("position")
        with self.assertRaisesRegex(hyst.Error, "unknown family 'preisak': there are .*preisach"):
            hyst.fit(hyst.read(RECORDING), "preisak")
        for key in "drive_unit", "displacment_unit", "sample_rate_hz":  # a file's; written, it would be read in mV
            with self.assertRaisesRegex(hyst.Error, f"header key '{key}' says what the numbers of a file are"):
                hyst.Recording(drive=[0.0, 1.0], displacement=[0.0, 1.0], sample_rate=1e3, keys={key: "mV"})
        with self.assertRaisesRegex(hyst.Error, "drive_between_samples is 'banana', not held, line or smooth"):
            hyst.Recording([0.0, 1.0], [0.0, 1.0], sample_rate=10, keys={"drive_between_samples": "banana"})
        with self.assertRaisesRegex(hyst.Error, "from_s=None: a number"):
            hyst.read(RECORDING).span(None, None)
        with self.assertRaisesRegex(hyst.Error, "start='now': a number"):
            hyst.Recording([0.0, 1.0], [0.0, 1.0], sample_rate=10, start="now")
        for said in {"sure": -1}, {"sure": 1.5}, {"seed": -1}, {"seed": 0.5}, {"samples": 0}, {"samples": 1e4}:
            (name, value), = said.items()
            with self.assertRaisesRegex(hyst.Error, f"{name}={value}: a whole number from [01] on"):
                hyst.diagnose(hyst.read(RECORDING), **said)
        with self.assertRaisesRegex(hyst.Error, "recording.mat: hyst writes no such files"):
            hyst.read(RECORDING).write("recording.mat")

    def test_options_may_be_numbers_of_numpy(self):
        with open("bare.csv", "w", encoding="utf-8") as file:
            file.write("".join(f"{k % 50},{2 * (k % 50)}\n" for k in range(300)))
        for rate in (np.int64(200), np.float32(200), np.array(200.0)):
            self.assertEqual(hyst.read("bare.csv", sample_rate=rate).sample_rate, 200.0)
        self.assertEqual(hyst.read("bare.csv", sample_rate=200, scales={"drive": np.int32(20)}).drive[3], 60.0)

    def test_missing_numbers_are_filled_only_if_asked(self):
        with open("holes.csv", "w", encoding="utf-8") as file:
            file.write("time (s),drive (V),position (um)\n" + "".join(
                f"{k / 100},{k % 50},{'OL' if k in (12, 13) else 2 * (k % 50)}\n" for k in range(300)))
        with self.assertRaises(hyst.Error) as refused:
            hyst.read("holes.csv")
        self.assertIn("line 14: 'OL' is not a number", str(refused.exception))
        read = hyst.read("holes.csv", fill_missing=True)
        self.assertEqual(list(read.displacement[11:15]), [22.0, 24.0, 26.0, 28.0])
        self.assertEqual(list(read.drive[11:15]), [11.0, 12.0, 13.0, 14.0])
        self.assertIn("the longest run is 2", read.understood)

    def test_what_is_masked_is_no_number(self):
        t = np.arange(3000) / 1000.0
        drive = 50.0 + 40.0 * np.sin(6.0 * t)
        masked = np.ma.masked_where(t == 0.007, np.where(t == 0.007, 99999.0, drive))
        no_number = "column 'drive', sample 7: not a finite number"
        self.assertIn(no_number, line_of(hyst.Recording, masked, drive, sample_rate=1000))
        self.assertIn("has no number in 1 row", line_of(hyst.Recording, masked, drive, time=t))
        self.assertIn(no_number, line_of(hyst.fit(hyst.read(RECORDING), operators=4).simulate, masked))
        whole = hyst.Recording(np.ma.masked_where(t < 0, drive), drive, sample_rate=1000)
        np.testing.assert_array_equal(whole.drive, drive)

    def test_what_cannot_be_numbers_is_refused(self):
        for wrong in ([0j, 1.0], [None, object()], ["1.0", "V"], None, hyst.read(RECORDING)):
            self.assertNotEqual(line_of(hyst.Recording, wrong, [0.0, 1.0], sample_rate=10), "no failure", wrong)
        self.assertIn("complex", line_of(hyst.Recording, np.array([0j, 1j]), [0.0, 1.0], sample_rate=10))

    def test_paths_are_whole(self):
        self.assertEqual(len(hyst.read(os.fsencode(RECORDING))), len(hyst.read(RECORDING)))
        self.assertIn("NUL", line_of(hyst.read, RECORDING + "\0b"))
        self.assertIn("a path is a int", line_of(hyst.read, 3))

    def test_xarray(self):
        read = hyst.read(RECORDING)
        data = read.to_xarray()
        self.assertEqual(data["displacement"].attrs["units"], "um")
        np.testing.assert_array_equal(data["drive"].values, read.drive)
        np.testing.assert_allclose(data["time"].values, read.time)

    def test_further_columns_are_kept(self):
        t = np.arange(200) / 1000.0
        u = 50.0 + 40.0 * np.sin(60.0 * t)
        with open("further.csv", "w", encoding="utf-8") as file:
            file.write("Time (s),Drive (V),Position (um),Chamber pressure (mbar),1st count\n")
            file.writelines(f"{a:.4f},{b:.6f},{0.1 * b:.6f},{c:.3f},{n}\n"
                            for n, (a, b, c) in enumerate(zip(t, u, 1000.0 + 3.0 * np.cos(20.0 * t))))
        recording = hyst.read("further.csv")
        self.assertEqual(recording.extra_units, {"Chamber_pressure": "mbar", "column_1st_count": ""})
        self.assertEqual(list(recording.extra), list(recording.extra_units))
        self.assertTrue(np.array_equal(recording.extra["column_1st_count"], np.arange(200)))
        with self.assertRaises(ValueError):
            recording.extra["Chamber_pressure"][0] = 1.0
        for written in ("further-again.csv", "further.h5"):
            recording.write(written)
            again = hyst.read(written)
            self.assertEqual(again.extra_units, recording.extra_units)
            for name, values in recording.extra.items():
                self.assertTrue(np.array_equal(again.extra[name], values), name)
        part = again.span(0.05, 0.1)
        self.assertTrue(np.array_equal(part.extra["column_1st_count"], np.arange(50, 100)))
        self.assertEqual(again.to_xarray()["Chamber_pressure"].attrs, {"units": "mbar"})
        self.assertEqual(hyst.Recording(u, 0.1 * u, sample_rate=1000).extra, {})

    def test_what_is_wrong_is_said_as_the_command_says_it(self):
        with open("ragged.csv", "w", encoding="utf-8") as file:
            file.write("# sample_rate_hz: 10\nt,drive,displacement\n0,1,2\n0.1,1\n")
        for path in ("nowhere.csv", "ragged.csv"):
            self.assertEqual(line_of(hyst.read, path), line_of(command, "fit", path))
        self.assertIn("sample 1: not a finite number",
                      line_of(hyst.Recording, [1, 2], [1, float("nan")], sample_rate=1))
        self.assertIn("more than 1e+06 V", line_of(hyst.Recording, [1, 2e6], [1, 1], sample_rate=1))
        self.assertIn("2 of drive, 3 of displacement", line_of(hyst.Recording, [1, 2], [1, 2, 3], sample_rate=1))
        self.assertIn("positive", line_of(hyst.Recording, [1, 2], [1, 2], sample_rate=0))
        self.assertIn("either", line_of(hyst.Recording, [1, 2], [1, 2]))
        self.assertIn("'volts'", line_of(hyst.Recording, [1, 2], [1, 2], sample_rate=1, volts=[1, 2]))
        self.assertIn("left unpacked", line_of(_library.checked, _library.lib.recording_read(b"x", b'{"tim": "t"}')))


class Models(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.recording = hyst.read(RECORDING)
        cls.model = hyst.fit(cls.recording)

    def test_exchanged_columns_are_refused(self):
        t = np.arange(3000) / 1000.0
        u = 50.0 * np.sin(12.0 * t) + 30.0 * np.sin(29.0 * t)
        plays = [0.0]
        for level in u:
            plays.append(min(max(plays[-1], level - 20.0), level + 20.0))
        y = 0.1 * u + 0.05 * np.array(plays[1:]) + 0.01 * np.random.default_rng(1).standard_normal(len(u))
        exchanged = hyst.Recording(y, u, sample_rate=1000)
        for work in (hyst.fit, hyst.diagnose):
            with self.assertRaisesRegex(hyst.Error, "are exchanged: .*; exchange them, or say columns_are_right=True"):
                work(exchanged)
        self.assertGreater(hyst.fit(exchanged, operators=4, columns_are_right=True).nrmse_percent, 1.0)
        self.assertLess(hyst.fit(hyst.Recording(u, y, sample_rate=1000), operators=4).nrmse_percent, 1.0)

    def test_a_fit_is_that_of_the_command(self):
        command("fit", RECORDING, "-o", "command.json")
        self.assertEqual(self.model.json, document("command.json"))
        self.assertEqual(self.model.blocks, ["prandtl_ishlinskii"])
        self.assertLess(self.model.nrmse_percent, 2.5)
        other = hyst.fit([self.recording], family="bouc_wen")
        self.assertEqual(other.blocks, ["bouc_wen"])
        self.assertIn("bouc_wen", hyst.families())

    def test_saved_and_loaded(self):
        self.model.save("saved.json")
        self.assertEqual(hyst.Model.load("saved.json").json, self.model.json)
        self.assertEqual(hyst.Model(self.model.json).json, self.model.json)

    def test_a_simulation_is_that_of_the_command(self):
        self.model.save("saved.json")
        command("simulate", "saved.json", RECORDING, "-o", "simulated.csv")
        np.testing.assert_array_equal(self.model.simulate(self.recording.drive, self.recording.sample_rate),
                                      hyst.read("simulated.csv").displacement)
        self.assertEqual(len(self.model.simulate([0, 1, 2])), 3)

    def test_a_simulation_of_a_recording(self):
        simulated = hyst.simulate(self.model, self.recording)
        np.testing.assert_array_equal(simulated, self.model.simulate(self.recording.drive, self.recording.sample_rate))
        np.testing.assert_array_equal(hyst.simulate(self.model, [0, 1, 2], 1000), self.model.simulate([0, 1, 2], 1000))
        self.assertIn("has its own", line_of(hyst.simulate, self.model, self.recording, 1000))

    def test_an_image_is_that_of_the_command(self):
        self.model.save("saved.json")
        options = ("--sample-rate", "10000", "--drive-range", "0:100", "--position-range", "-5:40")
        told = json.loads(command("compile", "saved.json", "-o", "image", "--json", *options))
        report = {}
        image = hyst.compile(self.model, sample_rate=10000, drive_range=(0, 100), position_range=(-5, 40),
                             report=report)
        with open("image", "rb") as file:
            self.assertEqual(image, file.read())
        self.assertEqual(report, told)

    def test_a_range_goes_up(self):
        for ends in (100, 0), (0, 0), (float("nan"), 1), (0, 1, 2), "0:100", 100:
            self.assertRegex(line_of(hyst.compile, self.model, drive_range=ends), "range|no finite number", ends)
            self.assertRegex(line_of(hyst.compile, self.model, position_range=ends), "range|no finite number", ends)
        self.assertIn("drive_range_v: from 100 to 0 is no range", line_of(hyst.compile, self.model, drive_range=(100, 0)))

    def test_zero_is_not_taken_for_no_option(self):
        self.assertIn("sample_rate_hz 0: must be positive", line_of(hyst.compile, self.model, sample_rate=0))
        self.assertIn("operators 0: must be positive", line_of(hyst.fit, self.recording, operators=0))
        self.assertIn("sample_rate_hz 0: must be positive", line_of(hyst.read, RECORDING, sample_rate=0))
        self.assertIn("scale of drive: 0", line_of(hyst.read, RECORDING, scales={"drive": 0}))

    def test_objects_of_another_class_are_refused(self):
        recording, model = self.recording, self.model
        class Other:  # has what the engine's own have
            _handle = recording._handle
        for wrong in recording, Other(), "model.json", 3:
            kind = type(wrong).__name__
            for work in (lambda: hyst.compile(wrong, sample_rate=1000), lambda: hyst.bode(recording, wrong),
                         lambda: hyst.diagnose(recording, wrong), lambda: hyst.simulate(wrong, recording)):
                self.assertEqual(line_of(work), f"{kind} is no model: hyst.fit or hyst.Model.load makes one")
        for wrong in model, Other(), "recording.csv", None:
            kind = type(wrong).__name__
            for work in (lambda: hyst.fit([wrong]), lambda: hyst.diagnose([wrong]), lambda: hyst.look([wrong])):
                self.assertEqual(line_of(work), f"{kind} is no recording: hyst.read or hyst.Recording makes one")
        for work in (hyst.fit, hyst.look, hyst.diagnose, hyst.bode):
            self.assertIn("Model is no recording", line_of(work, model))
        self.assertIn("no model", line_of(hyst.compile, None))
        self.assertIn("hyst.Model.load reads a file", line_of(hyst.Model, "model.json"))

    def test_no_handle_is_taken_in_another_way(self):
        package = os.path.dirname(hyst.__file__)
        for name in sorted(os.listdir(package)):
            if name.endswith(".py"):
                with open(os.path.join(package, name), encoding="utf-8") as file:
                    self.assertLessEqual(set(re.findall(r"(\w+)\._handle\b", file.read())), {"self"}, name)

    def test_nothing_is_freed_twice(self):
        for held in self.recording, self.model:
            for copied in copy.copy, copy.deepcopy, pickle.dumps:
                with self.assertRaisesRegex(TypeError, "cannot be copied or pickled"):
                    copied(held)

    def test_what_is_wrong_is_said_as_the_command_says_it(self):
        short = hyst.Recording(np.arange(20), np.arange(20), sample_rate=10, name="short.csv")
        short.write("short.csv")
        self.assertEqual(line_of(hyst.fit, short), line_of(command, "fit", "short.csv"))
        self.assertIn(line_of(hyst.fit, short, family="none"),
                      line_of(command, "fit", "short.csv", "--family", "none"))
        self.assertEqual(line_of(hyst.Model.load, "nowhere.json"),
                         line_of(command, "compile", "nowhere.json", "-o", "x"))
        self.assertIn("unknown block", line_of(hyst.Model, {**self.model.json, "chain": [{"block": "none"}]}))
        self.assertIn("no recording", line_of(hyst.fit, ["a.csv"]))
        self.assertIn("not reading or position", line_of(hyst.compile, self.model, follow="nothing"))


class Comparing(unittest.TestCase):
    def test_all_families_are_those_of_the_command(self):
        with open(RECORDING, encoding="ascii") as whole, open("short.csv", "w", encoding="ascii") as part:
            lines = whole.readlines()
            part.writelines(lines[:2500])
        compared = {}
        best = hyst.fit(hyst.read("short.csv"), "all", compared=compared)
        command("fit", "short.csv", "--family", "all", "-o", "best.json")
        self.assertEqual(best.blocks, hyst.Model.load("best.json").blocks)
        self.assertEqual(best.nrmse_percent, hyst.Model.load("best.json").nrmse_percent)
        self.assertEqual(list(compared), list(hyst.families()))
        self.assertIn(best, compared.values())
        failed = [family for family, model in compared.items() if isinstance(model, hyst.Error)]
        self.assertTrue(failed)
        self.assertEqual(str(compared[failed[0]]), line_of(hyst.fit, hyst.read("short.csv"), failed[0]))


class Diagnoses(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.recording = hyst.read(RECORDING)
        hyst.fit(cls.recording).save("model.json")
        cls.heard = []
        cls.answer = hyst.diagnose(cls.recording, hyst.Model.load("model.json"),
                                   progress=lambda what, fraction: cls.heard.append((what, fraction)))
        cls.printed = command("diagnose", RECORDING, "--model", "model.json", "--json", "diagnosis.json", "-o",
                              "better.json", "--report", "diagnosis.html")

    def test_it_is_that_of_the_command(self):
        self.assertEqual(self.answer.json, document("diagnosis.json"))
        self.assertEqual(str(self.answer), self.printed.replace("was written to better.json",
                                                                "hyst diagnose writes with -o BETTER.json"))
        self.assertEqual(self.answer.model.json, document("better.json"))
        saved = hyst.diagnose(self.recording, hyst.Model.load("model.json"))
        self.assertIn("No such file", line_of(saved.save, "nowhere/better.json"))
        self.assertEqual(str(saved), str(self.answer))
        os.remove("better.json")
        saved.save("better.json")
        self.assertEqual(str(saved), self.printed)
        self.assertEqual(saved.model.json, document("better.json"))
        saved.report("own.html")
        with open("own.html", encoding="utf-8") as own, open("diagnosis.html", encoding="utf-8") as other:
            self.assertEqual(without_origin(own.read()), without_origin(other.read()))

    def test_its_page_names_the_files_that_it_was_made_of_and_no_others(self):
        other = hyst.read(RECORDING)
        other.write("other.csv")
        hyst.read("other.csv").write("other.h5")
        self.answer.report("own.html")
        self.answer.model.save("other.json")
        hyst.Model.load("other.json")
        self.answer.report("own.html")
        with open("own.html", encoding="utf-8") as page:
            named = re.findall("<dd>([^<]*)<br><code>SHA-256 ([0-9a-f]+)</code>", page.read())
        self.assertEqual(named, [(name, sha256(name)) for name in (RECORDING, "model.json")])
        with open("other.h5", "rb") as file:
            written = file.read()
        self.assertIn(f"{sha256('other.csv')}  other.csv".encode(), written)
        self.assertNotIn(RECORDING.encode(), written)

    def test_its_parts(self):
        found = self.answer.findings[0]
        self.assertEqual((found.block, found.place, found.certainty), ("resonance", "mechanics", "named"))
        frequency = found.parameters["frequency_hz"]
        self.assertAlmostEqual(frequency.value, 300.0, delta=5.0)
        self.assertLess(frequency.error, 2.0)
        self.assertTrue(dataclasses.is_dataclass(found))
        self.assertLess(self.answer.after.held_out_percent, 0.3 * self.answer.before.held_out_percent)
        self.assertLess(found.error_after_percent, found.error_before_percent)
        self.assertIn("transport_delay", [block.block for block in self.answer.unseen])
        left = self.recording.displacement - self.answer.simulated("after")
        counted = slice(self.answer.first_counted(), None)
        self.assertLess(np.std(left[counted]),
                        0.5 * np.std((self.recording.displacement - self.answer.simulated("before"))[counted]))

    def test_progress_was_told(self):
        self.assertLessEqual({"fitting", "looking", "diagnosing: search", "diagnosing: account"},
                             {what for what, _ in self.heard})
        fractions = [fraction for what, fraction in self.heard
                     if what.startswith("diagnosing: ") and what != "diagnosing: account"]
        self.assertEqual(fractions, sorted(fractions))

    def test_its_picture(self):
        axes = self.answer.plot()
        self.assertEqual([axis.get_xlabel() for axis in axes], ["time, s", "drive, V"])
        axes[0].figure.savefig("diagnosis.png")
        self.recording.plot()[0].figure.savefig("recording.png")
        self.assertGreater(os.path.getsize("diagnosis.png"), 10000)

    def test_part_of_the_samples(self):
        part = hyst.diagnose(self.recording, samples=4000)
        used, = part.json["used"]
        self.assertEqual(used["of_samples"], self.recording.drive.size)
        self.assertEqual(used["samples"] // used["mean_of"], 4000)
        self.assertEqual(len(part.plot()), 2)
        with self.assertRaisesRegex(hyst.Error, "a diagnosis of 999 of the samples: it takes 1000 of each recording"):
            hyst.diagnose(self.recording, samples=999)
        for samples in 0, -1:
            with self.assertRaisesRegex(hyst.Error, f"samples={samples}: "):
                hyst.diagnose(self.recording, samples=samples)

    def test_the_script_that_the_command_writes_repeats_it(self):
        os.makedirs("script", exist_ok=True)
        odd = 'script/a "name" \u00b5.csv'
        self.recording.write(odd)
        answers = []
        options = ("--model", "model.json", "--json", "script/d.json", "-o", "script/m.json", "--report", "script/d.html",
                   "--title", "Axis 3 <\u00b5>", "--from", "0.5", "--samples", "4000")
        printed = command("diagnose", odd, *options, "--emit-python", "script/repeat.py")
        for again in (False, True):
            if again:
                for name in ("d.json", "m.json", "d.html"):
                    os.remove(os.path.join("script", name))
                self.assertEqual(subprocess.check_output([sys.executable, "script/repeat.py"], text=True), printed)
            with open("script/d.html", encoding="utf-8") as page:
                answers.append((document("script/d.json"), document("script/m.json"), without_origin(page.read())))
        self.assertEqual(answers[0], answers[1])
        self.assertIn("<title>Axis 3 &lt;\u00b5&gt;</title>", answers[0][2])
        self.assertIn("<h1>Axis 3 &lt;\u00b5&gt;</h1>\n<p class=\"note\">What the model leaves out</p>", answers[0][2])

    def test_a_title_is_of_one_page(self):
        self.answer.report("titled.html", title="Axis 3")
        self.answer.report("untitled.html")
        for name, heading in ("titled.html", "Axis 3"), ("untitled.html", "What the model leaves out"):
            with open(name, encoding="utf-8") as page:
                self.assertEqual(re.findall("<h1>(.*)</h1>", page.read()), [heading])
        self.assertIn("--title is of the page that --report writes",
                      line_of(command, "diagnose", RECORDING, "--title", "Axis 3"))

    def test_a_span_of_a_recording(self):
        part = self.recording.span(0.5, 0.75)
        kept = (self.recording.time > 0.5 - 1e-9) & (self.recording.time < 0.75 - 1e-9)
        np.testing.assert_array_equal(part.displacement, self.recording.displacement[kept])
        np.testing.assert_allclose(part.time, self.recording.time[kept], atol=1e-9)
        self.assertEqual(len(self.recording.span()), len(self.recording))
        self.assertIn("no sample from 900 to 901 s", line_of(self.recording.span, 900.0, 901.0))

    def test_the_recording_stays_as_it_was(self):
        np.testing.assert_array_equal(self.recording.displacement, hyst.read(RECORDING).displacement)

    def test_what_is_wrong_is_said_as_the_command_says_it(self):
        short = hyst.Recording(np.arange(200), np.arange(200) % 7, sample_rate=10, name="short.csv")
        short.write("short.csv")
        self.assertEqual(line_of(hyst.diagnose, short), line_of(command, "diagnose", "short.csv"))
        self.assertIn("no recordings", line_of(hyst.diagnose, []))



class Looks(unittest.TestCase):
    def test_a_look_is_that_of_the_command(self):
        recording = hyst.read(RECORDING)
        stuck = hyst.Recording(recording.drive, np.where(np.arange(len(recording.drive)) // 300 == 20, 12.0,
                                                         recording.displacement), sample_rate=recording.sample_rate)
        stuck.write("stuck.csv")
        several = [recording, hyst.read("stuck.csv")]
        looked = hyst.look(several)
        told = json.loads(command("look", RECORDING, "stuck.csv", "--json"))
        told.pop("format")
        self.assertEqual(looked.json, told)
        self.assertEqual(str(looked), command("look", RECORDING, "stuck.csv"))
        self.assertIn("stuck_samples", [fault.block for fault in looked.faults])
        self.assertIn("stuck_samples", repr(looked))
        self.assertEqual(looked.faults[0].place, "recording")

    def test_a_response_is_that_of_the_command(self):
        recording, model = hyst.read(RECORDING), hyst.fit(hyst.read(RECORDING))
        model.save("bode.json")
        told = json.loads(command("bode", RECORDING, "--model", "bode.json", "--json"))
        answer = hyst.bode(recording, model)
        self.assertEqual(answer.method, told["method"])
        for points, response in (("points", answer.measured), ("model", answer.model)):
            self.assertGreater(len(response.lag_s), 10)
            for key in ("frequency_hz", "gain_um_per_v", "phase_deg"):
                np.testing.assert_array_equal(getattr(response, key), [point[key] for point in told[points]])
        told = json.loads(command("bode", "--model", "bode.json", "--bias", "40", "--amplitude", "2", "--json"))
        alone = hyst.bode(model=model, bias=40, amplitude=2)
        np.testing.assert_array_equal(alone.measured.phase_deg, [point["phase_deg"] for point in told["points"]])
        self.assertIsNone(alone.model)
        self.assertIsNone(hyst.bode(recording).model)

    def test_what_is_wrong_is_said(self):
        short = hyst.Recording([0, 1, 2], [0, 1, 2], sample_rate=1000)
        self.assertIn("no recordings", line_of(hyst.look, []))
        self.assertIn("is no recording", line_of(hyst.look, ["file.csv"]))
        self.assertIn("is no recording", line_of(hyst.bode, "file.csv"))
        self.assertIn("needs a recording, or a model", line_of(hyst.bode))
        self.assertIn("too few", line_of(hyst.bode, short))
        self.assertIn("without a recording", line_of(hyst.bode, hyst.read(RECORDING), bias=3))


if __name__ == "__main__":
    unittest.main(verbosity=1)
