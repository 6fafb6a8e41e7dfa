"""Eigenfunctions of the uniform slewing beam with the arm's own hub and payload."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar

import numpy as np
from numpy.polynomial.legendre import leggauss

from slewctl._types import Array
from slewctl.arm import Arm
from slewctl.basis.contract import Basis, Growth
from slewctl.basis.inertia import inertia_of
from slewctl.basis.matched_roots import Ratios, hub_matched_roots, power_series
from slewctl.errors import InputError, shown

# Below, sin, cos and the exponentials are nearly dependent; above, Krylov's functions are.
_KRYLOV_BELOW = 2.5


@dataclass(frozen=True)
class HubMatched(Basis):
    """The first `n` eigenfunctions of the uniform slewing beam with a hub and a payload.

    With y an eigenfunction in the inertial frame (see `slewctl.basis.matched_roots`),
    φ = y − y(0) − y'(0) ξ is its deflection in the body axis.  Without hub and payload these
    are the slewing functions, for a hub that is heavier than everything else the clamped-free
    ones, up to normalisation.  Here it is ∫ φ_i'' φ_j'' dξ = δ_ij: the curvatures are
    orthogonal, and unlike the tip's displacement their size never vanishes.  The sign makes
    φ(1) >= 0.

    Parameters
    ----------
    n : int
        How many functions.
    ratios : Ratios, optional
        Hub and payload relative to the uniform beam.  By default those of the arm that the
        functions are matched to: the uniform beam that is most like it has its length, hub
        and payload, and a mass of 3/L² times the moment of inertia of the arm's beam about
        its clamp, which it therefore shares.

    Raises
    ------
    InputError
        If n < 1, or `ratios` is something else.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.arms.paper_beam()
    >>> sc.assemble(arm, sc.HubMatched(3)).n
    3
    """

    ratios: Ratios | None = None
    name: ClassVar[str] = "hub-matched"

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.ratios, Ratios | None):
            raise InputError(
                f"{shown(self.ratios)} is not of type Ratios",
                where="HubMatched.ratios",
                remedy="give Ratios, or leave it out to match the arm",
            )

    def _matched_to(self, arm: Arm) -> HubMatched:
        if self.ratios is not None:
            return self
        given = inertia_of(arm)
        mass = 3 * given.beam_inertia
        ratios = Ratios(
            given.hub_inertia / mass,
            given.radius,
            given.payload_mass / mass,
            given.payload_inertia / mass,
        )
        return replace(self, ratios=ratios)

    @property
    def known_ratios(self) -> Ratios:
        """The ratios, refused where they depend on an arm not given yet."""
        if self.ratios is None:
            raise self._unmatched()
        return self.ratios

    @property
    def growth(self) -> Growth:
        return Growth(float(hub_matched_roots(self.n, self.known_ratios)[-1]), 1)

    def _evaluate(self, xi: Array, derivative: int) -> Array:
        modes = _modes(self.n, self.known_ratios)
        slow = len(modes.states)
        return np.hstack(
            [
                _slow_shapes(xi, modes.z[:slow], modes.states, derivative),
                _fast_shapes(xi, modes.z[slow:], modes.amplitudes, derivative),
            ]
        )


@dataclass(frozen=True, eq=False)
class _Modes:
    """Eigenfunctions: ``states`` of the slow ones, ``amplitudes`` of the others.

    A state is y⁽ᵏ⁾(0)/zᵏ for k = 0 … 3; the amplitudes are those of sin zξ, cos zξ, e^(−zξ)
    and e^(−z(1−ξ)), then y'(0)/z.  One row a mode.
    """

    z: Array
    states: Array
    amplitudes: Array


@lru_cache(maxsize=128)
def _modes(n: int, ratios: Ratios) -> _Modes:
    z = hub_matched_roots(n, ratios)
    slow = int(np.searchsorted(z, _KRYLOV_BELOW))
    states = _root_states(z[:slow], ratios)
    amplitudes = _amplitudes(z[slow:], ratios)
    tip = np.ones(1)
    nodes, weights = leggauss(20)
    curvature = np.sqrt(weights / 2)[:, None] * _slow_shapes((nodes + 1) / 2, z[:slow], states, 2)
    # One function at a time, so that its last bit does not depend on how many there are.
    norms = [float(np.linalg.norm(np.ascontiguousarray(column))) for column in curvature.T]
    states /= np.array(norms).reshape(-1, 1)
    amplitudes /= _curvature_norm(z[slow:], amplitudes)[:, None]
    states[_slow_shapes(tip, z[:slow], states, 0)[0] < 0] *= -1
    amplitudes[_fast_shapes(tip, z[slow:], amplitudes, 0)[0] < 0] *= -1
    return _Modes(z, states, amplitudes)


def _root_states(z: Array, ratios: Ratios) -> Array:
    """Return the states of modes with small z, from the balance of forces at the tip.

    Both conditions at the root hold for the states (p, 1, −h, 0) and (0, 0, p, 1).  Of the
    two at the tip, y''' = −m y (in states) has a coefficient of the second state without
    cancellation.
    """
    p, h, m = ratios.hub_radius * z, ratios.hub_inertia * z**3, ratios.payload_mass * z
    c1, c2, c3, c4 = (power_series(z, j, 1.0) for j in range(4))
    first = p * c2 + c3 - h * c4 + m * (p * c1 + c2 - h * c3)
    second = p * c4 + c1 + m * (p * c3 + c4)
    states = np.stack([p * second, second, -h * second - p * first, -first], axis=-1)
    return states / np.abs(states).max(axis=-1, keepdims=True)


def _amplitudes(z: Array, ratios: Ratios) -> Array:
    """Return the amplitudes of modes as the null vectors of their four boundary conditions.

    The unknowns are (1 + h + p) y'(0)/z and the amplitudes of cos and of the exponentials: with
    a heavy or wide hub y'(0) is small, and as a difference of amplitudes it would be lost.
    """
    p, h, m, k = (
        ratio[:, None]
        for ratio in (
            ratios.hub_radius * z,
            ratios.hub_inertia * z**3,
            ratios.payload_mass * z,
            ratios.payload_inertia * z**3,
        )
    )
    s, c, e = np.sin(z), np.cos(z), np.exp(-z)
    one, zero = np.ones_like(z), np.zeros_like(z)
    t = 1 / (1 + h[:, 0] + p[:, 0])
    y0, y1, y2, y3 = (
        np.stack(row, axis=-1)
        for row in (
            (zero, one, one, e),
            (t, zero, zero, zero),
            (zero, -one, one, e),
            (-t, zero, -2 * one, 2 * e),
        )
    )
    t0, t1, t2, t3 = (
        np.stack(row, axis=-1)
        for row in (
            (t * s, c, e + s, 1 - e * s),
            (t * c, -s, c - e, 1 - e * c),
            (-t * s, -c, e - s, 1 + e * s),
            (-t * c, s, -e - c, 1 + e * c),
        )
    )
    conditions = np.stack([y0 - p * y1, y2 - p * y3 + h * y1, t2 - k * t1, t3 + m * t0], axis=1)
    conditions /= np.abs(conditions).max(axis=-1, keepdims=True)
    scaled_slope, b, c, d = np.linalg.svd(conditions)[2][:, -1].T
    slope = scaled_slope * t
    return np.stack([slope + c - d * e, b, c, d, slope], axis=-1)


def _curvature_norm(z: Array, amplitudes: Array) -> Array:
    """Return ‖y''‖ in L2 in closed form.

    u = y'' obeys u'''' = z⁴u too, and partial integration of u(ξu')-like products gives
    4∫u² = [ξ(u² + (u''/z²)² − 2u'u'''/z⁴) + (3uu''' − u'u'')/z⁴] from 0 to 1.
    """
    a, b, c, d, _ = amplitudes.T
    s, co, e = np.sin(z), np.cos(z), np.exp(-z)
    y0, y1, y2, y3 = b + c + d * e, a - c + d * e, -b + c + d * e, -a - c + d * e
    t0, t1 = a * s + b * co + c * e + d, a * co - b * s - c * e + d
    t2, t3 = -a * s - b * co + c * e + d, -a * co + b * s - c * e + d
    at_tip = t2**2 + t0**2 - 2 * t3 * t1 + (3 * t2 * t1 - t3 * t0) / z
    at_root = (3 * y2 * y1 - y3 * y0) / z
    return z**2 * np.sqrt((at_tip - at_root) / 4)


def _slow_shapes(xi: Array, z: Array, states: Array, derivative: int) -> Array:
    """Return φ or a derivative in Krylov's functions, without the rigid part."""
    x = np.multiply.outer(xi, z)
    # Orders of the series that stand for y(0), y'(0), y''(0) and y'''(0) in each derivative.
    orders = ((4, 5, 2, 3), (3, 4, 1, 2), (2, 3, 0, 1))[derivative]
    parts = zip(states.T, orders, strict=True)
    return z**derivative * sum(
        (state * power_series(x, order, 1.0) for state, order in parts), np.zeros_like(x)
    )


def _fast_shapes(xi: Array, z: Array, amplitudes: Array, derivative: int) -> Array:
    """Return φ or a derivative in decaying exponentials, each term without its rigid part."""
    a, b, c, d, slope = amplitudes.T
    x, e = np.multiply.outer(xi, z), np.exp(-z)
    sine, versine = np.sin(x), 2 * np.sin(x / 2) ** 2
    near_root, near_tip = np.exp(-x), np.exp(x - z)
    if derivative == 0:
        return a * sine - b * versine + c * np.expm1(-x) + d * (near_tip - e) - slope * x
    if derivative == 1:
        return z * (-a * versine - b * sine - c * np.expm1(-x) + d * (near_tip - e))
    return z**2 * (-a * sine - b * np.cos(x) + c * near_root + d * near_tip)
