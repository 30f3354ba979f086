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
import struct
import subprocess
import sys
import threading
import time
import tty

try:
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
    from selenium.webdriver.support.ui import Select
except ImportError:
    print("skipped: no Selenium (python3-selenium)")
    sys.exit(77)

PATIENCE_S = 120  # for what surely comes, on a busy machine
TIMEOUT_S = "1.5" # for an answer of the emulator, which pauses there
NARROW, WIDE = (390, 844), (1280, 900)


class Cable:
    """A pseudo-terminal before the amplifier's. Cut, it swallows what is sent, and the test may be the master."""

    def __init__(self, port):
        self.far = os.open(port, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self.far)
        self.near, self.held = os.openpty()
        tty.setraw(self.held)
        self.port = os.ttyname(self.held)
        self.cut, self.heard = False, b""
        for ends in ((self.near, self.far), (self.far, self.near)):
            threading.Thread(target=self.carry, args=ends, daemon=True).start()

    def carry(self, source, sink):
        while True:
            try:
                data = os.read(source, 4096)
                if not self.cut:
                    os.write(sink, data)
                elif source == self.far:
                    self.heard += data
            except OSError: # the amplifier has ended
                return


    def write_register(self, address, value):
        """While it is cut: again until the amplifier has taken it, whose answer is then the request."""
        frame = struct.pack(">BBHH", 1, 6, address, value)
        check = 0xFFFF
        for byte in frame:
            check ^= byte
            for _ in range(8):
                check = check >> 1 ^ (0xA001 if check & 1 else 0)
        frame += struct.pack("<H", check)
        for _ in range(PATIENCE_S):
            self.heard = b""
            os.write(self.far, frame)
            for _ in range(20):
                time.sleep(0.05)
                if frame in self.heard:
                    return
        sys.exit(f"FAIL: register {address:#06x} does not take {value:#06x}: {self.heard.hex()}")


