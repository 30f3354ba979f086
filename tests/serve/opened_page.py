# SPDX-License-Identifier: GPL-3.0-or-later
"""The live page in Chromium: what a test sees of it, and does to it."""
import re
import sys
import time

from chromium import open_chromium, shape
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select

PATIENCE_S = 120  # for what surely comes, on a busy machine


class OpenedPage:
    def __init__(self, scratch, folder, address):
        self.scratch, self.folder, self.address, self.pictures = scratch, folder, address, 0
        self.browser = open_chromium(scratch)
        self.started = time.monotonic()

    # ---- Looking ----

    def shape(self, size, scheme):
        shape(self.browser, *size, scheme)
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
