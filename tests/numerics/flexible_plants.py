"""Flexible plants in modal coordinates for the tests of the matrix equations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slewctl import Arm, Beam, GeneralisedPlant, Hub, Objective, generalised_plant, truth

Array = NDArray[np.float64]


def arm_plant(modes: int, damping_ratio: float) -> GeneralisedPlant:
    """Return the generalised plant of a uniform arm with a hub, angle measured."""
    arm = Arm(Beam(1.0, 1.0, 1.0), Hub(0.3), damping_ratio=damping_ratio)
    objective = Objective({"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    return generalised_plant(truth(arm, modes), objective)


def oscillators(omega: Array, zeta: Array, drive: Array, read: Array) -> tuple[Array, Array, Array]:
    """Return (A, B, C) of Σ read_i drive_i / (s² + 2ζ_iω_i s + ω_i²), [displacements, rates]."""
    n = len(omega)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(omega**2), -np.diag(2 * zeta * omega)]])
    B = np.concatenate([np.zeros(n), drive])[:, None]
    C = np.concatenate([read, np.zeros(n)])[None, :]
    return A, B, C


def random_rotation(rng: np.random.Generator, n: int) -> Array:
    """Return an orthogonal matrix."""
    return np.linalg.qr(rng.standard_normal((n, n)))[0]
