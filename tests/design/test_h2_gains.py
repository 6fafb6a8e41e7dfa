"""State feedback and estimator by one inequality each: optimal, bounded, never believed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from design_problems import arms as any_arm
from hypothesis import given, settings

from slewctl import (
    AccuracyError,
    Arm,
    ClampedFree,
    DesignError,
    GeneralisedPlant,
    Hub,
    ModalData,
    Objective,
    Polynomial,
    Slewing,
    arms,
    assemble,
    generalised_plant,
    kalman,
    lqr,
)
from slewctl.basis import Basis, create
from slewctl.design.lmi.h2_gains import (
    H2Gain,
    build_estimator,
    build_state_feedback,
    h2_estimator,
    h2_state_feedback,
    solve_estimator,
    solve_state_feedback,
)

OBJECTIVE = Objective(
    {"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 1e-3, "theta_dot": 1e-2}
)
BOTH = pytest.mark.parametrize("method", [h2_state_feedback, h2_estimator])
Method = Callable[[GeneralisedPlant], H2Gain]


def plant(basis: Basis, hub: float = 0.2, objective: Objective = OBJECTIVE) -> GeneralisedPlant:
    arm = replace(arms.paper_beam(), hub=Hub(hub), damping_ratio=0.005)
    return generalised_plant(assemble(arm, basis), objective)


@pytest.mark.parametrize("hub", [0.0, 0.02, 0.2, 20.0])
@pytest.mark.parametrize("basis", [ClampedFree, Slewing])
@pytest.mark.parametrize("n", [1, 3, 8])
def test_gap_of_the_state_feedback_is_below_1e_12(basis: type[Basis], n: int, hub: float) -> None:
    found = h2_state_feedback(plant(basis(n), hub))
    assert found.certificate.verified
    assert abs(found.gap) < 1e-12
    assert found.iterations <= 25


# 20 functions of a beam; what is known by three modes has no such model.
BEAMS = [name for name in arms.names() if not isinstance(arms.get(name).beam, ModalData)]


@pytest.mark.slow
@pytest.mark.parametrize("name", BEAMS[::2])
def test_gap_of_the_state_feedback_is_below_1e_12_for_42_states(name: str) -> None:
    arm = replace(arms.get(name), damping_ratio=0.005, motor=None, joint=None)
    size = assemble(arm, Polynomial(1))
    torque = 0.1 * size.mass[0, 0] * size.omega[0] ** 2
    objective = Objective(
        {"tip": 0.1 * arm.beam.length, "torque": torque},
        {"torque": 0.1 * torque / size.omega[0] ** 0.5, "theta": 3e-3 / size.omega[0] ** 0.5},
    )
    found = h2_state_feedback(
        generalised_plant(assemble(arm, create("clamped-free", 20)), objective)
    )
    assert found.certificate.verified
    assert abs(found.gap) < 1e-12


@given(any_arm())
@settings(deadline=None, max_examples=10, derandomize=True)
def test_gaps_of_any_arm(arm: Arm) -> None:
    p = generalised_plant(assemble(arm, ClampedFree(2)), OBJECTIVE)
    assert abs(h2_state_feedback(p).gap) < 1e-12
    assert abs(h2_estimator(p).gap) < 1e-9


def test_gains_are_those_of_the_riccati_equations() -> None:
    """The cost is stationary at the optimum: a gap of 1e-14 leaves the gain seven digits."""
    p = plant(ClampedFree(4))
    K, Kf = lqr(p).gain, kalman(p).gain
    np.testing.assert_allclose(h2_state_feedback(p).gain, K, atol=1e-6 * np.abs(K).max())
    np.testing.assert_allclose(h2_estimator(p).gain, Kf, atol=1e-5 * np.abs(Kf).max())


@BOTH
@pytest.mark.parametrize("n", [1, 4])
def test_bound_is_from_below_and_near(method: Method, n: int) -> None:
    found = method(plant(ClampedFree(n)))
    assert found.bound.sense == "at least"
    assert found.bound.bound <= found.optimum * (1 + 1e-11)
    assert found.bound.bound >= found.optimum * (1 - 1e-4)
    assert found.cost >= found.optimum * (1 - 1e-11)


@BOTH
def test_units_of_limits_and_noises_do_not_matter(method: Method) -> None:
    """Twice the limits: a quarter of the cost; twice the noises: four times; the same gain."""
    scaled = Objective({k: 2 * v for k, v in OBJECTIVE.limits.items()}, OBJECTIVE.noise)
    noisy = Objective(OBJECTIVE.limits, {k: 2 * v for k, v in OBJECTIVE.noise.items()})
    first, second, third = (
        method(plant(ClampedFree(2), objective=o)) for o in (OBJECTIVE, scaled, noisy)
    )
    assert second.cost == pytest.approx(first.cost / 4, rel=1e-9)
    assert third.cost == pytest.approx(first.cost * 4, rel=1e-9)
    size = np.abs(first.gain).max()
    np.testing.assert_allclose(second.gain, first.gain, atol=1e-5 * size)
    np.testing.assert_allclose(third.gain, first.gain, atol=1e-5 * size)


def test_a_loose_solver_is_not_called_optimal() -> None:
    problem = build_state_feedback(plant(ClampedFree(2)))
    found = solve_state_feedback(replace(problem, lmi=replace(problem.lmi, tolerance=0.3)))
    assert found.status == "optimal"
    assert found.gap > 1e-6
    assert not found.certificate.verified


def test_problems_can_be_extended() -> None:
    import cvxpy as cp

    for build, solve in (
        (build_state_feedback, solve_state_feedback),
        (build_estimator, solve_estimator),
    ):
        problem = build(plant(ClampedFree(1)))
        free = solve(problem)
        lmi = problem.lmi
        largest = float(np.linalg.eigvalsh(lmi.X.value)[-1])
        for held, works in ((0.7 * largest * np.eye(4), True), (None, False)):
            extra = [lmi.X << held] if works else [cp.trace(lmi.X) >= 1, cp.trace(lmi.X) <= -1]
            longer = cp.Problem(lmi.problem.objective, [*lmi.problem.constraints, *extra])
            changed = replace(problem, lmi=replace(lmi, problem=longer))
            if works:
                assert solve(changed).cost > free.cost * (1 + 1e-6)
                assert not solve(changed).certificate.verified
            else:
                with pytest.raises(AccuracyError, match="relax the constraints"):
                    solve(changed)


@BOTH
def test_assumptions_are_checked(method: Method) -> None:
    objective = Objective({"tip_deflection": 0.1, "torque": 1.0}, OBJECTIVE.noise)
    with pytest.raises(DesignError, match="rigid-body rotation is not penalised"):
        method(plant(Polynomial(2), objective=objective))
