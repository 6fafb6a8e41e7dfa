"""Designs judged on the truth: what the comparison says must follow from the loops."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are, solve_continuous_lyapunov

from slewctl import Hub, InputError, Objective, Slew, arms, generalised_plant, truth
from slewctl.compare import (
    QUANTITIES,
    Case,
    CaseResult,
    compare,
    count_designs,
    evaluate,
    read,
)
from slewctl.numerics.balance import balance

# Two comparisons, each made once for all.
pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("comparison")]
OBJECTIVE = Objective(
    {"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 1e-3, "theta_dot": 1e-2}
)


def case_with_hub(inertia: float, **changes: object) -> Case:
    arm = replace(arms.paper_beam(), hub=Hub(inertia), damping_ratio=0.005)
    return Case("case", arm, OBJECTIVE, slew=Slew(30.0, 2.0), **changes)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def heavy_hub() -> CaseResult:
    return compare([case_with_hub(0.1944, orders=(1, 2, 3))]).cases[0]


@pytest.fixture(scope="module")
def no_hub() -> CaseResult:
    return compare([case_with_hub(0.0, orders=(1, 2, 3))]).cases[0]


def least_cost(result: CaseResult) -> float:
    """Return the optimum on the truth by scipy's Riccati solver: tr BᵀXB + tr R K P Kᵀ."""
    plant = generalised_plant(truth(result.case.arm, result.truth.modes), OBJECTIVE)
    R, V = plant.D12.T @ plant.D12, plant.D21 @ plant.D21.T
    X = solve_continuous_are(plant.A, plant.B2, plant.C1.T @ plant.C1, R)
    P = solve_continuous_are(plant.A.T, plant.C2.T, plant.B1 @ plant.B1.T, V)
    gain = np.linalg.solve(R, plant.B2.T @ X)
    return float(np.trace(plant.B1.T @ X @ plant.B1) + np.trace(R @ gain @ P @ gain.T))


def test_a_loss_is_the_cost_over_the_optimum_and_never_negative(
    heavy_hub: CaseResult, no_hub: CaseResult
) -> None:
    for result in (heavy_hub, no_hub):
        plant = generalised_plant(truth(result.case.arm, result.truth.modes), OBJECTIVE)
        optimum, stable = least_cost(result), [e for e in result.evaluations if e.stable]
        assert len(stable) >= 3
        for evaluation in stable:
            closed = plant.close(evaluation.controller.system)
            A, B, C = (np.asarray(getattr(closed, name)) for name in "ABC")
            s = balance(A)  # in the states as they come scipy knows seven digits
            A, B, C = A / s[:, None] * s, B / s[:, None], C * s
            cost = np.trace(C @ solve_continuous_lyapunov(A, -B @ B.T) @ C.T)
            assert evaluation.loss == pytest.approx(cost / optimum - 1, rel=1e-7, abs=1e-7)
            assert evaluation.loss > -1e-8


def test_losses_shrink_with_order_where_the_basis_converges(heavy_hub: CaseResult) -> None:
    for basis in ("clamped-free", "slewing"):
        losses = [e.loss for e in heavy_hub.evaluations if e.basis == basis]
        assert None not in losses
        assert np.all(np.diff(np.array(losses, dtype=float)) < 1e-7)


def test_ranking_turns_round_with_the_hub(heavy_hub: CaseResult, no_hub: CaseResult) -> None:
    """Section 5 of the physics: each basis wins on its own side of the hub's inertia."""
    loss = {(e.basis, e.n): e.loss for e in heavy_hub.evaluations}
    second = loss["clamped-free", 2]
    assert second is not None
    assert second < 0.03
    slewing = loss["slewing", 2]
    assert slewing is not None
    assert 0.08 < slewing < 0.20
    unstable = {e.basis for e in no_hub.evaluations if not e.stable}
    assert unstable == {"clamped-free"}


