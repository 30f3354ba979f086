# SPDX-License-Identifier: GPL-3.0-or-later
"""extending.py SOURCE UNITY SCRATCH: docs/EXTENDING.md is true.

Copies the project into the folder SCRATCH, builds there what the recipes touch, then follows the document, section by
section: applies its marked blocks, builds, and checks what was added at work. In between it leaves out what a recipe
asks for, and expects a failure that names it. Prints how long each recipe took to build, without a compiler cache.

A marked block has an info string:

    ```c file=PATH                  the whole of a new file
    ```c file=PATH after="TEXT"     goes behind the one line that has TEXT; before="TEXT": in front of it
    ```c file=PATH replace="TEXT"   replaces that line
    ```sh run                       is run, in the copy
"""
import csv
import os
import re
import shlex
import shutil
import subprocess
import sys
import time

JOBS = "2"


def fail(text):
    sys.exit(f"extending: {text}")


def expect(condition, text):
    if not condition:
        fail(text)


def run(*command, cwd, failing=False):
    """What the command prints. It must succeed or, with `failing`, must not."""
    done = subprocess.run(command, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if (done.returncode != 0) != failing:
        fail(f"{shlex.join(command)}: exit status {done.returncode}\n{done.stdout}")
    return done.stdout


def sections(text):
    """Number of a section -> its marked blocks: (line, options, text)."""
    found, section, lines = {}, 0, text.split("\n")
    at = 0
    while at < len(lines):
        heading = re.match(r"## (\d+)\. ", lines[at])
        if heading:
            section = int(heading[1])
        if lines[at].startswith("```"):
            info, first = shlex.split(lines[at][3:]), at + 1
            at += 1
            while lines[at] != "```":
                at += 1
            options = dict(word.split("=", 1) for word in info if "=" in word)
            if options or "run" in info:
                found.setdefault(section, []).append((first, options, "\n".join(lines[first:at]) + "\n"))
        at += 1
    return found


def insert(root, line, options, text):
    """An edit of one line of a file: it must be there, and only once."""
    path = os.path.join(root, options["file"])
    how, mark = next((how, options[how]) for how in ("after", "before", "replace") if how in options)
    with open(path, encoding="utf-8") as file:
        old = file.readlines()
    places = [i for i, one in enumerate(old) if mark in one]
    expect(len(places) == 1, f"docs/EXTENDING.md:{line}: {options['file']} has {len(places)} lines with: {mark}")
    place = places[0] + (1 if how == "after" else 0)
    old[place:place + (1 if how == "replace" else 0)] = [text]
    with open(path, "w", encoding="utf-8") as file:
        file.write("".join(old))


def apply(root, blocks):
    for line, options, text in blocks:
        if not options:
            run("sh", "-ec", text, cwd=root)
        elif len(options) > 1:
            insert(root, line, options, text)
        else:
            path = os.path.join(root, options["file"])
            expect(not os.path.exists(path), f"docs/EXTENDING.md:{line}: {options['file']} is there already")
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)


def copy(source, root):
    """What belongs to the project, new files included; without git, all but build."""
    git = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "--deduplicate"],
                         cwd=source, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=False)
    if git.returncode == 0:
        for name in git.stdout.decode().split("\0"):
            if name and os.path.isfile(os.path.join(source, name)): # not what is deleted and not yet committed
                os.makedirs(os.path.dirname(os.path.join(root, name)), exist_ok=True)
                shutil.copy2(os.path.join(source, name), os.path.join(root, name))
    else:
        shutil.copytree(source, root, ignore=lambda folder, names: {"build", ".git"} & set(names) if folder == source
                        else set())


class LeftOut:
    """A file without the lines that have one of these texts, for a while."""

    def __init__(self, root, name, *texts, instead=None):
        self.path, self.texts, self.instead = os.path.join(root, name), texts, instead

    def write(self, text):
        with open(self.path, "w", encoding="utf-8") as file:
            file.write(text)

    def __enter__(self):
        with open(self.path, encoding="utf-8") as file:
            self.whole = file.read()
        text = self.whole
        for left_out in self.texts:
            expect(left_out in text, f"{self.path}: has no {left_out}")
            text = text.replace(left_out, self.instead or "")
        self.write(text)

    def __exit__(self, *unused):
        self.write(self.whole)