def start(command, pattern, log):
    """The process, in the folder of its log, and what the pattern finds in its first lines."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=open(log, "w", encoding="utf-8"), text=True,
                               cwd=os.path.dirname(log))
    for line in process.stdout:
        found = re.search(pattern, line)
        if found:
            return process, found[1]
    sys.exit(f"FAIL: {command[1]} said nothing: " + open(log, encoding="utf-8").read())


class Day:
    def __init__(self, scratch, folder, address):
        self.scratch, self.folder, self.address, self.pictures = scratch, folder, address, 0
        options = webdriver.ChromeOptions()
        options.binary_location = shutil.which("chromium")
        for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars",
                         "--no-first-run", "--disable-extensions", "--disable-background-networking",
                         f"--user-data-dir={scratch}/profile"):
            options.add_argument(argument)
        self.browser = webdriver.Chrome(service=Service(shutil.which("chromedriver")), options=options)
        self.started = time.monotonic()

    # ---- Looking ----

    def shape(self, size, scheme):
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
            "width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False})
        self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {
            "features": [{"name": "prefers-color-scheme", "value": scheme},
                         {"name": "prefers-reduced-motion", "value": "reduce"}]})
        self.until(f"the window is {size[0]} px wide", lambda: self.script("return innerWidth") == size[0])
        self.fits_the_window("in this shape")

    def fits_the_window(self, when):
        if self.script("return document.documentElement.scrollWidth > innerWidth"):
            wide = self.script("""return [...document.querySelectorAll("body *")].filter((e) =>
                e.getBoundingClientRect().right > innerWidth).map((e) => e.tagName + "#" + e.id).join(" ")""")
            self.fail(f"the page is wider than the window, {when}: {wide}")

    def script(self, text, *arguments):
        return self.browser.execute_script(text, *arguments)

    def picture(self, name, at=None):
        if at:
            self.script("document.querySelector(arguments[0]).scrollIntoView({block: 'start'})", at)
        # Two frames, so that everything is drawn.
        self.browser.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
        self.pictures += 1
        self.browser.save_screenshot(f"{self.scratch}/{self.pictures:02}-{name}.png")
        self.stop_is_in_view(name)
        self.fits_the_window(name)
        print(f"{time.monotonic() - self.started:5.1f} s  {name}", flush=True)

    def stop_is_in_view(self, when):
        if not self.script("""const b = document.getElementById("stop").getBoundingClientRect();
                return b.top >= 0 && b.left >= 0 && b.bottom <= innerHeight && b.right <= innerWidth && b.width > 80 &&
                    document.elementFromPoint((b.left + b.right) / 2, (b.top + b.bottom) / 2).closest("#stop") !== null"""):
            self.fail(f"Stop is not in view: {when}")

    def text(self, css):
        return self.browser.find_element(By.CSS_SELECTOR, css).text

    def fail(self, why):
        self.browser.save_screenshot(f"{self.scratch}/failed.png")
        print(f"FAIL: {why}\nbody: {self.script('return JSON.stringify(document.body.dataset)')}"
              f"\nbanner: {self.text('#banner')}\nmessage: {self.text('#message')}\nresult: {self.text('#result')}")
        for entry in self.browser.get_log("browser"):
            print(entry["message"])
        sys.exit(1)

    def until(self, what, condition):
        end = time.monotonic() + PATIENCE_S
        while not condition():
            if time.monotonic() > end:
                self.fail(f"waited in vain: {what}")
            time.sleep(0.05)

    def has(self, **values):
        return all(self.script("return document.body.dataset[arguments[0]]", key) == value
                   for key, value in values.items())

    def until_page(self, **values):
        self.until(f"the page is in {values}", lambda: self.has(**values))

    def expect(self, css, pattern):
        self.until(f"{css} shows {pattern}", lambda: re.search(pattern, self.text(css)))

    # ---- Doing ----

    def fill(self, form, **values):
        for name, value in values.items():
            field = self.browser.find_element(By.CSS_SELECTOR, f"#{form} [name={name}]")
            if field.tag_name == "select":
                Select(field).select_by_value(value)
            else:
                field.clear()
                field.send_keys(value)

    def click(self, css):
        element = self.browser.find_element(By.CSS_SELECTOR, css)
        if css != "#stop": # which is in view as it is
            self.script("arguments[0].scrollIntoView({block: 'center'})", element)
        element.click()

    def keys(self, *keys):
        ActionChains(self.browser).send_keys(*keys).perform()

    def tab_to(self, css):
        for _ in range(250):
            if self.script("return document.activeElement.matches(arguments[0])", css):
                break
            self.keys(Keys.TAB)
        else:
            self.fail(f"Tab never comes to {css}")
        if not self.script("""const a = document.activeElement, s = getComputedStyle(a), b = a.getBoundingClientRect();
                return s.outlineStyle !== "none" && parseFloat(s.outlineWidth) >= 2 && b.bottom > 0 &&
                    b.top < innerHeight"""):
            self.fail(f"the focus does not show at {css}")

    def type_in(self, css, text):
        self.tab_to(css)
        ActionChains(self.browser).key_down(Keys.CONTROL).send_keys("a").key_up(Keys.CONTROL).send_keys(text).perform()
        self.until(f"{css} is {text}", lambda: self.value(css) == text)

    def choose(self, css, text):
        """By its first letters, as a select takes them."""
        self.tab_to(css)
        self.keys(text)
        self.until(f"{css} is {text}", lambda: self.script("return document.activeElement.value") == text)

    def result(self, name, good="true"):
        self.until(f"{name} has ended", lambda: self.has(run="idle", job="idle") and
                   self.script("return document.getElementById('result').dataset.name") == name)
        if self.script("return document.getElementById('result').dataset.good") != good:
            self.fail(f"{name}: not {good}")

    def value(self, css):
        return self.script("return document.querySelector(arguments[0]).value", css)

    def until_shown(self, names):
        self.until(f"{names} is shown below", lambda: (self.script(
            "return document.getElementById('compared').dataset.shown") or "").strip() == names)

    def in_the_report(self, text):
        self.browser.switch_to.frame("report-frame")
        self.until("the report is in the page", lambda: len(self.text("body")) > 500)
        shown = self.text("body")
        self.browser.switch_to.default_content()
        if text not in shown:
            self.fail(f"the report has no {text}: {shown[:500]}")

    def forget_result(self):
        self.script("delete document.getElementById('result').dataset.name")


def by_clicks(day):
    day.shape(WIDE, "light")
    day.until_page(server="open", line="connected", control="yes")
    day.expect("#now-drive", "no scale yet")
    day.picture("opened")

    # A file from elsewhere, which does not say what its displacement is.
    day.fill("import", file="scope.txt", drive="CH1", displacement="CH2")
    day.click("#import [value=look]")
    day.result("import", "false")
    day.expect("#result-text", "^import has failed: .*in V: say how many um that is")
    if os.path.basename(day.folder) in day.text("#job-text"):
        day.fail("what the command printed has the folder before each name")
    day.picture("import-refused", "#result")
    day.fill("import", displacement_scale="5")
    day.forget_result()
    day.click("#import [value=look]")
    day.result("import")
    day.expect("#job-text", "stroke 49.5 um")
    if os.path.exists(f"{day.folder}/scope.h5"):
        day.fail("a look at a file has written a recording")
    day.forget_result()
    day.click("#import .go")
    day.result("import")
    day.until("the recording may be fitted", lambda: day.value("#fit [name=recording]") == "scope.h5")
    day.until_shown("scope.h5")
    day.picture("imported", "#result")

    bringing(day)
    exchanged(day)

    # A record that is stopped, then one to its end.
    day.fill("record", waveform="sine", frequency="2", cycles="1000", frames="1000")
    day.click("#record .go")
    day.until_page(run="record")
    day.expect("#now-state", "conditioning|playing")
    day.click("#stop")
    day.result("record", "false")
    day.expect("#message", "the amplifier took it after")
    day.expect("#result-text", "stopped.*parked")
    day.expect("#now-state", "parked")
    day.picture("stopped-while-recording", "main")
    day.forget_result()
    day.fill("record", waveform="triangle", cycles="3")
    day.click("#record .go")
    day.until("it records", lambda: day.text("#now-state") == "playing" or not day.has(run="record"))
    day.picture("recording", "main")
    day.result("record")
    day.until_shown("record.csv")
    day.picture("recorded", "#result")

    day.click("#fit .go")
    day.result("fit")
    day.expect("#job-text", "held out.*NRMSE")
    day.picture("fitted", "#result")
    day.click("#compile .go")
    day.result("compile")
    day.click("#push .go")
    day.result("push")
    day.expect("#amplifier", "is in force")
    day.fill("track", frequency="2", cycles="2", frames="500")
    day.click("#track .go")
    day.result("track")
    times = re.search(r"([\d.]+) times less", day.text("#result-text"))
    if not times or float(times[1]) < 1.5:
        day.fail("the compensation does not help")
    day.until_shown("track-linear.csv track-compensate.csv")
    day.picture("tracked", "#result")
    day.picture("before-and-after", "#compare")


def scope(path=None):
    """3 V a step, and 0.1 V of a sensor. The text, also written to a file."""
    text = "s;CH1 (V);CH2 (V)\n" + "".join(f"{k / 500:.3f};{3 * (k % 100)};{(k % 100) / 10:.2f}\n" for k in range(400))
    if path:
        with open(path, "w", encoding="ascii") as file:
            file.write(text)
    return text


def bringing(day):
    """Files of this computer: chosen, dropped, and refused. What is in the last one is said by itself."""
    there = f"{day.scratch}/TEK 0001.CSV", f"{day.scratch}/other.html", f"{day.scratch}/of hyst.csv"
    for path in there:
        scope(path)
    day.forget_result()
    day.browser.find_element(By.CSS_SELECTOR, "#upload [name=files]").send_keys(there[0])
    day.result("import", "false")
    day.expect("#result-text", "^import has failed: .*in V: say how many um that is")
    if day.value("#import [name=file]") != "TEK_0001.CSV":
        day.fail("what was brought is not chosen")
    day.picture("brought", "#upload")
    day.browser.find_element(By.CSS_SELECTOR, "#upload [name=files]").send_keys(there[1])
    day.expect("#message", "other.html.*ending")
    if day.value("#fit [name=recording]") == "TEK_0001.CSV":
        day.fail("what does not say its displacement is proposed for a fit")
    shutil.copy(f"{day.folder}/tutorial.csv", there[2]) # which says itself what it is
    day.forget_result()
    day.browser.find_element(By.CSS_SELECTOR, "#upload [name=files]").send_keys(there[2])
    day.result("import")
    day.until("it may be fitted", lambda: day.value("#fit [name=recording]") == "of_hyst.csv")
    day.until_shown("of_hyst.csv")
    os.remove(f"{day.folder}/of_hyst.csv")
    day.forget_result()
    day.script("""const data = new DataTransfer();
        for (const name of ["dropped.txt", "TEK 0001.CSV"]) { data.items.add(new File([arguments[0]], name)); }
        for (const kind of ["dragover", "drop"]) {
          document.querySelector("main").dispatchEvent(
              new DragEvent(kind, { dataTransfer: data, bubbles: true, cancelable: true }));
        }""", scope())
    day.result("import", "false")
    if day.value("#import [name=file]") != "TEK_0001-2.CSV":
        day.fail("what was dropped last is not chosen")
    day.until_page(upload="idle")
    for name in ("TEK_0001.CSV", "dropped.txt", "TEK_0001-2.CSV"):
        with open(f"{day.folder}/{name}", encoding="ascii") as file:
            if file.read() != scope():
                day.fail(f"{name} is not what was brought")
    if os.path.exists(f"{day.folder}/other.html"):
        day.fail("a page of elsewhere is in the folder")


def exchanged(day):
    """A recording whose columns look exchanged is refused; then, and only for it, the page may insist."""
    box = day.browser.find_element(By.CSS_SELECTOR, "#fit [name=columns_are_right]")

    def wish():
        return day.script("return requests.fit(document.getElementById('fit').elements).columns_are_right")

    with open(f"{day.folder}/tutorial.csv", encoding="ascii") as file, \
            open(f"{day.folder}/turned.csv", "w", encoding="ascii") as turned:
        for line in file:
            cells = line.rstrip("\n").split(",")
            if line[0] not in "#t":
                cells[1], cells[2] = cells[2], cells[1]
            turned.write(",".join(cells) + "\n")
    day.forget_result()
    day.browser.find_element(By.CSS_SELECTOR, "#upload [name=files]").send_keys(f"{day.folder}/turned.csv")
    day.result("import")
    if box.is_displayed():
        day.fail("the page offers to insist on columns that nothing was said about")
    day.forget_result()
    day.fill("fit", recording="turned-2.csv")
    day.click("#fit .go")
    day.result("fit", "false")
    day.expect("#result-text", "are exchanged")
    day.until("the page offers to insist", box.is_displayed)
    box.click()
    if wish() is not True:
        day.fail("a page that insists does not say so")
    day.picture("columns-refused", "#fit")
    day.fill("fit", recording="tutorial.csv")
    if box.is_displayed() or wish() is not False:
        day.fail("the page insists on the columns of another recording, too")
    for name in ("turned.csv", "turned-2.csv"):
        os.remove(f"{day.folder}/{name}")


def comparing(day):
    """The form below the runs: what it shows, a model's answer, and a report of two runs."""
    day.fill("compare", a="record.csv", b="")
    day.click("#compare form:not([id]) .go")
    day.until_shown("record.csv")
    if "A: record.csv" not in day.text("#compare-table") or "B:" in day.text("#compare-table"):
        day.fail(f"A alone: {day.text('#compare-table')}")
    day.click("#compare summary")
    day.script("document.querySelector('#simulate [name=model]').value = ''") # the test chooses
    day.fill("simulate", model="model.json", recording="record.csv")
    day.click("#simulate [value=simulate]")
    day.result("simulate")
    day.until_shown("simulated.csv")
    # A simulation has what was measured as its reference: the model's error is the fit's.
    if not re.search(r"A: simulated.csv\s+[\d.]+ %", day.text("#compare-table")):
        day.fail(f"no error of the simulation: {day.text('#compare-table')}")
    day.fill("compare", a="track-linear.csv", b="track-compensate.csv")
    day.click("#simulate [value=report]")
    day.result("report")
    day.expect("#report-link", "report.html")
    day.in_the_report("The tracking error falls")
    day.picture("report-of-a-and-b", "#report")


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


