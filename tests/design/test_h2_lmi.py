"""H2 by matrix inequalities: optimal to rounding, and never believed unverified."""

from __future__ import annotations

from dataclasses import replace

import control
import cvxpy as cp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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
from slewctl.basis import Basis, bases_of, create
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


@pytest.mark.slow
@pytest.mark.parametrize("hub", [0.0, 0.02, 0.2, 20.0])
@pytest.mark.parametrize("basis", [ClampedFree, Slewing])
@pytest.mark.parametrize("n", [1, 2, 4, 8])
def test_gap_is_below_1e_9(basis: type[Basis], n: int, hub: float) -> None:
    assert gap(plant(basis(n), hub)) < 1e-9


CATALOGUE_BASES = [
    (name, basis)
    for name in arms.names()
    for basis in bases_of(arms.get(name))
    if basis in ("clamped-free", "slewing", "hub-matched", "modal")
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "basis"), CATALOGUE_BASES)
def test_gap_is_below_1e_9_for_every_catalogue_arm(name: str, basis: str) -> None:
    arm = replace(arms.get(name), damping_ratio=0.005, motor=None, joint=None)
    first = truth(arm, 1)
    omega = first.omega[0]
    torque = 0.1 * first.mass[0, 0] * omega**2
    objective = Objective(
        {"tip": 0.1 * arm.reach, "torque": torque},
        {"torque": 0.1 * torque / omega**0.5, "theta": 3e-3 / omega**0.5},
    )
    n = 3 if basis == "modal" else 4
    assert gap(generalised_plant(assemble(arm, create(basis, n)), objective)) < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(("basis", "hub"), [(Slewing, 0.0), (ClampedFree, 0.2), (Slewing, 20.0)])
def test_gap_is_below_1e_9_for_42_states(basis: type[Basis], hub: float) -> None:
    problem = build_h2(plant(basis(20), hub))
    controller = solve_h2(problem)
    assert controller.certificate.verified
    assert abs(controller.h2_cost / lqg(problem.plant).h2_cost - 1) < 1e-9
    for lmi in (problem.regulator, problem.filter):
        assert lmi.problem.solver_stats.num_iters <= 25


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


@pytest.mark.slow
@pytest.mark.parametrize("formulation", ["separated", "joint"])
@given(st.integers(0, 10**6), st.floats(0.0, 3.0))
@settings(deadline=None, max_examples=6, derandomize=True)
def test_coordinates_do_not_matter(formulation: str, seed: int, decades: float) -> None:
    """Any similarity transformation, its columns up to three decades apart: K T is the same."""
    p = plant(ClampedFree(2))
    rng = np.random.default_rng(seed)
    mixing, _ = np.linalg.qr(rng.normal(size=(6, 6)))
    T = mixing * 10.0 ** rng.uniform(-decades, decades, size=6)
    first, second = h2_lmi(p), h2_lmi(p.transformed(T), formulation=formulation)
    assert second.certificate.verified, second.certificate
    assert second.h2_cost == pytest.approx(first.h2_cost, rel=1e-7)
    K = first.gains["state_feedback"]
    tolerance = 1e-3 if formulation == "joint" else 1e-5
    np.testing.assert_allclose(
        second.gains["state_feedback"] @ T, K, atol=tolerance * np.abs(K).max()
    )


def test_raw_physical_coordinates_are_as_good() -> None:
    arm = replace(arms.paper_beam(), hub=Hub(0.2), damping_ratio=0.005)
    model = assemble(arm, ClampedFree(8))
    raw = generalised_plant(model, OBJECTIVE, coordinates="physical")
    found = h2_lmi(raw)
    assert found.certificate.verified, found.certificate
    optimum = lqg(generalised_plant(model, OBJECTIVE)).h2_cost
    assert found.h2_cost == pytest.approx(optimum, rel=1e-9)


@pytest.mark.parametrize("formulation", ["separated", "joint"])
def test_the_bound_is_shown_beside_what_is_achieved(formulation: str) -> None:
    p = plant(ClampedFree(3))
    found = h2_lmi(p, formulation=formulation)
    (bound,) = found.guarantees
    optimum = lqg(p).h2_cost
    assert bound.achieved == pytest.approx(found.h2_cost, rel=1e-12)
    assert bound.bound == pytest.approx(optimum, rel=1e-5)
    assert bound.sense == ("at least" if formulation == "separated" else "at most")
    if formulation == "separated":
        # A bound, not an estimate: the violation that the solver leaves is taken off.
        assert bound.bound <= optimum * (1 + 1e-11)
    assert set(found.seconds) == {"build", "solve", "solver"}
    assert found.seconds["solver"] < found.seconds["solve"]
    assert any("independent" in text for text in found.assumptions)


def test_an_inaccurate_solver_is_judged_by_its_result() -> None:
    """What it calls inaccurate may be optimal, and what it calls optimal may not be."""
    problem = build_h2(plant(ClampedFree(2)))
    strict = replace(
        problem,
        regulator=replace(problem.regulator, tolerance=1e-20),
        filter=replace(problem.filter, tolerance=1e-20),
    )
    found = solve_h2(strict)
    assert strict.regulator.problem.status == "optimal_inaccurate"
    assert "optimal, inaccurate" in str(found.certificate)
    assert found.certificate.verified
    loose = replace(problem, filter=replace(problem.filter, tolerance=0.3))
    sloppy = solve_h2(loose)
    assert loose.filter.problem.status == "optimal"
    assert not sloppy.certificate.verified
    assert sloppy.h2_cost > found.h2_cost * (1 + 1e-6)


def test_a_solver_that_stops_is_no_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    def stops(self: cp.Problem, **settings: object) -> None:
        raise cp.error.SolverError("numerical")

    problem = build_h2(plant(ClampedFree(1)))
    monkeypatch.setattr(cp.Problem, "solve", stops)
    with pytest.raises(AccuracyError, match="stopped without a solution"):
        solve_h2(problem)


def test_an_unknown_formulation_is_refused() -> None:
    with pytest.raises(InputError, match="did you mean 'joint'"):
        h2_lmi(plant(ClampedFree(1)), formulation="jiont")


@pytest.mark.parametrize("formulation", ["separated", "joint"])
def test_cross_terms_are_taken_into_account(formulation: str) -> None:
    p = plant(ClampedFree(1))
    B, D = np.array(p.system.B), np.array(p.system.D)
    D[0, -1] = 0.3  # the actuator enters the tip's row of z
    B[:, 1] = 0.05 * B[:, 0]  # the first sensor's noise disturbs too
    crossed = control.StateSpace(
        p.system.A, B, p.system.C, D, inputs=p.system.input_labels, outputs=p.system.output_labels
    )
    turned = replace(p, system=crossed)
    found = h2_lmi(turned, formulation=formulation)
    assert found.certificate.verified, found.certificate
    assert found.h2_cost == pytest.approx(lqg(turned).h2_cost, rel=1e-6)
    assert found.h2_cost != pytest.approx(lqg(p).h2_cost, rel=1e-2)


def test_assumptions_are_checked_before_anything_is_solved() -> None:
    objective = Objective({"tip_deflection": 0.1, "torque": 1.0}, OBJECTIVE.noise)
    with pytest.raises(DesignError, match="rigid-body rotation is not penalised"):
        build_h2(plant(Polynomial(2), objective=objective))