class Copy:
    def __init__(self, root):
        self.root, self.host, self.arm = root, os.path.join(root, "build/host"), os.path.join(root, "build/arm")
        self.hyst = os.path.join(self.host, "host_tools/hyst")
        self.times = {}

    def build(self, *targets, folder=None, failing=False):
        return run("cmake", "--build", folder or self.host, "--parallel", JOBS, "--target", *targets, cwd=self.root,
                   failing=failing)

    def timed(self, what, *targets, folder=None):
        """Adds to the time of a recipe."""
        begin = time.monotonic()
        run("cmake", folder or self.host, cwd=self.root) # or a new target is none yet
        self.build(*targets, folder=folder)
        self.times[what] = self.times.get(what, 0.0) + time.monotonic() - begin

    def text(self, name):
        with open(os.path.join(self.root, name), encoding="utf-8") as file:
            return file.read()

    def program(self, name, failing=False):
        return run(os.path.join(self.host, name), cwd=self.root, failing=failing)

    def contract(self, failing=False):
        return run(os.path.join(self.root, "tests/proof/contract"), self.hyst,
                   os.path.join(self.host, "tests/proof/proof_generate"), cwd=self.root, failing=failing)


def displacement(path):
    with open(path, encoding="utf-8") as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        return [float(row["displacement"]) for row in rows]


def check_simulation(made):
    """Twice as long as the step's instant, 0.25 s at 200 Hz: from sample 50 on the gain is 1.1 of what it was."""
    rate, count, at = 200, 100, 50
    drive = [10.0 + 40.0 * (k % 40) / 39.0 for k in range(count)]
    path = os.path.join(made.root, "recording.csv")
    with open(path, "w", encoding="utf-8") as file:
        file.write(f"# sample_rate_hz: {rate}\n# drive_unit: V\n# displacement_unit: um\nt,drive,displacement\n")
        file.writelines(f"{k / rate:.4f},{u:.6f},{0.1 * u:.6f}\n" for k, u in enumerate(drive))
    hysteresis = ('{"block": "prandtl_ishlinskii", "parameters": {"offset_um": {"value": 0.5}, '
                  '"weights": {"value": [0.08, 0.03]}, "thresholds_v": {"value": [5.0]}}}')
    step = ', {"block": "gain_step", "parameters": {"time_s": {"value": 0.25}, "gain_change": {"value": 0.1}}}'
    positions = []
    for name, chain in (("without", hysteresis), ("with", hysteresis + step)):
        model, output = (os.path.join(made.root, name + end) for end in (".json", ".csv"))
        with open(model, "w", encoding="utf-8") as file:
            file.write(f'{{"format": "hyst-model-1", "sample_rate_hz": {rate}, "chain": [{chain}]}}')
        run(made.hyst, "simulate", model, path, "-o", output, cwd=made.root)
        positions.append(displacement(output))
    for k, (without, changed) in enumerate(zip(*positions, strict=True)):
        wanted = without * (1.1 if k >= at else 1.0)
        # 1e-9: both were written with the digits that a double needs, and a position is some micrometres.
        expect(abs(changed - wanted) < 1e-9, f"gain_step: sample {k} is {changed} um, not {wanted} um")
    expect(min(positions[0]) > 0.1, "gain_step: a position of zero shows no gain")


def block(made, blocks):
    apply(made.root, blocks[:1])
    made.timed("a block", "hyst_tool")
    said = made.contract(failing=True)
    expect("block gain_step: no effect of that name" in said, f"proof_contract does not name the effect:\n{said}")
    apply(made.root, blocks[1:])
    made.timed("a block", "hyst_tool", "proof_generate", "test_host_contract", "test_proof_simulator")
    expect(re.search("^gain_step ", run(made.hyst, "blocks", cwd=made.root), re.M), "hyst blocks does not list gain_step")
    check_simulation(made)
    made.contract()
    made.program("tests/host/test_host_contract")
    made.program("tests/proof/test_proof_simulator")


def command(made, blocks):
    apply(made.root, blocks)
    made.timed("a command", "hyst_tool", "test_host_contract")
    said = run(made.hyst, "ranges", os.path.join(made.root, "recording.csv"), cwd=made.root)
    expect(said == "drive: 10 .. 50 V\ndisplacement: 1 .. 5 um\n", f"hyst ranges prints:\n{said}")
    said = run(made.hyst, "ranges", os.path.join(made.root, "nowhere.csv"), cwd=made.root, failing=True)
    expect("nowhere.csv" in said and said.count("\n") == 1, f"hyst ranges of no file prints:\n{said}")
    made.program("tests/host/test_host_contract")


def left_out(made):
    """What a block or a command leaves out is named, by the build or by host_contract."""
    with LeftOut(made.root, "host_tools/blocks/gain_step.c", ".order = 45,"):
        said = made.build("hyst_tool", failing=True)
        expect(re.search(r"block\s+gain_step\s+has\s+no\s+\.order", said), f"the build does not name .order:\n{said}")
    with LeftOut(made.root, "host_tools/blocks/gain_step.c", '.text = "gain that changes at one instant",'), \
            LeftOut(made.root, "host_tools/commands/command_ranges.c",
                    '.summary = "Print the range of every column of a recording",'):
        made.build("test_host_contract")
        said = made.program("tests/host/test_host_contract", failing=True)
        for line in ("block gain_step: no text", "command ranges: no summary"):
            expect(line in said, f"host_contract does not say: {line}\n{said}")


