"""What the five pictures tell is so: their words stand on numbers that may not turn round."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

pytest.importorskip("sphinx", reason="the extra docs is not installed")
sys.path.insert(0, str(Path(__file__).parents[2] / "docs" / "_ext"))
pictures = pytest.importorskip("pictures")


def numbers(name: str) -> dict[str, float]:
    return dict(pictures.PICTURES[name]().numbers)


def test_new_functions_do_not_bend_at_the_root() -> None:
    told = numbers("functions")
    assert told["cantilever"] == pytest.approx(3.516, abs=1e-3)  # (βL)² of the first root
    assert told["new"] == pytest.approx(0, abs=1e-9)


def test_the_better_basis_changes_with_the_hub() -> None:
    told = numbers("errors")
    assert told["slewing_none"] < told["clamped_free_none"] / 100
    assert told["clamped_free_hub"] < told["slewing_hub"] / 100
    assert max(told["arm_matched_none"], told["arm_matched_hub"]) < 1e-5


def test_one_function_is_well_on_its_model_and_lost_on_the_arm() -> None:
    told = numbers("spilled")
    assert told["phase"] > 30
    assert not pictures.loop(1).stable
    assert abs(told["grows"] / told["second"] - 1) < 0.1


@pytest.mark.slow
def test_three_functions_hold_on_the_arm_and_not_with_a_payload() -> None:
    assert pictures.loop(3).margins.confirmed
    assert numbers("margin")["disk"] > 0.5
    told = numbers("verdict")
    assert (told["lost_1"], told["lost_2"], told["lost_3"]) == (2, 0, 0)
    assert told["failing"] == "with a payload of 10 g"
