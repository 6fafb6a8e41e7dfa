"""Gauss–Legendre panels that are exact, or carry a bound that is below rounding.

Every integrand of the assembly is a polynomial of degree d times a product of shapes
that grows no faster than exp(κ|Im or Re ξ|) off the real axis.  On the Bernstein ellipse
of parameter ρ around a panel of half-width h it is therefore bounded by
ρ^d exp(κh(ρ − 1/ρ)/2) times its size on the panel, and N Gauss points leave a relative
error below (64/15) ρ^(d − 2N) exp(κh(ρ − 1/ρ)/2)/(1 − ρ^−2)  (Trefethen, Approximation
Theory and Approximation Practice, theorem 19.3).  N is the smallest number for which the
best ρ brings that below the unit roundoff.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from slewctl._types import Array, IntArray
from slewctl.errors import AccuracyError

LongArray = npt.NDArray[np.floating[Any]]

# Of double precision.
UNIT_ROUNDOFF = 2.0**-53


@dataclass(frozen=True, eq=False)
class Rule:
    """Points ``xi`` in [0, 1] with positive weights that sum to one."""

    xi: Array
    weights: Array


def points_needed(exponents: Array, degree: int) -> IntArray:
    """Return how many Gauss points make the integrals on each panel exact to rounding.

    Parameters
    ----------
    exponents : ndarray, shape (panels,)
        κh: growth exponent of the integrand times the panel's half-width.
    degree : int
        Degree of its polynomial factor.
    """
    rho = np.geomspace(1.05, 1e3, 400)
    log_bound = (
        np.multiply.outer(exponents, (rho - 1 / rho) / 2)
        + math.log(64 / 15)
        - np.log1p(-(rho**-2.0))
        - math.log(UNIT_ROUNDOFF)
    )
    needed = np.ceil((log_bound / np.log(rho) + degree).min(axis=1) / 2).astype(int)
    return np.where(np.asarray(exponents) == 0, degree // 2 + 1, needed)


@lru_cache(maxsize=256)
def _gauss(points: int) -> tuple[Array, Array]:
    """Return Gauss–Legendre nodes and weights on [-1, 1], by Newton steps from Tricomi's formula.

    The weight at a node close to ±1 amplifies the node's rounding by 1/(1 − x²), which in
    double precision leaves it with ten digits only: the last steps are of extended precision.
    """
    k = np.arange(points, 0.0, -1.0)
    x = (1 - (points - 1) / (8 * points**3)) * np.cos(np.pi * (4 * k - 1) / (4 * points + 2))
    for kind in (float, float, np.longdouble, np.longdouble):
        x = x.astype(kind)
        value, slope = _legendre(points, x)
        x = x - value / slope
    return x.astype(float), (2 / ((1 - x**2) * slope**2)).astype(float)


def _legendre(degree: int, x: LongArray) -> tuple[LongArray, LongArray]:
    """Return the Legendre polynomial of a degree and its slope, in the precision of `x`."""
    one = np.ones_like(x)
    before, value = one, x.copy()
    for k in range(2, degree + 1):
        before, value = value, ((2 * k - 1) * x * value - (k - 1) * before) / k
    return value, degree * (before - x * value) / (1 - x**2) if degree > 1 else one


@lru_cache(maxsize=64)  # all arms and bases without inner points of their own share a few
def composite(breakpoints: tuple[float, ...], exponent: float, degree: int) -> Rule:
    """Return the rule on [0, 1] that respects `breakpoints`.

    Parameters
    ----------
    breakpoints : tuple of float
        Inner points where the integrand is not smooth.
    exponent, degree : float, int
        Growth of the integrand (see the module's docstring), with κ per unit of ``xi``.
    """
    bounds = np.array([0.0, *sorted(set(breakpoints)), 1.0])
    half, middle = np.diff(bounds) / 2, (bounds[1:] + bounds[:-1]) / 2
    needed = points_needed(exponent * half, degree)
    first = np.concatenate([[0], np.cumsum(needed)])
    xi, weights = np.empty((2, first[-1]))
    for points in np.unique(needed):
        nodes, w = _gauss(int(points))
        panels = np.flatnonzero(needed == points)
        at = first[panels, None] + np.arange(points)
        xi[at] = middle[panels, None] + half[panels, None] * nodes
        weights[at] = half[panels, None] * w
    for shared in (xi, weights):
        shared.flags.writeable = False
    return Rule(xi, weights)


def halved(breakpoints: tuple[float, ...], times: int) -> tuple[float, ...]:
    """Return breakpoints that cut every panel in two, `times` times."""
    bounds = np.array([0.0, *sorted(set(breakpoints)), 1.0])
    for _ in range(times):
        bounds = np.sort(np.concatenate([bounds, (bounds[:-1] + bounds[1:]) / 2]))
    return tuple(float(b) for b in bounds[1:-1])


# A callable profile has no known degree: its panels take this one and are halved until the
# matrices settle.
SAMPLED_DEGREE = 24
_SETTLED = 1e-12  # relative change of the matrices that is rounding
_ACCEPTABLE = 1e-6  # taken after the last halving, its size told with the result
_HALVINGS = 8  # of all panels: 2⁸ times as many

FactorBuilder = Callable[[tuple[float, ...]], tuple[Array, ...]]


def settled(
    build: FactorBuilder, breakpoints: tuple[float, ...], where: str
) -> tuple[tuple[Array, ...], float]:
    """Return factors built on panels that were halved until the factors' squares settle.

    Parameters
    ----------
    build : callable
        Returns square-root factors F of matrices FᵀF for given breakpoints.
    breakpoints : tuple of float
        Of the coarsest panels.
    where : str
        What is integrated, for the message.

    Returns
    -------
    factors : tuple of ndarray
    change : float
        Largest relative change of the matrices in the last halving, at least the roundoff.

    Raises
    ------
    AccuracyError
        If they still change by more than 1e-6.
    """
    coarse, change = build(breakpoints), math.inf
    for times in range(1, _HALVINGS + 1):
        fine = build(halved(breakpoints, times))
        change = max(map(_relative_change, coarse, fine))
        coarse = fine
        if change <= _SETTLED:
            break
    if not change <= _ACCEPTABLE:
        raise AccuracyError(
            f"the integrals over a callable profile still change by {change:.1e}",
            where=where,
            remedy="give a profile with kinks or steps as Stations",
        )
    return coarse, max(change, UNIT_ROUNDOFF)


def _relative_change(coarse: Array, fine: Array) -> float:
    """Return max |ΔG_ij| / sqrt(G_ii G_jj) between two Gram matrices of factors."""
    gram = fine.T @ fine
    scale = np.sqrt(np.diag(gram))
    scale[scale == 0] = 1.0  # a function that leaves the integrand alone, such as a joint's twist
    return float(np.max(np.abs(gram - coarse.T @ coarse) / np.outer(scale, scale)))