def ripple(day):
    """A sine of two periods a column: the envelope fills whole columns, which twenty snapshots a second cannot. A busy
    machine may look for it too late; then it is played again."""
    def filled():
        return sum(share > 0.6 for share in day.script(FILLED, "#plot-drive", "--drive")) >= 60

    Select(day.browser.find_element(By.ID, "window")).select_by_value("5")
    day.fill("record", waveform="sine", frequency="237", cycles="2400", frames="3000", name="ripple")
    for _ in range(3):
        day.forget_result()
        day.click("#record .go")
        day.until_page(run="record")
        day.until("the envelope fills the plot of the drive", lambda: filled() or not day.has(run="record"))
        if filled():
            break
        day.result("record")
    else:
        day.fail("no envelope of a sine of 237 Hz was to be seen")
    # Of fewer than twenty samples a period lines would be a scribble. How many there are is the line's affair.
    day.until("the loop is no scribble", lambda: day.script("""const end = rows.count - 1;
        return plots.loop.series[0].dots || 200 / (rows.t[end] - rows.t[end - 200]) > 15 * 237"""))
    day.picture("ripple", "main")
    day.result("record")
    # The page shows each frame that the server read. The server reads half as many after each loss on the line: a busy
    # machine may lose some, once or twice.
    gaps, losses = (day.script(f"return Number(document.body.dataset.{name} || 0)") for name in ("gaps", "losses"))
    if gaps != losses or losses > 2:
        day.fail(f"the stream had {gaps} gaps, and the line to the amplifier {losses} losses")
    Select(day.browser.find_element(By.ID, "window")).select_by_value("15")


