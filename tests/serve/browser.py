# SPDX-License-Identifier: GPL-3.0-or-later
"""browser.py HYST ELF ACTUATOR SCRATCH: a day at the live page, in Chromium.

ACTUATOR is docs/tutorial/actuator.json, beside which its recording lies.

The amplifier is emulated; between it and the server lies a line that can be cut. The day goes by clicks on a wide light
page, then by the keyboard alone on a dark one of 390 px. It waits for what the page shows, never for a time. SCRATCH
gets a series of screenshots. Exits with 77 where there is no Chromium, chromedriver or Selenium.
"""
import os
import re
import shutil
import subprocess
import sys
import time

from cable import Cable
from chromium import drop_profile # ends here where there is none
from opened_page import PATIENCE_S, OpenedPage
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select

TIMEOUT_S = "1.5" # for an answer of the emulator, which pauses there
NARROW, MIDDLE, WIDE = (390, 844), (500, 900), (1280, 900)
OLD_S = 1740000000 # in February 2025


def start(command, pattern, log):
    """The process, in the folder of its log, and what the pattern finds in its first lines."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=open(log, "w", encoding="utf-8"), text=True,
                               cwd=os.path.dirname(log))
    for line in process.stdout:
        found = re.search(pattern, line)
        if found:
            return process, found[1]
    sys.exit(f"FAIL: {command[1]} said nothing: " + open(log, encoding="utf-8").read())


def by_clicks(page):
    page.shape(WIDE, "light")
    page.until_page(server="open", line="connected", control="yes")
    page.expect("#now-drive", "no scale yet")
    page.picture("opened")

    # A file from elsewhere, which does not say what its displacement is.
    page.fill("import", file="scope.txt", drive="CH1", displacement="CH2")
    page.click("#import [value=look]")
    page.result("import", "false")
    page.expect("#result-text", "^import has failed: .*in V: say how many um that is")
    if os.path.basename(page.folder) in page.text("#job-text"):
        page.fail("what the command printed has the folder before each name")
    page.picture("import-refused", "#result")
    page.fill("import", displacement_scale="5")
    page.forget_result()
    page.click("#import [value=look]")
    page.result("import")
    page.expect("#job-text", "stroke 49.5 um")
    if os.path.exists(f"{page.folder}/scope.h5"):
        page.fail("a look at a file has written a recording")
    page.forget_result()
    page.click("#import .go")
    page.result("import")
    page.until("the recording may be fitted", lambda: page.value("#fit [name=recording]") == "scope.h5")
    page.until_shown("scope.h5")
    page.picture("imported", "#result")

    bringing(page)
    exchanged(page)

    # A record that is stopped, then one to its end.
    page.fill("record", waveform="sine", frequency="2", cycles="1000", frames="1000")
    page.click("#record .go")
    page.until_page(run="record")
    page.expect("#now-state", "conditioning|playing")
    page.click("#stop")
    page.result("record", "false")
    page.expect("#message", "the amplifier took it after")
    page.expect("#result-text", "stopped.*parked")
    page.expect("#now-state", "parked")
    page.picture("stopped-while-recording", "main")
    page.forget_result()
    page.fill("record", waveform="triangle", cycles="3")
    page.click("#record .go")
    page.until("it records", lambda: page.text("#now-state") == "playing" or not page.has(run="record"))
    page.picture("recording", "main")
    page.result("record")
    page.until_shown("record.csv")
    page.picture("recorded", "#result")

    page.click("#fit .go")
    page.result("fit")
    page.expect("#job-text", "held out.*NRMSE")
    page.picture("fitted", "#result")
    page.click("#compile .go")
    page.result("compile")
    page.click("#push .go")
    page.result("push")
    page.expect("#amplifier", "is in force")
    page.fill("track", frequency="2", cycles="2", frames="500")
    page.click("#track .go")
    page.result("track")
    times = re.search(r"([\d.]+) times less", page.text("#result-text"))
    if not times or float(times[1]) < 1.5:
        page.fail("the compensation does not help")
    page.until_shown("track-linear.csv track-compensate.csv")
    page.picture("tracked", "#result")
    page.picture("before-and-after", "#compare")


def scope(path=None):
    """3 V a step, and 0.1 V of a sensor. The text, also written to a file."""
    text = "s;CH1 (V);CH2 (V)\n" + "".join(f"{k / 500:.3f};{3 * (k % 100)};{(k % 100) / 10:.2f}\n" for k in range(400))
    if path:
        with open(path, "w", encoding="ascii") as file:
            file.write(text)
    return text


def bringing(page):
    """Files of this computer: chosen, dropped, and refused. What is in the last one is said by itself."""
    there = f"{page.scratch}/TEK 0001.CSV", f"{page.scratch}/other.html", f"{page.scratch}/of hyst.csv"
    for path in there:
        scope(path)
    page.forget_result()
    page.browser.find_element(By.CSS_SELECTOR, "#upload [name=files]").send_keys(there[0])
    page.result("import", "false")
    page.expect("#result-text", "^import has failed: .*in V: say how many um that is")
    if page.value("#import [name=file]") != "TEK_0001.CSV":
        page.fail("what was brought is not chosen")
    page.picture("brought", "#upload")
    page.browser.find_element(By.CSS_SELECTOR, "#upload [name=files]").send_keys(there[1])
    page.expect("#message", "other.html.*ending")
    if page.value("#fit [name=recording]") == "TEK_0001.CSV":
        page.fail("what does not say its displacement is proposed for a fit")
    shutil.copy(f"{page.folder}/tutorial.csv", there[2]) # which says itself what it is
    page.forget_result()
    page.browser.find_element(By.CSS_SELECTOR, "#upload [name=files]").send_keys(there[2])
    page.result("import")
    page.until("it may be fitted", lambda: page.value("#fit [name=recording]") == "of_hyst.csv")
    page.until_shown("of_hyst.csv")
    os.remove(f"{page.folder}/of_hyst.csv")
    page.forget_result()
    page.script("""const data = new DataTransfer();
        for (const name of ["dropped.txt", "TEK 0001.CSV"]) { data.items.add(new File([arguments[0]], name)); }
        for (const kind of ["dragover", "drop"]) {
          document.querySelector("main").dispatchEvent(
              new DragEvent(kind, { dataTransfer: data, bubbles: true, cancelable: true }));
        }""", scope())
    page.result("import", "false")
    if page.value("#import [name=file]") != "TEK_0001-2.CSV":
        page.fail("what was dropped last is not chosen")
    page.until_page(upload="idle")
    for name in ("TEK_0001.CSV", "dropped.txt", "TEK_0001-2.CSV"):
        with open(f"{page.folder}/{name}", encoding="ascii") as file:
            if file.read() != scope():
                page.fail(f"{name} is not what was brought")
    if os.path.exists(f"{page.folder}/other.html"):
        page.fail("a page of elsewhere is in the folder")


def exchanged(page):
    """A recording whose columns look exchanged is refused; then, and only for it, the page may insist."""
    box = page.browser.find_element(By.CSS_SELECTOR, "#fit [name=columns_are_right]")

    def wish():
        return page.script("return requests.fit(document.getElementById('fit').elements).columns_are_right")

    with open(f"{page.folder}/tutorial.csv", encoding="ascii") as file, \
            open(f"{page.folder}/turned.csv", "w", encoding="ascii") as turned:
        for line in file:
            cells = line.rstrip("\n").split(",")
            if line[0] not in "#t":
                cells[1], cells[2] = cells[2], cells[1]
            turned.write(",".join(cells) + "\n")
    page.forget_result()
    page.browser.find_element(By.CSS_SELECTOR, "#upload [name=files]").send_keys(f"{page.folder}/turned.csv")
    page.result("import")
    if box.is_displayed():
        page.fail("the page offers to insist on columns that nothing was said about")
    page.forget_result()
    page.fill("fit", recording="turned-2.csv")
    page.click("#fit .go")
    page.result("fit", "false")
    page.expect("#result-text", "are exchanged")
    page.until("the page offers to insist", box.is_displayed)
    box.click()
    if wish() is not True:
        page.fail("a page that insists does not say so")
    page.picture("columns-refused", "#fit")
    page.fill("fit", recording="tutorial.csv")
    if box.is_displayed() or wish() is not False:
        page.fail("the page insists on the columns of another recording, too")
    for name in ("turned.csv", "turned-2.csv"):
        os.remove(f"{page.folder}/{name}")


def comparing(page):
    """The form below the runs: what it shows, a model's answer, and a report of two runs."""
    page.fill("compare", a="record.csv", b="")
    page.click("#compare form:not([id]) .go")
    page.until_shown("record.csv")
    if "A: record.csv" not in page.text("#compare-table") or "B:" in page.text("#compare-table"):
        page.fail(f"A alone: {page.text('#compare-table')}")
    page.click("#compare summary")
    page.script("document.querySelector('#simulate [name=model]').value = ''") # the test chooses
    page.fill("simulate", model="model.json", recording="record.csv")
    page.click("#simulate [value=simulate]")
    page.result("simulate")
    page.until_shown("simulated.csv")
    # A simulation has what was measured as its reference: the model's error is the fit's.
    if not re.search(r"A: simulated.csv\s+[\d.]+ %", page.text("#compare-table")):
        page.fail(f"no error of the simulation: {page.text('#compare-table')}")
    page.fill("compare", a="track-linear.csv", b="track-compensate.csv")
    page.click("#simulate [value=report]")
    page.result("report")
    page.expect("#report-link", "report.html")
    page.in_the_report("The tracking error falls")
    page.picture("report-of-a-and-b", "#report")


