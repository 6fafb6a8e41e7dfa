"""Bounded standard deviations: met to rounding, and at the cost that Lagrange multipliers give."""

from __future__ import annotations

import math

import cvxpy as cp
import numpy as np
import pytest
from constrained_problems import OBJECTIVE, in_units, plant
from scipy.optimize import brentq

from slewctl import (
    ClampedFree,
    DesignError,
    GeneralisedPlant,
    InputError,
    Objective,
    assemble,
    generalised_plant,
    lqg,
)
from slewctl.design.lmi import state_feedback
from slewctl.design.lmi.blocks import Block, definiteness
from slewctl.design.lmi.variance_bound import variance_bound
from slewctl.numerics.h2_norm import h2_cost


def deviation(problem: GeneralisedPlant, system: object, name: str) -> float:
    """Return the standard deviation of a signal of the objective's limits in the closed loop."""
    closed = problem.close(system)
    row = list(closed.output_labels).index(f"z_{name}")
    assert problem.objective is not None
    A, B, C = (np.asarray(getattr(closed, key)) for key in "ABC")
    return problem.objective.limits[name] * math.sqrt(h2_cost(A, B, C[row : row + 1]).value)


def weighted(problem: GeneralisedPlant, torque: float, tip: float = 0.1) -> object:
    """Return the LQG controller for other limits: the optimum for some Lagrange multipliers."""
    assert problem.objective is not None
    assert problem.model is not None
    limits = {"tip": tip, "torque": torque}
    return lqg(generalised_plant(problem.model, Objective(limits, problem.objective.noise))).system


@pytest.mark.slow
@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("share", [0.9, 0.5])
def test_an_active_bound_is_met_and_agrees_with_a_multiplier(n: int, share: float) -> None:
    problem = plant(n)
    bound = share * deviation(problem, lqg(problem).system, "torque")
    controller = variance_bound(problem, std_max={"torque": bound})
    assert controller.certificate.verified, controller.certificate
    found = deviation(problem, controller.system, "torque")
    assert found == pytest.approx(bound, rel=1e-6)
    # Independently: the torque's limit at which LQG keeps the bound by itself.
    limit = brentq(
        lambda log: deviation(problem, weighted(problem, math.exp(log)), "torque") - bound,
        math.log(1.6e-3), math.log(1.6), xtol=1e-13,
    )  # fmt: skip
    closed = problem.close(weighted(problem, math.exp(limit)))
    expected = h2_cost(*(np.asarray(getattr(closed, key)) for key in "ABC")).value
    assert controller.h2_cost == pytest.approx(expected, rel=1e-5)


def test_tip_bound_minimising_torque_is_the_dual_of_the_torque_bound_minimising_the_tip() -> None:
    problem = plant(2)
    torque = 0.6 * deviation(problem, lqg(problem).system, "torque")
    first = variance_bound(problem, std_max={"torque": torque}, minimise="tip")
    tip = deviation(problem, first.system, "tip")
    second = variance_bound(problem, std_max={"tip": tip}, minimise="torque")
    assert first.certificate.verified
    assert second.certificate.verified
    assert deviation(problem, second.system, "tip") == pytest.approx(tip, rel=1e-6)
    assert deviation(problem, second.system, "torque") == pytest.approx(torque, rel=1e-5)


def test_a_bound_that_the_optimum_keeps_leaves_it() -> None:
    problem = plant(3)
    best = lqg(problem)
    loose = {"torque": 1.01 * deviation(problem, best.system, "torque"), "theta": 1e3}
    controller = variance_bound(problem, std_max=loose)
    assert controller.h2_cost == pytest.approx(best.h2_cost, rel=1e-9)
    for name, gain in best.gains.items():
        np.testing.assert_allclose(controller.gains[name], gain, rtol=1e-6, atol=1e-9)


def test_what_a_poor_solver_returns_is_marked(monkeypatch: pytest.MonkeyPatch) -> None:
    honest = state_feedback.run

    def poor(cost: object, blocks: object, tolerance: float, margin: float) -> object:
        return honest(cost, blocks, 3e-2, margin)

    monkeypatch.setattr(state_feedback, "run", poor)
    problem = plant(2)
    bound = 0.5 * deviation(problem, lqg(problem).system, "torque")
    controller = variance_bound(problem, std_max={"torque": bound})
    assert not controller.certificate.verified
    failed = [check.name for check in controller.certificate.checks if not check.passed]
    assert "complementarity gap over the cost" in failed


def test_a_block_that_is_not_positive_definite_fails_its_check() -> None:
    values = {
        "good": np.diag([1.0, 1e-9]),
        "flat": np.diag([1.0, 0.0]),
        "bad": np.diag([1.0, -1e-9]),
    }
    blocks = [Block(name, cp.Constant(value)) for name, value in values.items()]
    assert [check.passed for check in definiteness(blocks)] == [True, False, False]


