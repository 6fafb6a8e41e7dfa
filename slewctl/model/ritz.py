"""The modes of an arm in one basis, from square-root factors of its mass and stiffness."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from scipy.linalg import qr, solve_triangular

from slewctl._types import Array
from slewctl.errors import InputError
from slewctl.model.quadrature import UNIT_ROUNDOFF

Boundary = Literal["hub-locked", "rotor-locked", "free"]


@dataclass(frozen=True, eq=False)
class Factors:
    """Square-root factors of an arm's mass and stiffness in one basis.

    Attributes
    ----------
    mass : ndarray, shape (p, n+1)
        F with M = FᵀF.
    stiffness : ndarray, shape (m, n)
        S with K_e = SᵀS.
    drag : ndarray, shape (l, n+1)
        C with CᵀC the damping by drag along the beam; no row where there is none.
    """

    mass: Array
    stiffness: Array
    drag: Array
    quadrature_error: float = field(default=UNIT_ROUNDOFF)


@dataclass(frozen=True, eq=False)
class RitzModes:
    """Natural frequencies in rad/s, increasing, and the modes in flexible coordinates.

    Attributes
    ----------
    omega : ndarray, shape (k,)
    shapes : ndarray, shape (n, k)
        Of unit modal mass.
    """

    omega: Array
    shapes: Array


@dataclass(frozen=True, eq=False)
class Triangular:
    """An arm's flexibility in one basis, and so in the first functions of it.

    With F = QR the first row of R is [√J, Φ̃/√J] and the rest, R₂, the factor of the mass
    that remains when the rigid rotation is taken out; with the hub held it is the factor of
    M_e itself.  With S = Q'T the singular values of R₂T⁻¹ are 1/ω.  Both are upper
    triangular: leading blocks are those of the first functions alone.

    Attributes
    ----------
    flexibility : ndarray, shape (n, n)
        R₂T⁻¹.
    inverse : ndarray, shape (n, n)
        T⁻¹.
    """

    flexibility: Array
    inverse: Array

    @classmethod
    def of(cls, parts: Factors, boundary: Boundary) -> Triangular:
        """Return that of factors, the hub held or free to turn."""
        free = boundary == "free"
        mass = parts.mass if free else parts.mass[:, 1:]
        R = qr(mass, mode="r")[0][: mass.shape[1]]
        T = qr(parts.stiffness, mode="r")[0][: parts.stiffness.shape[1]]
        n = T.shape[0]
        tiny = n * np.finfo(float).eps
        for factor, matrix in ((R, "mass"), (T, "stiffness")):
            diagonal = np.abs(np.diag(factor))
            if not np.all(diagonal > tiny * np.linalg.norm(factor, axis=0)):
                raise InputError(
                    f"the {matrix} matrix is not positive definite to working precision",
                    where=f"basis of {n} functions",
                    remedy="use fewer functions, or give the arm inertia",
                )
        inverse = solve_triangular(T, np.eye(n))
        return cls((R[1:, 1:] if free else R) @ inverse, inverse)

    def omega(self, n: int) -> Array:
        """Return the natural frequencies in the first n functions; a third of the modes' work."""
        return np.asarray(1 / np.linalg.svd(self.flexibility[:n, :n], compute_uv=False))

    def modes(self) -> RitzModes:
        """Return all modes."""
        _, periods, V = np.linalg.svd(self.flexibility)
        return RitzModes(1 / periods, self.inverse @ V.T / periods)


def ritz_modes(parts: Factors, boundary: Boundary) -> RitzModes:
    """Return all n modes that the factors have, the hub held or free to turn."""
    return Triangular.of(parts, boundary).modes()


def rounding(omega: Array) -> Array:
    """Return the relative error that rounding leaves in increasing frequencies."""
    return np.asarray(np.finfo(float).eps * (10 + omega / omega[0]))