# In each column of a plot, how much of the height between its highest and lowest pixel of this colour is of it; 0 where
# there is nearly nothing of it. A line from snapshot to snapshot is a few pixels high there.
FILLED = """
    const canvas = document.querySelector(arguments[0]), c = canvas.getContext("2d");
    const ink = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
    ink.fillStyle = getComputedStyle(canvas).getPropertyValue(arguments[1]);
    ink.fillRect(0, 0, 1, 1);
    const [r, g, b] = ink.getImageData(0, 0, 1, 1).data;
    const { data, width, height } = c.getImageData(0, 0, canvas.width, canvas.height);
    let top = height, bottom = 0;
    const counts = [];
    for (let x = 52; x < width - 10; x++) {
      let count = 0;
      for (let y = 20; y < height - 22; y++) { // below the legend
        const i = 4 * (y * width + x);
        if (Math.abs(data[i] - r) + Math.abs(data[i + 1] - g) + Math.abs(data[i + 2] - b) < 60) {
          count++;
          top = Math.min(top, y);
          bottom = Math.max(bottom, y);
        }
      }
      counts.push(count);
    }
    return counts.map((count) => bottom > top + 50 ? count / (bottom - top + 1) : 0);
"""


def ripple(page):
    """A sine of two periods a column: the envelope fills whole columns, which twenty snapshots a second cannot. A busy
    machine may look for it too late; then it is played again."""
    def filled():
        return sum(share > 0.6 for share in page.script(FILLED, "#plot-drive", "--drive")) >= 60

    Select(page.browser.find_element(By.ID, "window")).select_by_value("5")
    page.fill("record", waveform="sine", frequency="237", cycles="2400", frames="3000", name="ripple")
    for _ in range(3):
        page.forget_result()
        page.click("#record .go")
        page.until_page(run="record")
        page.until("the envelope fills the plot of the drive", lambda: filled() or not page.has(run="record"))
        if filled():
            break
        page.result("record")
    else:
        page.fail("no envelope of a sine of 237 Hz was to be seen")
    # Of fewer than twenty samples a period lines would be a scribble. How many there are is the line's affair.
    page.until("the loop is no scribble", lambda: page.script("""const end = rows.count - 1;
        return plots.loop.series[0].dots || 200 / (rows.t[end] - rows.t[end - 200]) > 15 * 237"""))
    page.picture("ripple", "main")
    page.result("record")
    # The page shows each frame that the server read. The server reads half as many after each loss on the line: a busy
    # machine may lose some, once or twice.
    gaps, losses = (page.script(f"return Number(document.body.dataset.{name} || 0)") for name in ("gaps", "losses"))
    if gaps != losses or losses > 2:
        page.fail(f"the stream had {gaps} gaps, and the line to the amplifier {losses} losses")
    Select(page.browser.find_element(By.ID, "window")).select_by_value("15")


