"""PD with notches and the lead compensator: exact on the rigid arm, honest on the flexible one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import control
import numpy as np
import pytest
from design_problems import OBJECTIVE, design_plant, uniform_arm
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import solve_continuous_lyapunov
from strategies import deterministic

from slewctl import (
    Arm,
    Beam,
    ClampedFree,
    DesignError,
    GeneralisedPlant,
    Hub,
    InputError,
    Objective,
    arms,
    assemble,
    close,
    generalised_plant,
)
from slewctl.design import lead, pd_notch
from slewctl.design.classical.filters import RigidArm, Section, in_series, low_pass, notch, response
from slewctl.design.classical.pd_notch import PDWish, pd_law
from slewctl.files import read_arm

RATE = Objective({"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1})


def stiff_plant(stiffness: float, objective: Objective = OBJECTIVE) -> GeneralisedPlant:
    """Return the plant of the uniform arm with its bending stiffness multiplied."""
    arm = Arm(Beam(1.0, 1.0, stiffness), Hub(0.3), damping_ratio=0.005)
    return generalised_plant(assemble(arm, ClampedFree(2)), objective)


def nearest(poles: np.ndarray, wanted: Sequence[complex]) -> float:
    """Return the largest relative distance from a wanted pole to the nearest one."""
    targets = np.asarray(wanted)
    return float((np.abs(poles[:, None] - targets).min(axis=0) / np.abs(targets)).max())


def pair(bandwidth_hz: float, ratio: float) -> list[complex]:
    root = np.sqrt(complex(ratio**2 - 1))
    return [2 * np.pi * bandwidth_hz * (-ratio + sign * root) for sign in (1, -1)]


def rigid_gains(rigid: RigidArm, ratio: float, filters: Sequence[Section]) -> np.ndarray:
    """Return k_p and k_d for which s² + 2ζs + 1 divides (J s² + c s) den + k (k_p + k_d s) num.

    All three remainders of the division are of first order, and the equation is linear.
    """
    above, below = np.ones(1), np.ones(1)
    for section in filters:
        above, below = np.polymul(above, section.numerator), np.polymul(below, section.denominator)
    parts = (
        np.polymul([rigid.inertia, rigid.drag, 0.0], below),
        rigid.torque_per_unit * above,
        rigid.torque_per_unit * np.polymul([1.0, 0.0], above),
    )
    own, proportional, derivative = (
        np.append(np.zeros(2), np.polydiv(part, [1.0, 2 * ratio, 1.0])[1])[-2:] for part in parts
    )
    return np.linalg.solve(np.column_stack([proportional, derivative]), -own)


@deterministic(40)
@given(
    inertia=st.floats(1e-3, 1e3),
    drag=st.floats(0.0, 0.2),
    gain=st.floats(0.1, 10.0),
    ratio=st.one_of(st.floats(0.3, 2.0), st.just(1.0)),
    rolloff=st.floats(8.0, 40.0),
    notches=st.lists(st.floats(6.0, 50.0), max_size=3),
)
def test_rigid_arm_gets_exactly_the_poles_wished(
    inertia: float, drag: float, gain: float, ratio: float, rolloff: float, notches: list[float]
) -> None:
    rigid = RigidArm(inertia, drag * inertia, gain)
    sections = [notch(omega, 0.1, 0.3) for omega in notches]
    asked = rigid_gains(rigid, ratio, [low_pass(rolloff), *sections])
    try:
        law = pd_law(rigid, PDWish(1.0, ratio, rolloff), sections)
    except DesignError:
        assert min(asked) < 0  # too much lag for this wish
        return
    assert [law.proportional, law.derivative] == pytest.approx(asked, rel=1e-6)
    assert law.check(rigid).passed
    # det = (J s² + c s) den + k (k_p + k_d s) num must have the factor s² + 2ζs + 1.
    above, below = np.ones(1), np.ones(1)
    for section in law.filters:
        above, below = np.polymul(above, section.numerator), np.polymul(below, section.denominator)
    loop = np.polyadd(
        np.polymul([inertia, drag * inertia, 0.0], below),
        gain * np.polymul([law.derivative, law.proportional], above),
    )
    remainder = np.polydiv(loop, [1.0, 2 * ratio, 1.0])[1]
    assert np.abs(remainder).max() <= 1e-11 * np.abs(loop).max()


@pytest.mark.parametrize("objective", [OBJECTIVE, RATE])
@pytest.mark.parametrize("ratio", [0.5, 0.7])
def test_poles_of_a_stiff_arm_approach_the_wished_ones(objective: Objective, ratio: float) -> None:
    """The error falls like (bandwidth/first frequency)², so a hundredfold with stiffness."""
    errors = []
    for stiffness in (1e4, 1e6, 1e8):
        controller = pd_notch(
            stiff_plant(stiffness, objective), bandwidth_hz=1.0, damping_ratio=ratio, notch_modes=[]
        )
        errors.append(nearest(controller.poles, pair(1.0, ratio)))
    assert errors[0] / errors[1] == pytest.approx(100, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(100, rel=0.05)
    assert errors[2] < 1e-6


def test_voltage_allows_for_friction_and_back_emf() -> None:
    link = arms.quanser_flexible_link()
    stiff = replace(link, beam=Beam(0.381, 0.17, 1e7), damping_ratio=0.005)
    objective = Objective({"tip": 0.1, "voltage": 5.0}, {"torque": 0.01, "theta": 0.001})
    plant = generalised_plant(assemble(stiff, ClampedFree(1)), objective)
    controller = pd_notch(plant, bandwidth_hz=4.0)
    assert nearest(controller.poles, pair(4.0, 0.7)) < 1e-5
    assert controller.system.output_labels == ["voltage"]


def test_a_measured_rate_does_not_change_the_loop() -> None:
    found = [
        pd_notch(design_plant(3, objective), bandwidth_hz=0.2) for objective in (OBJECTIVE, RATE)
    ]
    assert len(found[0].poles) == len(found[1].poles)
    assert nearest(found[0].poles, found[1].poles) < 1e-9
    assert nearest(found[1].poles, found[0].poles) < 1e-9
    for omega in (0.1, 1.3, 20.0):  # the same torque for the same motion
        s = 1j * omega
        (of_angle,), (of_both,) = (np.atleast_2d(c.system(s, squeeze=False)) for c in found)
        assert of_angle[0] == pytest.approx(of_both[0] + s * of_both[1], rel=1e-9)
    # Noise of the rate comes on top of that of the angle, each filtered by its own gain.
    for controller, objective in zip(found, (OBJECTIVE, RATE), strict=True):
        closed = design_plant(3, objective).close(controller.system)
        A, B, C = (np.asarray(getattr(closed, name)) for name in "ABC")
        P = solve_continuous_lyapunov(A, -B @ B.T)
        assert controller.h2_cost == pytest.approx(np.trace(C @ P @ C.T), rel=1e-7)
    assert found[1].h2_cost > found[0].h2_cost


def test_sensors_that_are_not_used_get_no_gain() -> None:
    objective = Objective(
        {"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "tip": 0.02, "theta": 0.01, "root_moment": 0.1}
    )
    controller = pd_notch(design_plant(2, objective), bandwidth_hz=0.2)
    assert controller.sensors == ("tip", "theta", "root_moment")
    assert np.all(np.asarray(controller.system.B)[:, [0, 2]] == 0)
    assert any("not fed back: tip, root_moment" in line for line in controller.assumptions)


@deterministic(30)
@given(
    omega=st.floats(1e-2, 1e4), depth=st.floats(1e-3, 0.9), width=st.floats(0.01, 2.0),
    above=st.floats(0.01, 100.0),
)  # fmt: skip
def test_notch_leaves_its_depth_at_the_mode_and_all_far_away(
    omega: float, depth: float, width: float, above: float
) -> None:
    section = notch(omega, depth, width)
    assert abs(section.at(1j * omega)) == pytest.approx(depth, rel=1e-12)
    assert abs(section.at(0j)) == pytest.approx(1)
    assert abs(section.at(1e6j * omega)) == pytest.approx(1, rel=1e-6)
    assert depth * (1 - 1e-12) <= abs(section.at(1j * above * omega)) <= 1 + 1e-12
    # Half the power is left on both sides of a deep notch, `width` apart.
    edges = omega * (np.sqrt(1 + width**2 / 4) + np.array([-width, width]) / 2)
    deep = notch(omega, 1e-9, width)
    assert np.abs(deep.at(1j * edges)) == pytest.approx([math.sqrt(0.5)] * 2, rel=1e-6)


@deterministic(20)
@given(corners=st.lists(st.floats(0.1, 100.0), min_size=1, max_size=4), at=st.floats(0.01, 1e3))
def test_filters_in_series_are_the_product_of_their_responses(
    corners: list[float], at: float
) -> None:
    kinds = [
        lambda w: low_pass(w),
        lambda w: notch(w, 0.1, 0.4),
        lambda w: Section((4.0, 2 * w), (1.0, 2 * w)),
        lambda w: Section((0.0, w, 3.0), (1.0, 3 * w, w**2)),
    ]
    sections = [kind(corner) for kind, corner in zip(kinds, corners, strict=False)]
    system = control.StateSpace(*in_series(sections))
    found = complex(np.asarray(system(1j * at)).ravel()[0])
    assert found == pytest.approx(response(sections, 1j * at), rel=1e-9, abs=1e-12)


def test_controller_is_weak_at_a_notched_mode() -> None:
    plant = design_plant(3)
    omega = plant.model.omega[1]
    plain, notched = (
        pd_notch(plant, bandwidth_hz=0.15, notch_modes=modes, rolloff_hz=20.0)
        for modes in ([], [2])
    )
    gain = [abs(complex(np.asarray(c.system(1j * omega)).ravel()[0])) for c in (plain, notched)]
    assert gain[1] == pytest.approx(0.1 * gain[0], rel=0.1)  # the PD gains differ a little


def boom_plant() -> GeneralisedPlant:
    """Return the boom with a payload of the design files."""
    boom = read_arm(Path(__file__).parents[2] / "designs" / "08-pd-notch.toml")
    return generalised_plant(assemble(boom, ClampedFree(3)), RATE)


def test_automatic_notches_save_a_loop_that_the_filters_lag_makes_unstable() -> None:
    plant = boom_plant()
    wish = {"bandwidth_hz": 1.0, "rolloff_hz": 20.0}
    plain, saved = pd_notch(plant, notch_modes=[], **wish), pd_notch(plant, **wish)
    assert not plain.certificate.verified
    assert plain.poles.real.max() > 0
    assert saved.certificate.verified, str(saved.certificate)
    assert any(line.startswith("notches") and ": mode" in line for line in saved.assumptions)


def test_an_unstable_baseline_is_returned_unverified() -> None:
    controller = pd_notch(boom_plant(), bandwidth_hz=3.0, notch_modes=[], rolloff_hz=8.0)
    assert not controller.certificate.verified
    assert math.isinf(controller.h2_cost)


@pytest.mark.parametrize("lead_deg", [35.0, 50.0, 60.0])
def test_lead_gives_the_phase_margin_of_a_rigid_arm(lead_deg: float) -> None:
    plant = stiff_plant(1e10)
    controller = lead(plant, crossover_hz=1.0, phase_lead_deg=lead_deg)
    assert controller.certificate.verified, str(controller.certificate)
    margins = close(plant.model, OBJECTIVE, controller).margins
    assert margins.phase_deg.value == pytest.approx(lead_deg, abs=1e-3)
    assert margins.phase_deg.frequency_hz == pytest.approx(1.0, rel=1e-5)


@pytest.mark.parametrize(
    ("options", "where", "what"),
    [
        ({}, "bandwidth_hz", "missing"),
        ({"bandwidth_hz": 0}, "bandwidth_hz", "not positive"),
        ({"bandwidth_hz": 1, "damping_ratio": -1}, "damping_ratio", "not positive"),
        ({"bandwidth_hz": 1, "notch_modes": [4]}, "notch_modes.0", "no mode 4"),
        ({"bandwidth_hz": 1, "notch_modes": "all"}, "notch_modes", "names no modes"),
        ({"bandwidth_hz": 1, "notch_modes": [1.5]}, "notch_modes.0", "whole number"),
        ({"bandwidth_hz": 1, "notch_depth": 1.0}, "notch_depth", "not below 1"),
        ({"bandwidth_hz": 1, "notch_width": 0}, "notch_width", "not positive"),
        ({"bandwidth_hz": 1, "rolloff_hz": 1.0}, "rolloff_hz", "not above the bandwidth"),
    ],
)
def test_impossible_options(options: dict[str, object], where: str, what: str) -> None:
    with pytest.raises(InputError, match=what) as caught:
        pd_notch(design_plant(3), **options)
    assert caught.value.where == where


@pytest.mark.parametrize(
    ("options", "where", "what"),
    [
        ({}, "crossover_hz", "missing"),
        ({"crossover_hz": -1}, "crossover_hz", "not positive"),
        ({"crossover_hz": 1, "rolloff_hz": 0.5}, "rolloff_hz", "not above the crossover"),
        ({"crossover_hz": 1, "phase_lead_deg": 0}, "phase_lead_deg", "not positive"),
    ],
)
def test_impossible_leads(options: dict[str, object], where: str, what: str) -> None:
    with pytest.raises(InputError, match=what) as caught:
        lead(design_plant(3), **options)
    assert caught.value.where == where


def test_more_lead_than_one_compensator_gives() -> None:
    with pytest.raises(DesignError, match="more than one compensator can give"):
        lead(design_plant(2), crossover_hz=1.0, phase_lead_deg=85.0)


@pytest.mark.parametrize("method", [pd_notch, lead])
def test_the_angle_must_be_measured(method: object) -> None:
    objective = Objective(OBJECTIVE.limits, {"torque": 0.1, "tip": 0.01})
    with pytest.raises(DesignError, match="neither the angle of the hub nor that of the rotor"):
        method(design_plant(2, objective))


def test_friction_that_damps_more_than_asked() -> None:
    arm = replace(uniform_arm(), hub=Hub(0.3, friction=10.0))
    plant = generalised_plant(assemble(arm, ClampedFree(2)), OBJECTIVE)
    with pytest.raises(DesignError, match="friction and back-EMF alone"):
        pd_notch(plant, bandwidth_hz=0.5)


def test_lag_that_no_gain_makes_up_for() -> None:
    with pytest.raises(DesignError, match="neither may be negative"):
        pd_notch(design_plant(2), bandwidth_hz=0.5, rolloff_hz=0.51, damping_ratio=0.7)


def test_a_plant_made_by_hand_is_refused() -> None:
    with pytest.raises(InputError, match="no model of an arm"):
        pd_notch(replace(design_plant(2), model=None), bandwidth_hz=0.2)


@pytest.mark.parametrize("shape", [{"notch_depth": 0.1}, {"notch_width": 0.5}])
def test_a_shape_without_a_notch_is_refused(shape: dict[str, float]) -> None:
    (name,) = shape
    with pytest.raises(InputError, match=f"{name}: there is no notch to shape"):
        pd_notch(boom_plant(), bandwidth_hz=3.0, notch_modes=[], **shape)
