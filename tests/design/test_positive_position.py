"""Positive position feedback: its stability condition, its tuning, and the damping it adds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from design_problems import OBJECTIVE, arms, design_plant, pole_distance, uniform_arm
from hypothesis import given
from hypothesis import strategies as st
from strategies import deterministic

from slewctl import (
    Arm,
    ClampedFree,
    Controller,
    DesignError,
    GeneralisedPlant,
    InputError,
    Objective,
    assemble,
    generalised_plant,
)
from slewctl.design import pd_notch, positive_position

LIMITS = {"tip": 0.1, "torque": 1.0}
GAUGE = Objective(LIMITS, {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1, "root_moment": 0.1})


def plant_of(arm: Arm, n: int, *sensors: str) -> GeneralisedPlant:
    noise = {"torque": 0.1, "theta": 0.01, **dict.fromkeys(sensors, 0.1)}
    return generalised_plant(assemble(arm, ClampedFree(n)), Objective(LIMITS, noise))


def gain_of(controller: Controller) -> np.ndarray:
    return controller.gains["positive_position"][0]


def vibrations(
    plant: GeneralisedPlant, sensor: str, filters: list[tuple[float, float, float]]
) -> np.ndarray:
    """Return the state matrix of the flexible modes under the filters (κ, ω_f, ζ_f) alone."""
    n, row = plant.model.n, list(plant.sensors).index(sensor)
    flexible = [*range(1, n + 1), *range(n + 2, 2 * n + 2)]
    A = plant.A[np.ix_(flexible, flexible)]
    B, C = plant.B2[flexible], plant.C2[[row]][:, flexible]
    size = len(filters)
    out = np.zeros((1, 2 * size))
    own, into = np.zeros((2 * size, 2 * size)), np.zeros((2 * size, 1))
    for k, (gain, omega, ratio) in enumerate(filters):
        own[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [[0, omega], [-omega, -2 * ratio * omega]]
        into[2 * k + 1], out[0, 2 * k] = omega, gain
    return np.block([[A, B @ out], [into @ C, own]])


@deterministic(15)
@given(
    arm=arms(), n=st.integers(1, 6), omega=st.floats(0.3, 3.0), ratio=st.floats(0.05, 1.0),
    second=st.floats(0.1, 10.0), share=st.floats(0.0, 1.0),
)  # fmt: skip
def test_vibrations_are_stable_exactly_below_static_gain_one(
    arm: Arm, n: int, omega: float, ratio: float, second: float, share: float
) -> None:
    arm = replace(arm, damping_ratio=0.005, hub=replace(arm.hub, friction=0.0))
    plant = plant_of(arm, n, "root_moment")
    model = plant.model
    first = model.omega[0]
    static = np.sum(plant.C2[1, 1 : n + 1] * plant.B2[n + 2 :, 0] / model.omega**2)
    for factor, stable in ((1 - 1e-4, True), (1 + 1e-4, False)):
        gain = factor / static
        filters = [
            (share * gain, omega * first, ratio),
            ((1 - share) * gain, second * first, ratio),
        ]
        poles = np.linalg.eigvals(vibrations(plant, "root_moment", filters))
        assert bool(poles.real.max() < 0) is stable


@deterministic(20)
@given(gain=st.floats(0.01, 0.79))
def test_a_mode_by_itself_gets_the_damping_promised(gain: float) -> None:
    plant = plant_of(uniform_arm(0.0), 1, "root_moment")
    controller = positive_position(plant, bandwidth_hz=1e-3, gain=gain)
    omega = plant.model.omega[0]
    kappa = gain_of(controller)[0]
    tuned = omega / np.sqrt(1 - gain)
    poles = np.linalg.eigvals(vibrations(plant, "root_moment", [(kappa, tuned, np.sqrt(gain))]))
    promised = np.sqrt(gain / (1 - gain)) / 2
    # Double poles: recomputed to the square root of rounding.
    assert np.abs(poles) == pytest.approx([omega] * 4, rel=1e-6)
    assert -poles.real / omega == pytest.approx([promised] * 4, abs=1e-6)
    assert f"damping ratio of {promised:.3g}" in " ".join(controller.assumptions)


@pytest.mark.parametrize("mode", [1, 2])
@pytest.mark.parametrize("gain", [0.05, 0.1])
def test_damping_is_added_to_the_mode(mode: int, gain: float) -> None:
    arm = uniform_arm(0.005, hub=1.0)
    plant = plant_of(arm, 3, "root_moment", "theta_dot")
    gain = gain if mode == 1 else gain / 50
    bandwidth = 0.01 * plant.model.frequencies_hz[0]
    without = pd_notch(plant, bandwidth_hz=bandwidth, notch_modes=[])
    damped = positive_position(plant, bandwidth_hz=bandwidth, gain=gain, modes=[mode])
    assert damped.certificate.verified, str(damped.certificate)
    ratios = [_ratio_near(c.poles, plant.model.omega[mode - 1]) for c in (without, damped)]
    promised = np.sqrt(gain / (1 - gain)) / 2
    assert ratios[0] < 0.02
    assert ratios[1] > 0.5 * promised


def _ratio_near(poles: np.ndarray, omega: float) -> float:
    """Return the smallest damping ratio of the poles within 40 % of a frequency."""
    near = poles[np.abs(np.log(np.abs(poles) / omega)) < np.log(1.4)]
    return float((-near.real / np.abs(near)).min())


def test_the_tip_without_its_rotation_is_the_deflection() -> None:
    arm = uniform_arm()
    found = [
        positive_position(plant_of(arm, 2, sensor), bandwidth_hz=0.05)
        for sensor in ("tip", "tip_deflection")
    ]
    assert pole_distance(found[0].poles, found[1].poles) < 1e-8
    assert gain_of(found[0]) == pytest.approx(gain_of(found[1]), rel=1e-9)


def test_nothing_is_fed_back_of_a_rotation_without_bending() -> None:
    plant = plant_of(uniform_arm(), 2, "tip")
    controller = positive_position(plant, bandwidth_hz=0.05)
    rigid = np.array([1.0, 1.0])  # theta, tip at reach 1 for a turn of 1 rad
    filters = np.asarray(controller.system.B)[2:]
    assert np.abs(filters @ rigid).max() <= 1e-12 * np.abs(filters).max()


def test_signal_is_chosen_or_named() -> None:
    plant = plant_of(uniform_arm(), 2, "tip", "moment@100mm", "root_moment")
    chosen = positive_position(plant, bandwidth_hz=0.05)
    assert any("answer in root_moment" in line for line in chosen.assumptions)
    named = positive_position(plant, bandwidth_hz=0.05, signal_used="moment@100mm")
    assert any("answer in moment@100mm" in line for line in named.assumptions)
    with pytest.raises(InputError, match="unknown name 'theta_dot'"):
        positive_position(plant, bandwidth_hz=0.05, signal_used="theta_dot")


def test_several_modes_take_gains_of_their_own() -> None:
    plant = plant_of(uniform_arm(0.005, hub=1.0), 3, "root_moment", "theta_dot")
    controller = positive_position(plant, bandwidth_hz=0.01, modes=[1, 2], gain=[0.1, 0.002])
    assert gain_of(controller).shape == (2,)
    assert controller.certificate.verified, str(controller.certificate)


def test_signs_that_differ_promise_nothing() -> None:
    arm = uniform_arm(0.005, hub=3.0)
    plant = plant_of(arm, 3, "tip_deflection")
    residues = plant.C2[1, 1:4] * plant.B2[5:, 0]
    assert residues.min() < 0 < residues.max()
    controller = positive_position(plant, bandwidth_hz=0.02)
    assert any("different signs" in line for line in controller.assumptions)
    assert not any("static" in check.name for check in controller.certificate.checks)


@pytest.mark.parametrize(
    ("options", "where", "what"),
    [
        ({}, "bandwidth_hz", "missing"),
        ({"bandwidth_hz": 0.1, "gain": 1.0}, "gain", "not below 1"),
        ({"bandwidth_hz": 0.1, "gain": 0.0}, "gain", "not positive"),
        ({"bandwidth_hz": 0.1, "gain": [0.1, 0.2]}, "gain", "2 gains for 1"),
        ({"bandwidth_hz": 0.1, "gain": "high"}, "gain", "not a finite number"),
        ({"bandwidth_hz": 0.1, "modes": []}, "modes", "names no modes"),
        ({"bandwidth_hz": 0.1, "modes": "1"}, "modes", "names no modes"),
        ({"bandwidth_hz": 0.1, "modes": [3]}, "modes.0", "no mode 3"),
        ({"bandwidth_hz": 0.1, "filter_damping": 0}, "filter_damping", "not positive"),
    ],
)
def test_impossible_options(options: dict[str, object], where: str, what: str) -> None:
    with pytest.raises(InputError, match=what) as caught:
        positive_position(design_plant(2, GAUGE), **options)
    assert caught.value.where == where


def test_bending_must_be_measured() -> None:
    with pytest.raises(DesignError, match="no sensor shows the bending, only theta"):
        positive_position(design_plant(2, OBJECTIVE), bandwidth_hz=0.1)


def test_filters_that_leave_no_stiffness() -> None:
    plant = plant_of(uniform_arm(), 3, "root_moment")
    with pytest.raises(DesignError, match="at 1 nothing is left"):
        positive_position(plant, bandwidth_hz=0.1, modes=[1, 2], gain=0.6)