def second_viewer(page):
    first = page.browser.current_window_handle
    page.browser.switch_to.new_window("tab")
    page.browser.get(page.address)
    page.shape(WIDE, "light")
    page.until_page(server="open", line="connected", control="no")
    page.expect("#now-drive", r"\d V")
    if page.browser.find_element(By.CSS_SELECTOR, "#record .go").is_enabled():
        page.fail("the second viewer may record")
    if page.browser.find_element(By.CSS_SELECTOR, "#upload [name=files]").is_enabled():
        page.fail("the second viewer may bring files")
    if not page.browser.find_element(By.ID, "stop").is_enabled():
        page.fail("the second viewer cannot stop")
    page.picture("second-viewer")
    page.browser.close()
    page.browser.switch_to.window(first)


def list_of_files(page):
    """In a window beside another one no button is cut off; a file of another day has its date."""
    page.shape(MIDDLE, "light")
    if page.script("""return [...document.querySelectorAll("#files button")].some((b) =>
            b.getBoundingClientRect().right > b.closest(".scroll").getBoundingClientRect().right)"""):
        page.fail("a button of a file is cut off")
    row = page.script("""return [...document.querySelectorAll("#files tr")].find((r) =>
        r.innerText.startsWith("scope.txt")).innerText""")
    if "2025" not in row:
        page.fail(f"no date of an old file: {row!r}")


