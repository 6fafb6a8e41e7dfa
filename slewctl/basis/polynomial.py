"""Polynomials with orthonormal curvature: spectral convergence, and the truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.polynomial.legendre import legvander

from slewctl._types import Array
from slewctl.basis.contract import Basis, Growth
from slewctl.errors import InputError, check_number, shown


@dataclass(frozen=True)
class Polynomial(Basis):
    """Polynomials in x with v(0) = v'(0) = 0, one set on each panel between breakpoints.

    The second derivatives are Legendre polynomials on the panels, orthonormal on
    [0, 1]; the shapes are their double integrals from the clamp, so v and v' are
    continuous while v'' may jump at a breakpoint, as it must where EI steps.  Without
    breakpoints the n functions span x² times the polynomials of degree < n.  The
    stiffness matrix of a uniform beam is then the identity: rounding does not reach
    the low frequencies, however many functions there are.

    Parameters
    ----------
    n : int
        How many functions.  They are ordered by degree, then by panel, so that the
        spaces are nested as n grows.
    edges : tuple of float
        Inner edges of the panels, increasing in (0, 1).

    Raises
    ------
    InputError
        If n < 1 or the edges do not increase within (0, 1).
    """

    edges: tuple[float, ...] = ()
    name: ClassVar[str] = "polynomial"

    def __post_init__(self) -> None:
        super().__post_init__()
        edges = tuple(check_number(edge, "Polynomial.edges") for edge in self.edges)
        object.__setattr__(self, "edges", edges)
        if np.any(np.diff([0.0, *edges, 1.0]) <= 0):
            raise InputError(
                f"{shown(edges)} does not increase within (0, 1)",
                where="Polynomial.edges",
                remedy="sort the edges and leave out 0 and 1",
            )

    @property
    def growth(self) -> Growth:
        return Growth(0.0, (self.n - 1) // (len(self.edges) + 1) + 2)

    @property
    def breakpoints(self) -> tuple[float, ...]:
        return self.edges

    def _evaluate(self, xi: Array, derivative: int) -> Array:
        bounds = np.array([0.0, *self.edges, 1.0])
        panels = len(bounds) - 1
        shapes = np.empty((len(xi), self.n))
        for panel in range(panels):
            count = len(range(panel, self.n, panels))
            if count:
                block = _panel_shapes(xi, bounds[panel], bounds[panel + 1], count, derivative)
                shapes[:, panel::panels] = block
        return shapes


def _panel_shapes(xi: Array, left: float, right: float, count: int, derivative: int) -> Array:
    """Return `count` shapes whose curvature lives on [left, right], or their derivatives."""
    half = (right - left) / 2
    local = np.clip((xi - (left + right) / 2) / half, -1.0, 1.0)
    k = np.arange(count)
    norm = np.sqrt((2 * k + 1) / (2 * half))  # unit L2 norm of the curvature
    P = legvander(local, count + 1)
    if derivative == 2:
        # An edge point belongs to the panel on its right, the tip to the last one.
        inside = (xi >= left) & ((xi < right) | (right == 1.0))
        return np.where(inside[:, None], norm * P[:, :count], 0.0)
    slope = np.empty((len(xi), count))
    slope[:, 0] = local + 1
    slope[:, 1:] = (P[:, 2 : count + 1] - P[:, : count - 1]) / (2 * k[1:] + 1)
    if derivative == 1:
        return norm * half * slope
    value = np.empty((len(xi), count))
    value[:, 0] = (local + 1) ** 2 / 2
    if count > 1:
        value[:, 1] = ((P[:, 3] - P[:, 1]) / 5 - local - 1) / 3
    m = k[2:]
    upper = (P[:, 4 : 4 + len(m)] - P[:, 2:count]) / (2 * m + 3)
    lower = (P[:, 2:count] - P[:, : len(m)]) / (2 * m - 1)
    value[:, 2:] = (upper - lower) / (2 * m + 1)
    # Beyond its panel only the constant curvature leaves a slope behind.
    value[:, 0] += 2 * np.maximum((xi - right) / half, 0.0)
    return norm * half**2 * value
