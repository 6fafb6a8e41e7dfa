"""A small sample of the identification benchmark: what it asks of many rigs, asked of two."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from identification import DELAY, FREQUENCY, figures, random_case, summary


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "closed"), [(1, False), (5, True)])
def test_a_rig_is_found_again(seed: int, closed: bool) -> None:
    row = figures(random_case(seed, closed=closed, duration=20.0))
    assert max(map(abs, row["frequency"])) < FREQUENCY
    assert abs(row["delay"]) < DELAY
    assert row["scatter"] == pytest.approx(1, abs=0.05)
    assert sum(row["inside"].values()) >= len(row["inside"]) - 2
    assert "1 rigs" in summary([row])
