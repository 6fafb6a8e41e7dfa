"""The confirmation by poles contradicts what is wrong, and the root finder finds roots."""

from __future__ import annotations

import control
import numpy as np
import pytest
from eigenvalue_doubts import Limit, gain_doubts, phase_doubts
from hypothesis import given, settings
from hypothesis import strategies as st

from slewctl._types import Array, IntArray
from slewctl.loop.single.crossings import crossings, log_gain, sampled
from slewctl.loop.single.return_ratio import BrokenLoop
from slewctl.loop.single.roots import polished

S = control.tf("s")
# Two resonances lift |L| above one beside the first crossing: five crossings.
LOOP = control.ss(
    2 / (S * (S + 2)) + 0.15 * S / (S**2 + 0.02 * S + 9) + 0.2 * S / (S**2 + 0.02 * S + 36)
)


def _sine(v: Array, _: IntArray) -> Array:
    return np.sin(v)


def parts(system: control.StateSpace) -> tuple[BrokenLoop, np.ndarray, np.ndarray, np.ndarray]:
    loop = BrokenLoop(system)
    gain = crossings(loop, sampled(loop), log_gain)
    return loop, -np.angle(-loop.response(gain.omega)), gain.omega, gain.rising


@pytest.mark.parametrize("step", [0, 0.01])
def test_nothing_is_doubted_where_nothing_is_wrong(step: float) -> None:
    loop, turns, omega, rising = parts(control.ss(LOOP.sample(step) if step else LOOP))
    assert len(turns) == 5
    assert phase_doubts(loop, turns, omega, rising) == []


@pytest.mark.parametrize("missing", range(5))
def test_a_missing_crossing_is_noticed(missing: int) -> None:
    loop, turns, omega, rising = parts(LOOP)
    kept = np.arange(len(turns)) != missing
    assert phase_doubts(loop, turns[kept], omega[kept], rising[kept])


def test_a_missing_critical_pair_is_noticed() -> None:
    loop, turns, omega, rising = parts(LOOP)
    k = int(np.argmin(np.abs(turns)))
    kept = np.ones(len(turns), dtype=bool)
    kept[[k, k - 1 if k else k + 1]] = False
    assert phase_doubts(loop, turns[kept], omega[kept], rising[kept])


def test_a_margin_that_is_too_large_or_invented_is_noticed() -> None:
    """1/(s(s + 1)(s + 2)) has the gain margin 6 at √2 rad/s."""
    loop = BrokenLoop(control.ss(1 / (S * (S + 1) * (S + 2))))
    right = Limit(6.0, float(np.sqrt(2)))
    assert gain_doubts(loop, [right]) == []
    assert gain_doubts(loop, [])  # infinite, as if it had been overlooked
    assert gain_doubts(loop, [Limit(7.0, float(np.sqrt(2)))])
    assert gain_doubts(loop, [Limit(5.0, float(np.sqrt(2))), right])
    assert gain_doubts(loop, [Limit(0.5, 1.0), right])


def test_a_shift_of_a_millionth_is_noticed() -> None:
    loop = BrokenLoop(control.ss(1 / (S * (S + 1) * (S + 2))))
    assert gain_doubts(loop, [Limit(6.0 * (1 + 3e-6), float(np.sqrt(2)))])
    assert gain_doubts(loop, [Limit(6.0 * (1 - 3e-6), float(np.sqrt(2)))])


@pytest.mark.slow
@given(st.lists(st.floats(-10, 10), min_size=1, max_size=30))
@settings(deadline=None, max_examples=50, derandomize=True)
def test_polished_roots(roots: list[float]) -> None:
    known = np.array(roots)

    def function(x: np.ndarray) -> np.ndarray:
        # Each enclosure has its own cubic; the order of the points is that of the roots.
        shift = x - function.known[: len(x)]  # type: ignore[attr-defined]
        return shift**3 + 0.1 * shift

    for value in known:
        function.known = np.array([value])  # type: ignore[attr-defined]
        ends = np.array([value - 1.0]), np.array([value + 2.0])
        found, off = polished(lambda v, _: function(v), *ends)
        assert found[0] == pytest.approx(value, abs=1e-14, rel=1e-14)
        assert off[0] <= 1e-14 * max(1.0, abs(value))


def test_many_enclosures_together() -> None:
    left = np.arange(1, 40) * np.pi - 1.0
    found, off = polished(_sine, left, left + 2.1)
    np.testing.assert_allclose(found, np.arange(1, 40) * np.pi, rtol=1e-15)
    # The sign changes as near as that, as it is evaluated.
    inside = off > 0
    ends = np.sign(np.sin(found - off)), np.sign(np.sin(found + off))
    assert inside.any()
    assert (ends[0] != ends[1])[inside].all()


def test_an_end_that_is_the_root_stays() -> None:
    found, off = polished(_sine, np.array([np.pi]), np.array([4.0]))
    assert found == pytest.approx(np.pi)
    assert off <= 1e-14
    assert len(polished(_sine, np.zeros(0), np.zeros(0))[0]) == 0