def second_viewer(day):
    first = day.browser.current_window_handle
    day.browser.switch_to.new_window("tab")
    day.browser.get(day.address)
    day.shape(WIDE, "light")
    day.until_page(server="open", line="connected", control="no")
    day.expect("#now-drive", r"\d V")
    if day.browser.find_element(By.CSS_SELECTOR, "#record .go").is_enabled():
        day.fail("the second viewer may record")
    if day.browser.find_element(By.CSS_SELECTOR, "#upload [name=files]").is_enabled():
        day.fail("the second viewer may bring files")
    if not day.browser.find_element(By.ID, "stop").is_enabled():
        day.fail("the second viewer cannot stop")
    day.picture("second-viewer")
    day.browser.close()
    day.browser.switch_to.window(first)


def by_keyboard(day, cable):
    day.shape(NARROW, "light")
    day.picture("narrow-light", "main")
    day.picture("narrow-light-work", "#steps-title")
    day.picture("narrow-light-compare", "#compare")
    day.shape(NARROW, "dark")
    day.picture("narrow-dark", "main")
    day.forget_result()

    day.tab_to("#upload [name=files]") # from there on its chooser is the browser's

    # Record and fit.
    day.choose("#record [name=waveform]", "staircase")
    day.type_in("#record [name=frequency]", "2")
    day.type_in("#record [name=cycles]", "2")
    day.type_in("#record [name=frames]", "1000")
    day.type_in("#record [name=name]", "keys")
    day.tab_to("#record .go")
    day.keys(Keys.ENTER)
    day.result("record")
    day.until("its recording is proposed", lambda: day.value("#fit [name=recording]") == "keys.csv")
    day.choose("#fit [name=recording]", "record.csv")
    day.tab_to("#fit .go")
    day.keys(Keys.ENTER)
    day.result("fit")
    day.until("its model is proposed", lambda: day.value("#compile [name=model]") == "model-2.json")
    day.forget_result()

    # A track, stopped beside a line that is cut.
    day.choose("#track [name=waveform]", "sine")
    day.type_in("#track [name=cycles]", "1000")
    day.tab_to("#track [name=condition]")
    day.keys(Keys.SPACE)
    day.tab_to("#track .go")
    day.picture("focus")
    day.keys(Keys.ENTER)
    day.expect("#now-state", "playing")

    # The line is cut while it plays.
    cable.cut = True
    day.until_page(line="cut")
    day.expect("#banner", "is cut")
    day.picture("line-cut", "main")
    day.keys(Keys.ESCAPE)
    cable.cut = False
    day.until_page(line="connected")
    day.result("track", "false")
    day.expect("#message", "the amplifier took it after")
    day.expect("#now-state", "parked")
    day.expect("#now-faults", "communication") # it heard of no master for longer than a second
    day.picture("line-is-back", "main")
    clear_fault(day)

    # What does the model leave out? Of a long recording, cancelled; then of the short one.
    day.forget_result()
    day.choose("#diagnose [name=recording]", "tutorial.csv")
    day.tab_to("#diagnose .go")
    day.keys(Keys.ENTER)
    day.until_page(job="diagnose")
    day.tab_to("#cancel")
    day.keys(Keys.ENTER)
    day.expect("#result-text", "was cancelled")
    day.forget_result()
    day.choose("#diagnose [name=recording]", "record.csv")
    day.tab_to("#diagnose .go")
    day.keys(Keys.ENTER)
    day.until_page(job="diagnose")
    day.picture("diagnosing", "#result")
    day.result("diagnose")
    day.expect("#report-link", "diagnosis")
    day.in_the_report("held out")
    day.picture("diagnosis", "#report")

    # The better model goes into the amplifier.
    before = day.text("#amplifier")
    day.until("the better model is proposed", lambda: day.value("#compile [name=model]") == "diagnosis.json")
    for step in ("compile", "push"):
        day.tab_to(f"#{step} .go")
        day.keys(Keys.ENTER)
        day.result(step)
    day.expect("#result-text", "in force, and read back the same")
    day.until("the page says which model", lambda: day.text("#amplifier") not in ("", before))
    day.picture("better-model", "main")
    day.picture("files", "#files")