def register(made, blocks):
    apply(made.root, blocks)
    made.timed("a telemetry register", "hyst_tool", "registers_markdown", "test_firmware_loop")
    made.program("tests/firmware/test_firmware_loop")
    printed = made.program("firmware/registers_markdown")
    expect(re.search(r"\|[^|\n]*0x0241[^|\n]*\|[^\n]*supply_lows", printed), f"no register supply_lows:\n{printed}")
    expect("supply_lows" not in made.text("docs/REGISTERS.md"), "docs/REGISTERS.md has the register before it was written")
    made.build("registers_markdown_update")  # which also wraps its lines
    expect(printed.split() == made.text("docs/REGISTERS.md").split(), "docs/REGISTERS.md was not written anew")
    with LeftOut(made.root, "firmware/app/loop/loop_report.c", "count(&t->supply_lows, (faults & FAULT_SUPPLY) != 0);"):
        made.build("test_firmware_loop")
        said = made.program("tests/firmware/test_firmware_loop", failing=True)
        expect("test_samples_with_a_low_supply_are_counted:FAIL" in said, f"the counter is not missed:\n{said}")


def board(made, blocks):
    apply(made.root, blocks)
    made.timed("a board", "rack", folder=made.arm)
    expect(os.path.getsize(os.path.join(made.arm, "firmware/rack.elf")) > 0, "no rack.elf")
    made.build("registers_markdown")
    expect("3 h405 in a rack" in made.program("firmware/registers_markdown"), "no board 3 in the registers' document")
    with LeftOut(made.root, "firmware/boards/rack/board.cmake", "ID 3", instead="ID 1"):
        said = run("cmake", made.host, cwd=made.root, failing=True)
        expect(re.search(r"number\s+1\s+or\s+its\s+name\s+is\s+that\s+of\s+board\s+h405", said),
               f"a number that is taken is not named:\n{said}")


def check_format(made, recipes):
    """What was added is in the project's format, as the test lint_format would have it."""
    names = {options["file"] for blocks in recipes.values() for _, options, _ in blocks if options}
    run("clang-format", "--dry-run", "-Werror", *sorted(name for name in names if name.endswith(".c")),
        "tests/proof/unknown_effects.c", cwd=made.root)
    said = subprocess.run(["tests/lint/words", ".", made.host], cwd=made.root, stdout=subprocess.PIPE, text=True, check=False)
    faults = [line for line in said.stdout.splitlines() if line.startswith(tuple(names))] # others are lint_words' to find
    expect(said.stdout and not faults, "\n".join(faults))


def main():
    source, unity, scratch = (os.path.abspath(path) for path in sys.argv[1:])
    with open(os.path.join(source, "docs/EXTENDING.md"), encoding="utf-8") as file:
        recipes = sections(file.read())
    expect(sorted(recipes) == [1, 2, 3, 4], f"sections with code: {sorted(recipes)}")
    shutil.rmtree(scratch, ignore_errors=True)
    made = Copy(os.path.join(scratch, "hyst"))
    copy(source, made.root)
    for name in ("MAKEFLAGS", "MFLAGS", "MAKELEVEL"):
        os.environ.pop(name, None)
    run("cmake", "-S", made.root, "-B", made.host, "-DCMAKE_BUILD_TYPE=Debug", "-DHYST_BUILD_BOARDS=OFF",
        f"-DUNITY_ROOT={unity}", cwd=made.root)
    run("cmake", "-S", made.root, "-B", made.arm, "--toolchain", "cmake/arm-none-eabi.cmake",
        "-DCMAKE_BUILD_TYPE=Release", "-DHYST_BOARD=all", cwd=made.root)
    begin = time.monotonic()
    made.build("hyst_tool", "proof_generate", "test_host_contract", "test_proof_simulator", "registers_markdown",
               "test_firmware_loop")
    made.build("h405", folder=made.arm)
    print(f"{time.monotonic() - begin:6.1f} s  the project as it is", flush=True)
    os.environ["CCACHE_DISABLE"] = "1" # the times are a compiler's
    block(made, recipes[1])
    command(made, recipes[2])
    left_out(made)
    register(made, recipes[3])
    board(made, recipes[4])
    check_format(made, recipes)
    for what, seconds in made.times.items():
        print(f"{seconds:6.1f} s  {what}, built from the edit")
    shutil.rmtree(scratch) # some hundred megabytes; kept after a failure


if __name__ == "__main__":
    main()
