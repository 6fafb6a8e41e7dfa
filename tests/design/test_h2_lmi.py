"""H2 by matrix inequalities: optimal to rounding, and never believed unverified."""

from __future__ import annotations

from dataclasses import replace

import control
import cvxpy as cp
import numpy as np
import pytest

from slewctl import (
    AccuracyError,
    Arm,
    Beam,
    ClampedFree,
    DesignError,
    GeneralisedPlant,
    Hub,
    InputError,
    Objective,
    Payload,
    Polynomial,
    Slewing,
    arms,
    assemble,
    generalised_plant,
    lqg,
    truth,
)
from slewctl.basis import Basis, create
from slewctl.design import build_h2, h2_lmi, solve_h2

OBJECTIVE = Objective(
    {"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 1e-3, "theta_dot": 1e-2}
)


def plant(basis: Basis, hub: float = 0.2, objective: Objective = OBJECTIVE) -> GeneralisedPlant:
    arm = replace(arms.paper_beam(), hub=Hub(hub), damping_ratio=0.005)
    return generalised_plant(assemble(arm, basis), objective)


def gap(p: GeneralisedPlant) -> float:
    """Return J/J_Riccati − 1, both costs recomputed from a Lyapunov equation."""
    controller = h2_lmi(p)
    assert controller.certificate.verified, controller.certificate
    return abs(controller.h2_cost / lqg(p).h2_cost - 1)


@pytest.mark.parametrize("hub", [0.0, 0.02, 0.2, 20.0])
@pytest.mark.parametrize("basis", [ClampedFree, Slewing])
@pytest.mark.parametrize("n", [1, 2, 4, 8])
def test_gap_is_below_1e_9(basis: type[Basis], n: int, hub: float) -> None:
    assert gap(plant(basis(n), hub)) < 1e-9


@pytest.mark.parametrize("name", arms.names())
@pytest.mark.parametrize("basis", ["clamped-free", "slewing", "hub-matched"])
def test_gap_is_below_1e_9_for_every_catalogue_arm(name: str, basis: str) -> None:
    arm = replace(arms.get(name), damping_ratio=0.005, motor=None)
    omega = truth(arm, 1).omega[0]
    torque = 0.1 * assemble(arm, Polynomial(1)).mass[0, 0] * omega**2
    objective = Objective(
        {"tip": 0.1 * arm.beam.length, "torque": torque},
        {"torque": 0.1 * torque / omega**0.5, "theta": 3e-3 / omega**0.5},
    )
    assert gap(generalised_plant(assemble(arm, create(basis, 4, arm)), objective)) < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("hub", [0.0, 0.2, 20.0])
@pytest.mark.parametrize("basis", [ClampedFree, Slewing])
@pytest.mark.parametrize("n", [14, 20])
def test_gap_is_below_1e_9_for_42_states(basis: type[Basis], n: int, hub: float) -> None:
    problem = build_h2(plant(basis(n), hub))
    controller = solve_h2(problem)
    assert controller.certificate.verified
    assert abs(controller.h2_cost / lqg(problem.plant).h2_cost - 1) < 1e-9
    for lmi in (problem.regulator, problem.filter):
        assert lmi.problem.solver_stats.num_iters <= 30


def test_state_feedback_is_the_riccati_gain_to_rounding() -> None:
    p = plant(ClampedFree(6))
    ours, reference = h2_lmi(p).gains["state_feedback"], lqg(p).gains["state_feedback"]
    # The cost is stationary at the optimum, so a gap of 1e-15 leaves the gain eight digits.
    np.testing.assert_allclose(ours, reference, rtol=0, atol=1e-6 * np.abs(reference).max())


@pytest.mark.parametrize(("length", "mass", "time"), [(1e-3, 1e3, 1.0), (1e3, 1.0, 1e-2)])
def test_units_do_not_matter(length: float, mass: float, time: float) -> None:
    """The same arm measured in other units: the same relative gap, the same closed loop."""
    torque = mass * length**2 / time**2
    hub = Hub(0.3 * mass * length**2)
    beam = Beam(length, mass / length * 2.0, 5.0 * mass * length**3 / time**2)
    arm = Arm(beam, hub, Payload(0.5 * mass), damping_ratio=0.01)
    objective = Objective(
        {"tip": 0.1 * length, "torque": torque},
        {
            "torque": 0.1 * torque * time**0.5,
            "theta": 1e-3 * time**0.5,
            "theta_dot": 1e-2 * time**-0.5,
        },
    )
    p = generalised_plant(assemble(arm, ClampedFree(3)), objective)
    assert gap(p) < 1e-9


def test_a_constrained_problem_is_not_called_optimal() -> None:
    """The problem may be extended before it is solved; the result then costs more, and says so."""
    problem = build_h2(plant(ClampedFree(2)))
    free = solve_h2(problem)
    largest = float(np.linalg.eigvalsh(problem.regulator.X.value)[-1])
    X = problem.regulator.X
    tight = cp.Problem(
        problem.regulator.problem.objective,
        [*problem.regulator.problem.constraints, X << 0.5 * largest * np.eye(X.shape[0])],
    )
    held = solve_h2(replace(problem, regulator=replace(problem.regulator, problem=tight)))
    assert held.h2_cost > free.h2_cost * (1 + 1e-3)
    assert free.certificate.verified
    assert not held.certificate.verified


def test_contradictory_constraints_are_refused() -> None:
    problem = build_h2(plant(ClampedFree(1)))
    X = problem.regulator.X
    impossible = cp.Problem(
        problem.regulator.problem.objective,
        [*problem.regulator.problem.constraints, cp.trace(X) >= 1, cp.trace(X) <= -1],
    )
    with pytest.raises(AccuracyError, match="relax the constraints"):
        solve_h2(replace(problem, regulator=replace(problem.regulator, problem=impossible)))


def test_other_coordinates_are_refused() -> None:
    p = plant(ClampedFree(2))
    T = np.random.default_rng(1).normal(size=(6, 6))
    s = p.system
    turned = control.StateSpace(
        np.linalg.solve(T, s.A @ T), np.linalg.solve(T, s.B), s.C @ T, s.D,
        inputs=s.input_labels, outputs=s.output_labels,
    )  # fmt: skip
    with pytest.raises(InputError, match="not in modal coordinates"):
        build_h2(replace(p, system=turned))


def test_assumptions_are_checked_before_anything_is_solved() -> None:
    objective = Objective({"tip_deflection": 0.1, "torque": 1.0}, OBJECTIVE.noise)
    with pytest.raises(DesignError, match="rigid-body rotation is not penalised"):
        build_h2(plant(Polynomial(2), objective=objective))
