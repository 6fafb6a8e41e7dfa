"""Varied arms: what changes changes exactly, what does not stays, and wrong wishes are refused."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from inspect import Parameter, signature

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from strategies import arms, deterministic, positive

from slewctl import (
    Actuator,
    Arm,
    Beam,
    Hub,
    InputError,
    Joint,
    KelvinVoigt,
    LumpedMass,
    ModalData,
    Motor,
    Payload,
    Rayleigh,
    Sensor,
    Stations,
    truth,
)
from slewctl.arm import vary

PROFILES = {
    "number": 2.0,
    "polynomial": (2.0, -0.5, 0.25),
    "stations": Stations((0.0, 0.4, 0.4, 1.0), (2.0, 1.5, 1.0, 0.7)),
    "callable": lambda x: 2.0 - 0.5 * np.sin(x),
}
CHANGES = [
    name for name, p in signature(vary).parameters.items() if p.kind is Parameter.KEYWORD_ONLY
]
XI = np.linspace(0.0, 1.0, 41)


@given(arms(damping=True))
@deterministic(20)
def test_without_a_change_the_arm_is_the_same(arm: Arm) -> None:
    assert vary(arm) == arm


@pytest.mark.parametrize("name", PROFILES)
def test_a_factor_multiplies_every_kind_of_profile_exactly(name: str) -> None:
    arm = Arm(Beam(1.0, PROFILES[name], PROFILES[name]), Hub(0.3))
    varied = vary(arm, stiffness_factor=0.8, mass_factor=1.5).beam
    # Powers of x are summed term by term, so a factor may round each of them.
    assert_allclose(varied.stiffness_profile(XI), 0.8 * arm.beam.stiffness_profile(XI), rtol=4e-16)
    assert_allclose(varied.mass_profile(XI), 1.5 * arm.beam.mass_profile(XI), rtol=4e-16)
    assert type(varied.mass_profile) is type(arm.beam.mass_profile)
    assert varied.breakpoints == arm.beam.breakpoints
    back = vary(vary(arm, stiffness_factor=2.0), stiffness_factor=0.5)
    assert back.beam.stiffness_profile(XI) == pytest.approx(arm.beam.stiffness_profile(XI))
    twice = vary(arm, stiffness_factor=2.0)
    assert twice == vary(arm, stiffness_factor=2.0)
    assert hash(twice) == hash(vary(arm, stiffness_factor=2.0))


@given(arms(damping=True), positive, positive)
@deterministic(10)
def test_frequencies_follow_similarity(arm: Arm, stiff: float, heavy: float) -> None:
    """ω² scales with EI, and with 1/m when every mass of the arm is multiplied alike."""
    one = truth(arm, 3).omega
    assert_allclose(
        truth(vary(arm, stiffness_factor=stiff), 3).omega, one * np.sqrt(stiff), rtol=1e-9
    )
    all_masses = vary(
        arm,
        mass_factor=heavy,
        hub_inertia=heavy * arm.hub.inertia,
        payload_mass=heavy * arm.payload.mass,
        payload_inertia=heavy * arm.payload.inertia,
    )
    assert_allclose(truth(all_masses, 3).omega, one / np.sqrt(heavy), rtol=1e-9)


def test_each_parameter_changes_its_property_alone() -> None:
    arm = Arm(
        Beam(1.0, 2.0, 3.0),
        Hub(0.5, 0.1, 0.2),
        Payload(0.4, 0.01),
        damping_ratio=(0.01, 0.02),
        damping=Rayleigh(0.1, 1e-4),
        motor=Motor(1.0, 0.1, 0.1, rotor_inertia=1e-4),
        joint=Joint(50.0, 0.3),
        name="all",
        masses=(LumpedMass(0.5, 0.1, 1e-3),),
        actuator=Actuator(lag=0.1, delay=0.2, torque_limit=3.0),
        sensors={"theta": Sensor(lag=0.1, delay=0.2), "tip": Sensor(lag=0.3, delay=0.2)},
    )
    expected = {
        "joint_rotor_inertia": replace(arm, joint=Joint(50.0, 0.3, 2.0)),
        "joint_rotor_friction": replace(arm, joint=Joint(50.0, 0.3, rotor_friction=2.0)),
        "actuator_lag": replace(arm, actuator=Actuator(lag=2.0, delay=0.2, torque_limit=3.0)),
        "actuator_delay": replace(arm, actuator=Actuator(lag=0.1, delay=2.0, torque_limit=3.0)),
        "sensor_lag": replace(arm, sensors=dict.fromkeys(("theta", "tip"), Sensor(2.0, delay=0.2))),
        "sensor_delay": replace(
            arm, sensors={"theta": Sensor(0.1, delay=2.0), "tip": Sensor(0.3, delay=2.0)}
        ),
        "payload_mass": replace(arm, payload=Payload(2.0, 0.01)),
        "payload_inertia": replace(arm, payload=Payload(0.4, 2.0)),
        "hub_inertia": replace(arm, hub=Hub(2.0, 0.1, 0.2)),
        "hub_friction": replace(arm, hub=Hub(0.5, 0.1, 2.0)),
        "hub_radius": replace(arm, hub=Hub(0.5, 2.0, 0.2)),
        "damping_ratio": replace(arm, damping_ratio=0.5),
        "payload_mass_factor": replace(arm, payload=Payload(0.8, 0.01)),
        "hub_inertia_factor": replace(arm, hub=Hub(1.0, 0.1, 0.2)),
        "stiffness_factor": replace(arm, beam=Beam(1.0, 2.0, 6.0)),
        "mass_factor": replace(arm, beam=Beam(1.0, 4.0, 3.0)),
        "joint_stiffness": replace(arm, joint=Joint(2.0, 0.3)),
        "joint_damping": replace(arm, joint=Joint(50.0, 2.0)),
        "joint_stiffness_factor": replace(arm, joint=Joint(100.0, 0.3)),
        "lumped_mass_factor": replace(arm, masses=(LumpedMass(0.5, 0.2, 2e-3),)),
        "frequency_factor": replace(arm, beam=Beam(1.0, 2.0, 12.0)),
        "damping_factor": replace(arm, damping_ratio=(0.02, 0.04), damping=Rayleigh(0.2, 2e-4)),
    }
    data = ModalData(100.0, (1.0, 2.0), (2.0, 3.0))
    of_data = {
        "coupling_factor": Arm(ModalData(100.0, (1.0, 2.0), (4.0, 6.0))),
        "inertia_factor": Arm(ModalData(200.0, (1.0, 2.0), (2.0, 3.0))),
    }
    assert {*expected, *of_data} == set(CHANGES)
    for name, changed in (expected | of_data).items():
        value = 0.5 if name == "damping_ratio" else 2.0
        varied = vary(Arm(data) if name in of_data else arm, **{name: value})
        for field in fields(Arm):
            assert getattr(varied, field.name) == getattr(changed, field.name), (name, field.name)
    internal = replace(arm, damping=KelvinVoigt(1e-3), damping_ratio=0.0)
    assert vary(internal, damping_factor=2.0).damping == KelvinVoigt(2e-3)


@pytest.mark.parametrize("name", CHANGES)
@given(wrong=st.sampled_from([math.nan, math.inf, -1.0, True, "1", [1.0], 1j]))
@deterministic(7)
def test_impossible_values_are_refused_by_name(name: str, wrong: object) -> None:
    arm = Arm(Beam(1.0, 1.0, 1.0), Hub(1.0), Payload(1.0), damping_ratio=0.01)
    with pytest.raises(InputError) as error:
        vary(arm, **{name: wrong})
    assert error.value.where == name
    assert error.value.remedy


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ({"payload_mass": 1.0, "payload_mass_factor": 2.0}, "payload_mass_factor"),
        ({"hub_inertia": 1.0, "hub_inertia_factor": 2.0}, "hub_inertia_factor"),
        ({"payload_mass_factor": 2.0}, "payload_mass_factor"),
        ({"hub_inertia_factor": 2.0}, "hub_inertia_factor"),
        ({"damping_factor": 2.0}, "damping_factor"),
        ({"stiffness_factor": 0.0}, "stiffness_factor"),
        ({"joint_rotor_inertia": 1.0}, "joint_rotor_inertia"),
        ({"sensor_lag": 1.0}, "sensor_lag"),
    ],
)
def test_contradictions_and_factors_of_nothing_are_refused(
    changes: dict[str, float], where: str
) -> None:
    with pytest.raises(InputError) as error:
        vary(Arm(Beam(1.0, 1.0, 1.0)), **changes)
    assert error.value.where == where
    assert error.value.remedy


def test_a_damping_ratio_of_one_and_what_is_no_arm_are_refused() -> None:
    arm = Arm(Beam(1.0, 1.0, 1.0), damping_ratio=(0.01, 0.2))
    assert vary(arm, damping_factor=4.9).damping_ratio == pytest.approx((0.049, 0.98))
    with pytest.raises(InputError, match="damping_factor"):
        vary(arm, damping_factor=5.0)
    with pytest.raises(InputError, match="not an Arm"):
        vary("arm")
