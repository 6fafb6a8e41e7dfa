"""A small sample of the identification benchmark: what it asks of many rigs, asked of one."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from identification import DELAY, FREQUENCY, figures, random_case, summary


@pytest.mark.slow
def test_a_rig_is_found_again_in_closed_loop() -> None:
    row = figures(random_case(1, closed=True, duration=12.0))
    assert max(map(abs, row["frequency"])) < FREQUENCY
    assert abs(row["delay"]) < DELAY
    assert row["scatter"] == pytest.approx(1, abs=0.05)
    assert sum(row["inside"].values()) >= len(row["inside"]) - 2
    assert "1 rigs" in summary([row])
