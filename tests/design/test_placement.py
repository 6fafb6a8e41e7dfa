"""Placed poles are hit, by gains that another formula in many digits confirms."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import control
import numpy as np
import pytest
from design_problems import OBJECTIVE, TWO_SENSORS, arms, design_plant, pole_distance, uniform_arm
from hypothesis import given
from hypothesis import strategies as st
from placement_oracle import ackermann, characteristic
from scipy.signal import place_poles
from strategies import deterministic

from slewctl import (
    Arm,
    ClampedFree,
    GeneralisedPlant,
    Objective,
    SlewctlError,
    assemble,
    balanced_truncation,
    close,
    generalised_plant,
    lqg,
    truth,
)
from slewctl import (
    arms as catalogue,
)
from slewctl.design import place, place_observer, pole_placement, pole_sensitivity
from slewctl.design.energy_coordinates import scaled
from slewctl.design.placement.pole_pairs import PolePair
from slewctl.design.placement.wishes import faster
from slewctl.files import read_arm

BANDWIDTH = 0.3  # of the first flexible frequency
ADDED = 0.05


def plant_of(arm: Arm, n: int, objective: Objective = OBJECTIVE) -> GeneralisedPlant:
    return generalised_plant(assemble(arm, ClampedFree(n)), objective)


def wished_poles(plant: GeneralisedPlant, added: float = ADDED) -> np.ndarray:
    """Return the poles that the wishes mean, from the eigenvalues of A."""
    values = np.linalg.eigvals(scaled(plant).A) * scaled(plant).rate
    upper = values[values.imag > 0]
    omega, ratio = np.abs(upper), -upper.real / np.abs(upper) + added
    bandwidth = 2 * np.pi * BANDWIDTH * plant.model.frequencies_hz[0]
    omega, ratio = np.append(omega, bandwidth), np.append(ratio, 0.7)
    half = omega * (-ratio + 1j * np.sqrt(1 - ratio**2))
    return np.concatenate([half, half.conj()])


def in_energy(plant: GeneralisedPlant, matrix: np.ndarray) -> np.ndarray:
    """Return a matrix of the plant's states in those of comparable energy."""
    state = scaled(plant).state
    return np.linalg.solve(state, matrix @ state)


def relative(gain: np.ndarray, exact: np.ndarray) -> float:
    return float(np.linalg.norm(gain - exact) / np.linalg.norm(exact))


@deterministic(12)
@given(arm=arms(), n=st.integers(1, 8), damping=st.floats(1e-4, 0.02))
def test_wishes_are_met_on_random_arms(arm: Arm, n: int, damping: float) -> None:
    plant = plant_of(replace(arm, damping_ratio=damping), n)
    wanted = wished_poles(plant)
    bandwidth = BANDWIDTH * plant.model.frequencies_hz[0]
    controller = pole_placement(plant, bandwidth_hz=bandwidth, added_damping=ADDED)
    placed = [check for check in controller.certificate.checks if check.name.startswith("poles")]
    assert len(placed) == 2
    assert all(check.passed for check in placed), str(controller.certificate)
    K = controller.gains["state_feedback"]
    closed = np.linalg.eigvals(in_energy(plant, plant.A - plant.B2 @ K))
    assert pole_distance(closed, wanted) < 1e-7


@pytest.mark.slow
@deterministic(8)
@given(arm=arms(), n=st.integers(1, 6), damping=st.floats(1e-4, 0.02))
def test_the_gain_is_that_of_ackermann_in_many_digits(arm: Arm, n: int, damping: float) -> None:
    plant = plant_of(replace(arm, damping_ratio=damping), n)
    state, poles = scaled(plant).state, wished_poles(plant)
    exact = ackermann(plant.A, plant.B2[:, 0], poles)
    assert relative(place(plant, poles)[0] @ state, exact @ state) < 1e-10
    observer = ackermann(plant.A.T, plant.C2[0], poles)
    inverse = np.linalg.inv(state)
    assert relative(inverse @ place_observer(plant, poles)[:, 0], inverse @ observer) < 1e-9


@pytest.mark.parametrize("n", [1, 2, 4, 8])
@pytest.mark.parametrize("damping", [1e-4, 5e-3])
def test_uncoupled_modes_get_their_gain_to_rounding(n: int, damping: float) -> None:
    plant = plant_of(uniform_arm(damping), n)
    energy, poles = scaled(plant).state, wished_poles(plant)
    exact = ackermann(plant.A, plant.B2[:, 0], poles)
    assert relative(place(plant, poles)[0] @ energy, exact @ energy) < 1e-13


