"""The joint inequality: the same optimum by one change of variables, and room for constraints."""

from __future__ import annotations

from dataclasses import replace

import cvxpy as cp
import numpy as np
import pytest

from slewctl import (
    AccuracyError,
    ClampedFree,
    GeneralisedPlant,
    Hub,
    Objective,
    Slewing,
    arms,
    assemble,
    generalised_plant,
    lqg,
)
from slewctl.basis import Basis, create
from slewctl.design.lmi.h2_joint import build_h2_joint, solve_h2_joint
from slewctl.design.lmi.h2_lmi import h2_lmi

OBJECTIVE = Objective(
    {"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 1e-3, "theta_dot": 1e-2}
)


def plant(basis: Basis, hub: float = 0.2) -> GeneralisedPlant:
    arm = replace(arms.paper_beam(), hub=Hub(hub), damping_ratio=0.005)
    return generalised_plant(assemble(arm, basis), OBJECTIVE)


@pytest.mark.slow
@pytest.mark.parametrize("hub", [0.0, 0.2, 20.0])
@pytest.mark.parametrize("basis", [ClampedFree, Slewing])
@pytest.mark.parametrize("n", [1, 3])
def test_gap_is_below_1e_8(basis: type[Basis], n: int, hub: float) -> None:
    p = plant(basis(n), hub)
    found = h2_lmi(p, formulation="joint")
    assert found.certificate.verified, found.certificate
    assert abs(found.h2_cost / lqg(p).h2_cost - 1) < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize(("basis", "n"), [("hub-matched", 6), ("clamped-free", 8), ("slewing", 8)])
def test_gap_is_below_1e_8_to_n_8(basis: str, n: int) -> None:
    p = plant(create(basis, n))
    found = h2_lmi(p, formulation="joint")
    assert found.certificate.verified, found.certificate
    assert abs(found.h2_cost / lqg(p).h2_cost - 1) < 1e-8


def test_the_variables_mean_what_they_say() -> None:
    """At the optimum Y⁻¹ is the covariance of the estimate's error, X that of the state."""
    p = plant(ClampedFree(1))
    joint = build_h2_joint(p)
    controller = solve_h2_joint(joint)
    both = h2_lmi(p)
    for name, gain in both.gains.items():
        np.testing.assert_allclose(
            controller.gains[name], gain, atol=2e-3 * np.abs(gain).max(), err_msg=name
        )
    X, Y = joint.variables.X.value, joint.variables.Y.value
    n = len(X)
    coupled = np.block([[X, np.eye(n)], [np.eye(n), Y]])
    assert np.linalg.eigvalsh(coupled)[0] > -1e-6


def test_full_and_observer_reconstruction_agree() -> None:
    """A_k from Â is the observer's matrix at the optimum: both close loops of one cost."""
    from slewctl.design.lmi.h2_joint import _reconstructed

    joint = build_h2_joint(plant(ClampedFree(2)))
    controller = solve_h2_joint(joint)
    made, _ = _reconstructed(joint)
    assert joint.setting.cost(made.system) == pytest.approx(controller.h2_cost, rel=1e-6)


def test_a_coupling_constraint_costs_and_is_not_called_optimal() -> None:
    joint = build_h2_joint(plant(ClampedFree(1)))
    free = solve_h2_joint(joint)
    v = joint.variables
    coupled = float(np.trace(v.X.value) + np.trace(v.Y.value))
    longer = cp.Problem(
        joint.problem.objective,
        [*joint.problem.constraints, cp.trace(v.X) + cp.trace(v.Y) <= 0.8 * coupled],
    )
    held = solve_h2_joint(replace(joint, problem=longer))
    assert held.h2_cost > free.h2_cost * (1 + 1e-4)
    assert free.certificate.verified
    assert not held.certificate.verified
    # The inequality's own bound still holds: it is one on this controller, not on the best.
    (bound,) = held.guarantees
    assert bound.check.passed


def test_contradictory_constraints_are_refused() -> None:
    joint = build_h2_joint(plant(ClampedFree(1)))
    longer = cp.Problem(
        joint.problem.objective, [*joint.problem.constraints, cp.trace(joint.variables.W) <= -1]
    )
    with pytest.raises(AccuracyError, match="relax the constraints"):
        solve_h2_joint(replace(joint, problem=longer))
