"""Deflections of an arm under inertia loads, as piecewise polynomials that stand for themselves.

An arm whose points move by y(ξ) is bent by the inertia forces of that motion.  With lengths
in units of L the bending moment is, up to a factor,

    M(ξ) = ∫_ξ^1 y(s) (s − ξ) dm(s) + Σ m_i y(ξ_i) (ξ_i − ξ) + (J_i/L²) y'(ξ_i),

summed over the payload and the masses along the beam that are beyond ξ, and the deflection
obeys EI φ'' = M, φ(0) = φ'(0) = 0.  The curvature M/EI is expanded in Legendre polynomials on
panels, which are halved until the expansion has converged to rounding.  What is kept is the
expansion: φ is then a piecewise polynomial of known degree; its boundary conditions,
derivatives and quadrature are exact, and the expansion's error says no more than how close φ
comes to the deflection that it stands for.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.linalg import qr

from slewctl._types import Array, BoolArray
from slewctl.arm import Arm
from slewctl.basis.combined import Combined
from slewctl.basis.contract import Basis
from slewctl.basis.inertia import Inertia, inertia_of, panel_rule
from slewctl.basis.polynomial import Polynomial

_MOST_TERMS = 40  # polynomials on a panel, where there are few panels
_LEAST_TERMS = 12  # and where a table of stations makes many
_TERMS_IN_ALL = 320  # of all panels together: what a basis costs grows with its square
_TAIL = 3  # the last of a panel's polynomials, which must have died out
_CONVERGED = 5e-14  # some 200 roundings: coefficients below it are noise
_MOST_HALVED = 95  # panels more than the breakpoints make, before the refusal
# A callable profile may have a kink anywhere, which no halving resolves.
_MOST_HALVED_SAMPLED = 3


@dataclass(frozen=True, eq=False)
class Motion:
    """Motions y = rotation·(r/L + ξ) + deflection, one column each.

    Attributes
    ----------
    rotation : ndarray, shape (k,)
    deflection : Basis, optional
        With k functions; none for a rigid rotation.
    """

    rotation: Array
    deflection: Basis | None = None

    def at(self, xi: Array, radius: float, derivative: int = 0) -> Array:
        """Return y or y' at `xi`, shape (m, k)."""
        lever = radius + xi if derivative == 0 else np.ones_like(xi)
        rigid = np.multiply.outer(lever, self.rotation)
        return (
            rigid if self.deflection is None else rigid + self.deflection.evaluate(xi, derivative)
        )


@dataclass(frozen=True, eq=False)
class Panels:
    """An arm sampled on panels, with `terms` polynomials on each."""

    arm: Arm
    edges: tuple[float, ...]
    terms: int

    @classmethod
    def of(cls, arm: Arm, inner: tuple[float, ...]) -> Panels:
        """Return the panels between the arm's breakpoints and the `inner` ones."""
        edges = _distinct((*arm.breakpoints, *inner))
        terms = _TERMS_IN_ALL // (len(edges) + 1)
        return cls(arm, edges, min(max(terms, _LEAST_TERMS), _MOST_TERMS))

    @cached_property
    def inertia(self) -> Inertia:
        """Hub and payload in units of L."""
        return inertia_of(self.arm)

    @cached_property
    def rule(self) -> tuple[Array, Array]:
        """Gauss points and weights that integrate products of the polynomials exactly."""
        return panel_rule((0.0, *self.edges, 1.0), self.terms + 2)

    @cached_property
    def mass(self) -> Array:
        """Mass in kg that each Gauss point stands for."""
        xi, weights = self.rule
        return weights * self.arm.beam.length * self.arm.beam.mass_profile(xi)

    @cached_property
    def stiffness(self) -> Array:
        """EI at the Gauss points, relative to its largest value."""
        values = self.arm.beam.stiffness_profile(self.rule[0])
        return values / values.max()

    @cached_property
    def from_root(self) -> Polynomial:
        """The polynomials that carry deflections: no deflection at the root."""
        return Polynomial(self.terms * (len(self.edges) + 1), self.edges)

    @cached_property
    def from_tip(self) -> Polynomial:
        """The polynomials of 1 − ξ that carry moments: no moment at the tip."""
        mirrored = tuple(1.0 - edge for edge in reversed(self.edges))
        return Polynomial(self.terms * (len(self.edges) + 1), mirrored)

    def curvatures(self, motion: Motion) -> tuple[Array, BoolArray]:
        """Return the coefficients of M/EI, and which panels do not resolve it.

        Returns
        -------
        coefficients : ndarray, shape (terms * panels, k)
            By term, then by panel, as `Polynomial` has them.
        unresolved : ndarray of bool, shape (panels,)
        """
        xi, weights = self.rule
        given, bodies = self.inertia, self.arm.bodies
        y = motion.at(xi, given.radius)
        # M'' is the load, so that M is its double integral from the tip.
        load = self.from_tip.projected(1 - xi, 2, self.mass[:, None] * y)
        moment = self.from_tip.combined(1 - xi, 0, load)
        ahead = bodies.xi - xi[:, None]
        moment += (np.maximum(ahead, 0.0) * bodies.mass) @ motion.at(bodies.xi, given.radius)
        turned = np.where(ahead > 0, bodies.inertia, 0.0) / self.arm.beam.length**2
        moment += turned @ motion.at(bodies.xi, given.radius, 1)
        curvature = moment / self.stiffness[:, None]
        coefficients = self.from_root.projected(xi, 2, weights[:, None] * curvature)
        return coefficients, self._tails(coefficients) | self._tails(load)[::-1]

    def _tails(self, coefficients: Array) -> BoolArray:
        """Return on which panels the last coefficients have not died out."""
        by_panel = coefficients.reshape(self.terms, len(self.edges) + 1, -1)
        functions = by_panel.shape[-1]
        # Two integrations make the k-th function (πk)² times smaller, but not its rounding.
        noise = _CONVERGED * functions**2 * np.linalg.norm(coefficients, axis=0)
        return np.any(np.abs(by_panel[-_TAIL:]).max(axis=0) > noise, axis=1)

    def halved(self, chosen: BoolArray) -> Panels:
        """Return panels of which the `chosen` ones are cut in two."""
        bounds = (0.0, *self.edges, 1.0)
        new = [(a + b) / 2 for (a, b), cut in zip(pairwise(bounds), chosen, strict=True) if cut]
        return replace(self, edges=tuple(sorted([*self.edges, *new])))


