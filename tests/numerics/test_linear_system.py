"""The light form of a system and python-control's: one thing, there and back."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hypothesis import given
from random_systems import COUNTS, SEEDS, STATES, random_system
from strategies import deterministic

from slewctl.numerics.linear_system import LinearSystem, alike, clock_unknown, linear

every_clock = pytest.mark.parametrize("dt", [0.0, 0.05, None])


def assert_equal(one: LinearSystem, other: LinearSystem | control.StateSpace) -> None:
    for name in "ABCD":
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert one.dt == other.dt
    assert (one.dt is None) == (other.dt is None)
    for labels in ("input_labels", "output_labels", "state_labels"):
        assert list(getattr(one, labels)) == list(getattr(other, labels))
    assert one.name == other.name


@every_clock
@given(seed=SEEDS, n=STATES, m=COUNTS, p=COUNTS)
@deterministic(15)
def test_there_and_back(seed: int, n: int, m: int, p: int, dt: float | None) -> None:
    ours = random_system(seed, n, m, p, dt).named(
        states=[f"state {i}" for i in range(n)], name="an arm"
    )
    theirs = ours.to_control()
    assert_equal(ours, theirs)
    back = linear(theirs)
    assert back is not None
    assert_equal(back, theirs)
    assert linear(ours) is ours


@every_clock
@given(seed=SEEDS, n=STATES, m=COUNTS, p=COUNTS)
@deterministic(8)
def test_names_that_nobody_gave_are_python_controls(
    seed: int, n: int, m: int, p: int, dt: float | None
) -> None:
    given_names = random_system(seed, n, m, p, dt)
    ours = LinearSystem(*given_names.matrices, dt)
    theirs = control.StateSpace(*given_names.matrices, dt)
    for labels in ("input_labels", "output_labels", "state_labels"):
        assert list(getattr(ours, labels)) == getattr(theirs, labels)


@given(SEEDS, STATES, COUNTS, COUNTS)
@deterministic(20)
def test_sizes_and_poles(seed: int, n: int, m: int, p: int) -> None:
    ours = random_system(seed, n, m, p)
    theirs = ours.to_control()
    assert (ours.nstates, ours.ninputs, ours.noutputs) == (n, m, p)
    expected = np.sort_complex(theirs.poles()) if n else np.zeros(0)
    np.testing.assert_allclose(np.sort_complex(ours.poles()), expected, rtol=1e-9, atol=1e-9)


def test_other_names_leave_the_rest() -> None:
    system = random_system(1, 2, 1, 2, 0.1).named(states=["p", "q"], name="first")
    renamed = system.named(outputs=["a", "b"])
    assert renamed.output_labels == ("a", "b")
    assert_equal(renamed.named(outputs=system.output_labels), system)
    assert system.output_labels == ("y1_0", "y1_1")


def test_numbers_are_matrices_of_one_entry() -> None:
    system = LinearSystem(-1, 2, 3, 4)
    assert [matrix.tolist() for matrix in system.matrices] == [[[-1.0]], [[2.0]], [[3.0]], [[4.0]]]
    assert system.sample_time == 0.0
    assert LinearSystem(-1, 2, 3, 4, None).sample_time == 0.0
    assert LinearSystem(-1, 2, 3, 4, 0.2).sample_time == 0.2


@pytest.mark.parametrize("which", ["inputs", "outputs", "states"])
def test_each_signal_has_one_name(which: str) -> None:
    with pytest.raises(ValueError, match="3 names for"):
        random_system(1, 2, 1, 2).named(**{which: ["a", "b", "c"]})


@pytest.mark.parametrize("place", range(4))
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_number_that_is_none_is_seen_in_every_matrix(place: int, value: float) -> None:
    system = random_system(1, 2, 2, 2)
    assert system.finite
    system.matrices[place][1, 1] = value
    assert not system.finite


def test_what_is_no_state_space() -> None:
    for other in (control.tf([1], [1, 1]), np.eye(2), None, "system"):
        assert linear(other) is None
    assert clock_unknown(control.rss(2, 1, 1, dt=True))
    assert not any(clock_unknown(control.rss(2, 1, 1, dt=dt)) for dt in (0, 0.1, None))


def test_an_answer_has_the_form_of_the_question() -> None:
    light = random_system(1, 2, 1, 1)
    assert alike(light, light) is light
    assert isinstance(alike(light.to_control(), light), control.StateSpace)
