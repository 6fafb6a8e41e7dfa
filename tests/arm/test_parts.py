"""Beam, Hub, Payload and Arm: what they accept, and how they refuse the rest."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from slewctl import Arm, Beam, Hub, InputError, Payload, Stations

NOT_A_NUMBER = [math.nan, math.inf, -math.inf, True, "1", None, 1j, [1.0]]


def assert_helpful(error: pytest.ExceptionInfo[InputError], where: str) -> None:
    """The message is one line that says where, what and what to do."""
    message = str(error.value)
    assert error.value.where == where
    assert error.value.what
    assert error.value.remedy
    assert message == f"{where}: {error.value.what}; {error.value.remedy}"
    assert "\n" not in message


def refused(build: Callable[[], object], where: str) -> str:
    with pytest.raises(InputError) as error:
        build()
    assert_helpful(error, where)
    return str(error.value)


@pytest.mark.parametrize("length", [*NOT_A_NUMBER, 0.0, -1.0])
def test_beam_length_is_refused_unless_positive(length: object) -> None:
    refused(lambda: Beam(length, 1.0, 1.0), "beam.length")


@pytest.mark.parametrize("field", ["mass_per_length", "bending_stiffness"])
@pytest.mark.parametrize("value", [math.nan, math.inf, True, "1", None, 1j, 0.0, -2.0])
def test_beam_profile_is_refused_unless_positive(field: str, value: object) -> None:
    good = {"mass_per_length": 1.0, "bending_stiffness": 1.0}
    refused(lambda: Beam(1.0, **(good | {field: value})), f"beam.{field}")


@pytest.mark.parametrize(
    ("kind", "field"),
    [
        (Hub, "inertia"),
        (Hub, "radius"),
        (Hub, "friction"),
        (Payload, "mass"),
        (Payload, "inertia"),
    ],
)
@pytest.mark.parametrize("value", [*NOT_A_NUMBER, -1e-9])
def test_hub_and_payload_are_refused_unless_nonnegative(
    kind: type, field: str, value: object
) -> None:
    refused(lambda: kind(**{field: value}), f"{kind.__name__.lower()}.{field}")


@pytest.mark.parametrize("ratio", [*NOT_A_NUMBER, -0.01, 1.0, 5.0])
def test_damping_ratio_is_refused_outside_0_to_1(ratio: object) -> None:
    at = ".0" if isinstance(ratio, list) else ""
    refused(lambda: Arm(Beam(1, 1, 1), damping_ratio=ratio), f"arm.damping_ratio{at}")


@pytest.mark.parametrize("part", ["beam", "hub", "payload"])
def test_wrong_part_is_refused(part: str) -> None:
    parts: dict[str, object] = {"beam": Beam(1, 1, 1), part: 3.0}
    message = refused(lambda: Arm(**parts), f"arm.{part}")
    assert part.capitalize() in message


def test_the_offending_value_is_in_the_message() -> None:
    assert "-3" in refused(lambda: Hub(inertia=-3), "hub.inertia")
    assert "'abc'" in refused(lambda: Beam("abc", 1, 1), "beam.length")
    assert "half a percent" in refused(
        lambda: Arm(Beam(1, 1, 1), damping_ratio=5), "arm.damping_ratio"
    )


@pytest.mark.parametrize("one", [1, np.float64(1), np.float32(1), np.int64(1), Fraction(1)])
def test_any_real_number_becomes_a_float(one: object) -> None:
    arm = Arm(Beam(one, 1, 1), Hub(one, one, one), Payload(one, one), damping_ratio=0 * one)
    numbers = (arm.beam.length, *vars(arm.hub).values(), *vars(arm.payload).values())
    assert all(type(number) is float for number in numbers)
    assert numbers == (1.0,) * 6
    assert type(arm.damping_ratio) is float


@pytest.mark.parametrize("spec", [[1.0, 0.5], np.array([1.0, 0.5])])
def test_list_and_array_profiles_equal_the_tuple(spec: object) -> None:
    expected, beam = Beam(2.0, (1.0, 0.5), (1.0, 0.5)), Beam(2.0, spec, spec)
    assert beam == expected
    assert hash(beam) == hash(expected)
    assert len({Arm(beam), Arm(expected)}) == 1
    xi = np.linspace(0, 1, 7)
    assert_array_equal(beam.mass_profile(xi), expected.mass_profile(xi))


def test_arms_that_differ_in_any_field_are_not_equal() -> None:
    def arm(**change: object) -> Arm:
        fields: dict[str, object] = {
            "beam": Beam(1, 1, 1),
            "hub": Hub(),
            "payload": Payload(),
            "damping_ratio": 0.0,
            "name": "arm",
        }
        return Arm(**(fields | change))

    others = [
        arm(beam=Beam(1, 1, 2)),
        arm(beam=Beam(1, Stations((0, 1), (1, 1)), 1)),
        arm(hub=Hub(1)),
        arm(hub=Hub(0, 1)),
        arm(hub=Hub(0, 0, 1)),
        arm(payload=Payload(1)),
        arm(payload=Payload(0, 1)),
        arm(damping_ratio=0.1),
        arm(name="other"),
    ]
    assert len({arm(), arm(), *others}) == len(others) + 1


def test_parts_cannot_be_changed() -> None:
    arm = Arm(Beam(1, 1, 1))
    for part, field in ((arm, "name"), (arm.beam, "length"), (arm.hub, "inertia")):
        with pytest.raises(AttributeError):
            setattr(part, field, 2.0)


def test_beam_breakpoints_are_those_of_both_profiles() -> None:
    mass = Stations((0, 0.5, 1.0, 2.0), (1, 2, 2, 1))
    stiffness = Stations((0, 0.5, 1.5, 1.5, 2.0), (3, 2, 2, 1, 1))
    assert Beam(2.0, mass, stiffness).breakpoints == (0.25, 0.5, 0.75)
    assert Beam(2.0, mass, 1.0).breakpoints == (0.25, 0.5)
    assert Beam(2.0, 1.0, (1.0, 0.5)).breakpoints == ()


@pytest.mark.parametrize("field", ["length", "beam"])
def test_message_is_one_line_for_a_matrix(field: str) -> None:
    if field == "length":
        refused(lambda: Beam(np.eye(3), 1, 1), "beam.length")
    else:
        refused(lambda: Arm(np.eye(3)), "arm.beam")


def test_integer_beyond_double_precision_is_refused() -> None:
    refused(lambda: Beam(10**400, 1, 1), "beam.length")


def test_name_that_is_no_text_is_refused() -> None:
    refused(lambda: Arm(Beam(1, 1, 1), name=5), "arm.name")
