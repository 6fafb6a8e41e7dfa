"""Plots under the pointer and the keyboard of a real browser."""

from __future__ import annotations

import csv
import gzip
import re
from pathlib import Path

import numpy as np
import pytest
from browsing import CUT_OFF, PHONE, REPORTS, TEXTS, Browser, contrast, value, verdict
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

from slewctl.compare import CaseResult, Comparison, StudyResult
from slewctl.files import read_study
from slewctl.report import write_comparison, write_study
from slewctl.report.comparison import section

READOUT = "return document.querySelector('.readout:not([hidden])')?.innerText ?? ''"


@pytest.fixture(scope="module")
def small_page(small_case: CaseResult, tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("small")
    asked = [verdict("nominal", "gain_margin_db", True), verdict("light", "disk_margin", False)]
    shown = [section(0, small_case, asked)]
    return str(write_comparison(Comparison((small_case,)), folder, sections=shown))


@pytest.fixture(scope="module")
def shown(browser: Browser, small_page: str) -> Browser:
    browser.driver.get_log("browser")
    browser.open(small_page)
    return browser


def pointed(browser: Browser, kind: str, x: float, y: float) -> str:
    """Return what is told with the pointer at a part of a figure's width and height."""
    (picture,) = browser.find(f"figure[data-kind={kind}] > svg")
    browser.run("arguments[0].scrollIntoView({block: 'center'})", picture)
    size = picture.rect
    at = int(size["width"] * (x - 0.5)), int(size["height"] * (y - 0.5))
    ActionChains(browser.driver, 0).move_to_element_with_offset(picture, *at).perform()
    return browser.run(READOUT)


def told(text: str, name: str) -> float:
    found = re.search(rf"{re.escape(name)} (−?[\d.]+(?:e−?\d+)?)", text)
    assert found, text
    return float(found[1].replace("−", "-"))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["bode", "nichols", "nyquist", "sensitivity"])
def test_pointer_tells_the_computed_loop(shown: Browser, small_case: CaseResult, kind: str) -> None:
    text = pointed(shown, kind, 0.45, 0.25)
    hertz = told(text, "frequency")
    for curve, line in zip(small_case.curves, text.splitlines()[1:], strict=True):
        assert line.startswith(str(curve.origin))
        at = np.interp(np.log(hertz), np.log(curve.frequency_hz), curve.gain_db)
        turn = np.interp(np.log(hertz), np.log(curve.frequency_hz), curve.phase_deg)
        assert told(line, "|L|") == pytest.approx(at, abs=0.3)
        assert told(line, "arg L") == pytest.approx(turn, abs=3)
        value = 10 ** (told(line, "|L|") / 20) * np.exp(1j * np.radians(told(line, "arg L")))
        assert told(line, "|S|") == pytest.approx(-20 * np.log10(abs(1 + value)), abs=0.01)
    # The same frequency is marked in every figure of the loop.
    for other in ("bode", "nichols", "nyquist", "sensitivity"):
        assert shown.find(f"figure[data-kind={other}] .cursor"), other


def test_pointer_tells_slew_and_poles(shown: Browser, small_case: CaseResult) -> None:
    text = pointed(shown, "slew", 0.5, 0.2)
    stable = next(c for c in small_case.curves if c.slew is not None)
    assert stable.slew is not None
    tip = np.interp(told(text, "time"), stable.slew.t, stable.slew.tip)
    (line,) = (ln for ln in text.splitlines() if ln.startswith(str(stable.origin)))
    assert told(line, "tip") == pytest.approx(tip, abs=2e-3)
    poles = np.concatenate([e.judgement.poles for e in small_case.evaluations])
    text = pointed(shown, "poles", 0.5, 0.3)
    off = np.abs(np.abs(poles) / (2 * np.pi) / told(text, "pole at") - 1)
    assert off.min() < 1e-3
    assert told(text, "decay rate") == pytest.approx(-poles[off.argmin()].real, rel=0.02)


def test_keys_and_buttons_enlarge_and_undo(shown: Browser, small_page: str) -> None:
    # Where the cursor begins is not what an earlier test has left.
    (heading,) = shown.find("h1")
    ActionChains(shown.driver, 0).move_to_element(heading).perform()
    shown.open(small_page)
    (figure,) = shown.find("figure[data-kind=nyquist]")
    (line, *_) = figure.find_elements(By.CSS_SELECTOR, "path.c.o1")
    whole, marks = line.get_dom_attribute("d"), figure.text
    shown.run("arguments[0].focus()", figure)
    figure.send_keys(Keys.ARROW_RIGHT, "+", "+")
    assert told(shown.run(READOUT), "|L|") == pytest.approx(0, abs=1)
    larger = line.get_dom_attribute("d")
    assert larger != whole
    assert figure.text != marks
    # Enlarged, a curve has more points in view and not fewer.
    assert larger.count("L") > whole.count(" ") // 2
    figure.send_keys("0")
    assert (line.get_dom_attribute("d"), figure.text) == (whole, marks)
    enlarge, _, undo = figure.find_elements(By.TAG_NAME, "button")
    enlarge.click()
    assert line.get_dom_attribute("d") != whole
    undo.click()
    assert line.get_dom_attribute("d") == whole


