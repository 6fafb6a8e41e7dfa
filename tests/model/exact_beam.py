"""Exact natural frequencies of slewing beams, by ways that share nothing with the package.

The harmonic motion w(x) in the inertial frame obeys (EI w'')'' = ω² m̄ w with the state
(w, w', M = EI w'', Q = M') continuous across steps.  With J_h, r, m_t, J_t

    w(0) = r w'(0),   M(0) − r Q(0) + ω² J_h w'(0) = 0,
    M(L) = ω² J_t w'(L),   Q(L) = −ω² m_t w(L).

* `uniform_determinant`: the 4 × 4 determinant of a uniform beam in closed form;
* `wedge_determinant`: Bessel functions for m̄ ∝ uⁿ, EI ∝ uⁿ⁺², u = 1 − cx;
* `series_determinant`: Taylor series on short pieces, any piecewise polynomial profile; a
  lumped mass (m, J) makes M step by −ω² J w' and Q by ω² m w.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import mpmath as mp
import numpy as np

from slewctl import Arm, Stations

Determinant = Callable[[mp.mpf], mp.mpf]
Columns = list[list[mp.mpf]]


def boundary_determinant(arm: Arm, omega: mp.mpf, root: Columns, tip: Columns) -> mp.mpf:
    """Determinant of the four conditions; each column is a solution's (w, w', M, Q)."""
    squared = omega**2
    hub, payload = arm.hub, arm.payload
    rows = [[], [], [], []]
    for w, slope, moment, force in root:
        rows[0].append(w - hub.radius * slope)
        rows[1].append(moment - hub.radius * force + squared * hub.inertia * slope)
    for w, slope, moment, force in tip:
        rows[2].append(moment - squared * payload.inertia * slope)
        rows[3].append(force + squared * payload.mass * w)
    return _determinant4(rows)


def _determinant4(a: Columns) -> mp.mpf:
    """Laplace expansion by 2 × 2 minors: mpmath's own returns 0 for nearly singular matrices."""

    def minor(top: int, i: int, j: int) -> mp.mpf:
        return a[top][i] * a[top + 1][j] - a[top][j] * a[top + 1][i]

    terms = ((0, 1, 1), (0, 2, -1), (0, 3, 1), (1, 2, 1), (1, 3, -1), (2, 3, 1))
    rest = {(i, j): [k for k in range(4) if k not in (i, j)] for i, j, _ in terms}
    return sum(sign * minor(0, i, j) * minor(2, *rest[i, j]) for i, j, sign in terms)


def uniform_determinant(arm: Arm, omega: mp.mpf) -> mp.mpf:
    """Closed form for constant m̄ and EI, with decaying exponentials for sinh and cosh."""
    L, m, EI = (
        mp.mpf(v) for v in (arm.beam.length, arm.beam.mass_per_length, arm.beam.bending_stiffness)
    )
    beta = (m * omega**2 / EI) ** mp.mpf("0.25")

    def states(x: mp.mpf) -> Columns:
        s, c = mp.sin(beta * x), mp.cos(beta * x)
        down, up = mp.exp(-beta * x), mp.exp(beta * (x - L))
        derivatives = ([s, c, -s, -c], [c, -s, -c, s], [down, -down, down, -down], [up] * 4)
        return [[d[0], beta * d[1], EI * beta**2 * d[2], EI * beta**3 * d[3]] for d in derivatives]

    return boundary_determinant(arm, omega, states(mp.mpf(0)), states(L))


def wedge_determinant(arm: Arm, c: float, n: int, omega: mp.mpf) -> mp.mpf:
    """Bessel solutions w = u^(−n/2) Z_n(k√u) for m̄ = uⁿ, EI = uⁿ⁺², u = 1 − cx, L = 1."""
    k = 2 * mp.sqrt(omega) / c

    def family(bessel: Callable[..., mp.mpf], sign: int, scale: mp.mpf, x: mp.mpf) -> list[mp.mpf]:
        # d/du [u^(−a/2) Z_a(k√u)] = ∓ (k/2) u^(−(a+1)/2) Z_{a+1}(k√u), and d/dx = −c d/du.
        u = 1 - c * x
        step = -c * sign * k / 2
        w, w1, w2, w3 = (
            scale * step**j * u ** (-mp.mpf(n + j) / 2) * bessel(n + j, k * mp.sqrt(u))
            for j in range(4)
        )
        slope_of_stiffness = -c * (n + 2) * u ** (n + 1)
        return [w, w1, u ** (n + 2) * w2, slope_of_stiffness * w2 + u ** (n + 2) * w3]

    kinds = (
        (mp.besselj, -1, mp.mpf(1)),
        (mp.bessely, -1, mp.mpf(1)),
        (mp.besseli, 1, mp.exp(-k)),
        (mp.besselk, -1, mp.exp(k * mp.sqrt(1 - mp.mpf(c)))),
    )
    root, tip = ([family(*kind, x) for kind in kinds] for x in (mp.mpf(0), mp.mpf(1)))
    return boundary_determinant(arm, omega, root, tip)


