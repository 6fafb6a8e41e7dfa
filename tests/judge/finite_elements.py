"""A slewing arm by finite elements, from its data alone: the judge of verdicts.

Nothing of the package is used but what an `Arm` was described with.  The deflection is that
in the inertial frame, w(x) = (r + x)θ + v(x), so that neither a basis nor a coupling integral
occurs: an element carries the two cubic Hermite functions of each of its nodes, and inside it
functions whose second derivatives are Legendre polynomials.  The clamp says w(0) = rθ and
w'(0) = θ; hub and payload are a mass and two inertias at the nodes at the ends.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.polynomial import Polynomial, legendre
from scipy.linalg import eigh

Array = np.ndarray

# Second derivatives inside an element go to this degree, the deflection to two more.
_INSIDE = 8
_POINTS = 24


class Described(Protocol):
    """What `slewctl.Arm` was described with."""

    beam: object
    hub: object
    payload: object
    damping_ratio: object
    damping: object
    motor: object


@dataclass(frozen=True, eq=False)
class Elements:
    """The arm's undamped modes, and what they show.

    Attributes
    ----------
    omega : ndarray, shape (N,)
        rad/s, increasing, the rigid rotation's zero first.
    theta, tip : ndarray, shape (N,)
        Hub angle and inertial displacement of the tip in each mode of unit mass.
    coefficients : ndarray
        Of the elements' functions, one column a mode.
    edges : ndarray
        Of the elements, in m.
    """

    arm: Described
    omega: Array
    theta: Array
    tip: Array
    coefficients: Array
    edges: Array

    def deflection(self, x: float) -> Array:
        """Return v(x) in each mode: what is seen from the turning hub."""
        turned = (self.arm.hub.radius + x) * self.theta
        return self._at(x, 0) - turned

    def moment(self, x: float) -> Array:
        """Return EI w''(x) in each mode."""
        beam = self.arm.beam
        stiffness = profile(beam.bending_stiffness, np.array([x]), beam.length)[0]
        return stiffness * self._at(x, 2)

    def _at(self, x: float, derivative: int) -> Array:
        e = min(int(np.searchsorted(self.edges, x, side="right")) - 1, len(self.edges) - 2)
        h = self.edges[e + 1] - self.edges[e]
        xi = np.array([2 * (x - self.edges[e]) / h - 1])
        numbers, values = _functions(e, h, xi, derivative, self.arm.hub.radius)
        return values[0] @ self.coefficients[numbers]


def profile(spec: object, x: Array, length: float) -> Array:
    """Return a property at x: a number, powers of x/L, or stations with straight lines."""
    if hasattr(spec, "values"):
        return np.interp(x, spec.x, spec.values)
    if isinstance(spec, tuple):
        return sum(c * (x / length) ** k for k, c in enumerate(spec)) + 0 * x
    return np.full(len(x), float(spec))


def elements(arm: Described, modes: int) -> Elements:
    """Return an arm's modes, the first `modes` flexible ones of them converged.

    Parameters
    ----------
    arm : Arm
        Its profiles are numbers, powers or stations.
    modes : int
    """
    beam, hub, payload = arm.beam, arm.hub, arm.payload
    edges = _edges(beam, 4 + modes // 2)
    size = 1 + (len(edges) - 1) * (2 + _INSIDE - 1)
    M, K = np.zeros((size, size)), np.zeros((size, size))
    xi, weights = legendre.leggauss(_POINTS)
    for e in range(len(edges) - 1):
        h = edges[e + 1] - edges[e]
        x = edges[e] + h * (1 + xi) / 2
        numbers, w = _functions(e, h, xi, 0, hub.radius)
        _, bent = _functions(e, h, xi, 2, hub.radius)
        mass = profile(beam.mass_per_length, x, beam.length) * weights * h / 2
        stiffness = profile(beam.bending_stiffness, x, beam.length) * weights * h / 2
        M[np.ix_(numbers, numbers)] += w.T @ (mass[:, None] * w)
        K[np.ix_(numbers, numbers)] += bent.T @ (stiffness[:, None] * bent)
    last = len(edges) - 2
    tip_w, tip_slope = _node(last + 1)
    rotor = 0.0
    if arm.motor is not None:
        rotor = arm.motor.gear_efficiency * arm.motor.gear_ratio**2 * arm.motor.rotor_inertia
    M[0, 0] += hub.inertia + rotor
    M[tip_w, tip_w] += payload.mass
    M[tip_slope, tip_slope] += payload.inertia
    omega, shapes = _modes(M, K)
    return Elements(arm, omega, shapes[0], shapes[tip_w], shapes, edges)


def _edges(beam: object, count: int) -> Array:
    """Return about so many elements of like length, with edges at the stations."""
    inner: set[float] = set()
    for spec in (beam.mass_per_length, beam.bending_stiffness):
        if hasattr(spec, "values"):
            inner |= set(spec.x[1:-1])
    fixed = np.array([0.0, *sorted(inner), beam.length])
    pieces = [
        np.linspace(a, b, 2 + int(count * (b - a) / beam.length))[:-1]
        for a, b in pairwise(fixed)
        if b > a
    ]
    return np.array([*np.concatenate(pieces), beam.length])


def _node(k: int) -> tuple[int, int]:
    """Return the numbers of displacement and slope at the k-th node, k > 0; θ is number 0."""
    first = 1 + (k - 1) * (2 + _INSIDE - 1)
    return first, first + 1


def _functions(e: int, h: float, xi: Array, d: int, radius: float) -> tuple[list[int], Array]:
    """Return the numbers of an element's functions and their d-th derivatives at ξ in [−1, 1]."""
    ends, inside = _on_the_unit_element(tuple(xi), d)
    left, left_slope, right, right_slope = ends * [[1.0], [h / 2], [1.0], [h / 2]]
    w2, s2 = _node(e + 1)
    if e == 0:
        columns, numbers = [radius * left + left_slope, right, right_slope], [0, w2, s2]
    else:
        columns, numbers = [left, left_slope, right, right_slope], [*_node(e), w2, s2]
    values = np.column_stack([*columns, *inside]) * (2 / h) ** d
    return [*numbers, *range(s2 + 1, s2 + 1 + len(inside))], values