def test_unstable_designs_have_a_frequency_and_nothing_else(no_hub: CaseResult) -> None:
    unstable = [e for e in no_hub.evaluations if not e.stable]
    assert unstable
    for e in unstable:
        poles = e.judgement.poles
        assert poles.real.max() > 0
        growing = poles[poles.real.argmax()]
        hertz = pytest.approx(abs(growing) / (2 * np.pi))
        assert e.judgement.unstable_hz[0] == hertz
        assert e.loss is None
        for name in QUANTITIES:
            reading = read(e.judgement, name)
            assert name == "stable" or np.isnan(reading.value)
            assert reading.frequency_hz == hertz


def test_singular_plant_is_reported_as_moving(heavy_hub: CaseResult, no_hub: CaseResult) -> None:
    """Without a hub the optimum rises with the modes kept; with one it has converged."""
    assert abs(heavy_hub.truth.optimum_drift) < 1e-8
    assert abs(no_hub.truth.optimum_drift) > 1e-4
    assert all(followed.converged for followed in heavy_hub.followed)
    assert [s.modes for s in heavy_hub.followed[0].seen] == [20, 40, 80]
    assert [s.modes for s in heavy_hub.followed[1].seen] == [20, 40]


def test_chosen_design_is_among_the_evaluations() -> None:
    case = case_with_hub(0.1944, basis="polynomial", n=3, orders=(1,))
    assert case.candidates == (("clamped-free", 1), ("slewing", 1), ("polynomial", 3))
    result = compare([case]).cases[0]
    assert result.chosen is result.evaluations[-1]
    assert [shape.source for shape in result.shapes] == ["truth", "polynomial"]
    alone = evaluate(case)
    assert alone.loss == result.chosen.loss


def test_progress_is_told_before_each_design() -> None:
    case, told = case_with_hub(0.1944, orders=(1, 2)), []
    compare([case], told.append)
    assert len(told) == count_designs([case]) == 4


def test_costs_are_confirmed_twice(heavy_hub: CaseResult) -> None:
    for e in heavy_hub.evaluations:
        assert e.verified, e.controller.certificate
        assert e.judgement.loop.h2.discrepancy < 1e-9


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"basis": "slewng"}, "did you mean 'slewing'"),
        ({"method": "lqq"}, "did you mean 'lqg'"),
        ({"n": 0}, "whole number >= 1"),
        ({"bases": ("nothing",)}, "compare.bases"),
        ({"truth_modes": 4}, "cannot judge a model of 5 functions"),
    ],
)
def test_impossible_cases_are_refused(changes: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=r"model|controller|compare|truth") as caught:
        case_with_hub(0.0, **changes)
    assert words in str(caught.value)


def test_an_alternative_without_a_design_costs_only_itself() -> None:
    case = case_with_hub(
        0.1944, method="pole-placement", n=2, orders=(1, 2), bases=("clamped-free",),
        options={"bandwidth_hz": 0.3, "added_damping": {"2": 0.1}}, truth_modes=6,
    )  # fmt: skip
    (result,) = compare([case]).cases
    assert [e.n for e in result.evaluations] == [2]
    ((refusal),) = result.refused
    assert (refusal.basis, refusal.n) == ("clamped-free", 1)
    assert "the design model has 1 flexible mode, no mode 2" in refusal.reason
    with pytest.raises(InputError, match="no mode 2"):
        compare([replace(case, n=1)])
    with pytest.raises(InputError, match="no such option"):
        case_with_hub(0.1944, options={"bandwith_hz": 0.3})


def test_ladders_end_where_the_designs_are_judged(
    heavy_hub: CaseResult, no_hub: CaseResult
) -> None:
    for result in (heavy_hub, no_hub):
        by_basis = {e.basis: e for e in result.evaluations if e.n == result.case.n}
        assert {ladder.origin.basis for ladder in result.ladders} == set(by_basis)
        for ladder in result.ladders:
            last, judged = ladder.rungs[-1], by_basis[ladder.origin.basis]
            assert (last.modes, last.stable) == (result.truth.modes, judged.stable)
            if judged.stable:
                assert last.judgement.cost == judged.judgement.cost
            assert ladder.rungs[0].modes == result.case.n
