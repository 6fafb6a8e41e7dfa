"""The pages in a real browser: quiet, legible on a phone, in the dark and on paper, sortable."""

from __future__ import annotations

import base64
import json
import re

import pytest
from browsing import (
    A4_HEIGHT,
    CUT_OFF,
    DESKTOP,
    PAPER,
    PHONE,
    REPORTS,
    TEXTS,
    Browser,
    contrast,
    luminance,
)
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.remote.webelement import WebElement

PAGES = [
    "comparison/index.html",
    "study/index.html",
    "paper/index.html",
]


# Module scope keeps the tests of a page together; the page itself is loaded by each.
@pytest.fixture(
    scope="module",
    params=[pytest.param(PAGES[0], marks=pytest.mark.slow), *PAGES[1:]],  # by far the largest
)
def page(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.parametrize("width", [PHONE, DESKTOP])
def test_page_fits_and_is_legible(browser: Browser, page: str, width: int) -> None:
    browser.open(page, width, only_read=True)
    assert browser.run(CUT_OFF, "html") == []
    small = [t for t in browser.run(TEXTS) if t["size"] < (8 if t["drawn"] else 12)]
    assert small == []


@pytest.mark.slow
def test_all_requirements_are_seen_without_scrolling(browser: Browser) -> None:
    browser.open(PAGES[0], DESKTOP, only_read=True)
    wide, seen = browser.run(
        "const box = document.querySelector('.asked').parentElement;"
        "return [box.scrollWidth, box.clientWidth]"
    )
    assert wide <= seen


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.slow
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