def test_dragging_enlarges_linked_axes(shown: Browser) -> None:
    (picture,) = shown.find("figure[data-kind=bode] > svg")
    lines = [
        shown.find(f"figure[data-kind={kind}] path.c.o0")[0] for kind in ("bode", "sensitivity")
    ]
    before = [line.get_dom_attribute("d") for line in lines]
    shown.run("arguments[0].scrollIntoView({block: 'center'})", picture)
    size = picture.rect
    (
        ActionChains(shown.driver, 0)
        .move_to_element_with_offset(picture, 0, int(-0.3 * size["height"]))
        .click_and_hold()
        .move_by_offset(int(0.2 * size["width"]), 2)
        .release()
        .perform()
    )
    assert all(line.get_dom_attribute("d") != d for line, d in zip(lines, before, strict=True))
    ActionChains(shown.driver, 0).double_click(picture).perform()
    assert [line.get_dom_attribute("d") for line in lines] == before


def test_designs_can_be_chosen(shown: Browser) -> None:
    boxes = shown.find(".legend input")
    boxes[0].click()
    visible = [line.is_displayed() for line in shown.find("figure[data-kind=bode] path.c")]
    assert not all(visible)
    assert any(visible)
    assert len(pointed(shown, "bode", 0.5, 0.25).splitlines()) == len(boxes)
    boxes[0].click()
    assert all(line.is_displayed() for line in shown.find("figure[data-kind=bode] path.c.o0"))


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_small_page_is_quiet_fits_a_phone_and_stands_out(
    browser: Browser, small_page: str, scheme: str
) -> None:
    browser.driver.get_log("browser")
    browser.open(small_page, PHONE, scheme)
    for box in browser.find("figure button"):
        browser.run("arguments[0].click()", box)
    pointed(browser, "bode", 0.5, 0.25)
    assert browser.driver.get_log("browser") == []
    assert browser.run(CUT_OFF, "html, .plots figure") == []
    texts = browser.run(TEXTS)
    assert [t for t in texts if t["size"] < (8 if t["drawn"] else 11)] == []
    assert {t["text"] for t in texts if contrast(t["ink"], t["ground"]) < 7} == set()


@pytest.fixture(scope="module")
def study_page(tmp_path_factory: pytest.TempPathFactory) -> str:
    with gzip.open(REPORTS / "study" / "rows.csv.gz", "rt") as file:
        rows = [{k: value(k, v) for k, v in row.items()} for row in csv.DictReader(file)]
    few = [r for r in rows if r["method"] == "lqg" and r["basis"] in ("clamped-free", "polynomial")]
    study = read_study(REPORTS.parent / "designs" / "studies" / "basis.toml")
    return str(write_study(StudyResult(study, few), tmp_path_factory.mktemp("study")))


def test_cells_of_a_map_tell_their_case_and_open_it(browser: Browser, study_page: str) -> None:
    browser.driver.get_log("browser")
    browser.open(study_page)
    (figure, *_) = browser.find("figure.map")
    browser.run("arguments[0].focus()", figure)
    figure.send_keys(Keys.ARROW_DOWN, Keys.ARROW_UP, Keys.ARROW_RIGHT)
    by_key = browser.run(READOUT)
    assert by_key.startswith("clamped-free, n = 2, hub inertia 0.01 of the beam's")
    assert "192 % lost of the optimal cost" in by_key  # 192.4 % in index.md
    # The pointer tells the same of the same cell.
    frame = browser.find("figure.map .here")[0].rect
    (picture,) = figure.find_elements(By.CSS_SELECTOR, "svg")
    at = frame["x"] + frame["width"] / 2, frame["y"] + frame["height"] / 2
    middle = (
        picture.rect["x"] + picture.rect["width"] / 2,
        picture.rect["y"] + picture.rect["height"] / 2,
    )
    offset = [int(a - b) for a, b in zip(at, middle, strict=True)]
    ActionChains(browser.driver, 0).move_to_element_with_offset(picture, *offset).perform()
    assert browser.run(READOUT) == by_key
    figure.send_keys(Keys.ENTER)
    (dialog,) = browser.find("dialog.case[open]")
    assert by_key.splitlines()[0] in dialog.text
    assert "settling" in dialog.text
    dialog.find_element(By.TAG_NAME, "button").click()
    assert not browser.find("dialog.case[open]")
    assert browser.driver.get_log("browser") == []


def test_without_script_everything_stands(browser: Browser, small_page: str) -> None:
    browser.command("Emulation.setScriptExecutionDisabled", value=True)
    try:
        browser.driver.get(Path(small_page).as_uri())
    finally:
        browser.command("Emulation.setScriptExecutionDisabled", value=False)
    pictures = browser.find("details[open] figure > svg")
    assert len(pictures) == len(browser.find("figure"))
    assert not browser.find(".tools, .legend input")
    for picture in pictures:
        drawn = picture.find_elements(By.CSS_SELECTOR, "path.c, path.p")
        assert any(path.rect["width"] > 20 for path in drawn)
        assert picture.find_elements(By.TAG_NAME, "text")