def deflections(arm: Arm, motion: Motion) -> Combined:
    """Return the deflections of `arm` under the inertia loads of `motion`.

    They are normalised to ∫ EI φ_i'' φ_j'' dξ ∝ δ_ij, in order: the first k functions span
    the first k deflections.

    Parameters
    ----------
    arm : Arm
    motion : Motion
        k motions.

    Returns
    -------
    Combined
        k functions: combinations of piecewise polynomials.
    """
    known = () if motion.deflection is None else motion.deflection.breakpoints
    panels = Panels.of(arm, known)
    profiles = (arm.beam.mass_profile, arm.beam.stiffness_profile)
    sampled = any(profile.degree is None for profile in profiles)
    most = len(panels.edges) + (_MOST_HALVED_SAMPLED if sampled else _MOST_HALVED)
    while True:
        coefficients, unresolved = panels.curvatures(motion)
        if not unresolved.any() or len(panels.edges) + unresolved.sum() > most:
            break
        panels = panels.halved(unresolved)
    return _orthonormal(panels, coefficients)


def _orthonormal(panels: Panels, coefficients: Array) -> Combined:
    """Return functions of orthonormal strain energy with these curvatures' span."""
    xi, weights = panels.rule
    scaled = np.asarray(coefficients / np.linalg.norm(coefficients, axis=0), dtype=float)
    curvature = panels.from_root.combined(xi, 2, scaled)
    strain = np.sqrt(weights * panels.stiffness)[:, None] * curvature
    R = np.asarray(qr(strain, mode="r")[0][: strain.shape[1]], dtype=float)
    functions: Array = np.linalg.solve(R.T * np.sign(np.diag(R)), scaled.T).T
    # Terms that carry rounding alone would only raise the degree, and the cost of every use.
    by_term = np.abs(functions.reshape(panels.terms, -1)).max(axis=1)
    terms = int(np.flatnonzero(by_term > _CONVERGED * by_term.max())[-1]) + 1
    trimmed = replace(panels, terms=terms).from_root
    return Combined(functions.shape[1], trimmed, functions[: trimmed.n])


def free_motion(arm: Arm, basis: Basis) -> Motion:
    """Return the motions that `basis` makes about a hub that turns freely.

    The hub counters each deflection φ by the rotation −Φ̃/J that leaves the arm without
    angular momentum.

    Parameters
    ----------
    arm : Arm
    basis : Basis
        Its deflections must be resolved by the Gauss points of the panels between its and
        the arm's breakpoints, halved until one wavelength or less is left to each.
    """
    panels = Panels.of(arm, basis.breakpoints)
    while basis.growth.exponent > 2 * np.pi * (len(panels.edges) + 1):
        panels = panels.halved(np.ones(len(panels.edges) + 1, dtype=bool))
    given, bodies, (xi, _) = panels.inertia, arm.bodies, panels.rule
    lever, inertia = given.radius + bodies.xi, bodies.inertia / arm.beam.length**2
    moment = panels.mass * (given.radius + xi)
    coupling = (
        moment @ basis.evaluate(xi)
        + (bodies.mass * lever) @ basis.evaluate(bodies.xi)
        + inertia @ basis.evaluate(bodies.xi, 1)
    )
    J = (
        given.hub_inertia
        + float(moment @ (given.radius + xi))
        + float(bodies.mass @ lever**2 + inertia.sum())
    )
    return Motion(-coupling / J, basis)


def _distinct(points: tuple[float, ...]) -> tuple[float, ...]:
    """Return the points in order, those that differ by rounding alone taken as one."""
    ordered = np.unique(points)
    return tuple(float(x) for x in ordered[np.diff(ordered, prepend=0.0) > 1e-12])