@pytest.mark.parametrize("make", [place_poles, None])
@pytest.mark.parametrize("n", [1, 2, 3])
def test_agrees_with_peers_where_they_work(n: int, make: object) -> None:
    plant = plant_of(uniform_arm(), n)
    energy = scaled(plant)
    poles = wished_poles(plant)
    if make is None:
        peer = control.place(energy.A, energy.B2, poles / energy.rate)
    else:
        peer = place_poles(energy.A, energy.B2, poles / energy.rate).gain_matrix
    assert relative(place(plant, poles), energy.state_feedback(np.asarray(peer))) < 1e-10


@pytest.mark.parametrize("voltage", [False, True])
def test_repeated_poles_that_peers_refuse(voltage: bool) -> None:
    objective = Objective(
        {"tip": 0.1, "voltage" if voltage else "torque": 1.0}, {"torque": 0.1, "theta": 0.01}
    )
    arm = replace(catalogue.quanser_flexible_link(), damping_ratio=0.005)
    plant = plant_of(arm, 2, objective)
    energy = scaled(plant)
    poles = np.full(6, -2.0 * energy.rate)
    with pytest.raises(ValueError, match="repeated"):
        place_poles(energy.A, energy.B2, poles / energy.rate)
    K = place(plant, poles)
    exact = ackermann(plant.A, plant.B2[:, 0], poles.astype(complex))
    assert relative(K @ energy.state, exact @ energy.state) < 1e-12
    # Six equal poles are recomputed to a sixth root of rounding; their polynomial is not.
    points = np.array([1.0, 3.0j, -1.0 + 2.0j]) * energy.rate
    closed = in_energy(plant, plant.A - plant.B2 @ K)
    assert characteristic(closed, points) == pytest.approx((points - poles[0]) ** 6, rel=1e-9)


def test_a_mode_left_alone_keeps_its_poles() -> None:
    plant = plant_of(uniform_arm(1e-4), 6)
    bandwidth = BANDWIDTH * plant.model.frequencies_hz[0]
    controller = pole_placement(plant, bandwidth_hz=bandwidth, added_damping=ADDED, leave=[2, 5])
    K, Kf = controller.gains["state_feedback"], controller.gains["observer"]
    states = [2, 5, 9, 12]
    assert np.all(K[:, states] == 0)
    assert np.all(Kf[states] == 0)
    own = plant.model.omega[[1, 4]] * (-1e-4 + 1j * np.sqrt(1 - 1e-8))
    for closed in (plant.A - plant.B2 @ K, plant.A - Kf @ plant.C2):
        values = np.linalg.eigvals(in_energy(plant, closed))
        assert np.abs(values[:, None] - own).min(axis=0) == pytest.approx(
            0, abs=1e-12 * own.imag[1]
        )


@deterministic(10)
@given(arm=arms(), n=st.integers(2, 6))
def test_modes_coupled_by_friction_can_be_left_alone(arm: Arm, n: int) -> None:
    arm = replace(arm, hub=replace(arm.hub, friction=0.1), damping_ratio=0.01)
    plant = plant_of(arm, n)
    energy = scaled(plant)
    controller = pole_placement(
        plant,
        bandwidth_hz=BANDWIDTH * plant.model.frequencies_hz[0],
        added_damping={"1": 0.1},
        leave=range(2, n + 1),
    )
    open_poles = np.linalg.eigvals(energy.A)
    open_poles = open_poles[np.argsort(np.abs(open_poles))][4:]
    K, Kf = controller.gains["state_feedback"], controller.gains["observer"]
    for closed in (plant.A - plant.B2 @ K, plant.A - Kf @ plant.C2):
        values = np.linalg.eigvals(in_energy(plant, closed)) / energy.rate
        gap = np.abs(values[:, None] - open_poles).min(axis=0)
        assert np.all(gap <= 1e-12 * np.abs(open_poles).max())


@deterministic(8)
@given(arm=arms(), n=st.integers(1, 6), factor=st.floats(1e-3, 1e3))
def test_a_faster_clock_scales_the_gains(arm: Arm, n: int, factor: float) -> None:
    arm = replace(arm, damping_ratio=0.005, hub=replace(arm.hub, friction=0.0))
    stiffness = tuple(factor**2 * value for value in arm.beam.bending_stiffness)
    quick = replace(arm, beam=replace(arm.beam, bending_stiffness=stiffness))
    gains = []
    for each in (arm, quick):
        plant = plant_of(each, n)
        omega = plant.model.omega
        bandwidth = BANDWIDTH * plant.model.frequencies_hz[0]
        controller = pole_placement(plant, bandwidth_hz=bandwidth, added_damping=ADDED)
        # In N·m per unit of [ωη, η̇]: a rate, which scales as the clock.
        displacement = np.concatenate([omega[:1], omega])
        gains.append(
            controller.gains["state_feedback"][0] / np.concatenate([displacement, np.ones(n + 1)])
        )
    assert relative(gains[1], factor * gains[0]) < 1e-9


