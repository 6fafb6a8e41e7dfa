"""Where no optimum, or no cost, is known to accuracy, what is known is told with the reason."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from slewctl.compare import compare, spillover_ladder
from slewctl.files import design_of_text
from slewctl.report import write_comparison

# A passive law on an arm without damping: with 28 modes its optimum's own poles are within
# rounding of the axis.
PASSIVE = """
arm = { name = "passive", beam = { length = 1.0, mass_per_length = 0.5, bending_stiffness = 5.0 }, \
hub = { inertia = 2.0, friction = 0.5 } }
controller = { method = "given", pid = { kp = 0.5, kd = 1.0, filter_hz = 2.0 }, \
limits = { theta = 0.1, torque = 1.0 }, noise = { torque = 0.1, theta = 0.01 } }
truth = { modes = 28 }
requirements = { disk_margin = 0.1 }
""".replace("\\\n", "")
# A law that is stable by 1e-10 rad/s: proved, and nothing is known of its cost.
HARDLY = """
arm = { name = "hardly", damping_ratio = 0.001, beam = { length = 1.0, mass_per_length = 0.5, \
bending_stiffness = 3.7e6 }, hub = { inertia = 2.0, friction = 0.18 } }
controller = { method = "given", A = [[-0.11]], B = [[1.36e-12, 8.8e-8]], C = [[1.0]], \
D = [[0.0, 0.0]], inputs = ["theta", "theta_dot"], feedback = "negative", \
limits = { theta = 0.1, torque = 1.0 }, \
noise = { torque = 0.1, theta = 0.01, theta_dot = 0.01 } }
truth = { modes = 4 }
requirements = { stable = true }
""".replace("\\\n", "")


@pytest.mark.slow
def test_an_optimum_that_is_not_verified_stops_neither_ladder_nor_page(tmp_path: Path) -> None:
    case = design_of_text(PASSIVE, tmp_path / "passive.toml").case
    ladder = spillover_ladder(case)
    assert ladder.stable_on_truth
    assert all(rung.value("h2_loss") is None for rung in ladder.rungs[-1:])
    assert ladder.unknown == ""  # of all rungs it is known: noise passes, and costs without end
    found = compare([case])
    assert found.cases[0].truth.optimal_cost is not None
    assert not found.cases[0].truth.optimal_verified
    write_comparison(found, tmp_path / "page")
    assert "The optimum itself is NOT verified" in (tmp_path / "page" / "index.html").read_text()


def test_what_is_not_known_of_a_cost_is_told_and_the_margins_are(tmp_path: Path) -> None:
    case = design_of_text(HARDLY, tmp_path / "hardly.toml").case
    ladder = spillover_ladder(case)
    assert ladder.stable_on_truth
    assert ladder.rungs[-1].value("h2_loss") is None
    assert ladder.rungs[-1].value("disk_margin") == pytest.approx(2.0, abs=1e-4)
    assert ladder.unknown.startswith("h2 loss with N = 1: ")
    found = compare([case])
    (chosen,) = found.cases[0].evaluations
    assert chosen.stable
    assert chosen.loss is None
    assert math.isfinite(found.cases[0].truth.optimal_cost or math.nan)
    write_comparison(found, tmp_path / "page")
    page = (tmp_path / "page" / "index.html").read_text()
    assert "On the truth it is stable" in page
    assert "nothing is known of a slew" in page
    assert "every loop is unstable" not in page
