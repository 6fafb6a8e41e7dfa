"""The lowest modes of an arm in very many piecewise polynomials, without their matrices.

A profile of thousands of stations has as many panels, and its modes a kink in the curvature
at each.  What is asked of them, the largest singular values 1/ω and the vectors of R₂T⁻¹ (see
`slewctl.model.assembly.ritz_modes`), comes from simultaneous iteration (Bathe, Finite Element
Procedures, section 11.6): the strain energy couples no two panels, so that T⁻¹ is applied
panel by panel, and the inertia is a double sum over them.  Every iterate is orthonormalised on
both sides and nothing is squared, so the accuracy is that of the whole matrix'.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial.legendre import legvander
from scipy.linalg import qr

from slewctl._types import Array
from slewctl.arm import Arm
from slewctl.basis import Polynomial
from slewctl.model.quadrature import SAMPLED_DEGREE, Rule, composite
from slewctl.model.ritz import Boundary, RitzModes, rounding

# Of an iteration that gains a digit or more in each.
_MOST_STEPS = 20


def trials(modes: int) -> int:
    """Return with how many vectors `modes` modes are sought: each step gains (ω_k/ω_j)⁴."""
    return 2 * modes + 8


@dataclass(frozen=True, eq=False)
class PanelOperator:
    """R₂T⁻¹ of an arm in as many polynomials on every panel, in panel-by-panel coordinates.

    The twist of an elastic joint is a coordinate before them.

    Parameters
    ----------
    arm : Arm
    basis : Polynomial
        With equally many functions on every panel.
    boundary : {"hub-locked", "rotor-locked", "free"}
    """

    arm: Arm
    basis: Polynomial
    boundary: Boundary

    @cached_property
    def panels(self) -> int:
        """How many panels there are."""
        return len(self.basis.edges) + 1

    @cached_property
    def terms(self) -> int:
        """How many functions each panel has."""
        return self.basis.n // self.panels

    @cached_property
    def degree(self) -> int:
        """Degree of the integrands."""
        beam = self.arm.beam
        degrees = (beam.mass_profile.degree, beam.stiffness_profile.degree)
        known = max(SAMPLED_DEGREE if degree is None else degree for degree in degrees)
        return 2 * (self.terms + 1) + known

    @cached_property
    def rule(self) -> Rule:
        """Gauss points, equally many on every panel."""
        return composite(self.basis.edges, 0.0, self.degree)

    @cached_property
    def stiffness_root(self) -> Array:
        """√(EI dx)/L² at the points, (panels, points)."""
        beam = self.arm.beam
        values = self.rule.weights * beam.length * beam.stiffness_profile(self.rule.xi)
        return (np.sqrt(values) / beam.length**2).reshape(self.panels, -1)

    @cached_property
    def strain(self) -> tuple[Array, Array]:
        """Q and T of every panel with QT the factor of its strain energy, stacked."""
        nodes = composite((), 0.0, self.degree).xi
        widths = np.diff([0.0, *self.basis.edges, 1.0])
        local = Polynomial(self.terms).evaluate(nodes, 2)
        factor = self.stiffness_root[:, :, None] * local / np.sqrt(widths)[:, None, None]
        Q, T = np.linalg.qr(factor)
        return Q, T

    @cached_property
    def points(self) -> Array:
        """The Gauss points and those of the bodies."""
        return np.append(self.rule.xi, self.arm.bodies.xi)

    @cached_property
    def mass_root(self) -> Array:
        """√(m̄ dx) at the points and √m_i of the bodies, shape (points, 1)."""
        arm = self.arm
        masses = self.rule.weights * arm.beam.length * arm.beam.mass_profile(self.rule.xi)
        return np.sqrt(np.append(masses, arm.bodies.mass))[:, None]

    @cached_property
    def turn_root(self) -> Array:
        """√J_i/L of the bodies, shape (bodies, 1)."""
        return (np.sqrt(self.arm.bodies.inertia) / self.arm.beam.length)[:, None]

    @cached_property
    def turning(self) -> Array:
        """Momenta of all that turns with the hub, by 1 rad/s, shape (points + bodies + 2,)."""
        arm = self.arm
        lever = self.mass_root[:, 0] * (arm.hub.radius + arm.beam.length * self.points)
        hub = arm.hub.inertia if arm.joint is not None else arm.hub_inertia
        return np.concatenate([lever, np.sqrt([*arm.bodies.inertia, hub]), [0.0]])

    @cached_property
    def rigid(self) -> Array:
        """The unit column of the rigid rotation, shape (points + bodies + 2,)."""
        column = self.turning.copy()
        column[-1] = 0.0 if self.arm.joint is None else math.sqrt(self.arm.rotor_inertia)
        return np.asarray(column / np.linalg.norm(column))

    @property
    def joint_root(self) -> float:
        """√k_j; zero without an elastic joint."""
        return 0.0 if self.arm.joint is None else math.sqrt(self.arm.joint.stiffness)

    def without_rotation(self, rows: Array) -> Array:
        """Return rows of momenta with the rigid rotation taken out, if the hub is free."""
        if self.boundary == "free":
            for _ in range(2):  # the second time removes the rounding of the first
                rows = rows - np.multiply.outer(self.rigid, self.rigid @ rows)
        return rows

    def coefficients(self, vectors: Array) -> Array:
        """Return T⁻¹ x: coefficients of the basis, after the twist of a joint, shape (n, k)."""
        if self.joint_root:
            return np.vstack([vectors[:1] / self.joint_root, self._bending(vectors[1:])])
        return self._bending(vectors)

    def _bending(self, vectors: Array) -> Array:
        stacked = np.linalg.solve(self.strain[1], vectors.reshape(self.panels, self.terms, -1))
        return np.asarray(stacked.transpose(1, 0, 2).reshape(self.basis.n, -1))

    def vectors(self, coefficients: Array) -> Array:
        """Return T c of coefficients of a basis of at most as many terms, shape (n, k)."""
        if self.joint_root:
            bent = self._strained(coefficients[1:])
            return np.vstack([self.joint_root * coefficients[:1], bent])
        return self._strained(coefficients)

    def _strained(self, coefficients: Array) -> Array:
        given = coefficients.reshape(-1, self.panels, coefficients.shape[1]).transpose(1, 0, 2)
        return np.asarray(
            (self.strain[1][:, :, : given.shape[1]] @ given).reshape(self.basis.n, -1)
        )

    def applied(self, vectors: Array) -> Array:
        """Return R₂T⁻¹ x up to an orthogonal factor, shape (points + bodies + 2, k)."""
        C, at = self.coefficients(vectors), self.arm.bodies.xi
        bent = C[1:] if self.joint_root else C
        moved = self.mass_root * self.basis.combined(self.points, 0, bent)
        turned = self.turn_root * self.basis.combined(at, 1, bent)
        rows = np.vstack([moved, turned, np.zeros((2, C.shape[1]))])
        if self.joint_root:
            rows += np.multiply.outer(self.turning, C[0])
        return self.without_rotation(rows)

    def adjoint(self, rows: Array) -> Array:
        """Return the transpose of `applied` times `rows`, shape (n, k)."""
        rows, at, count = self.without_rotation(rows), self.arm.bodies.xi, len(self.points)
        moved = self.basis.projected(self.points, 0, self.mass_root * rows[:count])
        total = moved + self.basis.projected(at, 1, self.turn_root * rows[count:-2])
        stacked = total.reshape(self.terms, self.panels, -1).transpose(1, 0, 2)
        solved = np.linalg.solve(self.strain[1].transpose(0, 2, 1), stacked)
        bent = np.asarray(solved.reshape(self.basis.n, -1))
        if self.joint_root:
            return np.vstack([(self.turning @ rows)[None] / self.joint_root, bent])
        return bent

    def smooth_moments(self, count: int) -> Array:
        """Return curvatures P_k/EI, that is with smooth bending moments, to start from."""
        moments = legvander(2 * self.rule.xi - 1, count - 1)
        values = moments.reshape(self.panels, -1, count) / self.stiffness_root[:, :, None]
        # Over √(EI dx) once more than that: the points' weights belong to the curvature.
        weights = self.rule.weights.reshape(self.panels, -1, 1)
        found = np.asarray(
            (self.strain[0].transpose(0, 2, 1) @ (weights * values)).reshape(self.basis.n, -1)
        )
        return np.vstack([np.ones((1, count)), found]) if self.joint_root else found


def lowest_modes(
    arm: Arm,
    basis: Polynomial,
    modes: int,
    boundary: Boundary,
    start: Array | None = None,
    tolerance: float = 1e-10,
) -> RitzModes:
    """Return the first modes of `arm` in `basis`, as `ritz_modes` of its factors would.

    Parameters
    ----------
    arm : Arm
    basis : Polynomial
        With equally many functions on every panel.
    modes : int
        How many must have settled; a few more are returned that have not.
    boundary : {"hub-locked", "free"}
    start : ndarray, shape (m, k), optional
        Coefficients of modes in a basis of fewer functions on the same panels.
    tolerance : float
        Relative error of the shapes; that of the frequencies is its square.
    """
    operator = PanelOperator(arm, basis, boundary)
    vectors = operator.smooth_moments(trials(modes)) if start is None else operator.vectors(start)
    for _ in range(_MOST_STEPS):
        vectors = np.asarray(qr(vectors, mode="economic")[0], dtype=float)
        left, R = qr(operator.applied(vectors), mode="economic")
        U, periods, V = np.linalg.svd(R)
        vectors, again = vectors @ V.T, operator.adjoint(left @ U)
        residuals = np.linalg.norm(again / periods - vectors, axis=0)[:modes]
        if np.all(residuals <= tolerance + 10 * rounding(1 / periods[:modes])):
            break
        vectors = again
    return RitzModes(1 / periods, operator.coefficients(vectors) / periods)
