"""A small sample of the identification benchmark: what it asks of many rigs, asked of a few."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from identification import DELAY, FREQUENCY, HALF_OF_NYQUIST, figures, random_case, summary

from slewctl.measured.elsewhere import elsewhere
from slewctl.measured.record_data import RecordData
from slewctl.measured.record_descent import descend_record, record_slopes
from slewctl.measured.rig_model import modes_for
from slewctl.measured.rig_parameters import Rig, parameters
from slewctl.measured.rig_problem import RigProblem


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "closed"), [(38, True), (15, False)])
def test_a_rig_is_found_again_as_well_as_it_can_be(seed: int, closed: bool) -> None:
    row = figures(random_case(seed, closed=closed, duration=8.0))
    assert max(map(abs, row["frequency"])) < FREQUENCY
    assert abs(row["delay"]) < DELAY
    assert row["scatter"] == pytest.approx(1, abs=0.05)
    assert sum(row["inside"].values()) >= len(row["inside"]) - 2
    # Deviations are not far below Cramér and Rao's; dry friction, which the bound does not
    # count, widens what is told of the rest.
    over = np.array([*row["stated_over_least"].values()])
    assert np.all(over > 0.75)
    assert np.median(over) < 2
    for off, least in zip(row["damping"], row["least"], strict=True):
        assert abs(np.log1p(off)) < 4 * max(least, 0.01)
    assert "1 rigs" in summary([row])


@pytest.mark.slow
def test_a_light_mode_that_was_taken_for_a_heavy_one_is_found() -> None:
    """All but the second mode is fitted as well with a fifth more of mass, stiffness and gain."""
    case = random_case(44, duration=30.0)
    data = RecordData(case.log, modes_for(case.nominal, HALF_OF_NYQUIST))
    free = parameters(case.nominal, case.free, data.channel, HALF_OF_NYQUIST)
    problem = RigProblem(Rig(case.nominal), free)
    scales = np.array([each.scale for each in free])

    def coordinates(values: dict[str, float]) -> np.ndarray:
        told = np.array([values[name] for name in case.free])
        return np.where(problem.logarithmic, np.log(told), told / scales)

    heavy = {name: 1.2 * value for name, value in case.truth.items()}
    heavy |= {"delay": case.delay, "damping.1": case.truth["damping.1"], "damping.2": 0.15}
    heavy["payload.mass"] *= 1.4
    wrong = descend_record(problem, data, coordinates(heavy), fine=False)
    data.weigh(left := data.state_part(problem.rig_at(wrong)),
               record_slopes(problem, data, left, wrong))  # fmt: skip
    wrong = descend_record(problem, data, wrong, fine=False)
    found = elsewhere(problem, data, wrong)
    place = case.free.index("damping.2")
    assert problem.values(wrong)[place] > 0.05
    assert problem.values(found)[place] < 0.01
    assert data.unlikely(problem.rig_at(found)) < data.unlikely(problem.rig_at(wrong)) - 50
    assert elsewhere(problem, data, found) is found