def clear_fault(day):
    day.tab_to("#clear button")
    day.keys(Keys.ENTER)
    day.result("clear")
    day.expect("#now-faults", "^none")
    day.until("there is nothing to clear", lambda: not day.browser.find_element(By.ID, "clear").is_displayed())


def fault(day, cable):
    """Another master drives the amplifier and falls silent: a fault, which the page shows and clears."""
    day.forget_result()
    cable.cut = True
    for register, value in ((0x013A, 0x5041), (0x0113, 500), # the communication timeout, in ms
                            (0x013A, 0x4F4E), (0x0100, 9), (0x0101, 1)): # armed, and under direct drive
        cable.write_register(register, value)
    day.until_page(line="cut")
    time.sleep(2) # the silence
    cable.cut = False
    day.until_page(line="connected")
    day.expect("#power", "in fault")
    day.expect("#now-faults", "communication")
    if not day.script("return document.getElementById('faults-box').classList.contains('alarm')"):
        day.fail("the fault is no alarm")
    day.picture("fault", "main")
    clear_fault(day)
    day.picture("fault-cleared", "main")


def emulated(day, process):
    """The page of `hyst serve --bench`, which starts the amplifier itself."""
    day.shape(WIDE, "dark")
    day.until_page(server="open", line="connected", control="yes")
    day.expect("#amplifier", "emulated.*no parameters")
    if day.script("return document.querySelector('#record [name=position_low]').value") != "-5":
        day.fail("the ranges of the bench are not proposed")
    day.expect("#now-state", "parked")
    day.click("#stop")
    day.expect("#message", "the amplifier took it after")
    day.picture("bench")
    process.terminate()
    if process.wait(PATIENCE_S) != 0:
        day.fail(f"the server ended with {process.returncode}")