def by_keyboard(page, cable):
    list_of_files(page)
    page.shape(NARROW, "light")
    page.picture("narrow-light", "main")
    page.picture("narrow-light-work", "#steps-title")
    page.picture("narrow-light-compare", "#compare")
    page.shape(NARROW, "dark")
    page.picture("narrow-dark", "main")
    page.forget_result()

    page.tab_to("#upload [name=files]") # from there on its chooser is the browser's

    # Record and fit.
    page.choose("#record [name=waveform]", "staircase")
    page.type_in("#record [name=frequency]", "2")
    page.type_in("#record [name=cycles]", "2")
    page.type_in("#record [name=frames]", "1000")
    page.type_in("#record [name=name]", "keys")
    page.tab_to("#record .go")
    page.keys(Keys.ENTER)
    page.result("record")
    page.until("its recording is proposed", lambda: page.value("#fit [name=recording]") == "keys.csv")
    page.choose("#fit [name=recording]", "record.csv")
    page.tab_to("#fit .go")
    page.keys(Keys.ENTER)
    page.result("fit")
    page.until("its model is proposed", lambda: page.value("#compile [name=model]") == "model-2.json")
    page.forget_result()

    # A track, stopped beside a line that is cut.
    page.choose("#track [name=waveform]", "sine")
    page.type_in("#track [name=cycles]", "1000")
    page.tab_to("#track [name=condition]")
    page.keys(Keys.SPACE)
    page.tab_to("#track .go")
    page.picture("focus")
    page.keys(Keys.ENTER)
    page.expect("#now-state", "playing")

    # The line is cut while it plays.
    cable.cut = True
    page.until_page(line="cut")
    page.expect("#banner", "is cut")
    page.picture("line-cut", "main")
    time.sleep(3.0)  # the amplifier's own second has to pass, and beside other tests its emulator is slower than time
    page.keys(Keys.ESCAPE)
    cable.cut = False
    page.until_page(line="connected")
    page.result("track", "false")
    page.expect("#message", "the amplifier took it after")
    page.expect("#now-state", "parked")
    page.expect("#now-faults", "communication") # it heard of no master for longer than a second
    page.picture("line-is-back", "main")
    clear_fault(page)

    # What does the model leave out? Of a long recording, cancelled; then of the short one.
    page.forget_result()
    page.choose("#diagnose [name=recording]", "tutorial.csv")
    page.tab_to("#diagnose .go")
    page.keys(Keys.ENTER)
    page.until_page(job="diagnose")
    page.tab_to("#cancel")
    page.keys(Keys.ENTER)
    page.expect("#result-text", "was cancelled")
    page.forget_result()
    page.choose("#diagnose [name=recording]", "record.csv")
    page.tab_to("#diagnose .go")
    page.keys(Keys.ENTER)
    page.until_page(job="diagnose")
    page.picture("diagnosing", "#result")
    page.result("diagnose")
    page.expect("#report-link", "diagnosis")
    page.in_the_report("held out")
    page.picture("diagnosis", "#report")

    # The better model goes into the amplifier.
    before = page.text("#amplifier")
    page.until("the better model is proposed", lambda: page.value("#compile [name=model]") == "diagnosis.json")
    for step in ("compile", "push"):
        page.tab_to(f"#{step} .go")
        page.keys(Keys.ENTER)
        page.result(step)
    page.expect("#result-text", "in force, and read back the same")
    page.until("the page says which model", lambda: page.text("#amplifier") not in ("", before))
    page.picture("better-model", "main")
    page.picture("files", "#files")


