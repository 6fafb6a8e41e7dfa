"""Polynomials with orthonormal curvature: spectral convergence, and the truth."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import ClassVar

import numpy as np
from numpy.polynomial.legendre import legvander

from slewctl._types import Array, IntArray
from slewctl.basis.contract import Basis, Growth
from slewctl.errors import InputError, check_number, shown

# Shapes at more points are not kept for the next one to ask, since they would fill the memory.
_KEPT = 100_000


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

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.arms.paper_beam()
    >>> sc.assemble(arm, sc.Polynomial(6)).n
    6
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
        """Return every function by itself: most points see those of their own panel alone."""
        half, terms, panels = self._halves, self._terms, len(self._halves)
        placed = self._placed(xi, derivative)
        scale = (self._norms * half ** (2 - derivative)).T[placed.panels]
        own = (placed.shapes[:, :, :terms] * scale[:, None, :])[placed.index]
        each = np.zeros((len(xi), terms, panels))
        points = np.arange(len(xi))[:, None]
        each[points, np.arange(terms), placed.panels[placed.index[0]][:, None]] = own
        found = each.reshape(len(xi), terms * panels)
        if panels > 1:
            first = np.zeros((2, panels, panels * min(terms, 2)))
            for degree in range(min(terms, 2)):
                at = degree * panels + np.arange(panels)
                first[degree, np.arange(panels), at] = self._norms[degree]
            deflection, slope = self._left_behind(first[0], first[1])
            left = np.stack([deflection, half[:, None] * slope], axis=1)[placed.panels]
            found[:, : left.shape[2]] += (placed.shapes[:, :, terms:] @ left)[placed.index]
        return found[:, : self.n]

    def _left_behind(self, constant: Array, linear: Array) -> tuple[Array, Array]:
        """Return the deflection and the slope that the panels before each leave it.

        Only a constant curvature leaves a slope behind, only that and a linear one a deflection.
        """
        width = 2 * self._halves[:, None]
        gained = width * constant
        slope = _before(gained)
        return _before(width * (gained / 2 + slope) - width**2 / 6 * linear), slope

    def _combined(self, xi: Array, derivative: int, coefficients: Array) -> Array:
        """Return the combinations panel by panel.

        What the panels on the left have left behind, a slope and a deflection, is summed
        once: the work grows with the points and the panels, not with their product.
        """
        half, terms = self._halves, self._terms
        padded = np.zeros((terms * len(half), coefficients.shape[1]))
        padded[: self.n] = coefficients
        scaled = padded.reshape(terms, len(half), -1) * self._norms[:, :, None]
        deflection, slope = self._left_behind(scaled[0], scaled[1:2].sum(axis=0))
        own = scaled * half[:, None] ** (2 - derivative)
        weights = np.concatenate([own, [deflection, half[:, None] * slope]])
        placed = self._placed(xi, derivative)
        found = placed.shapes @ weights[:, placed.panels].transpose(1, 0, 2)
        return np.asarray(found[placed.index])

    def projected(self, xi: Array, derivative: int, values: Array) -> Array:
        """Return ``evaluate(xi, derivative).T @ values`` panel by panel, shape (n, k).

        Parameters
        ----------
        xi : ndarray, shape (m,)
        derivative : {0, 1, 2}
        values : ndarray, shape (m, k)
        """
        half, terms, columns = self._halves, self._terms, values.shape[1]
        placed = self._placed(xi, derivative)
        given = np.zeros((*placed.shapes.shape[:2], columns))
        given[placed.index] = values
        sums = np.zeros((placed.shapes.shape[2], len(half), columns))
        sums[:, placed.panels] = (placed.shapes.transpose(0, 2, 1) @ given).transpose(1, 0, 2)
        own = sums[:terms] * half[:, None] ** (2 - derivative)
        # How much the deflection and the slope count that each panel leaves to the next.
        width = 2 * half[:, None]
        deflection = _before(sums[-2, ::-1])[::-1]
        slope = _before((width / 2 * sums[-1] + width * deflection)[::-1])[::-1]
        own[0] += width * (slope + width / 2 * deflection)
        own[1:2] -= width**2 / 6 * deflection
        return np.asarray((self._norms[:, :, None] * own).reshape(-1, columns)[: self.n])

    @cached_property
    def _halves(self) -> Array:
        """Half the width of each panel."""
        return np.asarray(np.diff([0.0, *self.edges, 1.0]) / 2)

    @property
    def _terms(self) -> int:
        """Most functions that a panel has."""
        return -(-self.n // len(self._halves))

    @cached_property
    def _norms(self) -> Array:
        """What gives each curvature unit L2 norm, (terms, panels)."""
        degrees = np.arange(self._terms)[:, None]
        return np.asarray(np.sqrt((2 * degrees + 1) / (2 * self._halves)))

    def _placed(self, xi: Array, derivative: int) -> _Placed:
        """Return the points by panel; the same few are asked for again and again."""
        points = np.ascontiguousarray(xi, dtype=float).tobytes()
        place = _placed if len(xi) * self._terms <= _KEPT else _placed.__wrapped__
        return place(points, self.edges, self._terms, derivative)


@dataclass(frozen=True, eq=False)
class _Placed:
    """Points sorted into panels.

    Attributes
    ----------
    panels : ndarray of int, shape (p,)
        Those that have points.
    index : pair of ndarray of int
        Where each point is in the first two axes of ``shapes``.
    shapes : ndarray, shape (p, most points, terms + 2)
        The panel's own shapes at its points, then those of what its left neighbours leave it:
        a deflection, and a slope times half the panel's width.
    """

    panels: IntArray
    index: tuple[IntArray, IntArray]
    shapes: Array


@lru_cache(maxsize=64)
def _placed(points: bytes, edges: tuple[float, ...], terms: int, derivative: int) -> _Placed:
    """Return points by panel, with the shapes of degree below `terms`.

    An edge point belongs to the panel on its right, the tip to the last one.
    """
    xi, bounds = np.frombuffer(points), np.array([0.0, *edges, 1.0])
    half = np.diff(bounds) / 2
    panel = np.clip(np.searchsorted(bounds, xi, side="right") - 1, 0, len(half) - 1)
    local = np.clip((xi - (bounds[panel] + bounds[panel + 1]) / 2) / half[panel], -1.0, 1.0)
    zero, one = np.zeros_like(local), np.ones_like(local)
    inherited = ([one, local + 1], [zero, 1 / half[panel]], [zero, zero])[derivative]
    own = _local_shapes(local, terms, derivative)
    shapes = np.hstack([own, np.transpose(inherited)])
    panels, row, counts = np.unique(panel, return_inverse=True, return_counts=True)
    order = np.argsort(panel, kind="stable")
    column = np.empty_like(order)
    column[order] = np.arange(len(xi)) - np.repeat(np.cumsum(counts) - counts, counts)
    stacked = np.zeros((len(panels), counts.max(initial=0), shapes.shape[1]))
    stacked[row, column] = shapes
    stacked.flags.writeable = False
    return _Placed(panels, (row, column), stacked)


def _before(steps: Array) -> Array:
    """Return the sum of the steps before each."""
    return np.vstack([np.zeros((1, steps.shape[1])), np.cumsum(steps[:-1], axis=0)])


def _local_shapes(local: Array, count: int, derivative: int) -> Array:
    """Return the Legendre polynomials, their integrals or double integrals from −1."""
    k = np.arange(count)
    P = np.asarray(legvander(local, count + 1), dtype=float)
    if derivative == 2:
        return P[:, :count]
    if derivative == 1:
        slope = np.empty((len(local), count))
        slope[:, 0] = local + 1
        slope[:, 1:] = (P[:, 2 : count + 1] - P[:, : count - 1]) / (2 * k[1:] + 1)
        return slope
    value = np.empty((len(local), count))
    value[:, 0] = (local + 1) ** 2 / 2
    if count > 1:
        value[:, 1] = ((P[:, 3] - P[:, 1]) / 5 - local - 1) / 3
    m = k[2:]
    upper = (P[:, 4 : 4 + len(m)] - P[:, 2:count]) / (2 * m + 3)
    lower = (P[:, 2:count] - P[:, : len(m)]) / (2 * m - 1)
    value[:, 2:] = (upper - lower) / (2 * m + 1)
    return value
