"""A check of margin certificates in interval arithmetic, which shares nothing with the search.

The loop is L = N/P in exact rationals, of the matrices as they were given (`exact_rational`).
What a certificate claims of an interval are signs of polynomials in ω, which Taylor's shift
to the middle of the interval encloses in balls of 400 bits (python-flint).  An interval may
be halved; what is claimed of it must hold all the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from exact_rational import in_s, parts, rational
from flint import arb, ctx, fmpq, fmpq_mat, fmpq_poly

_HALVINGS = 40
Check = Callable[[fmpq, fmpq], bool]


def exact(value: float) -> fmpq:
    """Return a double as the rational number that it is."""
    return fmpq(*float(value).as_integer_ratio())


@dataclass(frozen=True, eq=False)
class Polynomials:
    """|N|², |P|², Re N P̄ and Im N P̄ on the axis, as polynomials in ω."""

    gain: fmpq_poly
    poles: fmpq_poly
    real: fmpq_poly
    imag: fmpq_poly

    @classmethod
    def of(cls, N: fmpq_poly, P: fmpq_poly) -> Polynomials:
        (n, m), (p, q) = (_on_axis(polynomial) for polynomial in (N, P))
        return cls(n * n + m * m, p * p + q * q, n * p + m * q, m * p - n * q)


def _on_axis(polynomial: fmpq_poly) -> tuple[fmpq_poly, fmpq_poly]:
    """Return real and imaginary part of p(jω), as polynomials in ω."""
    even, odd = parts(polynomial)
    square = fmpq_poly([0, 0, 1])
    return even(square), odd(square) * fmpq_poly([0, 1])


def _shifted(polynomial: fmpq_poly, middle: fmpq) -> list[arb]:
    """Return the Taylor coefficients about a point."""
    return [arb(c) for c in polynomial(fmpq_poly([middle, 1])).coeffs()]


def positive(polynomial: fmpq_poly) -> Check:
    """Return the check that a polynomial is positive on an interval."""

    def check(a: fmpq, b: fmpq) -> bool:
        first, *rest = [*_shifted(polynomial, (a + b) / 2), arb(0)]
        h = arb((b - a) / 2)
        return bool(first > sum((abs(c) * h ** (k + 1) for k, c in enumerate(rest)), arb(0)))

    return check


def monotone(polynomial: fmpq_poly) -> Check:
    """Return the check that the derivative of a polynomial has no root on an interval."""
    up, down = positive(polynomial.derivative()), positive(-polynomial.derivative())
    return lambda a, b: up(a, b) or down(a, b)


def holds(checks: Sequence[Check], a: float, b: float, halvings: int = _HALVINGS) -> bool:
    """Whether, on each part of an interval, one of the checks succeeds."""
    work = [(exact(a), exact(b), halvings)]
    while work:
        low, high, left = work.pop()
        if any(check(low, high) for check in checks):
            continue
        if not left:
            return False
        middle = (low + high) / 2
        work += [(low, middle, left - 1), (middle, high, left - 1)]
    return True


def covered(a: np.ndarray, b: np.ndarray, start: float, end: float) -> bool:
    """Whether intervals leave nothing out between start and end."""
    return bool(a[0] <= start and b[-1] >= end and np.all(a[1:] <= np.maximum.accumulate(b)[:-1]))


def _roots(polynomial: fmpq_poly, a: float, b: float) -> int:
    """Return how often a polynomial changes sign between two points, given that it does once."""
    return int(polynomial(exact(a)) * polynomial(exact(b)) < 0)


def unit_crossings(of: Polynomials, a: np.ndarray, b: np.ndarray) -> int:
    """Return the crossings of |L| = 1, each interval having none or one; -1 if not so."""
    excess, count = of.gain - of.poles, 0
    clear = [positive(excess), positive(-excess)]
    for low, high in zip(a.tolist(), b.tolist(), strict=True):
        if holds(clear, low, high, 3):
            continue
        if not holds([monotone(excess), *clear], low, high):
            return -1
        count += _roots(excess, low, high)
    return count


def no_limit_between(
    of: Polynomials, rise: float, fall: float, a: np.ndarray, b: np.ndarray
) -> bool:
    """Whether L is nowhere −1/f with a factor fall < f < rise."""
    checks = [
        positive(of.imag),
        positive(-of.imag),
        positive(of.real),
        positive(of.poles - exact(rise) ** 2 * of.gain),  # |L| < 1/rise
    ]
    if fall > 0:
        checks.append(positive(exact(fall) ** 2 * of.gain - of.poles))
    return all(holds(checks, *ends) for ends in zip(a.tolist(), b.tolist(), strict=True))


def farther(of: Polynomials, distance: float, shift: float, a: np.ndarray, b: np.ndarray) -> bool:
    """Whether |w| > distance·|1 + shift·w| with w = 1 + L on all intervals."""
    t, k = exact(distance), exact(shift)
    total = of.gain + of.poles + 2 * of.real  # |N + P|²
    # |P + k(N + P)|² with Re (N + P) P̄ = Re N P̄ + |P|².
    other = of.poles + 2 * k * (of.real + of.poles) + k * k * total
    check = [positive(total - t * t * other)]
    return all(holds(check, *ends) for ends in zip(a.tolist(), b.tolist(), strict=True))


def beyond(polynomial: fmpq_poly, end: float) -> bool:
    """Whether a polynomial is positive at and above a point."""
    shifted = polynomial(fmpq_poly([exact(end), 1]))
    # Descartes: no change of sign among the coefficients, no positive root.
    return all(c >= 0 for c in shifted.coeffs()) and shifted[0] > 0


def unstable_roots(N: fmpq_poly, P: fmpq_poly) -> int:
    """Return how many roots of N + P lie right of the axis, by isolation of all of them."""
    count = 0
    for factor, multiplicity in (N + P).numer().factor_squarefree()[1]:
        count += multiplicity * sum(bool(root.real > 0) for root, _ in factor.complex_roots())
    return count


def precision(bits: int = 400) -> None:
    """Set the precision of all balls."""
    ctx.prec = bits


def exact_fraction(plant: object, controller: object, step: float) -> tuple[fmpq_poly, fmpq_poly]:
    """Return N and P of L = K·G, whose product of matrices is not rounded either.

    Parameters
    ----------
    plant, controller : objects with matrices A, B, C, D
        Of one input, and of one output; negative feedback.
    step : float
        Sample time; N and P are then in s of z = (1 + s)/(1 − s).
    """
    Ag, Bg, Cg, Dg = (rational(getattr(plant, name)) for name in "ABCD")
    Ak, Bk, Ck, Dk = (rational(getattr(controller, name)) for name in "ABCD")
    n, m = Ag.nrows(), Ak.nrows()
    A, B, C = fmpq_mat(n + m, n + m), fmpq_mat(n + m, 1), fmpq_mat(1, n + m)
    blocks = [(A, Ag, 0, 0), (B, Bg, 0, 0), (C, Ck, 0, n), (A, Ak, n, n)]
    for whole, part, row, column in (*blocks, (A, Bk * Cg, n, 0), (B, Bk * Dg, n, 0)):
        _put(whole, part, row, column)
    _put(C, Dk * Cg, 0, 0)
    return in_s(A, B, C, (Dk * Dg)[0, 0], bool(step))


def _put(whole: fmpq_mat, part: fmpq_mat, row: int, column: int) -> None:
    for i in range(part.nrows()):
        for j in range(part.ncols()):
            whole[row + i, column + j] = part[i, j]
