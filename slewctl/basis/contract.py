"""The contract that every basis keeps: shapes with v(0) = v'(0) = 0 on ``xi = x/L``."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from slewctl._types import Array
from slewctl.arm import Arm, ModalData
from slewctl.errors import InputError, check_count, shown


@dataclass(frozen=True)
class Growth:
    """How fast the shapes grow off the real axis, which fixes the exact quadrature.

    On the complex plane every shape is bounded by a polynomial of the given degree
    times exp(`exponent`·|Im or Re ξ|).

    Attributes
    ----------
    exponent : float
    degree : int

    Examples
    --------
    >>> from slewctl.basis import Growth
    >>> Growth(exponent=0.0, degree=4).degree
    4
    """

    exponent: float
    degree: int


@dataclass(frozen=True)
class Basis(ABC):
    """A set of `n` admissible functions φ_1 … φ_n of ``xi = x/L`` in [0, 1].

    Every function satisfies the geometric boundary conditions of the clamp in the
    rotating body axis, φ(0) = φ'(0) = 0.

    A basis is a description.  Some describe the same functions for every arm; others, such
    as the modes of a uniform arm with this hub and payload, have functions only once an arm
    is given: `matched_to` returns them, and `slewctl.assemble` calls it.

    Parameters
    ----------
    n : int
        How many functions.

    Raises
    ------
    InputError
        If n < 1.
    """

    n: int
    name: ClassVar[str]

    def __post_init__(self) -> None:
        object.__setattr__(self, "n", check_count(self.n, f"{type(self).__name__}.n"))

    def matched_to(self, arm: Arm) -> Basis:
        """Return the functions that this basis describes for `arm`.

        Itself, where they are the same for every arm or have been matched to one already.

        Raises
        ------
        InputError
            If `arm` is not an arm.
        """
        if not isinstance(arm, Arm):
            raise InputError(
                f"{shown(arm)} is not an Arm",
                where=f"{type(self).__name__}.matched_to",
                remedy="give a slewctl.Arm",
            )
        if self.needs_beam and isinstance(arm.beam, ModalData):
            raise InputError(
                f"the {self.name} functions need a beam: {arm.name} is known by its modes alone",
                where="basis",
                remedy="use the basis 'modal'",
            )
        return self._matched_to(arm)

    @property
    def needs_beam(self) -> bool:
        """Whether the functions are of x along a beam."""
        return True

    def tip_values(self, coefficients: Array) -> Array:
        """Return what the sign of combinations goes by: their deflection at the tip, (1, k)."""
        return self.combined(np.ones(1), 0, coefficients)

    def _matched_to(self, arm: Arm) -> Basis:
        """Return what `matched_to` promises."""
        return self

    def _unmatched(self) -> InputError:
        """Return the error of asking for functions that depend on an arm not given yet."""
        return InputError(
            f"the {self.name} functions depend on the arm, and none is given",
            where=type(self).__name__,
            remedy="give the basis to assemble(arm, basis), or take basis.matched_to(arm)",
        )

    @property
    @abstractmethod
    def growth(self) -> Growth:
        """Growth of the shapes off the real axis (see `Growth`)."""

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Inner points of [0, 1] where a shape's second derivative is not smooth."""
        return ()

    @property
    def twist(self) -> Array:
        """How far each function turns the hub against the rotor, in rad, shape (n,).

        Zero but where an arm has an elastic joint; see `slewctl.arm.Joint`.
        """
        return np.zeros(self.n)

    def evaluate(self, xi: Array, derivative: int = 0) -> Array:
        """Return the shapes or a derivative with respect to ``xi``.

        Parameters
        ----------
        xi : ndarray, shape (m,)
            Points in [0, 1].
        derivative : {0, 1, 2}
            Order of the derivative.

        Returns
        -------
        ndarray, shape (m, n)
            One column a function, dimensionless.

        Raises
        ------
        InputError
            For another order of derivative.
        """
        return self._evaluate(self._points(xi, derivative), derivative)

    def combined(self, xi: Array, derivative: int, coefficients: Array) -> Array:
        """Return ``evaluate(xi, derivative) @ coefficients``, shape (m, k).

        Piecewise bases have a way to it without the matrix of all functions.

        Parameters
        ----------
        xi : ndarray, shape (m,)
        derivative : {0, 1, 2}
        coefficients : ndarray, shape (n, k)

        Raises
        ------
        InputError
            As `evaluate`.
        """
        return self._combined(self._points(xi, derivative), derivative, coefficients)

    def _points(self, xi: Array, derivative: int) -> Array:
        """Return `xi` as an array of numbers; refuse another order of derivative."""
        if derivative not in (0, 1, 2):
            raise InputError(
                f"{shown(derivative)} is not an order of derivative",
                where=f"{type(self).__name__}.evaluate",
                remedy="give 0, 1 or 2",
            )
        return np.atleast_1d(np.asarray(xi, dtype=float))

    def _combined(self, xi: Array, derivative: int, coefficients: Array) -> Array:
        """Return what `combined` promises."""
        return self._evaluate(xi, derivative) @ coefficients

    @abstractmethod
    def _evaluate(self, xi: Array, derivative: int) -> Array:
        """Return what `evaluate` promises; `derivative` is 0, 1 or 2."""
