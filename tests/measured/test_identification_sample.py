"""A small sample of the identification benchmark: what it asks of many rigs, asked of a few."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from identification import DELAY, FREQUENCY, figures, random_case, summary


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "closed"), [(1, True), (38, True), (15, False)])
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
