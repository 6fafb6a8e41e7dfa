"""A moving arm in a real browser: it plays, pauses and is scrubbed; on paper it is poses."""

from __future__ import annotations

import time

import pytest
from browsing import CUT_OFF, PHONE, TEXTS, Browser, contrast

import slewctl as sc
from slewctl.report import write_simulation

BEAM = "return document.querySelector('.moving .beam').getAttribute('d')"
SEEN = "return getComputedStyle(document.querySelector(arguments[0])).display != 'none'"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> str:
    arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    problem = sc.Problem(
        arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01}, slew=sc.Slew(30.0, 4.0)
    )
    found = problem.simulate(sc.lqg(problem.plant("clamped-free", n=1)))
    beside = found.animate(found, names=["one", "other"])
    return str(write_simulation(found, tmp_path_factory.mktemp("slew"), "arm", beside))


def test_it_plays_pauses_and_is_scrubbed(browser: Browser, page: str) -> None:
    browser.driver.get_log("browser")
    browser.open(page)
    assert browser.run(SEEN, ".poses")
    assert not browser.run(SEEN, ".moving")
    button, slider = browser.find(".slew-motion button")[0], browser.find(".slew-motion input")[0]
    button.click()
    assert button.text == "Pause"
    first = browser.run(BEAM)
    deadline = time.monotonic() + 10
    while browser.run(BEAM) == first and time.monotonic() < deadline:
        time.sleep(0.02)
    assert browser.run(BEAM) != first
    button.click()
    assert button.text == "Play"
    assert not browser.run(SEEN, ".poses")
    browser.run("arguments[0].value = 12; arguments[0].dispatchEvent(new Event('input'))", slider)
    assert (
        browser.run("return document.querySelector('.slew-motion output').textContent") == "12.00 s"
    )
    assert button.text == "Again"
    # 30 degrees: the tip is where the arm points at the end.
    x0, y0, x, y = browser.run(
        "const hub = document.querySelector('.hub'), tip = document.querySelector('.moving .tip');"
        "return [hub.cx, hub.cy, tip.cx, tip.cy].map((part) => part.baseVal.value)"
    )
    assert (y0 - y) / (x - x0) == pytest.approx(3**-0.5, abs=0.02)
    assert browser.driver.get_log("browser") == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_a_phone_and_is_legible(browser: Browser, page: str, scheme: str) -> None:
    browser.open(page, PHONE, scheme)
    assert browser.run(CUT_OFF, ".slew-motion") == []
    pale = [text for text in browser.run(TEXTS) if contrast(text["ink"], text["ground"]) < 4.5]
    assert pale == []


def test_on_paper_there_are_poses(browser: Browser, page: str) -> None:
    browser.open(page, media="print")
    assert browser.run(SEEN, ".poses")
    assert not browser.run(SEEN, ".slew-motion .bar")