@cache
def _on_the_unit_element(xi: tuple[float, ...], d: int) -> tuple[Array, Array]:
    """Return d-th derivatives of the four Hermite functions on [−1, 1] and of those inside.

    The ones inside have the second derivatives P_k, k = 2, 3 …, and no value and no slope at
    either end.
    """
    at = np.array(xi)
    hermite = ([0.5, -0.75, 0, 0.25], [0.25, -0.25, -0.25, 0.25],
               [0.5, 0.75, 0, -0.25], [-0.25, -0.25, 0.25, 0.25])  # fmt: skip
    ends = [Polynomial(c).deriv(d)(at) if d else Polynomial(c)(at) for c in hermite]
    inside = []
    for k in range(2, _INSIDE + 1):
        twice = legendre.legint(legendre.legint(np.eye(k + 1)[k], lbnd=-1), lbnd=-1)
        inside.append(legendre.legval(at, legendre.legder(twice, d) if d else twice))
    return np.array(ends), np.array(inside)


def _modes(M: Array, K: Array) -> tuple[Array, Array]:
    """Return ω and the modes of unit mass, the slow ones to full accuracy.

    1/(ω² + σ) are the eigenvalues, so that rounding hurts the fast modes and not the slow.
    """
    scale = 1 / np.sqrt(np.diag(K))
    Ms, Ks = M * np.outer(scale, scale), K * np.outer(scale, scale)
    last = len(K) - 2
    slow = eigh(Ms[1:, 1:], Ks[1:, 1:], eigvals_only=True, subset_by_index=[last, last])
    shift = 1 / slow[0]  # ω² of the first mode with the hub held
    values, vectors = eigh(Ms, Ks + shift * Ms)
    inverse, shapes = values[::-1], vectors[:, ::-1] * scale[:, None]
    squared = 1 / inverse - shift
    squared[0] = 0.0
    shapes = shapes / np.sqrt(np.einsum("ik,ij,jk->k", shapes, M, shapes))
    return np.sqrt(np.abs(squared)), shapes
