"""Profiles: values, breakpoints, degree, and what is refused."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import polynomial
from numpy.testing import assert_allclose, assert_array_equal
from strategies import deterministic

from slewctl import Beam, InputError, Stations

XI = np.linspace(0.0, 1.0, 101)


def refused(build: Callable[[], object], where: str) -> str:
    with pytest.raises(InputError) as error:
        build()
    message = str(error.value)
    assert message.startswith(f"{where}: ")
    assert error.value.remedy
    assert "\n" not in message
    return message


def test_constant_polynomial_and_table_have_their_values() -> None:
    beam = Beam(2.0, 3.0, (1.0, 0.0, -0.5))
    assert_array_equal(beam.mass_profile(XI), np.full_like(XI, 3.0))
    # Three roundings of terms not greater than one.
    assert_allclose(beam.stiffness_profile(XI), 1 - 0.5 * XI**2, rtol=0, atol=4e-16)
    assert beam.mass_profile.degree == 0
    assert beam.stiffness_profile.degree == 2


def test_table_is_linear_between_stations_and_jumps_at_a_step() -> None:
    table = Stations((0.0, 1.0, 1.0, 2.0), (4.0, 2.0, 1.0, 3.0))
    profile = Beam(2.0, table, 1.0).mass_profile
    xi = np.array([0.0, 0.25, 0.4999999, 0.5000001, 0.75, 1.0])
    assert_allclose(profile(xi), [4, 3, 2, 1, 2, 3], rtol=0, atol=1e-6)  # slope 4 times 1e-7
    assert profile.breakpoints == (0.5,)
    assert profile.degree == 1


def test_callable_takes_metres_and_may_return_a_scalar() -> None:
    beam = Beam(2.0, lambda x: 1.0 + x, lambda x: 5.0)
    assert_array_equal(beam.mass_profile(XI), 1.0 + 2.0 * XI)
    assert_array_equal(beam.stiffness_profile(XI), np.full_like(XI, 5.0))
    assert beam.mass_profile.degree is None
    assert beam.mass_profile.breakpoints == ()


@pytest.mark.parametrize(
    "spec",
    [
        (1.0, -1.0),  # zero at the tip
        (0.0, 1.0),  # zero at the clamp
        (0.25, -1.0, 1.0),  # touches zero in the middle, (ξ − ½)²
        (1.0, -6.0, 6.0),  # negative only inside
        Stations((0, 1, 2), (1, 0, 1)),
        Stations((0, 1, 1, 2), (1, 1, -1, 1)),
        lambda x: 2.0 - x,
        lambda x: (x - 1.0) ** 2,
    ],
)
@pytest.mark.parametrize("field", ["mass_per_length", "bending_stiffness"])
def test_profile_that_touches_zero_is_refused(spec: object, field: str) -> None:
    fields: dict[str, object] = {"mass_per_length": 1.0, "bending_stiffness": 1.0, field: spec}
    # Of a table the station at which it falls is named.
    at = f".values.{np.argmin(spec.values)}" if isinstance(spec, Stations) else ""
    message = refused(lambda: Beam(2.0, **fields), f"beam.{field}{at}")
    assert re.search(r"positive everywhere|not positive and finite at x = ", message)


@given(st.lists(st.floats(0.05, 0.95), min_size=1, max_size=3, unique=True), st.floats(1e-3, 0.5))
@deterministic(60)
def test_minimum_of_a_polynomial_is_below_every_sample(dips: list[float], floor: float) -> None:
    """Product of (ξ − a)² plus a floor: the minimum is the floor, at each a."""
    squares = np.array([1.0])
    for dip in dips:
        squares = polynomial.polymul(squares, [dip**2, -2 * dip, 1.0])
    squares[0] += floor
    lowest = Beam(1.0, tuple(squares), 1.0).mass_profile.minimum()
    # Coefficients of the product are below 8, so values carry an error of some 1e-14.
    assert lowest == pytest.approx(floor, abs=1e-13)
    assert lowest <= Beam(1.0, tuple(squares), 1.0).mass_profile(XI).min() + 1e-13


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, None, 1j])
def test_callable_that_is_not_finite_is_refused(value: object) -> None:
    message = refused(lambda: Beam(1.0, lambda x: value, 1.0), "beam.mass_per_length")
    assert re.search(r"not positive and finite at x = 0 m|return one real number", message)


@pytest.mark.parametrize(
    ("spec", "at"),
    [
        ((), ""),
        ([], ""),
        ((1.0, "2"), ".1"),
        ((1.0, np.nan), ".1"),
        ([1.0, True], ".1"),
        ("wood", ""),
        (np.ones((2, 2)), ".0"),
        ({"a": 1}, ""),
    ],
)
def test_what_is_no_profile_is_refused(spec: object, at: str) -> None:
    refused(lambda: Beam(1.0, spec, 1.0), f"beam.mass_per_length{at}")


@pytest.mark.parametrize(
    "function",
    [lambda x: np.ones(3), lambda x: "steel", lambda x: [1.0, "a"]],
    ids=["wrong shape", "text", "mixed list"],
)
def test_callable_that_returns_no_numbers_is_refused(function: object) -> None:
    refused(lambda: Beam(1.0, function, 1.0), "beam.mass_per_length")


def test_zero_dimensional_array_is_a_number() -> None:
    assert Beam(1.0, np.array(2.0), 1.0) == Beam(1.0, 2.0, 1.0)


def test_tiny_leading_coefficient_is_harmless() -> None:
    profile = Beam(1.0, (1.0, -0.5, 1e-310), 1.0).mass_profile
    assert profile.minimum() == 0.5


@pytest.mark.parametrize("x", [(0.1, 1.0), (0.0, 0.9), (0.0, 1.1), (-0.1, 1.0), (0.0, 100.0)])
def test_table_that_does_not_cover_the_beam_is_refused(x: tuple[float, float]) -> None:
    message = refused(lambda: Beam(1.0, Stations(x, (1, 1)), 1.0), "beam.mass_per_length")
    assert "from 0 to 1 m" in message


@pytest.mark.parametrize(
    ("x", "at"),
    [
        ((0.0, 0.6, 0.4, 1.0), 2),  # falls
        ((0.0, 0.0, 0.5, 1.0), 1),  # a step at the clamp
        ((0.0, 0.5, 1.0, 1.0), 3),  # a step at the tip
        ((0.5, 0.5, 0.5, 0.5), 1),
    ],
)
def test_stations_that_do_not_increase_are_refused(x: tuple[float, ...], at: int) -> None:
    assert "do not increase" in refused(lambda: Stations(x, (1, 1, 1, 1)), f"stations.x.{at}")


def test_station_given_three_times_is_refused() -> None:
    refused(lambda: Stations((0, 0.5, 0.5, 0.5, 1), (1, 1, 2, 3, 3)), "stations.x.3")


@pytest.mark.parametrize(
    ("x", "values"), [((0, 1), (1,)), ((0, 1), (1, 2, 3)), ((0,), (1,)), ((), ())]
)
def test_stations_without_one_value_each_are_refused(x: tuple, values: tuple) -> None:
    refused(lambda: Stations(x, values), "stations")


@pytest.mark.parametrize("bad", [np.nan, np.inf, True, "1", None])
def test_stations_that_are_no_numbers_are_refused(bad: object) -> None:
    refused(lambda: Stations((0, bad, 1), (1, 1, 1)), "stations.x.1")
    refused(lambda: Stations((0, 0.5, 1), (1, bad, 1)), "stations.values.1")


def test_single_number_is_no_table() -> None:
    refused(lambda: Stations(0.0, 1.0), "stations.x")


def test_stations_from_lists_and_arrays_are_equal_and_hashable() -> None:
    tables = {
        Stations((0, 1), (1, 2)),
        Stations([0.0, 1.0], [1.0, 2.0]),
        Stations(np.array([0.0, 1.0]), np.array([1.0, 2.0])),
    }
    assert len(tables) == 1
    assert Stations((0, 1), (1, 3)) not in tables


def test_the_station_that_falls_is_named_alone() -> None:
    x = [*np.linspace(0.0, 0.9, 2000), 0.5, 1.0]
    message = refused(lambda: Stations(x, np.ones(2002)), "stations.x.2000")
    assert "0.5 m follows 0.9 m" in message
    assert len(message) < 200


def test_more_coefficients_than_count_are_refused_at_once() -> None:
    message = refused(lambda: Beam(1.0, [1.0] * 3000, 1.0), "beam.mass_per_length")
    assert "3000 coefficients, where 62 are the most" in message
    assert Beam(1.0, [1.0] * 62, 1.0).mass_profile.degree == 61


@pytest.mark.parametrize("value", [1e-150, 1e150, 1e300])
@pytest.mark.parametrize("table", [False, True])
def test_profiles_beyond_every_arm_are_refused(value: float, table: bool) -> None:
    spec = Stations((0.0, 0.5, 1.0), (value, value, value)) if table else value
    assert "check the units" in refused(lambda: Beam(1.0, spec, 1.0), "beam.mass_per_length")
    assert "check the units" in refused(lambda: Beam(1.0, 1.0, spec), "beam.bending_stiffness")
    assert "check the units" in refused(
        lambda: Beam(1.0, (1.0, -1e150, 1e150), 1.0), "beam.mass_per_length.1"
    )