def test_tightening_never_lowers_the_cost() -> None:
    problem = plant(2)
    own = deviation(problem, lqg(problem).system, "torque")
    costs = [
        variance_bound(problem, std_max={"torque": share * own}).h2_cost
        for share in (1.1, 0.9, 0.7, 0.5, 0.35)
    ]
    assert np.all(np.diff(costs) > 0)


def test_several_bounds_hold_together() -> None:
    problem = plant(2)
    best = lqg(problem).system
    torque = 0.95 * deviation(problem, best, "torque")
    free = variance_bound(problem, std_max={"torque": torque}, minimise="tip")
    theta = next(g for g in variance_bound(problem, std_max={"torque": torque, "theta": 1.0})
                 .guarantees if g.name == "standard deviation of theta").achieved  # fmt: skip
    bounds = {
        "torque": torque,
        "theta": theta,
        "tip": 1.02 * deviation(problem, free.system, "tip"),
    }
    controller = variance_bound(problem, std_max=bounds)
    assert controller.certificate.verified
    names = [g.name for g in controller.guarantees]
    assert [f"standard deviation of {name}" in names for name in bounds] == [True] * 3


def test_units_do_not_matter() -> None:
    first = plant(2)
    second = in_units(first, 1e3, 10.0, 1e2)
    torque = 10.0 * 1e3**2 / 1e2**2
    bound = 0.5 * deviation(first, lqg(first).system, "torque")
    one = variance_bound(first, std_max={"torque": bound})
    other = variance_bound(second, std_max={"torque": bound * torque})
    assert other.h2_cost == pytest.approx(one.h2_cost, rel=1e-6)


def test_physical_coordinates_may_go_in() -> None:
    modal = plant(2)
    model = modal.model
    assert model is not None
    physical = modal.transformed(np.kron(np.eye(2), model.mode_shapes))
    bound = 0.5 * deviation(modal, lqg(modal).system, "torque")
    one = variance_bound(modal, std_max={"torque": bound})
    other = variance_bound(physical, std_max={"torque": bound})
    assert other.certificate.verified
    assert other.h2_cost == pytest.approx(one.h2_cost, rel=1e-6)


def test_bounds_that_exclude_each_other_say_what_is_possible() -> None:
    problem = plant(1)
    own = {name: deviation(problem, lqg(problem).system, name) for name in ("torque", "tip")}
    bounds = {"torque": 0.4 * own["torque"], "tip": 1.02 * own["tip"]}
    with pytest.raises(DesignError) as caught:
        variance_bound(problem, std_max=bounds)
    advised = dict(
        part.split(" = ") for part in caught.value.remedy.split("kept: ")[1].split(", or ")
    )
    assert set(advised) == {"std_max.torque", "std_max.tip"}
    for key, value in advised.items():
        relaxed = {**bounds, key.removeprefix("std_max."): float(value)}
        assert variance_bound(problem, std_max=relaxed).certificate.verified
        tighter = {**bounds, key.removeprefix("std_max."): 0.98 * float(value)}
        with pytest.raises(DesignError):
            variance_bound(problem, std_max=tighter)


def test_a_bound_below_the_estimation_error_asks_for_better_sensors() -> None:
    with pytest.raises(DesignError, match="better sensors"):
        variance_bound(plant(1), std_max={"tip": 1e-6})


@pytest.mark.parametrize(
    ("options", "where"),
    [
        ({"std_max": {}}, "std_max"),
        ({"std_max": 3.0}, "std_max"),
        ({"std_max": {"torque": 0.0}}, "std_max.torque"),
        ({"std_max": {"voltage": 1.0}}, "std_max.voltage"),
        ({"std_max": {"tips": 1.0}}, "std_max"),
        ({"std_max": {"torque": 1.0}, "minimise": "costs"}, "minimise"),
        ({"std_max": {"theta": 1.0}, "minimise": "tip"}, "std_max"),
    ],
)
def test_impossible_options_are_refused(options: dict[str, object], where: str) -> None:
    with pytest.raises(InputError) as caught:
        variance_bound(plant(1), **options)
    assert caught.value.where == where


def test_a_plant_without_objective_is_refused() -> None:
    from dataclasses import replace

    with pytest.raises(InputError, match="objective"):
        variance_bound(replace(plant(1), objective=None), std_max={"torque": 1.0})


@pytest.mark.slow
def test_eight_functions() -> None:
    problem = generalised_plant(assemble(plant(1).model.arm, ClampedFree(8)), OBJECTIVE)
    bound = 0.5 * deviation(problem, lqg(problem).system, "torque")
    controller = variance_bound(problem, std_max={"torque": bound})
    assert controller.certificate.verified
    assert deviation(problem, controller.system, "torque") == pytest.approx(bound, rel=1e-6)


@pytest.mark.parametrize("bound", [1e-4, 1e-6])
def test_an_actuator_alone_that_cannot_be_bounded_so_low_says_so(bound: float) -> None:
    """The least variance of a single bounded torque is zero and reached by nothing."""
    with pytest.raises(DesignError, match="raise it") as error:
        variance_bound(plant(2), std_max={"torque": bound})
    assert "math domain" not in str(error.value)