def main():
    hyst, elf, actuator, scratch = map(os.path.abspath, sys.argv[1:5])
    if shutil.which("chromium") is None or shutil.which("chromedriver") is None:
        print("skipped: no chromium, or no chromedriver (chromium-driver)")
        sys.exit(77)
    shutil.rmtree(scratch, ignore_errors=True)
    folder = f"{scratch}/folder_{'with_a_long_name_' * 6}" # which is to wrap on a narrow page
    os.makedirs(folder)
    shutil.copy(os.path.join(os.path.dirname(actuator), "recording.csv"), f"{folder}/tutorial.csv")
    scope(f"{folder}/scope.txt")
    twin = ["--image", elf, "--model", actuator, "--drive-range", "0:100", "--position-range", "-5:40", "--noise-um", "0.02"]
    bench, port = start([hyst, "bench", *twin], r"^port: (\S+)", f"{scratch}/bench.log")
    cable = Cable(port)
    server, address = start([hyst, "serve", "--port", cable.port, "--timeout", TIMEOUT_S, "--folder", os.path.basename(folder)], r"^page: (\S+)",
                            f"{scratch}/serve.log")
    day = None
    try:
        day = Day(scratch, folder, address)
        day.browser.get(address)
        for field, value in (("drive_low", "0"), ("drive_high", "100"), ("position_low", "-5"), ("position_high", "40")):
            day.until("the form is open", lambda name=field: day.browser.find_element(By.NAME, name).is_displayed())
            day.fill("record", **{field: value})
        by_clicks(day)
        comparing(day)
        ripple(day)
        second_viewer(day)
        by_keyboard(day, cable)
        fault(day, cable)
        server.terminate()
        if server.wait(PATIENCE_S) != 0:
            sys.exit(f"FAIL: the server ended with {server.returncode}")
        day.expect("#banner", "No connection to the server")
        day.picture("server-gone", "main")
        bench.terminate()
        bench.wait(PATIENCE_S)
        server, address = start([hyst, "serve", "--bench", "--timeout", TIMEOUT_S, "--folder", os.path.basename(folder), *twin], r"^page: (\S+)",
                                f"{scratch}/bench-serve.log")
        day.browser.get(address)
        emulated(day, server)
    finally:
        if day:
            day.browser.quit()
        for process in (server, bench):
            process.kill()
            process.wait()
    shutil.rmtree(f"{scratch}/profile", ignore_errors=True)


main()
