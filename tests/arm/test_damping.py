"""Damping laws and ratios of an arm: what they accept, and what they mean."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from slewctl.arm import Arm, Beam, KelvinVoigt, Motor, Rayleigh
from slewctl.errors import InputError

BEAM = Beam(1.0, 1.0, 1.0)
FIELDS = [(Rayleigh, "alpha"), (Rayleigh, "beta"), (KelvinVoigt, "retardation_time")]


@pytest.mark.parametrize(("law", "field"), FIELDS)
@pytest.mark.parametrize("value", [math.nan, math.inf, -1e-12, True, "1", None, [1.0]])
def test_laws_are_refused_unless_nonnegative(law: type, field: str, value: object) -> None:
    with pytest.raises(InputError) as error:
        law(**{field: value})
    assert error.value.where == f"damping.{field}"
    assert error.value.remedy


@pytest.mark.parametrize(("law", "field"), FIELDS)
def test_laws_hold_floats_and_compare_by_value(law: type, field: str) -> None:
    one = law(**{field: Fraction(1, 2)})
    assert type(getattr(one, field)) is float
    assert one == law(**{field: 0.5})
    assert hash(one) == hash(law(**{field: 0.5}))
    assert one != law(**{field: 0.25})


def test_kelvin_voigt_is_stiffness_proportional() -> None:
    assert KelvinVoigt(0.3).coefficients == Rayleigh(beta=0.3).coefficients == (0.0, 0.3)
    assert Rayleigh(0.1, 0.2).coefficients == (0.1, 0.2)


@pytest.mark.parametrize("part", ["damping", "motor"])
def test_wrong_part_is_refused(part: str) -> None:
    with pytest.raises(InputError, match=r"give a slewctl\.") as error:
        Arm(BEAM, **{part: 0.01})
    assert error.value.where == f"arm.{part}"


def test_arms_that_differ_in_damping_or_motor_are_not_equal() -> None:
    motor = Motor(1.0, 1.0, 1.0)
    arms = [
        Arm(BEAM),
        Arm(BEAM, damping_ratio=0.1),
        Arm(BEAM, damping_ratio=(0.1,)),
        Arm(BEAM, damping_ratio=(0.1, 0.2)),
        Arm(BEAM, damping=Rayleigh(0.1)),
        Arm(BEAM, damping=Rayleigh(0.0, 0.1)),
        Arm(BEAM, damping=KelvinVoigt(0.1)),
        Arm(BEAM, motor=motor),
    ]
    assert len({*arms, Arm(BEAM, motor=Motor(1.0, 1.0, 1.0))}) == len(arms)


@pytest.mark.parametrize(
    ("given", "kept", "four"),
    [
        (0, 0.0, [0, 0, 0, 0]),
        (0.02, 0.02, [0.02, 0.02, 0.02, 0.02]),
        ([0.02], (0.02,), [0.02, 0.02, 0.02, 0.02]),
        (np.array([0.1, 0.2]), (0.1, 0.2), [0.1, 0.2, 0.2, 0.2]),
        ((0.1, 0.2, 0.3, 0.4, 0.5), (0.1, 0.2, 0.3, 0.4, 0.5), [0.1, 0.2, 0.3, 0.4]),
    ],
)
def test_last_ratio_holds_for_all_modes_that_follow(
    given: object, kept: object, four: list[float]
) -> None:
    arm = Arm(BEAM, damping_ratio=given)
    assert arm.damping_ratio == kept
    assert_array_equal(arm.damping_ratios(4), four)
    assert arm.damping_ratios(1).shape == (1,)


@pytest.mark.parametrize(
    ("given", "at"),
    [
        ([], ""),
        ((0.1, 1.0), ".1"),
        ((0.1, -0.1), ".1"),
        ((0.1, "0.1"), ".1"),
        ("0.1", ""),
        ([[0.1]], ".0"),
        (np.eye(2), ".0"),
        ({0.1}, ""),
    ],
)
def test_wrong_ratios_are_refused(given: object, at: str) -> None:
    with pytest.raises(InputError) as error:
        Arm(BEAM, damping_ratio=given)
    assert error.value.where == f"arm.damping_ratio{at}"
    assert error.value.remedy
