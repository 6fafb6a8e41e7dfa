"""The search for extremes against formulas: textbook second-order systems, double poles, beats."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import block_diag, expm
from scipy.optimize import brentq
from strategies import deterministic

from slewctl.errors import AccuracyError
from slewctl.loop.motion import extremes
from slewctl.loop.motion.decoupled import decoupled
from slewctl.loop.motion.extremes import Part, Search, Sought
from slewctl.loop.motion.modal_motion import Motion, driven


class Free:
    """A free motion of one signal C e^(At) x₀ + constant."""

    def __init__(self, A: np.ndarray, C: np.ndarray, start: np.ndarray, constant: float = 0.0):
        self.motion = driven(
            decoupled(A), np.atleast_2d(C), start[None], np.zeros((1, len(A), 1)),
            np.full((1, 1, 1), constant), np.zeros(1), np.inf,
        )  # fmt: skip
        self.final = np.array([constant])
        self.turning: list[list[Part]] = []

    def resting(
        self,
        signals: np.ndarray,
        margins: Callable[[], np.ndarray],
        *,
        backwards: bool = False,
    ) -> Iterator[list[Part]]:
        until = self.motion.until(0, float(margins()[0]))
        yield [(self.motion, until * np.linspace(0, 1, 40)[None])]

    def curves(self, end: float, points: int) -> tuple[np.ndarray, np.ndarray]:
        raise NotImplementedError


def sought(sense: float = 0.0) -> Sought:
    none = np.zeros(1)
    return Sought(np.array([0]), none, np.array([sense]), none, np.full(1, 1e-13))


def highest(free: Free, sense: float = 0.0) -> float:
    return float(Search().highest(free, sought(sense))[0])


def last_outside(free: Free, level: float) -> float:
    return Search().last_outside(free, sought(), level)


def oscillator(damping: float, omega: float = 1.0) -> Free:
    """The error of a unit step: x(0) = −1 at rest."""
    A = np.array([[0, omega], [-omega, -2 * damping * omega]])
    return Free(A, np.array([1.0, 0.0]), np.array([-1.0, 0.0]))


@given(st.floats(-4, -0.1), st.floats(-6, 6))
@deterministic(30)
def test_overshoot_and_settling_of_a_second_order_system(exponent: float, speed: float) -> None:
    """Overshoot e^(−πζ/√(1−ζ²)); the last crossing of 2 % by bisection between two extremes."""
    damping, omega = 10**exponent, 10**speed
    free, root = oscillator(damping, omega), np.sqrt(1 - damping**2)
    assert highest(free, 1.0) == pytest.approx(np.exp(-np.pi * damping / root), rel=1e-9)
    assert highest(free) == pytest.approx(1.0, rel=1e-9)

    def error(t: float) -> float:
        return -np.exp(-damping * t) * (np.cos(root * t) + damping / root * np.sin(root * t))

    # Extremes at kπ/root of size e^(−ζkπ/root): the last outside, and the zero after it.
    last = np.floor(np.log(50) / damping * root / np.pi) * np.pi / root
    zero = last + (np.pi - np.arctan(root / damping)) / root
    crossing = brentq(lambda t: abs(error(t)) - 0.02, last, zero, xtol=1e-14)
    assert last_outside(free, 0.02) * omega == pytest.approx(crossing, rel=1e-8)


@pytest.mark.parametrize("count", [2, 3, 5])
@pytest.mark.parametrize("rate", [1e-6, 1.0, 1e6])
def test_poles_with_a_single_eigenvector(count: int, rate: float) -> None:
    """A chain of lags: the error is e^(−t) Σ t^j/j!, which has one time at 2 %."""
    A = rate * (-np.eye(count) + np.diag(np.ones(count - 1), 1))
    free = Free(A, -np.eye(count)[0], np.ones(count))
    series = np.polynomial.Polynomial([1 / np.prod(np.arange(1.0, j + 1)) for j in range(count)])
    t = brentq(lambda t: np.exp(-t) * series(t) - 0.02, 0.1, 50.0, xtol=1e-14)
    assert last_outside(free, 0.02) * rate == pytest.approx(t, rel=1e-8)
    assert highest(free) == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("apart", [0.0, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3, 1e-2])
def test_poles_that_nearly_coincide(apart: float) -> None:
    """Two like oscillators in a row: resonance, t·e^(−ζt)/2, whatever the distance of the poles."""
    damping, chain = 0.01, np.zeros((4, 4))
    for k, omega in enumerate((1.0, 1.0 + apart)):
        part = slice(2 * k, 2 * k + 2)
        chain[part, part] = [[0, omega], [-omega, -2 * damping * omega]]
    chain[1, 2] = 1.0
    start = np.array([0.0, 0, 1, 0])
    free = Free(chain, np.array([1.0, 0, 0, 0]), start)
    h = 8e-3
    step, states = expm(chain * h), start[:, None]
    while states.shape[1] < 120_000:
        states, step = np.hstack([states, step @ states]), step @ step
    seen = np.abs(states[0])
    assert seen.max() * (1 - 1e-9) <= highest(free) <= seen.max() * (1 + 2e-5)
    level = 0.02 * seen.max()
    last = np.flatnonzero(seen > level)[-1] * h
    assert last * (1 - 1e-9) <= last_outside(free, level) <= last + 2 * h


def chained(
    rng: np.random.Generator, modes: int, copies: int, apart: float, decades: float
) -> np.ndarray:
    """Chains of like oscillators that drive each other, in coordinates at random."""
    parts = []
    for omega in 10 ** rng.uniform(0, decades, modes):
        part = np.zeros((2 * copies, 2 * copies))
        for k in range(copies):
            w, own = omega * (1 + apart * k), slice(2 * k, 2 * k + 2)
            part[own, own] = [[0, w], [-w, -0.1 * w]]
            if k:
                part[2 * k - 2 : 2 * k, own] = 0.1 * omega * rng.standard_normal((2, 2))
        parts.append(part)
    n = 2 * copies * modes
    back, there = (np.linalg.qr(rng.standard_normal((n, n)))[0] for _ in range(2))
    mixed = back * np.exp(rng.uniform(-1, 1, n)) @ there
    return np.asarray(mixed @ block_diag(*parts) @ np.linalg.inv(mixed))


def assert_walked(A: np.ndarray, rng: np.random.Generator) -> None:
    """Peak and last crossing agree with steps of the whole, cut again where they are found."""
    n, rates = len(A), np.linalg.eigvals(A)
    C, start = rng.standard_normal(n), rng.standard_normal(n)
    free = Free(A, C, start)
    h, end = 0.02 / np.abs(rates).max(), 30 / np.abs(rates.real).min()

    def walked(states: np.ndarray, h: float, count: int) -> np.ndarray:
        step = expm(A * h)
        while states.shape[1] <= count:
            states, step = np.hstack([states, step @ states]), step @ step
        return states[:, : count + 1]

    states = walked(start[:, None], h, int(end / h))
    seen = np.abs(C @ states)
    # Of a peak between two steps so much is missed at most.
    tops = np.flatnonzero(seen > seen.max() * (1 - 1e-3))
    peak = max(
        np.abs(C @ walked(states[:, [max(k - 1, 0)]], h / 1000, 2000)).max()
        for k in tops[np.argsort(-seen[tops])[:20]]
    )
    assert highest(free) == pytest.approx(peak, rel=1e-6)
    level = 0.02 * peak
    last = int(np.flatnonzero(seen > level)[-1])
    again = np.abs(C @ walked(states[:, [last]], h / 1000, 1000))
    crossing = np.flatnonzero(again > level)[-1] / 1000
    assert last_outside(free, level) == pytest.approx((last + crossing) * h, rel=1e-6, abs=h / 500)


APART = st.one_of(st.just(0.0), st.floats(-13, -1).map(lambda x: 10.0**x))


@given(st.integers(0, 2**32), st.integers(1, 3), st.integers(2, 4), APART)
@deterministic(8)
def test_chains_of_modes_that_are_not_told_apart(
    seed: int, modes: int, copies: int, apart: float
) -> None:
    rng = np.random.default_rng(seed)
    assert_walked(chained(rng, modes, copies, apart, 0.5), rng)


@pytest.mark.slow
@given(st.integers(0, 2**32), st.integers(1, 6), st.integers(2, 4), APART, st.floats(0, 1))
@deterministic(40)
def test_many_chains_of_modes_over_decades(
    seed: int, modes: int, copies: int, apart: float, decades: float
) -> None:
    rng = np.random.default_rng(seed)
    assert_walked(chained(rng, modes, copies, apart, decades), rng)


def test_a_fast_mode_beside_one_that_is_eight_decades_slower() -> None:
    A = np.diag([-1e-4, -1e4])
    free = Free(A, np.array([1.0, 1.0]), np.array([1.0, -3.0]))
    # |e^(−1e-4 t) − 3 e^(−1e4 t)| is 2 at once, and its largest positive value lies between.
    assert highest(free) == pytest.approx(2.0, rel=1e-9)
    top = np.log(3e4 / 1e-4) / (1e4 - 1e-4)
    assert highest(free, 1.0) == pytest.approx(np.exp(-1e-4 * top) - 3 * np.exp(-1e4 * top))
    assert last_outside(free, 0.02) == pytest.approx(np.log(50) / 1e-4, rel=1e-9)


@given(st.lists(st.floats(1.0, 10.0), min_size=2, max_size=5, unique=True), st.floats(-1.5, -0.7))
@deterministic(15)
def test_beats_of_several_modes_agree_with_fine_steps(omegas: list[float], decay: float) -> None:
    damping, n = 10**decay, 2 * len(omegas)
    A = np.zeros((n, n))
    for k, w in enumerate(omegas):
        A[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [[0, w], [-w, -2 * damping * w]]
    start = np.tile([1.0, 0.3], len(omegas)) / np.repeat(omegas, 2)
    C = np.tile([0.0, 1.0], len(omegas))
    free = Free(A, C, start)
    end = 12 / (damping * min(omegas))
    h = 0.01 / max(omegas)
    count = min(int(end / h), 400_000)
    step, states = expm(A * h), start[:, None]
    while states.shape[1] < count:
        states, step = np.hstack([states, step @ states]), step @ step
    seen = np.abs(C @ states)
    assert seen.max() * (1 - 1e-9) <= highest(free) <= seen.max() * (1 + 1e-3)
    last = np.flatnonzero(seen > 0.1 * seen.max())[-1] * h
    assert last - 1e-9 <= last_outside(free, 0.1 * seen.max()) <= last + 2 * h


def test_a_steady_error_decides() -> None:
    """1 + e^(−t)(…): a last value within the level, on it, and outside."""
    A, C, start = np.array([[-1.0]]), np.ones(1), np.ones(1)
    within = Free(A, C, start, 0.01)
    assert last_outside(within, 0.02) == pytest.approx(np.log(100), rel=1e-9)
    assert last_outside(Free(A, C, start, 0.03), 0.02) == np.inf
    assert highest(Free(A, C, -start, 0.03)) == pytest.approx(0.97)
    assert highest(Free(A, C, -start, 3.0)) == 3.0  # approached and never reached
    on_the_edge = last_outside(Free(A, C, start, 0.02), 0.02 * (1 + 1e-9))
    assert 0 < on_the_edge < 40


def test_a_peak_on_the_edge_of_the_band_is_within() -> None:
    """ζ at which the first overshoot is 2 %: settled at the first entry, in any unit of time."""
    damping = -np.log(0.02) / np.hypot(np.pi, np.log(0.02))
    times = [
        last_outside(oscillator(damping, omega), 0.02 * (1 + 1e-9)) * omega
        for omega in (1.0, 3.0, 0.1, 1e5)
    ]
    np.testing.assert_allclose(times, times[0], rtol=1e-8)
    assert times[0] < np.pi / np.sqrt(1 - damping**2)


def test_slow_decay_takes_no_longer() -> None:
    """Ten million oscillations before the band is reached: the last ones are looked at alone."""
    free = oscillator(1e-7)
    assert last_outside(free, 0.02) == pytest.approx(np.log(50) / 1e-7, rel=1e-6)
    assert highest(free, 1.0) == pytest.approx(np.exp(-np.pi * 1e-7), rel=1e-9)


def test_too_much_work_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twelve modes that hardly decay and hardly ever meet: no guess is returned."""
    omegas = np.sqrt([2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37])
    A = np.zeros((24, 24))
    for k, w in enumerate(omegas):
        A[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [[0, w], [-w, -2e-9 * w]]
    free = Free(A, np.tile([0.0, 1.0], 12), np.tile([1.0, 0.0], 12))
    monkeypatch.setattr(extremes, "_MOST", 100_000)
    with pytest.raises(AccuracyError, match="intervals"):
        highest(free)


@pytest.mark.parametrize("shift", [0.0, 1e-10, 1e-6, 1e-3])
@pytest.mark.parametrize("n", [2, 4, 7])
def test_parts_move_like_the_whole(n: int, shift: float) -> None:
    """e^(At) of matrices with a (nearly) multiple eigenvalue beside simple ones."""
    rng = np.random.default_rng(n)
    T = np.triu(rng.standard_normal((2 * n, 2 * n)))
    T[np.diag_indices(2 * n)] = [
        *(-1 - shift * np.arange(n)),
        *(-3.0 - np.arange(n)),
    ]
    Q = np.linalg.qr(rng.standard_normal((2 * n, 2 * n)))[0]
    A = Q @ T @ Q.T
    parts = decoupled(A)
    for t in (0.0, 0.3, 2.0):
        moved = (parts.right * np.exp(parts.rates * t) @ parts.left).real
        moved = moved + sum((b.right @ expm(b.T * t) @ b.left).real for b in parts.blocks)
        np.testing.assert_allclose(moved, expm(A * t), atol=1e-8)


def test_motion_under_a_polynomial_agrees_with_fine_steps() -> None:
    """Modes that turn by 1e-3 to 1e3 rad in the piece, driven by a polynomial of degree five."""
    rng = np.random.default_rng(5)
    A = np.diag([0.0, -1e-3, -1.1, -30.0, -1e3, 0.0, 0.0])
    A[5:, 5:] = [[0, 50.0], [-50.0, -1.0]]
    drive = rng.standard_normal((7, 6))
    motion: Motion = driven(
        decoupled(A), np.eye(7), np.zeros((1, 7)), drive[None], np.zeros((1, 7, 6)), np.zeros(1),
        1.0,
    )  # fmt: skip
    whole = np.zeros((13, 13))
    whole[:7, :7], whole[:7, 7:], whole[7:, 7:] = A, drive, np.diag(np.arange(1.0, 6.0), -1)
    t = np.linspace(0, 1, 41)
    expected = np.array([(expm(whole * s)[:, 7])[:7] for s in t])
    found = motion.at(np.zeros(41, dtype=int), t).T
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-13)
    assert np.all(np.abs(expected).max(axis=0) <= motion.sizes()[0] * (1 + 1e-12))


@pytest.mark.parametrize("n", [2, 5])
def test_blocks_count_as_the_work_that_they_are(n: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A search among modes that are not told apart ends after as much work as any other."""
    A = np.diag(np.full(n, -1.0)) + np.diag(np.ones(n - 1), 1)
    motion = driven(
        decoupled(A), np.eye(n), np.ones((1, n)), np.zeros((1, n, 1)), np.zeros((1, n, 1)),
        np.zeros(1), 10.0,
    )  # fmt: skip
    assert [len(block.T) for block in motion.blocks] == [n]
    assert motion.work == pytest.approx(1 + n**2 / 16)
    free = Free(A, np.eye(n)[-1], np.eye(n)[0])
    monkeypatch.setattr(extremes, "_MOST", 100)
    with pytest.raises(AccuracyError, match=f"in {int(100 / (1 + n**2 / 16))} intervals"):
        highest(free)
