"""The inertia of an arm in units of its length: what shapes in ``xi = x/L`` need to know."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import leggauss

from slewctl._types import Array
from slewctl.arm import Arm

# Exact for polynomial profiles up to degree 61, and for tables.
_POINTS = 32


@dataclass(frozen=True)
class Inertia:
    """Masses and moments of inertia of an arm, all in kg, lengths as multiples of L.

    Attributes
    ----------
    hub_inertia, payload_inertia, beam_inertia : float
        J_h/L², J_t/L² and, about the clamp, ∫ m̄ x² dx / L² with the masses along the beam as
        points.
    payload_mass : float
    radius : float
        r/L.
    """

    hub_inertia: float
    radius: float
    beam_inertia: float
    payload_mass: float
    payload_inertia: float


def inertia_of(arm: Arm) -> Inertia:
    """Return the inertia of `arm` in units of its length."""
    L = arm.beam.length
    xi, weights = panel_rule((0.0, *arm.breakpoints, 1.0), _POINTS)
    return Inertia(
        arm.hub_inertia / L**2,
        arm.hub.radius / L,
        float(L * weights @ (arm.beam.mass_profile(xi) * xi**2))
        + sum(mass.mass * (mass.x / L) ** 2 for mass in arm.masses),
        arm.payload.mass,
        arm.payload.inertia / L**2,
    )


def panel_rule(bounds: tuple[float, ...], points: int) -> tuple[Array, Array]:
    """Return Gauss–Legendre points and weights on the panels between `bounds`.

    Parameters
    ----------
    bounds : tuple of float
        Increasing, with both ends.
    points : int
        Points on each panel.

    Returns
    -------
    xi, weights : ndarray, shape (panels * points,)
    """
    nodes, weights = leggauss(points)
    half = np.diff(bounds) / 2
    middle = (np.array(bounds[1:]) + np.array(bounds[:-1])) / 2
    xi = middle[:, None] + half[:, None] * nodes
    return xi.ravel(), (half[:, None] * weights).ravel()