def _pieces(spec: object, length: float) -> list[tuple[mp.mpf, mp.mpf, list[mp.mpf]]]:
    """(left, right, coefficients in powers of x) of a constant, polynomial or table."""
    L = mp.mpf(length)
    if isinstance(spec, Stations):
        x, v = [mp.mpf(a) for a in spec.x], [mp.mpf(a) for a in spec.values]
        spans = [i for i in range(len(x) - 1) if x[i + 1] > x[i]]
        slopes = {i: (v[i + 1] - v[i]) / (x[i + 1] - x[i]) for i in spans}
        return [(x[i], x[i + 1], [v[i] - slopes[i] * x[i], slopes[i]]) for i in spans]
    powers = spec if isinstance(spec, tuple) else (spec,)
    return [(mp.mpf(0), L, [mp.mpf(c) / L**k for k, c in enumerate(powers)])]


def _shifted(coefficients: list[mp.mpf], at: mp.mpf) -> list[mp.mpf]:
    """Taylor coefficients of a polynomial about `at`."""
    n = len(coefficients)
    return [
        sum(mp.binomial(k, j) * coefficients[k] * at ** (k - j) for k in range(j, n))
        for j in range(n)
    ]


def _advance(
    state: list[mp.mpf], m: list[mp.mpf], EI: list[mp.mpf], squared: mp.mpf, h: mp.mpf
) -> list[mp.mpf]:
    """Carry (w, w', M, Q) over a piece of width h by Taylor series about its left end."""
    w, moment = [state[0], state[1]], [state[2], state[3]]
    tolerance = mp.mpf(10) ** (-mp.mp.dps)
    quiet = 0
    j = 0
    while quiet < 8:
        # M = EI w'' gives w_{j+2}; M'' = ω² m̄ w gives M_{j+2}.
        known = sum(
            EI[i] * w[j - i + 2] * (j - i + 2) * (j - i + 1)
            for i in range(1, min(j, len(EI) - 1) + 1)
        )
        w.append((moment[j] - known) / (EI[0] * (j + 2) * (j + 1)))
        load = squared * sum(m[i] * w[j - i] for i in range(min(j, len(m) - 1) + 1))
        moment.append(load / ((j + 2) * (j + 1)))
        size = max(abs(w[-1]), abs(moment[-1])) * h ** (j + 2) * (j + 2)
        quiet = quiet + 1 if size < tolerance * max(map(abs, state)) else 0
        j += 1

    def value(a: list[mp.mpf]) -> mp.mpf:
        return sum(c * h**k for k, c in enumerate(a))

    def slope(a: list[mp.mpf]) -> mp.mpf:
        return sum(k * c * h ** (k - 1) for k, c in enumerate(a) if k)

    return [value(w), slope(w), value(moment), slope(moment)]


def series_determinant(arm: Arm, omega: mp.mpf, pieces: int = 4) -> mp.mpf:
    """Determinant by Taylor series on pieces, exact to the working precision."""
    L = arm.beam.length
    masses = _pieces(arm.beam.mass_per_length, L)
    stiffnesses = _pieces(arm.beam.bending_stiffness, L)
    cuts = {left for left, _, _ in (*masses, *stiffnesses)} | {mp.mpf(L)}
    cuts |= {mp.mpf(L) * k / pieces for k in range(pieces)} | {mp.mpf(m.x) for m in arm.masses}
    bounds = sorted(cuts)
    start = [[mp.mpf(int(i == j)) for i in range(4)] for j in range(4)]
    tip = []
    for column in start:
        state = column
        for left, right in pairwise(bounds):
            m, EI = (
                _shifted(next(c for a, b, c in table if a <= left < b), left)
                for table in (masses, stiffnesses)
            )
            state = _advance(state, m, EI, omega**2, right - left)
            for body in arm.masses:
                if body.x == right:
                    w, slope, moment, force = state
                    moment -= omega**2 * body.inertia * slope
                    state = [w, slope, moment, force + omega**2 * body.mass * w]
        tip.append(state)
    return boundary_determinant(arm, omega, start, tip)


def encloses(determinant: Determinant, omega: float, relative: float) -> bool:
    """Whether a root is proved to lie within ω(1 ± relative): the determinant changes sign."""
    reach = mp.mpf(omega) * mp.mpf(relative)
    return mp.sign(determinant(omega - reach)) * mp.sign(determinant(omega + reach)) < 0


def count_below(determinant: Determinant, top: float, points: int) -> int:
    """Number of sign changes on (0, top] on a grid of `points`, uniform in √ω."""
    grid = np.linspace(np.sqrt(top) / points, np.sqrt(top), points) ** 2
    signs = [mp.sign(determinant(mp.mpf(w))) for w in grid]
    return sum(a != b for a, b in pairwise(signs))


def alternates_between(determinant: Determinant, omega: np.ndarray) -> bool:
    """Whether an odd number of roots separates the midpoints of neighbouring `omega`."""
    signs = [mp.sign(determinant(mp.mpf(w))) for w in (omega[1:] + omega[:-1]) / 2]
    return all(a == -b for a, b in pairwise(signs))
