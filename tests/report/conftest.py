"""Fixtures of the report's tests."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator

import pytest
from browsing import Browser

import slewctl as sc
from slewctl.compare import Case, CaseResult, compare


@pytest.fixture(scope="session")
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


@pytest.fixture(scope="session")
def small_case() -> CaseResult:
    """A comparison of a stable design with an unstable one, as small as can be."""
    arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.0), damping_ratio=0.005)
    noise = {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
    objective = sc.Objective({"tip": 0.03, "torque": 1.0}, noise)
    case = Case(
        "small <arm>", arm, objective, basis="slewing", n=2, truth_modes=5,
        bases=("clamped-free", "slewing"), orders=(2,),
    )  # fmt: skip
    return compare([case]).cases[0]
