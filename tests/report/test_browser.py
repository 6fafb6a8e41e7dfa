"""The pages in a real browser: quiet, legible on a phone, in the dark and on paper, sortable."""

from __future__ import annotations

import base64
import json
import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.remote.webelement import WebElement

REPORTS = Path(__file__).parents[2] / "reports"
PAGES = [
    "comparison/index.html",
    "study/index.html",
    "paper/index.html",
]

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
            self.driver.get((REPORTS / page).as_uri())
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


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    # Google's first: where it is installed, chromedriver is of its version.
    binaries = map(shutil.which, ("google-chrome", "chromium", "chromium-browser"))
    binary, driver = next(filter(None, binaries), None), shutil.which("chromedriver")
    if binary is None or driver is None:
        reason = "no Chromium or Chrome with its chromedriver"
        if os.environ.get("REQUIRE_BROWSER"):
            pytest.fail(reason)
        pytest.skip(reason)
    browser = Browser(binary, driver, tmp_path_factory.mktemp("profile"))
    yield browser
    browser.driver.quit()


# Module scope keeps the tests of a page together; the page itself is loaded by each.
@pytest.fixture(
    scope="module",
    params=[pytest.param(PAGES[0], marks=pytest.mark.slow), *PAGES[1:]],  # by far the largest
)
def page(request: pytest.FixtureRequest) -> str:
    return request.param


def test_page_says_nothing_on_the_console_and_asks_for_nothing(browser: Browser, page: str) -> None:
    for log in ("browser", "performance"):
        browser.driver.get_log(log)  # what earlier pages left behind
    browser.open(page)
    browser.run("for (const heading of document.querySelectorAll('th button')) heading.click()")
    messages = browser.driver.get_log("browser")
    assert [m for m in messages if m["level"] in ("WARNING", "SEVERE")] == []
    events = [json.loads(e["message"])["message"] for e in browser.driver.get_log("performance")]
    requests = [
        e["params"]["request"]["url"] for e in events if e["method"] == "Network.requestWillBeSent"
    ]
    # Chromium's own pages send theirs under a scheme of their own.
    asked = [url for url in requests if not url.startswith(("data:", "chrome:"))]
    assert asked == [(REPORTS / page).as_uri()]


@pytest.mark.parametrize("width", [PHONE, DESKTOP])
def test_page_fits_and_is_legible(browser: Browser, page: str, width: int) -> None:
    browser.open(page, width, only_read=True)
    assert browser.run(CUT_OFF, "html") == []
    small = [t for t in browser.run(TEXTS) if t["size"] < (8 if t["drawn"] else 12)]
    assert small == []


def test_figures_are_vectors_and_described(browser: Browser, page: str) -> None:
    browser.open(page, only_read=True)
    figures = browser.run(
        "return [...document.querySelectorAll('figure')].map((figure) => {"
        "  const svg = figure.querySelector('svg'), box = svg.getBoundingClientRect();"
        "  return [svg.ariaLabel, box.width, box.height];"
        "})"
    )
    assert figures
    assert [f for f in figures if not (f[0] and f[1] > 100 and f[2] > 100)] == []
    assert browser.run("return document.querySelectorAll('img, canvas, image').length") == 0


@pytest.mark.parametrize(
    ("media", "scheme", "dark"),
    [("screen", "light", False), ("screen", "dark", True), ("print", "dark", False)],
)
def test_every_text_stands_out(
    browser: Browser, page: str, media: str, scheme: str, dark: bool
) -> None:
    browser.open(page, scheme=scheme, media=media, only_read=True)
    ground = luminance(browser.run("return getComputedStyle(document.body).backgroundColor"))
    assert ground < 0.02 if dark else ground > 0.9
    faint = {
        (text["text"], text["ink"], text["ground"])
        for text in browser.run(TEXTS)
        if contrast(text["ink"], text["ground"]) < 7
    }
    assert faint == set()


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


def test_headings_sort_their_columns(browser: Browser, page: str) -> None:
    browser.open(page)
    tried = 0
    for column, heading in enumerate(headings(browser)):
        numbers = [number(text) for text in column_texts(browser, column)]
        if None in numbers:
            continue
        tried += 1
        button = heading.find_element(By.TAG_NAME, "button")
        button.click()
        assert [number(text) for text in column_texts(browser, column)] == sorted(numbers)
        assert [h for h in headings(browser) if h.get_dom_attribute("aria-sort")] == [heading]
        assert heading.get_dom_attribute("aria-sort") == "ascending"
        button.send_keys(Keys.ENTER)
        assert [number(text) for text in column_texts(browser, column)] == sorted(numbers)[::-1]
        assert heading.get_dom_attribute("aria-sort") == "descending"
    assert tried


def test_every_kind_of_number_sorts(browser: Browser, page: str) -> None:
    up = ["−∞", "−1.5", "−2.0e−03", "0.00 %", "< 0.01 %", "0.01 %", "4.16 / ∞", "42.2° at 0.3 Hz",
          "1,234 %", "∞", "any", "unstable", "–"]  # fmt: skip
    browser.open(page)
    button = headings(browser)[0].find_element(By.TAG_NAME, "button")
    browser.run(
        "document.querySelector('table.sortable').tBodies[0].innerHTML ="
        "  arguments[0].map((text) => `<tr><td>${text}</td></tr>`).join('')",
        [up[k * 5 % len(up)] for k in range(len(up))],
    )
    button.click()
    assert column_texts(browser, 0) == up
    button.click()
    assert column_texts(browser, 0) == [*up[-2::-1], up[-1]]


def headings(browser: Browser) -> list[WebElement]:
    """Return the headings of the page's first sortable table."""
    tables = browser.find("table.sortable")
    assert tables, "no table of the page can be sorted"
    return tables[0].find_elements(By.TAG_NAME, "th")


def column_texts(browser: Browser, column: int) -> list[str]:
    """Return the texts in a column of the page's first sortable table."""
    return browser.run(
        "return [...document.querySelector('table.sortable').tBodies[0].rows]"
        ".map((row) => row.cells[arguments[0]].innerText)",
        column,
    )


def number(text: str) -> float | None:
    """Return the number that a cell begins with, if it does."""
    found = re.match(r"-?[\d.]+(e-?\d+)?", text.replace("−", "-").replace(",", ""))
    return float(found[0]) if found else None


def test_page_prints_whole(browser: Browser, page: str) -> None:
    browser.open(page, PAPER, media="print", unfolded=False)
    assert browser.run(CUT_OFF, "html, .wide, figure, pre") == []
    folded = browser.run(
        "return [...document.querySelectorAll('details > *')]"
        ".filter((part) => !part.checkVisibility()).map((part) => part.tagName)"
    )
    assert folded == []
    height = browser.run("return document.querySelector('footer').getBoundingClientRect().bottom")
    printed = browser.command("Page.printToPDF", paperWidth=8.27, paperHeight=11.69)
    pages = len(re.findall(rb"/Type\s*/Page\b", base64.b64decode(printed["data"])))
    assert pages >= height / A4_HEIGHT
