# SPDX-License-Identifier: GPL-3.0-or-later
"""Chromium, driven by Selenium. Importing it ends a test with 77, skipped, where one of them is missing."""
import shutil
import sys

try:
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
except ImportError:
    print("skipped: no Selenium (python3-selenium)")
    sys.exit(77)
if shutil.which("chromium") is None or shutil.which("chromedriver") is None:
    print("skipped: no chromium, or no chromedriver (chromium-driver)")
    sys.exit(77)


def open_chromium(scratch, *more):
    """Without a window; its profile is in `scratch`, which drop_profile clears. `more`: arguments of Chromium's."""
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars",
                     "--no-first-run", "--disable-extensions", "--disable-background-networking",
                     f"--user-data-dir={scratch}/profile", *more):
        options.add_argument(argument)
    return webdriver.Chrome(service=Service(shutil.which("chromedriver")), options=options)


def shape(browser, width, height, scheme):
    """A window of this size, of a user who prefers a light or a dark page, and no motion."""
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
        "width": width, "height": height, "deviceScaleFactor": 1, "mobile": False})
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {
        "features": [{"name": "prefers-color-scheme", "value": scheme},
                     {"name": "prefers-reduced-motion", "value": "reduce"}]})


def drop_profile(scratch):
    shutil.rmtree(f"{scratch}/profile", ignore_errors=True)
