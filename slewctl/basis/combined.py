"""Linear combinations of another basis: how an arm's own modes become a basis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from slewctl._types import Array
from slewctl.basis.contract import Basis, Growth
from slewctl.errors import InputError


@dataclass(frozen=True, eq=False)
class Combined(Basis):
    """Functions φ = ψ C, with ψ another basis and C constant.

    Parameters
    ----------
    n : int
        How many functions: the number of columns of `coefficients`.
    parent : Basis
    coefficients : ndarray, shape (parent.n, n)

    Raises
    ------
    InputError
        If n < 1 or the coefficients have another shape.
    """

    parent: Basis
    coefficients: Array
    name: ClassVar[str] = "arm modes"

    def __post_init__(self) -> None:
        super().__post_init__()
        if np.shape(self.coefficients) != (self.parent.n, self.n):
            raise InputError(
                f"coefficients of shape {np.shape(self.coefficients)}",
                where="Combined.coefficients",
                remedy=f"give a matrix of shape {(self.parent.n, self.n)}",
            )

    @property
    def growth(self) -> Growth:
        return self.parent.growth

    @property
    def breakpoints(self) -> tuple[float, ...]:
        return self.parent.breakpoints

    @property
    def twist(self) -> Array:
        return np.asarray(self.parent.twist @ self.coefficients)

    @property
    def needs_beam(self) -> bool:
        return self.parent.needs_beam

    def tip_values(self, coefficients: Array) -> Array:
        if self.needs_beam:
            return super().tip_values(coefficients)
        return self.parent.tip_values(self.coefficients @ coefficients)

    def _evaluate(self, xi: Array, derivative: int) -> Array:
        return self.parent.combined(xi, derivative, self.coefficients)
