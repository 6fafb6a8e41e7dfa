"""A real browser for the tests of pages, and what they ask of it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.remote.webelement import WebElement

REPORTS = Path(__file__).parents[2] / "reports"
FLAGS = [
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--disable-dev-shm-usage",  # containers have little of it
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
DESKTOP, PHONE = 1280, 390
# A4 at 96 dots per inch; its width less margins of 15 mm.
PAPER, A4_HEIGHT = 681, 1123

# Every text that can be seen with its colour, the ground behind it and its size as laid out.
TEXTS = """
const texts = [];
const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
while (walker.nextNode()) {
  const text = walker.currentNode.data.trim(), element = walker.currentNode.parentElement;
  if (!text || !element.checkVisibility()) continue;
  const style = getComputedStyle(element), drawn = element instanceof SVGElement;
  let ground = element;
  while (getComputedStyle(ground).backgroundColor === "rgba(0, 0, 0, 0)") ground = ground.parentElement;
  const place = drawn ? element.getScreenCTM() : { a: 1, b: 0 };
  texts.push({ text, drawn, ink: drawn ? style.fill : style.color,
    ground: getComputedStyle(ground).backgroundColor,
    size: parseFloat(style.fontSize) * Math.hypot(place.a, place.b) });
}
return texts;
"""
# What is wider than the box that shows it, from the whole page down to a listing.
CUT_OFF = """
return [...document.querySelectorAll(arguments[0])]
  .filter((box) => box.scrollWidth > box.clientWidth)
  .map((box) => `${box.tagName}, ${box.scrollWidth} px: ${box.textContent.trim().slice(0, 60)}`);
"""


def address(page: str) -> str:
    """Return the address of a page of the reports, or of one anywhere."""
    return (REPORTS / page).as_uri()


class Browser:
    """A headless Chromium that shows pages as a screen, a phone or paper would."""

    def __init__(self, binary: str, driver: str, profile: Path) -> None:
        options = webdriver.ChromeOptions()
        options.binary_location = binary
        for flag in [*FLAGS, f"--user-data-dir={profile}"]:
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("no_proxy", "*")  # chromedriver listens on this very machine
            self.driver = webdriver.Chrome(options=options, service=Service(executable_path=driver))
        self.untouched = ""  # the page that is shown, if nobody has changed it

    def open(
        self,
        page: str,
        width: int = DESKTOP,
        scheme: str = "light",
        media: str = "screen",
        unfolded: bool = True,
        only_read: bool = False,
    ) -> None:
        """Load a page afresh, or show one again that was only read, and open what is folded."""
        self.command(
            "Emulation.setEmulatedMedia",
            media=media,
            features=[{"name": "prefers-color-scheme", "value": scheme}],
        )
        # A mobile device has no scroll bar that takes some of the width; nor has paper.
        self.command(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=900,
            deviceScaleFactor=1,
            mobile=width != DESKTOP,
        )
        if not (only_read and self.untouched == page):
            self.driver.get(address(page))
        self.untouched = page if only_read else ""
        if unfolded:
            self.run("for (const part of document.querySelectorAll('details')) part.open = true")

    def command(self, name: str, **arguments: Any) -> Any:
        """Send a command of Chromium's own protocol."""
        return self.driver.execute_cdp_cmd(name, arguments)

    def run(self, script: str, *arguments: Any) -> Any:
        """Return what a script returns."""
        return self.driver.execute_script(script, *arguments)

    def find(self, selector: str) -> list[WebElement]:
        """Return all elements of a CSS selector."""
        return self.driver.find_elements(By.CSS_SELECTOR, selector)


def contrast(one: str, other: str) -> float:
    """Return the contrast of two colours as the WCAG define it."""
    dark, light = sorted((luminance(one), luminance(other)))
    return (light + 0.05) / (dark + 0.05)


def luminance(colour: str) -> float:
    """Return the relative luminance of an opaque colour, rgb(…)."""
    found = re.fullmatch(r"rgb\((\d+), (\d+), (\d+)\)", colour)
    assert found, colour
    parts = [int(part) / 255 for part in found.groups()]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def value(key: str, text: str) -> object:
    """Return what a cell of a CSV file was."""
    if key in ("reason", "sensors", "method", "basis", "outcome"):
        return text
    if text in ("", "True", "False"):
        return text == "True" if text else None
    return int(text) if key in ("n", "unstable_mode") else float(text)


def verdict(arm: str, quantity: str, passed: bool) -> dict[str, object]:
    """Return a verdict as the command gives it to the page."""
    return {
        "arm": arm, "requirement": quantity, "quantity": quantity, "passed": passed,
        "value": "4.2 dB", "limit": ">= 6 dB", "number": 4.2, "bound": 6.0,
        "place": "3.8 Hz, mode 1", "note": "a note",
    }  # fmt: skip
