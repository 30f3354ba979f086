# SPDX-License-Identifier: GPL-3.0-or-later
"""plot.py PLOT_JS SCRATCH: what the live page's plots do for pointer and keys, in Chromium, without a server.

A drag enlarges, a double click shows all, a click on a name hides its trace, the pointer reads out; so do keys alone. A
live plot that is enlarged is held. All of it light and wide, and dark at 390 px. Exits with 77 where there is no
Chromium, chromedriver or Selenium.
"""
import os
import shutil
import sys

from chromium import drop_profile, open_chromium, shape # ends here where there is none
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

PAGE = """<!doctype html><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<style>:root {{ color-scheme: light dark; --grid: #ccc; --soft: #777; --ink: #111; --paper: #fff; --a: #00f; --b: #f00; }}
@media (prefers-color-scheme: dark) {{ :root {{ --grid: #333; --soft: #999; --ink: #eee; --paper: #000; --a: #8af; }} }}
canvas {{ display: block; width: 100%; height: 208px }}</style><canvas id="plot"></canvas><script>{script}
const x = Array.from({{ length: 1001 }}, (_, i) => i / 100), plot = new Plot(document.getElementById("plot"));
const show = (offset) => plot.draw([{{ x, y: x.map((t) => t + offset), colour: "--a", label: "rising" }},
  {{ x, y: x.map((t) => 100 + 0 * t), colour: "--b", label: "level" }}], {{ values: true, live: true }});
show(0);</script>"""
LEFT, RIGHT = 52, 10 # of plot.js


class Plot:
    def __init__(self, browser, width, scheme):
        shape(browser, width, 700, scheme)
        browser.refresh()
        self.browser, self.name = browser, f"{width} px, {scheme}"
        self.canvas = browser.find_element(By.ID, "plot")
        self.wide = self.canvas.size["width"]

    def data(self, key):
        return self.canvas.get_attribute(f"data-{key}")

    def range(self):
        return [float(value) for value in self.data("x").split()]

    def colours(self, name):
        """Pixels of a trace below the legend."""
        return self.browser.execute_script("""
            const canvas = arguments[0], c = canvas.getContext("2d"), probe = document.createElement("canvas").getContext("2d");
            probe.fillStyle = getComputedStyle(canvas).getPropertyValue(arguments[1]);
            probe.fillRect(0, 0, 1, 1);
            const want = probe.getImageData(0, 0, 1, 1).data, data = c.getImageData(0, 20, canvas.width, 166).data;
            let count = 0;
            for (let i = 0; i < data.length; i += 4) {
              count += Math.abs(data[i] - want[0]) + Math.abs(data[i + 1] - want[1]) + Math.abs(data[i + 2] - want[2]) < 60;
            }
            return count;""", self.canvas, name)

    def move(self, x, y=100):
        return ActionChains(self.browser).move_to_element_with_offset(self.canvas, x - self.wide / 2, y - 104)

    def at(self, value):
        """The column at a time, of 10 s in the whole width."""
        return round(LEFT + value / 10 * (self.wide - LEFT - RIGHT))

    def check(self, good, what):
        if not good:
            sys.exit(f"FAIL: {self.name}: {what}: x {self.data('x')}, hidden {self.data('hidden')}, read {self.data('read')}")

    def near(self, expected, what):
        per_pixel = 10 / (self.wide - LEFT - RIGHT) # a pixel at each end
        self.check(all(abs(a - b) < 2 * per_pixel for a, b in zip(self.range(), expected)), what)

    def by_pointer(self):
        self.near((0, 10), "all of it is shown")
        self.move(self.at(3)).perform()
        read = self.data("read").split(", ")
        self.check(read[1] == "level 100.0000" and abs(float(read[0].split()[1]) - 3) < 0.1, "the pointer reads out")
        self.move(self.at(2)).click_and_hold().perform()
        self.move(self.at(4)).release().perform()
        self.near((2, 4), "a drag enlarges")
        self.browser.execute_script("show(50)")
        self.move(self.at(5)).perform() # now at 3 s
        self.check(abs(float(self.data("read").split(", ")[0].split()[1]) - 3) < 0.1, "it is held while enlarged")
        self.move(self.at(5)).double_click().perform()
        self.browser.execute_script("show(50)")
        self.near((0, 10), "a double click shows all")
        self.move(self.at(3)).perform()
        self.check(abs(float(self.data("read").split(", ")[0].split()[1]) - 53) < 0.1, "and goes on")
        self.move(LEFT + 10, 9).click().perform()
        self.check(self.data("hidden") == "rising" and self.colours("--a") == 0, "a click on the name hides the trace")
        self.move(LEFT + 10, 9).click().perform()
        self.check(self.data("hidden") == "" and self.colours("--a") > 100, "another one shows it")

    def by_keys(self):
        def keys(*all_keys):
            ActionChains(self.browser).send_keys(*all_keys).perform()
        keys(Keys.TAB)
        self.check(self.browser.switch_to.active_element == self.canvas, "Tab comes to the plot")
        keys("+")
        self.near((2.5, 7.5), "+ enlarges")
        keys("-")
        self.near((0, 10), "- shrinks")
        keys("+", "+", "0")
        self.near((0, 10), "0 shows all")
        keys(Keys.ARROW_LEFT)
        before = float(self.data("read").split(", ")[0].split()[1])
        keys(Keys.ARROW_RIGHT, Keys.ARROW_RIGHT)
        self.check(float(self.data("read").split(", ")[0].split()[1]) > before, "arrows move the reading")
        keys("2")
        self.check(self.data("hidden") == "level" and self.colours("--b") == 0, "2 hides the second trace")
        keys("2")
        self.check(self.data("hidden") == "" and self.colours("--b") > 100, "and shows it")


def main():
    script, scratch = sys.argv[1:3]
    shutil.rmtree(scratch, ignore_errors=True)
    os.makedirs(scratch)
    with open(script, encoding="utf-8") as source, open(f"{scratch}/plot.html", "w", encoding="utf-8") as page:
        page.write(PAGE.format(script=source.read()))
    browser = open_chromium(scratch)
    try:
        browser.get(f"file://{os.path.abspath(scratch)}/plot.html")
        for width, scheme in ((1280, "light"), (390, "dark")):
            Plot(browser, width, scheme).by_pointer()
            plot = Plot(browser, width, scheme) # opened anew
            plot.by_keys()
            browser.save_screenshot(f"{scratch}/{width}-{scheme}.png")
            print(plot.name, "good")
    finally:
        browser.quit()
    drop_profile(scratch)


main()
