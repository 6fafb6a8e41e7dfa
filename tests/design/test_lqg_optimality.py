"""LQG is the separation of two problems, and nothing near it is better."""

from __future__ import annotations

import control
import numpy as np
import pytest
from design_problems import (
    OBJECTIVE,
    OBJECTIVES,
    Array,
    arms,
    design_plant,
    pole_distance,
    uniform_arm,
)
from hypothesis import given, settings

from slewctl import (
    Arm,
    ClampedFree,
    Controller,
    GeneralisedPlant,
    Objective,
    assemble,
    generalised_plant,
    kalman,
    lqg,
    lqr,
)
from slewctl import arms as catalogue
from slewctl.numerics.h2_norm import h2_cost


def cost_of(plant: GeneralisedPlant, A: Array, B: Array, C: Array) -> float:
    """Return the H2 cost of a controller given by its matrices; infinite when unstable."""
    system = control.StateSpace(A, B, C, 0, inputs=list(plant.sensors), outputs=["torque"])
    closed = plant.close(system)
    if np.linalg.eigvals(closed.A).real.max() >= 0:
        return np.inf
    return h2_cost(closed.A, closed.B, closed.C).value


def matrices(controller: Controller) -> tuple[Array, Array, Array]:
    system = controller.system
    return np.asarray(system.A), np.asarray(system.B), np.asarray(system.C)


@given(arms())
@settings(deadline=None, max_examples=20, derandomize=True)
def test_separation_principle(arm: Arm) -> None:
    plant = generalised_plant(assemble(arm, ClampedFree(2)), OBJECTIVE)
    closed = np.linalg.eigvals(plant.close(lqg(plant).system).A)
    regulator = np.linalg.eigvals(plant.A - plant.B2 @ lqr(plant).gain)
    observer = np.linalg.eigvals(plant.A - kalman(plant).gain @ plant.C2)
    # Regulator and observer poles may nearly coincide: then rounding enters by its root.
    assert pole_distance(closed, np.concatenate([regulator, observer])) < 1e-7


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("seed", range(10))
def test_no_perturbed_controller_is_better(objective: Objective, seed: int) -> None:
    plant = design_plant(2, objective)
    best = lqg(plant)
    rng = np.random.default_rng(seed)
    for size in (1e-4, 1e-3, 1e-2, 0.1):
        moved = [m * (1 + size * rng.standard_normal(m.shape)) for m in matrices(best)]
        assert cost_of(plant, *moved) >= best.h2_cost * (1 - 1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_cost_is_stationary_at_the_optimum(seed: int) -> None:
    plant = design_plant(2)
    best = lqg(plant)
    rng = np.random.default_rng(seed)
    _, B, C = matrices(best)
    dB, dC = B * rng.standard_normal(B.shape), C * rng.standard_normal(C.shape)
    A = matrices(best)[0]

    def excess(step: float) -> float:
        return cost_of(plant, A, B + step * dB, C + step * dC) / best.h2_cost - 1

    # First order vanishes: halving the step quarters the excess, but for the third order.
    assert excess(1e-4) > 0
    assert excess(2e-4) / excess(1e-4) == pytest.approx(4, rel=1e-2)
    assert excess(-1e-4) / excess(1e-4) == pytest.approx(1, rel=2e-2)


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("modes", [1, 3, 8])
def test_cost_by_both_dual_formulas(objective: Objective, modes: int) -> None:
    plant = design_plant(modes, objective)
    regulator, observer = lqr(plant), kalman(plant)
    K, Kf, X, Y = regulator.gain, observer.gain, regulator.X, observer.X
    control_side = np.trace(plant.B1.T @ X @ plant.B1) + np.trace(
        plant.D12 @ K @ Y @ K.T @ plant.D12.T
    )
    filter_side = np.trace(plant.C1 @ Y @ plant.C1.T) + np.trace(
        plant.D21.T @ Kf.T @ X @ Kf @ plant.D21
    )
    # All three are tr of products of matrices known to 1e-11 or better.
    cost = lqg(plant).h2_cost
    assert cost == pytest.approx(control_side, rel=1e-9)
    assert cost == pytest.approx(filter_side, rel=1e-9)


def test_output_feedback_costs_more_than_state_feedback() -> None:
    plant = design_plant(3)
    state_feedback = float(np.trace(plant.B1.T @ lqr(plant).X @ plant.B1))
    assert lqg(plant).h2_cost > state_feedback


def test_another_sensor_never_costs() -> None:
    more = Objective(OBJECTIVE.limits, {**OBJECTIVE.noise, "tip": 0.05})
    assert lqg(design_plant(3, more)).h2_cost < lqg(design_plant(3)).h2_cost


@pytest.mark.parametrize("objective", OBJECTIVES[:1])
@pytest.mark.parametrize("modes", [1, 3])
def test_positive_angle_yields_negative_torque(objective: Objective, modes: int) -> None:
    controller = lqg(design_plant(modes, objective)).system
    A, B, C = (np.asarray(getattr(controller, name)) for name in "ABC")
    steady = -(C @ np.linalg.solve(A, B))
    assert steady[0, 0] < 0


@pytest.mark.parametrize("arm", [catalogue.get("paper-beam"), uniform_arm(0.0)])
@pytest.mark.parametrize("modes", [1, 4, 8])
def test_undamped_arm_is_stabilised(arm: Arm, modes: int) -> None:
    plant = generalised_plant(assemble(arm, ClampedFree(modes)), OBJECTIVE)
    controller = lqg(plant)
    assert controller.certificate.verified, str(controller.certificate)
    assert np.linalg.eigvals(plant.close(controller.system).A).real.max() < 0