def clear_fault(page):
    page.tab_to("#clear button")
    page.keys(Keys.ENTER)
    page.result("clear")
    page.expect("#now-faults", "^none")
    page.until("there is nothing to clear", lambda: not page.browser.find_element(By.ID, "clear").is_displayed())


def fault(page, cable):
    """Another master drives the amplifier and falls silent: a fault, which the page shows and clears."""
    page.forget_result()
    cable.cut = True
    for register, value in ((0x013A, 0x5041), (0x0113, 500), # the communication timeout, in ms
                            (0x013A, 0x4F4E), (0x0100, 9), (0x0101, 1)): # armed, and under direct drive
        cable.write_register(register, value)
    page.until_page(line="cut")
    time.sleep(2) # the silence
    cable.cut = False
    page.until_page(line="connected")
    page.expect("#power", "in fault")
    page.expect("#now-faults", "communication")
    if not page.script("return document.getElementById('faults-box').classList.contains('alarm')"):
        page.fail("the fault is no alarm")
    page.picture("fault", "main")
    clear_fault(page)
    page.picture("fault-cleared", "main")


def emulated(page, process):
    """The page of `hyst serve --bench`, which starts the amplifier itself."""
    page.shape(WIDE, "dark")
    page.until_page(server="open", line="connected", control="yes")
    page.expect("#amplifier", "emulated.*no parameters")
    if page.script("return document.querySelector('#record [name=position_low]').value") != "-5":
        page.fail("the ranges of the bench are not proposed")
    page.expect("#now-state", "parked")
    page.click("#stop")
    page.expect("#message", "the amplifier took it after")
    page.picture("bench")
    process.terminate()
    if process.wait(PATIENCE_S) != 0:
        page.fail(f"the server ended with {process.returncode}")


def main():
    hyst, elf, actuator, scratch = map(os.path.abspath, sys.argv[1:5])
    shutil.rmtree(scratch, ignore_errors=True)
    folder = f"{scratch}/folder_{'with_a_long_name_' * 6}" # which is to wrap on a narrow page
    os.makedirs(folder)
    shutil.copy(os.path.join(os.path.dirname(actuator), "recording.csv"), f"{folder}/tutorial.csv")
    scope(f"{folder}/scope.txt")
    os.utime(f"{folder}/scope.txt", (OLD_S, OLD_S))
    twin = ["--image", elf, "--model", actuator, "--drive-range", "0:100", "--position-range", "-5:40", "--noise-um", "0.02"]
    bench, port = start([hyst, "bench", *twin], r"^port: (\S+)", f"{scratch}/bench.log")
    cable = Cable(port)
    server, address = start([hyst, "serve", "--port", cable.port, "--timeout", TIMEOUT_S, "--folder", os.path.basename(folder)],
                            r"^page: (\S+)", f"{scratch}/serve.log")
    page = None
    try:
        page = OpenedPage(scratch, folder, address)
        page.browser.get(address)
        for field, value in (("drive_low", "0"), ("drive_high", "100"), ("position_low", "-5"), ("position_high", "40")):
            page.until("the form is open", lambda name=field: page.browser.find_element(By.NAME, name).is_displayed())
            page.fill("record", **{field: value})
        by_clicks(page)
        comparing(page)
        ripple(page)
        second_viewer(page)
        by_keyboard(page, cable)
        fault(page, cable)
        server.terminate()
        if server.wait(PATIENCE_S) != 0:
            sys.exit(f"FAIL: the server ended with {server.returncode}")
        page.expect("#banner", "No connection to the server")
        page.picture("server-gone", "main")
        bench.terminate()
        bench.wait(PATIENCE_S)
        server, address = start([hyst, "serve", "--bench", "--timeout", TIMEOUT_S, "--folder", os.path.basename(folder),
                                 *twin], r"^page: (\S+)", f"{scratch}/bench-serve.log")
        page.browser.get(address)
        emulated(page, server)
    finally:
        if page:
            page.browser.quit()
        for process in (server, bench):
            process.kill()
            process.wait()
    drop_profile(scratch)


main()
