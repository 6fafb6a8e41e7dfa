"""Crossings of a loop in exact arithmetic: its entries are rationals, its roots isolated.

Every double is a rational number.  With P = det(sI − A) and N = det(sI − A + BC) − P + D·P
the loop is L = N/P exactly, |L| = 1 and Im L = 0 on the axis are polynomials in ω², and
their positive roots are isolated without rounding (python-flint).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import control
import numpy as np
from flint import fmpq, fmpq_mat, fmpq_poly
from numpy.typing import NDArray

Array = NDArray[np.float64]


def rational(values: Array) -> fmpq_mat:
    """Return a matrix of doubles as the rational numbers that they are."""
    rows = np.atleast_2d(np.asarray(values, dtype=float))
    return fmpq_mat([[fmpq(*float(v).as_integer_ratio()) for v in row] for row in rows])


@dataclass(frozen=True, eq=False)
class ExactLoop:
    """L = C (sI − A)⁻¹ B + D with exact entries; `step` is its sample time in s, or zero."""

    A: fmpq_mat
    B: fmpq_mat
    C: fmpq_mat
    D: fmpq_mat
    step: float

    @classmethod
    def of(cls, loop: control.StateSpace) -> ExactLoop:
        """Return a loop as its matrices have it."""
        return cls(*(rational(M) for M in (loop.A, loop.B, loop.C, loop.D)), float(loop.dt or 0))

    @classmethod
    def in_series(cls, plant: control.StateSpace, controller: control.StateSpace) -> ExactLoop:
        """Return K G, of which no product of doubles was rounded; signals in one order."""
        G, K = cls.of(plant), cls.of(controller)
        n, k = plant.nstates, controller.nstates
        A = fmpq_mat(n + k, n + k)
        for rows, columns, block in (
            (0, 0, G.A),
            (n, 0, K.B * G.C if k else fmpq_mat(0, n)),
            (n, n, K.A),
        ):
            for i in range(block.nrows()):
                for j in range(block.ncols()):
                    A[rows + i, columns + j] = block[i, j]
        B = fmpq_mat([*G.B.tolist(), *(K.B * G.D).tolist()] if k else G.B.tolist())
        left, right = (K.D * G.C).tolist()[0], K.C.tolist()[0] if k else []
        return cls(A, B, fmpq_mat([[*left, *right]]), K.D * G.D, G.step)

    def scaled(self, factor: float) -> ExactLoop:
        """Return the loop times a factor."""
        exact = fmpq(*float(factor).as_integer_ratio())
        return replace(self, C=self.C * exact, D=self.D * exact)


Loop = control.StateSpace | ExactLoop


def _exact(loop: Loop) -> ExactLoop:
    return loop if isinstance(loop, ExactLoop) else ExactLoop.of(loop)


def fraction(loop: Loop) -> tuple[fmpq_poly, fmpq_poly]:
    """Return numerator and denominator of L on the axis: in s, or in s = (z − 1)/(z + 1)."""
    exact = _exact(loop)
    return in_s(exact.A, exact.B, exact.C, exact.D[0, 0], bool(exact.step))


def in_s(
    A: fmpq_mat, B: fmpq_mat, C: fmpq_mat, D: fmpq, sampled: bool
) -> tuple[fmpq_poly, fmpq_poly]:
    """Return the same of exact matrices."""
    P = A.charpoly()
    N = (A - B * C).charpoly() - P + D * P
    if sampled:
        N, P = _bilinear(N, A.nrows()), _bilinear(P, A.nrows())
    common = N.gcd(P)
    return N // common, P // common


def _bilinear(polynomial: fmpq_poly, degree: int) -> fmpq_poly:
    """Return (1 − s)ⁿ·p((1 + s)/(1 − s))."""
    up, down = fmpq_poly([1, 1]), fmpq_poly([1, -1])
    total = fmpq_poly([0])
    for k in range(degree + 1):
        total += polynomial[k] * up**k * down ** (degree - k)
    return total


def parts(polynomial: fmpq_poly) -> tuple[fmpq_poly, fmpq_poly]:
    """Return e and o of p(jω) = e(x) + jω·o(x), x = ω²."""
    coefficients = polynomial.coeffs()
    sign = [1, -1]
    even = [sign[k % 2] * c for k, c in enumerate(coefficients[0::2])]
    odd = [sign[k % 2] * c for k, c in enumerate(coefficients[1::2])]
    return fmpq_poly(even), fmpq_poly(odd)


def _positive_roots(polynomial: fmpq_poly, step: float) -> Array:
    """Return ω in rad/s of the roots x = ω² > 0 where the polynomial changes sign."""
    found: list[float] = []
    for factor, multiplicity in polynomial.numer().factor_squarefree()[1]:
        if multiplicity % 2 and factor.degree() > 0:
            roots = [root for root, _ in factor.complex_roots() if root.imag == 0]
            found += [float(root.real.mid()) for root in roots if root.real > 0]
    v = np.sqrt(np.sort(found))
    return 2 * np.arctan(v) / step if step else v


def gain_crossings(loop: Loop) -> Array:
    """Return every ω > 0 in rad/s where |L| passes one."""
    (ne, no), (pe, po) = (parts(p) for p in fraction(loop))
    x = fmpq_poly([0, 1])
    return _positive_roots(ne * ne + x * no * no - pe * pe - x * po * po, _exact(loop).step)


def real_crossings(loop: Loop) -> Array:
    """Return every ω > 0 in rad/s where Im L changes sign at a finite, nonzero L."""
    (ne, no), (pe, po) = (parts(p) for p in fraction(loop))
    return _positive_roots(no * pe - ne * po, _exact(loop).step)


def unstable_poles(loop: Loop) -> int:
    """Number of closed-loop poles, hidden ones included, that are not stable: exactly."""
    exact = _exact(loop)
    closed = (exact.A - exact.B * exact.C * (1 / (1 + exact.D[0, 0]))).charpoly()
    if exact.step:
        closed = _bilinear(closed, exact.A.nrows())
    return sum(
        multiplicity * sum(not root.real < 0 for root, _ in factor.complex_roots())
        for factor, multiplicity in closed.numer().factor_squarefree()[1]
    )


def stable(loop: Loop) -> bool:
    """Whether every closed-loop pole, hidden ones included, is stable: exactly."""
    return not unstable_poles(loop)