@pytest.mark.parametrize("n", [1, 3, 6])
def test_the_same_gain_in_any_coordinates(n: int) -> None:
    plant = plant_of(uniform_arm(), n)
    physical = generalised_plant(plant.model, OBJECTIVE, coordinates="physical")
    poles = wished_poles(plant)
    U = plant.model.mode_shapes
    T = np.block([[U, np.zeros_like(U)], [np.zeros_like(U), U]])
    energy = scaled(plant).state
    assert relative(place(physical, poles) @ T @ energy, place(plant, poles) @ energy) < 1e-9
    mixed = np.random.default_rng(n).standard_normal((2 * n + 2, 2 * n + 2))
    turned = plant.transformed(mixed @ np.linalg.inv(energy))
    gain = place(turned, poles) @ mixed
    assert relative(gain, place(plant, poles) @ energy) < 1e-6


def test_the_loop_has_the_poles_of_both_gains() -> None:
    plant = plant_of(uniform_arm(), 3, TWO_SENSORS)
    controller = pole_placement(plant, bandwidth_hz=0.3, added_damping=ADDED)
    K, Kf = controller.gains["state_feedback"], controller.gains["observer"]
    both = np.concatenate(
        [
            np.linalg.eigvals(in_energy(plant, plant.A - plant.B2 @ K)),
            np.linalg.eigvals(in_energy(plant, plant.A - Kf @ plant.C2)),
        ]
    )
    assert pole_distance(controller.poles, both) < 1e-8
    assert controller.certificate.verified, str(controller.certificate)


@pytest.mark.parametrize("n", [1, 3, 6])
def test_a_second_sensor_makes_the_observer_less_sensitive(n: int) -> None:
    conditions = []
    for objective in (OBJECTIVE, TWO_SENSORS):
        plant = plant_of(uniform_arm(), n, objective)
        poles = 2 * wished_poles(plant, added=0.2)
        closed = plant.A - place_observer(plant, poles) @ plant.C2
        assert pole_distance(np.linalg.eigvals(in_energy(plant, closed)), poles) < 1e-8
        conditions.append(pole_sensitivity(in_energy(plant, closed)).eigenvectors)
    assert conditions[1] < conditions[0]


def test_several_sensors_take_poles_repeated_more_often_than_sensors() -> None:
    plant = plant_of(uniform_arm(), 2, TWO_SENSORS)
    rate = scaled(plant).rate
    closed = in_energy(plant, plant.A - place_observer(plant, [-rate] * 6) @ plant.C2)
    points = np.array([1.0, 3.0j, -1.0 + 2.0j]) * rate
    assert characteristic(closed, points) == pytest.approx((points + rate) ** 6, rel=1e-9)


@deterministic(30)
@given(frequency=st.floats(0.1, 100), ratio=st.floats(1e-4, 3.0), speed=st.floats(0.2, 10))
def test_an_observer_pair_decays_as_much_faster_as_asked(
    frequency: float, ratio: float, speed: float
) -> None:
    pair = PolePair.mode(frequency, ratio)
    quick = faster(pair, speed)
    assert quick.damping == pytest.approx(speed * pair.damping, rel=1e-12)
    assert quick.ratio <= max(0.7, ratio) * (1 + 1e-12)
    if speed * ratio <= 0.7:
        assert quick.frequency == pytest.approx(frequency, rel=1e-12)


def test_a_damped_estimate_survives_a_wrong_frequency() -> None:
    """Mode 2 of the design model is 1.4 % too high and damped by 0.3 % only."""
    arm = read_arm(Path(__file__).parents[2] / "designs" / "07-pole-placement.toml")
    objective = Objective(
        {"tip": 0.02, "torque": 4.0}, {"torque": 0.2, "theta": 0.005, "theta_dot": 0.1}
    )
    plant, exact = plant_of(arm, 3, objective), truth(arm)
    for damping, stable in ((0.0, False), (0.1, True)):
        controller = pole_placement(
            plant,
            bandwidth_hz=1.0,
            added_damping={"1": 0.2},
            observer_speed=2.0,
            observer_damping=damping,
        )
        assert controller.certificate.verified, str(controller.certificate)
        assert close(exact, objective, controller).stable is stable


def test_sensitivity_of_a_normal_matrix_and_of_a_jordan_block() -> None:
    turn = np.array([[-0.1, 1.0], [-1.0, -0.1]])
    found = pole_sensitivity(turn)
    assert found.eigenvectors == pytest.approx(1)
    assert found.condition == pytest.approx([1, 1])
    assert pole_sensitivity(np.array([[0.0, 1.0], [0.0, 0.0]])).condition.min() > 1e15


