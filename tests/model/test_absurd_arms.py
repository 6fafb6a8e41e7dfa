"""Arms of absurd sizes: a finite model or one clear refusal, never a warning or a NaN."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import TypeVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import deterministic

from slewctl import (
    Arm,
    ArmMatched,
    Beam,
    ClampedFree,
    Hub,
    HubMatched,
    InputError,
    Payload,
    SlewctlError,
    Slewing,
    WithStatic,
    assemble,
    truth,
)
from slewctl.model import Model, frequencies

Made = TypeVar("Made")

ORDINARY = {
    "length": 1.0,
    "mass": 1.0,
    "stiffness": 1.0,
    "hub_inertia": 0.1,
    "radius": 0.1,
    "friction": 0.1,
    "payload_mass": 0.2,
    "payload_inertia": 0.01,
}
NAMES = {
    "length": "beam.length",
    "mass": "beam.mass_per_length",
    "stiffness": "beam.bending_stiffness",
    "hub_inertia": "hub.inertia",
    "radius": "hub.radius",
    "friction": "hub.friction",
    "payload_mass": "payload.mass",
    "payload_inertia": "payload.inertia",
}
MODELS: list[Callable[[Arm], Model]] = [
    lambda arm: assemble(arm, ClampedFree(3)),
    lambda arm: assemble(arm, Slewing(3)),
    lambda arm: assemble(arm, HubMatched(3)),
    lambda arm: assemble(arm, ArmMatched(3)),
    lambda arm: assemble(arm, WithStatic(ClampedFree(2))),
    lambda arm: truth(arm, 4),
]


def arm_of(values: dict[str, float]) -> Arm:
    v = ORDINARY | values
    return Arm(
        Beam(v["length"], v["mass"], v["stiffness"]),
        Hub(v["hub_inertia"], v["radius"], v["friction"]),
        Payload(v["payload_mass"], v["payload_inertia"]),
        damping_ratio=0.01,
    )


@pytest.mark.parametrize("name", list(ORDINARY))
@pytest.mark.parametrize("value", [1e150, 1e300])
def test_values_beyond_every_arm_are_refused_by_name(name: str, value: float) -> None:
    with pytest.raises(InputError, match="check the units") as error:
        arm_of({name: value})
    assert error.value.where == NAMES[name]


@pytest.mark.parametrize("name", ["length", "mass", "stiffness"])
def test_values_below_every_arm_are_refused_by_name(name: str) -> None:
    with pytest.raises(InputError, match="check the units") as error:
        arm_of({name: 1e-150})
    assert error.value.where == NAMES[name]


def made_or_refused(make: Callable[[Arm], Made], arm: Arm) -> Made | None:
    """What is made without a warning, or None for a clear refusal."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return make(arm)
        except SlewctlError:
            return None


@deterministic(15)
@given(
    st.dictionaries(
        st.sampled_from(list(ORDINARY)), st.floats(-40, 40).map(lambda e: 10.0**e), max_size=3
    )
)
def test_every_other_arm_has_a_finite_model_or_is_refused(values: dict[str, float]) -> None:
    length = values.get("length", 1.0)
    arm = arm_of(values | {"length": min(max(length, 1e-9), 1e9)})
    for make in MODELS:
        model = made_or_refused(make, arm)
        for name in ("mass", "damping", "stiffness", "omega", "mode_shapes") if model else ():
            assert np.all(np.isfinite(getattr(model, name)))
    locked = made_or_refused(lambda arm: frequencies(arm, 3), arm)
    assert locked is None or np.all(np.isfinite(locked.hz))
