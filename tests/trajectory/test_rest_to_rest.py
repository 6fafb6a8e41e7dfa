"""The fastest turns without vibration: at rest by simulation, symmetric, scaling, no slower."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.linalg import expm

from slewctl.errors import AccuracyError, InputError
from slewctl.trajectory.costate import fastest
from slewctl.trajectory.profiles import RigidTimeOptimal
from slewctl.trajectory.rest_to_rest import BangBang, _started, rest_to_rest
from slewctl.trajectory.shapers import Mode, shaper

ARMS = [
    ([Mode(1.5)], 1),
    ([Mode(1.5, 0.08)], 1),
    ([Mode(1.5, 0.03)], 2),
    ([Mode(1.5, 0.01), Mode(4.1, 0.02)], 1),
]


def after(found: BangBang, inertia: float, modes: list[Mode]) -> list[np.ndarray]:
    """Return (angle, rate) of the rigid arm and of each mode at the end, by matrix exponentials."""
    systems = [(np.array([[0.0, 1.0], [0.0, 0.0]]), 1 / inertia)]
    for m in modes:
        systems.append((np.array([[0, 1], [-(m.frequency**2), -2 * m.ratio * m.frequency]]), 1.0))
    marks = [0.0, *found.switches, found.duration]
    ends = []
    for a, b in systems:
        big = np.zeros((3, 3))
        big[:2, :2] = a
        state = np.array([0.0, 0.0, found.limit])
        for before, behind in itertools.pairwise(marks):
            big[1, 2] = b
            state = expm(big * (behind - before)) @ state
            state[2] *= -1
        ends.append(state[:2])
    return ends


@pytest.mark.parametrize(("modes", "order"), ARMS)
def test_at_rest_at_the_end(modes: list[Mode], order: int) -> None:
    found = rest_to_rest(-0.9, 0.7, 1.3, modes, order)
    rigid, *flexible = after(found, 1.3, modes)
    np.testing.assert_allclose(rigid, [-0.9, 0.0], atol=1e-10)
    np.testing.assert_allclose(flexible, 0.0, atol=1e-10)
    off = [[Mode(m.frequency * (1 + h), m.ratio) for m in modes] for h in (1e-3, 1e-4)]
    left = [max(np.abs(after(found, 1.3, m)[1:]).max(axis=1)) for m in off]
    assert np.log10(left[0] / left[1]) == pytest.approx(order, abs=0.05)


def test_undamped_turns_are_symmetric_and_no_slower_than_shaped_ones() -> None:
    mode = Mode(1.5)
    rigid = RigidTimeOptimal(0.9, 0.7, 1.3).duration
    for order, kind in ((1, "zv"), (2, "zvd")):
        found = rest_to_rest(0.9, 0.7, 1.3, [mode], order)
        marks = np.array([0.0, *found.switches, found.duration])
        np.testing.assert_allclose(marks + marks[::-1], found.duration, rtol=1e-10)
        assert rigid < found.duration <= rigid + shaper(kind, mode).duration


def test_time_scales() -> None:
    slow = rest_to_rest(0.9, 0.7, 1.3, [Mode(1.5, 0.02)])
    fast = rest_to_rest(0.9, 70.0, 1.3, [Mode(15.0, 0.02)])
    np.testing.assert_allclose(np.array(fast.switches) * 10, slow.switches, rtol=1e-9)


def test_torque_between_switches() -> None:
    turn = BangBang(2.0, (1.0, 2.0), 3.0)
    t = np.array([-1, 0, 1, 2, 3.0])
    np.testing.assert_array_equal(turn.torque(t), [0, 2, -2, 2, 0])


@pytest.mark.parametrize("bad", [(0.0, 1.0, 1.0), (1.0, 0.0, 1.0), (1.0, 1.0, -1.0)])
def test_impossible_turns_are_refused(bad: tuple[float, float, float]) -> None:
    with pytest.raises(InputError):
        rest_to_rest(*bad, [Mode(1.0)])


@pytest.mark.slow
def test_four_modes_switch_more_often_than_there_are_equations() -> None:
    modes = [Mode(1.5, 0.01), Mode(6.1, 0.02), Mode(19.0, 0.02), Mode(41.0, 0.03)]
    found = rest_to_rest(1.0, 1.0, 2.0, modes)
    assert len(found.switches) == 11 > 1 + 2 * len(modes)
    rigid, *flexible = after(found, 2.0, modes)
    np.testing.assert_allclose(rigid, [1.0, 0.0], atol=1e-10)
    np.testing.assert_allclose(flexible, 0.0, atol=1e-10)
    without = rest_to_rest(1.0, 1.0, 2.0, modes[:3])
    assert without.duration < found.duration
    undamped = rest_to_rest(1.0, 1.0, 2.0, [Mode(m.frequency) for m in modes], 2)
    marks = np.array([0.0, *undamped.switches, undamped.duration])
    np.testing.assert_allclose(marks + marks[::-1], undamped.duration, rtol=1e-8)


def test_the_multipliers_prove_that_nothing_is_faster() -> None:
    """∫|λ| bounds how far any torque comes, by quadrature; the turn comes as far."""
    modes = [Mode(1.5, 0.01), Mode(4.1, 0.02)]
    found = fastest(_started(2.0, modes, 1), 2.0)
    t = np.linspace(0.0, found.end, 400_001)
    costate = found.multipliers @ found.functionals.at(t)[0]
    assert np.trapezoid(np.abs(costate), t) == pytest.approx(2.0, rel=1e-9)
    assert found.reach == pytest.approx(2.0, rel=1e-12)


@pytest.mark.slow
def test_any_modes_are_at_rest_at_the_end() -> None:
    rng = np.random.default_rng(0)
    for _ in range(8):
        count = int(rng.integers(1, 4))
        low = rng.uniform(0.5, 8.0)
        frequencies = low * np.cumprod([1.0, *rng.uniform(2, 4, count - 1)])
        modes = [Mode(w, rng.uniform(0, 0.05)) for w in frequencies]
        found = rest_to_rest(1.0, 1.0, 1.0, modes, int(rng.integers(1, 3)))
        rigid, *flexible = after(found, 1.0, modes)
        np.testing.assert_allclose(rigid, [1.0, 0.0], atol=1e-8)
        np.testing.assert_allclose(flexible, 0.0, atol=1e-8)


def test_too_many_periods_are_refused() -> None:
    with pytest.raises(AccuracyError, match=r"1e\+05 rad/s has \d+ periods.*fastest modes out"):
        rest_to_rest(1.0, 1.0, 1.0, [Mode(3.0), Mode(1e5)])
    with pytest.raises(InputError, match="RigidTimeOptimal"):
        rest_to_rest(1.0, 1.0, 1.0, [])


@pytest.mark.parametrize("time", [1e-9, 1e-4, 1e4, 1e6, 1e12])
def test_the_unit_of_time_changes_nothing(time: float) -> None:
    plain = rest_to_rest(1.0, 1.0, 2.0, [Mode(2**0.5)])
    found = rest_to_rest(1.0, 1 / time**2, 2.0, [Mode(2**0.5 / time)])
    assert found.duration == pytest.approx(time * plain.duration, rel=1e-12)
    np.testing.assert_allclose(found.switches, time * np.array(plain.switches), rtol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("size", [1e-6, 1e-5, 1e-3, 1.0, 1e3, 1e5])
def test_turns_of_any_size_beside_a_period_end_at_rest(size: float) -> None:
    """A turn within a thousandth of a period, or over a hundred of them."""
    mode = Mode(1.0, 0.01)
    found = rest_to_rest(size, 1.0, 1.0, [mode])
    ends = np.array([0.0, *found.switches, found.duration])
    signs = (-1.0) ** np.arange(len(ends) - 1)
    assert signs @ np.diff(ends) == pytest.approx(0, abs=1e-9 * found.duration)
    assert signs @ np.diff(ends**2) / 2 == pytest.approx(-size, rel=1e-6)
    pole = 0.01 + 1j * mode.damped
    left = signs @ np.diff(np.exp(pole * (ends - found.duration)))
    assert abs(left) < 1e-8