@deterministic(6)
@given(n=st.integers(1, 6), seed=st.integers(0, 99))
def test_no_pole_moves_farther_than_bauer_and_fike_allow(n: int, seed: int) -> None:
    plant = plant_of(uniform_arm(), n)
    closed = in_energy(plant, plant.A - plant.B2 @ place(plant, wished_poles(plant)))
    change = np.random.default_rng(seed).standard_normal(closed.shape)
    change *= 1e-3 * scaled(plant).rate / np.linalg.norm(change, 2)
    before, found = pole_sensitivity(closed), np.linalg.eigvals(closed + change)
    moved = np.abs(found[:, None] - before.poles).min(axis=1).max()
    assert moved <= before.eigenvectors * np.linalg.norm(change, 2) * (1 + 1e-9)


def test_design_plant_in_one_line() -> None:
    controller = pole_placement(design_plant(), bandwidth_hz=0.3, added_damping=0.05)
    assert controller.method == "pole-placement"
    assert sum("sensitivity" in line for line in controller.assumptions) == 2


def lagged(plant: GeneralisedPlant, lag: float) -> GeneralisedPlant:
    """The plant with its actuator behind a first-order lag, an odd number of states."""
    system, n, w = plant.system, plant.system.nstates, plant.system.ninputs - 1
    A, B = np.zeros((n + 1, n + 1)), np.zeros((n + 1, w + 1))
    A[:n, :n], A[:n, n], A[n, n] = system.A, system.B[:, -1], -1 / lag
    B[:n, :w], B[n, -1] = system.B[:, :w], 1 / lag
    C = np.hstack([system.C, np.zeros((system.noutputs, 1))])
    slow = control.StateSpace(
        A, B, C, system.D,
        inputs=system.input_labels, outputs=system.output_labels,
        states=[*system.state_labels, "lag"],
    )  # fmt: skip
    return replace(plant, system=slow, model=None)


@deterministic(12)
@given(
    arm=arms(),
    n=st.integers(1, 4),
    lag=st.sampled_from([3e-3, 0.05, 2.0]),
    moved=st.floats(0.5, 3.0),
)
def test_a_lag_is_placed_as_ackermann_does_in_many_digits(
    arm: Arm, n: int, lag: float, moved: float
) -> None:
    """With friction, which couples the modes, and without; the lag moved, or left (moved = 1)."""
    bare = plant_of(replace(arm, damping_ratio=0.005), n)
    plant = lagged(bare, lag)
    poles = np.append(wished_poles(bare), -moved / lag)
    state = scaled(plant).state
    inverse = np.linalg.inv(state)
    exact = ackermann(plant.A, plant.B2[:, 0], poles)
    assert relative(place(plant, poles)[0] @ state, exact @ state) < 1e-9
    observer = ackermann(plant.A.T, plant.C2[0], poles)
    assert relative(inverse @ place_observer(plant, poles)[:, 0], inverse @ observer) < 1e-8


@pytest.mark.parametrize("friction", [0.0, 0.05])
@pytest.mark.parametrize("objective", [OBJECTIVE, TWO_SENSORS])
def test_wishes_leave_a_lag_where_it_is(friction: float, objective: Objective) -> None:
    arm = uniform_arm()
    bare = plant_of(replace(arm, hub=replace(arm.hub, friction=friction)), 3, objective)
    plant = lagged(bare, 3e-3)
    bandwidth = BANDWIDTH * bare.model.frequencies_hz[0]
    controller = pole_placement(plant, bandwidth_hz=bandwidth, added_damping=ADDED)
    assert controller.certificate.verified, str(controller.certificate)
    K = controller.gains["state_feedback"]
    closed = np.linalg.eigvals(in_energy(plant, plant.A - plant.B2 @ K))
    assert pole_distance(closed, np.append(wished_poles(bare), -1 / 3e-3)) < 1e-7
    assert any("not moved: the real pole" in line for line in controller.assumptions)


def test_a_lag_keeps_its_pole_among_faster_ones() -> None:
    bare = plant_of(uniform_arm(), 2)
    plant = lagged(bare, 0.05)
    K = place(plant, [-20.0, -30.0, -40.0, [-1.0, 1.0], [-1.0, -1.0], -2.0, -3.0])
    own = np.linalg.eig(plant.A)
    lag = own[1][:, int(np.argmin(np.abs(own[0] + 20)))].real
    assert abs(K[0] @ lag) < 1e-12 * np.linalg.norm(K) * np.linalg.norm(lag)


@pytest.mark.parametrize("lag_s", [1e-9, 1e-12])
def test_a_lag_too_fast_to_compute_with_is_named(lag_s: float) -> None:
    """Where what its pole is rounded by is as large as the arm's own poles."""
    plant = lagged(design_plant(2), lag_s)
    for design in (lqg, lambda given: balanced_truncation(given, 4)):
        with pytest.raises(SlewctlError, match="lags millions of times as fast"):
            design(plant)
