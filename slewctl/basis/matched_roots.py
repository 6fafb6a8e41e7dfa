"""Natural frequencies of the uniform slewing beam with a hub and a payload, for every index.

The motion y(ξ) in the inertial frame obeys y'''' = z⁴ y on [0, 1].  With the hub rotation
θ = y'(0) and the ratios η = J_h/(mL²), ρ = r/L, μ = m_t/m, κ = J_t/(mL²), virtual work gives

    y(0) = ρ y'(0),            y''(0) − ρ y'''(0) + η z⁴ y'(0) = 0,
    y''(1) = κ z⁴ y'(1),       y'''(1) = −μ z⁴ y(1).

Write p = ρz, h = ηz³, m = μz, k = κz³.  Laplace expansion of the determinant in Rayleigh's
functions leaves, with G_j(z) = Σ_i (−4)^i z^(4i+j)/(4i+j)!, the characteristic function

    g = h N₂₃ − N₁₃ − 2p N₀₃ − p² N₀₂,
    N₂₃ = (1 + G₀)/2 − 2m G₃ − k G₁ + 2mk G₄,     N₁₃ = −2G₃ − 2m G₂ − k G₀ + 2mk G₃,
    N₀₃ = −G₂ − m G₁ + 2k G₃ + mk G₂,             N₀₂ = −G₁ − m G₀ + 2k G₂ + mk G₁,

which is positive at z → 0 and changes sign at every natural frequency.  G_0 … G_4 are products
of sin or cos with sinh or cosh; they are taken divided by e^z, and from the series where the
products would cancel.

No frequency is missed or found twice, by Rayleigh's theorem: one constraint moves each
frequency up, at most to the next one.  Locking the payload's rotation, its displacement and the
hub in turn leads to the clamped-clamped beam, with one frequency in every (iπ, (i+1)π); going
back, each system's frequencies are separated by those of the one before.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from slewctl._types import Array
from slewctl.errors import InputError, check_count, check_nonnegative

# Below, differences of the hyperbolic functions cancel, and their series needs few terms.
_SERIES_BELOW = 1.0
_LEAST_ROOTS = 8
_LARGEST = 1e50  # products of three ratios stay finite


@dataclass(frozen=True)
class Ratios:
    """Hub and payload relative to a uniform beam of mass m and length L, dimensionless.

    Parameters
    ----------
    hub_inertia : float
        J_h/(m L²): three times J_h over the beam's moment of inertia about the clamp.
    hub_radius : float
        r/L.
    payload_mass : float
        m_t/m.
    payload_inertia : float
        J_t/(m L²).

    Raises
    ------
    InputError
        If one is negative, not finite or beyond 1e50.
    """

    hub_inertia: float = 0.0
    hub_radius: float = 0.0
    payload_mass: float = 0.0
    payload_inertia: float = 0.0

    def __post_init__(self) -> None:
        for name in ("hub_inertia", "hub_radius", "payload_mass", "payload_inertia"):
            value = check_nonnegative(getattr(self, name), f"ratios.{name}")
            if value > _LARGEST:
                raise InputError(
                    f"{value:g} is beyond {_LARGEST:g}",
                    where=f"ratios.{name}",
                    remedy="check the units: such a hub or payload dwarfs every beam",
                )
            object.__setattr__(self, name, value)


def power_series(x: Array, start: int, factor: float, terms: int = 8) -> Array:
    """Return Σ_i factor^i x^(4i+start)/(4i+start)!, accurate to rounding for 0 <= x <= 2.5.

    With `factor` 1 these are Krylov's functions (cosh x + cos x)/2 and its kin, from
    ``start`` 4 on without their first terms; with −4 the products cos x cosh x and its kin.
    """
    total = np.zeros_like(x)
    for i in reversed(range(terms)):
        k = 4 * i + start
        total = total * (factor * x**4) + 1 / math.factorial(k)
    return total * x**start


def hub_matched_roots(n: int, ratios: Ratios) -> Array:
    """Return the first `n` positive roots z of g, where ω = z² √(EI/(m L³)).

    Parameters
    ----------
    n : int
    ratios : Ratios

    Returns
    -------
    ndarray, shape (n,)
        Increasing; each to within a few units in the last place.

    Raises
    ------
    InputError
        If n < 1.
    """
    # The bases are nested: those of few functions share what is found at once.
    shared = max(_LEAST_ROOTS, 1 << (check_count(n, "n") - 1).bit_length())
    return _roots(shared, ratios)[:n]


@lru_cache(maxsize=128)
def _roots(n: int, ratios: Ratios) -> Array:
    i = np.arange(1.0, n + 2.0)
    system = _System(math.inf, ratios.hub_radius, math.inf, math.inf)
    locked = system.between(np.pi * i, np.pi * i + np.pi)
    for released in (
        {"payload_mass": ratios.payload_mass},
        {"payload_inertia": ratios.payload_inertia},
    ):
        system = replace(system, **released)
        locked = system.between(np.concatenate([[0.0], locked[:-1]]), locked)
    # The free hub adds the rigid rotation at z = 0, below the first locked frequency.
    z = replace(system, hub_inertia=ratios.hub_inertia).between(locked[:-1], locked[1:])
    z.setflags(write=False)
    return z


@dataclass(frozen=True)
class _System:
    """Ratios of which an infinite one means a locked coordinate."""

    hub_inertia: float
    hub_radius: float
    payload_mass: float
    payload_inertia: float

    def between(self, low: Array, high: Array) -> Array:
        """Return root i of g, known to be the only one between low[i] and high[i].

        Bisection on the doubles themselves: 63 steps reach neighbouring numbers whatever
        their scale, and a root that coincides with an end is found there.
        """
        left, right = np.ascontiguousarray(low).view(np.int64), high.view(np.int64)
        # Below its first root g is positive, or negative if half of the payload is locked:
        # the infinite ratio has then sent one root, and the sign change there, to zero.
        half_locked = math.isinf(self.payload_mass) != math.isinf(self.payload_inertia)
        sign = np.where(np.arange(len(left)) % 2 == half_locked, 1.0, -1.0)
        for _ in range(63):
            middle = left + (right - left) // 2
            below = sign * self.characteristic(middle.view(np.float64)) >= 0
            left, right = np.where(below, middle, left), np.where(below, right, middle)
        return right.view(np.float64)

    def characteristic(self, z: Array) -> Array:
        """Return g up to a positive factor that keeps it finite."""
        one, G = _products(z)
        h0, h1 = _homogeneous(self.hub_inertia, z**3)
        p0, p1 = _homogeneous(self.hub_radius, z)
        m0, m1 = _homogeneous(self.payload_mass, z)
        k0, k1 = _homogeneous(self.payload_inertia, z**3)
        a, m, k, mk = m0 * k0, m1 * k0, m0 * k1, m1 * k1
        N23 = a * (one + G[0]) / 2 - 2 * m * G[3] - k * G[1] + 2 * mk * G[4]
        N13 = -2 * a * G[3] - 2 * m * G[2] - k * G[0] + 2 * mk * G[3]
        N03 = -a * G[2] - m * G[1] + 2 * k * G[3] + mk * G[2]
        N02 = -a * G[1] - m * G[0] + 2 * k * G[2] + mk * G[1]
        return p0**2 * (h1 * N23 - h0 * N13) - h0 * p1 * (2 * p0 * N03 + p1 * N02)


def _homogeneous(ratio: float, power: Array) -> tuple[Array, Array]:
    """Return (1, x)/(1 + x) for x = ratio·power, which has a limit for an infinite ratio."""
    if math.isinf(ratio):
        return np.zeros_like(power), np.ones_like(power)
    x = ratio * power
    return 1 / (1 + x), x / (1 + x)


def _products(z: Array) -> tuple[Array, list[Array]]:
    """Return 1 and G_0 … G_4 at z, divided by e^z where z is not small."""
    large = np.maximum(z, _SERIES_BELOW)
    sine, cosine = np.sin(large), np.cos(large)
    decay = np.exp(-large)
    sinh, cosh = (1 - decay**2) / 2, (1 + decay**2) / 2
    G = [
        cosine * cosh,
        (cosine * sinh + sine * cosh) / 2,
        sine * sinh / 2,
        (sine * cosh - cosine * sinh) / 4,
        (decay - cosine * cosh) / 4,
    ]
    small = z < _SERIES_BELOW
    if np.any(small):
        for j, values in enumerate(G):
            values[small] = power_series(z[small], j, -4.0)
        decay[small] = 1.0
    return decay, G
