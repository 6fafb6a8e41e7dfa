"""H2 control with bounded spillover: the bound holds, and protects as it says."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest
from constrained_problems import OMEGA, arm, in_units, plant
from design_problems import transfer

from slewctl import (
    DesignError,
    GeneralisedPlant,
    InputError,
    Objective,
    close,
    generalised_plant,
    lqg,
    truth,
)
from slewctl.design.lmi.h2_hinf import h2_hinf
from slewctl.numerics.hinf_norm import peak_gain

CORNER_HZ = 2 * OMEGA / (2 * math.pi)


def gain(
    problem: GeneralisedPlant, controller: control.StateSpace, omega: np.ndarray
) -> np.ndarray:
    """Return |W K S| on a grid, from transfer matrices rather than from a realisation."""
    noise = np.linalg.norm(problem.D21, axis=1)
    s = 1j * omega
    G, K = transfer(problem.control_path, s), transfer(controller, s)
    S = np.linalg.inv(np.eye(G.shape[1]) - G @ K)
    weighted = K @ S * (noise / noise[0])
    return np.abs(s / (s + 2 * math.pi * CORNER_HZ)) * np.linalg.norm(weighted, axis=(1, 2))


def grid(problem: GeneralisedPlant, controller: control.StateSpace) -> np.ndarray:
    poles = np.linalg.eigvals(problem.close(controller).A)
    return np.sort(np.concatenate([np.geomspace(1e-3, 1e4, 600), np.abs(poles)]))


def easy(problem: GeneralisedPlant) -> float:
    """Return ‖W K S‖∞ of the LQG design, about."""
    system = lqg(problem).system
    return float(gain(problem, system, grid(problem, system)).max())


@pytest.mark.slow
@pytest.mark.parametrize(("n", "factor"), [(1, 0.7), (2, 0.3)])
def test_the_bound_holds_on_a_grid_of_transfer_matrices(n: int, factor: float) -> None:
    problem = plant(n)
    bound = factor * easy(problem)
    controller = h2_hinf(problem, hinf_max=bound, weight_hz=CORNER_HZ)
    assert controller.certificate.verified, controller.certificate
    norm, cost = controller.guarantees
    sampled = gain(problem, controller.system, grid(problem, controller.system)).max()
    assert sampled <= norm.achieved * (1 + 1e-6)
    assert sampled == pytest.approx(norm.achieved, rel=1e-2)
    assert norm.achieved <= bound
    assert norm.unit == "N·m/rad"
    assert lqg(problem).h2_cost < cost.achieved <= cost.bound


def test_a_loose_bound_leaves_the_optimum() -> None:
    problem = plant(3)
    controller = h2_hinf(problem, hinf_max=1.01 * easy(problem), weight_hz=CORNER_HZ)
    best = lqg(problem)
    assert controller.h2_cost == pytest.approx(best.h2_cost, rel=1e-9)
    for name, expected in best.gains.items():
        np.testing.assert_allclose(controller.gains[name], expected, rtol=1e-6, atol=1e-9)


def test_near_the_optimum_the_inequalities_cost_next_to_nothing() -> None:
    problem = plant(1)
    controller = h2_hinf(problem, hinf_max=0.97 * easy(problem), weight_hz=CORNER_HZ)
    assert controller.h2_cost == pytest.approx(lqg(problem).h2_cost, rel=0.02)


@pytest.mark.slow
def test_tightening_costs_more_and_less_than_detuning_the_optimum() -> None:
    problem = plant(1)
    limit = easy(problem)
    costs = [
        h2_hinf(problem, hinf_max=factor * limit, weight_hz=CORNER_HZ).h2_cost
        for factor in (0.8, 0.4)
    ]
    assert np.all(np.diff(costs) > 0)
    assert problem.objective is not None
    assert problem.model is not None
    detuned = []
    for torque in np.geomspace(0.05, 1, 4):
        for noise in np.geomspace(1, 10, 6):
            objective = Objective(
                {**problem.objective.limits, "torque": torque * 1.6},
                {name: value * (noise if name != "torque" else 1)
                 for name, value in problem.objective.noise.items()},
            )  # fmt: skip
            system = lqg(generalised_plant(problem.model, objective)).system
            if gain(problem, system, grid(problem, system)).max() <= 0.4 * limit:
                closed = problem.close(system)
                detuned.append(control.norm(closed, 2) ** 2)
    assert costs[-1] < min(detuned)


@pytest.mark.slow
def test_neglected_modes_below_the_bound_cannot_destabilise() -> None:
    """Any stable Δ with |Δ| < |W|/γ: random resonances, scaled up to the edge, stay stable."""
    problem = plant(1, Objective({"tip": 0.1, "torque": 1.6}, {"torque": 0.07, "theta": 1.3e-3}))
    controller = h2_hinf(problem, hinf_max=0.3 * easy(problem), weight_hz=CORNER_HZ)
    gamma = controller.guarantees[0].achieved
    random = np.random.default_rng(1)
    for _ in range(40):
        omega, sign = OMEGA * random.uniform(0.5, 30), random.choice([-1.0, 1.0])
        delta = control.TransferFunction([sign, 0.0], [1, 2 * 0.01 * omega, omega**2])
        at = np.sort(np.concatenate([np.geomspace(1e-2, 1e4, 400), [omega]]))
        weight = np.abs(1j * at / (1j * at + 2 * math.pi * CORNER_HZ))
        room = (weight / gamma / np.abs(delta(1j * at))).min()
        G, extra = problem.control_path, control.ss(0.99 * room * delta)
        total = control.parallel(control.ss(G.A, G.B, G.C, G.D), extra)
        K = controller.system
        A = np.block([[total.A, total.B @ K.C], [K.B @ total.C, K.A]])
        assert np.linalg.eigvals(A).real.max() < 0


def test_the_design_is_stable_on_the_truth() -> None:
    problem = plant(1)
    controller = h2_hinf(problem, hinf_max=0.2 * easy(problem), weight_hz=CORNER_HZ)
    assert problem.objective is not None
    assert close(truth(arm()), problem.objective, controller).stable


@pytest.mark.slow
def test_units_do_not_matter() -> None:
    first = plant(1)
    bound = 0.5 * easy(first)
    second = in_units(first, 10.0, 100.0, 1e3)
    torque = 100.0 * 10.0**2 / 1e3**2
    one = h2_hinf(first, hinf_max=bound, weight_hz=CORNER_HZ)
    other = h2_hinf(second, hinf_max=bound * torque, weight_hz=CORNER_HZ / 1e3)
    assert other.h2_cost == pytest.approx(one.h2_cost, rel=1e-3)
    assert other.guarantees[0].achieved == pytest.approx(
        one.guarantees[0].achieved * torque, rel=1e-2
    )


@pytest.mark.slow
def test_an_impossible_bound_says_what_is_possible() -> None:
    problem = plant(1)
    limit = 1e-7 * easy(problem)
    with pytest.raises(DesignError) as caught:
        h2_hinf(problem, hinf_max=limit, weight_hz=CORNER_HZ)
    text = caught.value.remedy
    possible = float(text.split("hinf_max = ")[1].split(",")[0])
    assert possible > limit
    relaxed = h2_hinf(problem, hinf_max=possible, weight_hz=CORNER_HZ)
    assert relaxed.guarantees[0].achieved <= possible


@pytest.mark.parametrize("option", ["hinf_max", "weight_hz"])
def test_impossible_options_are_refused(option: str) -> None:
    with pytest.raises(InputError) as caught:
        h2_hinf(plant(1), **{"hinf_max": 1.0, "weight_hz": 1.0, option: 0.0})
    assert caught.value.where == option


@pytest.mark.slow
def test_norm_of_random_systems_against_a_fine_grid() -> None:
    random = np.random.default_rng(2)
    for size, inputs, outputs in ((2, 1, 1), (4, 2, 1), (6, 2, 3), (8, 1, 2)):
        for _ in range(5):
            A = random.normal(size=(size, size))
            A -= (np.linalg.eigvals(A).real.max() + 10 ** random.uniform(-2, 0)) * np.eye(size)
            B, C = random.normal(size=(size, inputs)), random.normal(size=(outputs, size))
            D = random.normal(size=(outputs, inputs)) * random.choice([0.0, 1.0])
            system = control.StateSpace(A, B, C, D)
            found = peak_gain(system)
            poles = np.linalg.eigvals(A)
            at = np.concatenate([[0.0], np.geomspace(1e-3, 1e3, 2000), np.abs(poles.imag)])
            sizes = np.linalg.norm(transfer(system, 1j * at), 2, axis=(1, 2))
            assert sizes.max() <= found.value * (1 + 1e-7)
            assert sizes.max() == pytest.approx(found.value, rel=2e-2)


def test_norm_of_a_resonance_in_closed_form() -> None:
    for zeta in (1e-4, 1e-2, 0.5):
        A, B, C = np.array([[0.0, 1.0], [-1.0, -2 * zeta]]), np.array([[0.0], [1.0]]), np.eye(2)[:1]
        exact = 1 / (2 * zeta * math.sqrt(1 - zeta**2))
        assert peak_gain(control.StateSpace(A, B, C, np.zeros((1, 1)))).value == pytest.approx(
            exact, rel=1e-7
        )


@pytest.mark.slow
def test_five_functions() -> None:
    problem = plant(5)
    controller = h2_hinf(problem, hinf_max=0.3 * easy(problem), weight_hz=CORNER_HZ)
    assert controller.certificate.verified, controller.certificate
