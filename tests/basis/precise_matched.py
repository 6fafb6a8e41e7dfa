"""The uniform beam with hub and payload in many digits, from the boundary conditions alone."""

from __future__ import annotations

import mpmath as mp

from slewctl.basis import Ratios


def krylov(x: mp.mpf) -> tuple[mp.mpf, mp.mpf, mp.mpf, mp.mpf]:
    """(cosh + cos)/2 and its successive integrals."""
    C, S, c, s = mp.cosh(x), mp.sinh(x), mp.cos(x), mp.sin(x)
    return (C + c) / 2, (S + s) / 2, (C - c) / 2, (S - s) / 2


def state(root: list[mp.mpf], x: mp.mpf) -> list[mp.mpf]:
    """y⁽ᵏ⁾/zᵏ, k = 0 … 3, at zξ = x from the same at the root."""
    c = krylov(x)
    return [sum(c[(j - k) % 4] * root[j] for j in range(4)) for k in range(4)]


def conditions(ratios: Ratios, z: mp.mpf) -> tuple[list[list[mp.mpf]], list[list[mp.mpf]]]:
    """Two root states that meet the hub's conditions, and the tip's defects of each."""
    p, h = z * ratios.hub_radius, z**3 * mp.mpf(ratios.hub_inertia)
    m, k = z * mp.mpf(ratios.payload_mass), z**3 * mp.mpf(ratios.payload_inertia)
    roots = [[p, mp.mpf(1), -h, mp.mpf(0)], [mp.mpf(0), mp.mpf(0), p, mp.mpf(1)]]
    tips = [state(root, z) for root in roots]
    return roots, [[y[2] - k * y[1], y[3] + m * y[0]] for y in tips]


def determinant(ratios: Ratios, z: mp.mpf) -> mp.mpf:
    """Vanishes at the natural frequencies; positive just above zero."""
    (a, b), (c, d) = conditions(ratios, z)[1]
    return b * c - a * d


def eigenfunction(ratios: Ratios, z: mp.mpf) -> list[mp.mpf]:
    """The state at the root."""
    (first, second), ((_, b), (_, d)) = conditions(ratios, z)
    return [d * u - b * v for u, v in zip(first, second, strict=True)]


def deflection(root: list[mp.mpf], z: mp.mpf, xi: float, derivative: int) -> mp.mpf:
    """φ = y − y(0) − y'(0)ξ or a derivative, from the state at the root."""
    x = z * mp.mpf(xi)
    rigid = (root[0] + root[1] * x, root[1], mp.mpf(0))[derivative]
    return z**derivative * (state(root, x)[derivative] - rigid)
