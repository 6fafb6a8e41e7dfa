"""Crossings counted by the code are those of exact rational arithmetic, none more or less."""

from __future__ import annotations

import control
import numpy as np
import pytest
from eigenvalue_crossings import all_sampled, sine, truly_real
from exact_rational import fraction, gain_crossings, real_crossings
from flexible_loops import random_flexible_loop

from slewctl._types import Array
from slewctl.loop.single.axis_ends import UndecidedError
from slewctl.loop.single.certificate import certify
from slewctl.loop.single.crossings import crossings, log_gain
from slewctl.loop.single.factored_loop import factored
from slewctl.loop.single.return_ratio import BrokenLoop
from slewctl.numerics.linear_system import LinearSystem

# Loops whose ends are lost in the rounding of their matrices.
UNDECIDED: list[str] = []


def check(loop: control.StateSpace, label: str) -> int:
    """Fail when a crossing is missing, invented, or off; return how many there are."""
    broken = BrokenLoop(loop)
    samples = all_sampled(broken)
    gain = crossings(broken, samples, log_gain).omega
    real = truly_real(broken, crossings(broken, samples, sine)).omega
    exact = gain_crossings(loop), real_crossings(loop)
    for found, known in zip((gain, real), exact, strict=True):
        assert len(found) == len(known), label
        np.testing.assert_allclose(found, known, rtol=1e-8, err_msg=label)
    certified(loop, exact, label)
    return len(gain) + len(real)


def certified(loop: control.StateSpace, exact: tuple[Array, Array], label: str) -> None:
    """Fail when the search in intervals finds others."""
    with np.errstate(all="ignore"):
        factors = factored(LinearSystem(loop.A, loop.B, loop.C, loop.D, loop.dt))
        try:
            found = certify(factors).search
        except UndecidedError:
            UNDECIDED.append(label)
            return
    known = factors.axis(exact[0]), factors.axis(exact[1])
    values = factors.on_axis(known[1]).real
    for points, theirs, where in (
        (found.unit, known[0], np.ones(len(known[0]), dtype=bool)),
        # Where L is smaller, its rounding may hide whether it is real: such places are touched.
        (found.real, known[1], (values < -1e-6) & (values > -1e8)),
    ):
        v, width = points.arrays
        if points is found.real:
            seen = factors.on_axis(v).real < -1e-6
            v, width = v[seen], width[seen]
        assert len(v) == np.sum(where), label
        assert np.all(np.abs(v - theirs[where]) <= width + 1e-12 * v), label


def test_roots_of_a_textbook_loop_are_exact() -> None:
    """1/(s(s + 1)(s + 2)): Im L = 0 at ω = √2 alone, |L| = 1 where x³ + 5x² + 4x = 1."""
    loop = control.tf2ss(control.tf([1], [1, 3, 2, 0]))
    assert real_crossings(loop) == pytest.approx([np.sqrt(2)], rel=1e-15)
    roots = np.roots([1, 5, 4, -1])
    assert gain_crossings(loop) == pytest.approx([np.sqrt(roots.max())], rel=1e-14)


@pytest.mark.parametrize("step", [0, 0.3])
def test_fraction_is_the_loop(step: float) -> None:
    loop = random_flexible_loop(np.random.default_rng(1), 5).loop
    loop = control.StateSpace(loop.A, loop.B, loop.C, loop.D, step)
    N, P = fraction(loop)
    for v in (0.1, 0.7, 3.0):
        n, p = (np.polyval([float(c) for c in poly.coeffs()[::-1]], 1j * v) for poly in (N, P))
        point = (1 + 1j * v) / (1 - 1j * v) if step else 1j * v
        direct = loop.C @ np.linalg.solve(point * np.eye(loop.nstates) - loop.A, loop.B) + loop.D
        assert n / p == pytest.approx(complex(direct[0, 0]), rel=1e-6)


def test_ten_loops_have_exactly_their_crossings() -> None:
    rng = np.random.default_rng(11)
    for i in range(10):
        check(random_flexible_loop(rng, int(rng.integers(5, 9))).loop, f"loop {i}")


@pytest.mark.slow
def test_fifteen_loops_have_exactly_their_crossings() -> None:
    rng = np.random.default_rng(12)
    loops = [random_flexible_loop(rng, int(rng.integers(5, 13))).loop for _ in range(15)]
    UNDECIDED.clear()
    assert sum(check(loop, f"loop {i}") for i, loop in enumerate(loops)) > 300
    assert len(UNDECIDED) <= 1


@pytest.mark.parametrize("gap", [1e-1, 1e-2, 1e-3, 1e-5])
def test_a_close_pair_of_real_crossings_is_found(gap: float) -> None:
    """Im L just passes zero and returns, a thousandth of `gap` later: neither root is lost.

    L = 1/(s + 1)³ − r/(s² + 2ζs + 1): a resonance lifts Im L from −1/4 to zero and above.
    """
    base = control.tf2ss(control.tf([1.0], [1, 3, 3, 1]))

    def loop(r: float) -> control.StateSpace:
        mode = control.StateSpace([[0, 1], [-1, -2e-3]], [[0], [1]], [[-r, 0]], 0)
        return control.StateSpace(base + mode)

    def near_one(r: float) -> list[float]:
        return [w for w in real_crossings(loop(r)) if abs(w - 1) < 0.1]

    low, high = 1e-4, 1e-3
    for _ in range(60):  # r at which the pair is born
        middle = np.sqrt(low * high)
        low, high = (middle, high) if not near_one(middle) else (low, middle)
    system = loop(high * (1 + gap**2))
    pair = near_one(high * (1 + gap**2))
    assert len(pair) == 2
    assert 0 < pair[1] - pair[0] < 10e-3 * gap
    broken = BrokenLoop(system)
    found = truly_real(broken, crossings(broken, all_sampled(broken), sine)).omega
    # At a double root the frequency moves as the square root of rounding.
    np.testing.assert_allclose(found[np.abs(found - 1) < 0.1], pair, rtol=1e-6 * gap)
