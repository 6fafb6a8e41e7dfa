"""Verdicts, margins and costs against finite elements and eigenvalues of their own loop.

A verdict is that the loop is stable on the truth and on a truth of twice the modes.  The
elements judge with the same numbers of modes: nothing that is unstable may pass, and nothing
that is stable be refused, but within 1e-9 of the axis.
"""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from finite_elements import elements
from judging import Tally
from own_loop import Law, OwnLoop, plant
from random_designs import Design, random_designs

import slewctl as sc


def holds(tally: Tally, designs: int) -> None:
    """Assert that no verdict is wrong, and that there was something to judge."""
    assert tally.wrong == []
    counts = tally.counts
    assert counts["designs"] == designs
    assert min(counts["stable"], counts["unstable"]) > designs / 4
    assert min(counts[f"next to the axis, {v}"] for v in ("stable", "unstable")) > designs / 2
    assert set(tally.gaps) == {"gain up", "gain down", "phase", "H2 cost"}
    assert tally.wrong_figures == []
    assert counts["margins not confirmed"] == 0


@pytest.mark.slow
def test_no_verdict_is_wrong_and_no_margin_or_cost() -> None:
    tally = Tally().judge(random_designs(1, 10, most_modes=7), figures=3)
    holds(tally, 10)


@pytest.mark.slow
def test_no_verdict_is_wrong_over_many_designs() -> None:
    tally = Tally().judge(random_designs(2, 24), figures=5)
    holds(tally, 24)


@pytest.mark.slow
def test_margins_of_controllers_in_companion_form() -> None:
    """PD and PID with two lags, of which the fast ones make entries of 1e9 and more."""
    shares = {"companion": 0.6, "sampled companion": 0.4}
    tally = Tally().judge(random_designs(5, 20, most_modes=7, shares=shares), figures=10)
    assert tally.wrong == []
    assert tally.wrong_figures == []
    assert tally.counts["with figures"] == 10


@pytest.mark.parametrize("always", [True, False])
def test_a_verdict_that_is_always_the_same_is_found_out(always: bool) -> None:
    class Careless(Design):
        def stable(self, modes: int) -> bool:
            return always

    designs = random_designs(3, 6, most_modes=6)
    careless = [
        Careless(**{item.name: getattr(d, item.name) for item in fields(Design)}) for d in designs
    ]
    counts = Tally().judge(careless).counts
    right, kind = ("unstable", "unstable, passed") if always else ("stable", "stable, refused")
    for which in ("", "next to the axis, "):
        assert counts[f"{which}{kind}"] == counts[f"{which}{right}"] > 0


def test_elements_have_the_published_frequencies() -> None:
    """Of a uniform pinned beam (tan βL = tanh βL), a cantilever, and the paper's beam."""
    uniform = sc.Arm(sc.Beam(2.0, 3.0, 5.0))
    roots = np.array([3.926602312, 7.068582746, 10.210176123, 13.351768778])
    scale = math.sqrt(5.0 / 3.0) / 4.0
    assert elements(uniform, 8).omega[1:5] / scale == pytest.approx(roots**2, rel=1e-8)
    held = replace(uniform, hub=sc.Hub(1e12))
    clamped = np.array([1.875104069, 4.694091133, 7.854757438, 10.995540735])
    assert elements(held, 8).omega[1:5] / scale == pytest.approx(clamped**2, rel=1e-8)
    # Converged, in Hz, with twenty polynomial functions.
    paper = [2.927294, 8.760107, 17.644837, 29.613771, 44.685289, 62.870721]
    found = elements(sc.arms.paper_beam(), 8).omega[1:7] / (2 * math.pi)
    assert found == pytest.approx(paper, abs=1e-6)


def test_a_hub_alone_is_turned_as_newton_says() -> None:
    """A beam of no weight on a heavy hub: J θ̈ = τ, and a PD law's poles in closed form."""
    arm = sc.Arm(sc.Beam(1.0, 1e-9, 1e6), sc.Hub(2.0), damping_ratio=0.01)
    law = Law(
        np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((1, 0)), np.array([[-8.0, -4.0]]),
        ("theta", "theta_dot"), "torque",
    )  # fmt: skip
    poles = OwnLoop(plant(elements(arm, 4), 0, law), law).poles()
    assert np.sort_complex(poles) == pytest.approx([-1 - 1.7320508j, -1 + 1.7320508j], rel=1e-7)
