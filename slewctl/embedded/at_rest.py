"""A controller at rest: its states, and the path of the reference that asks nothing of it."""

from __future__ import annotations

import numpy as np

from slewctl._types import Array
from slewctl.design.reference import Reference
from slewctl.numerics.linear_system import LinearSystem

# A command at the start, relative to what the readings alone would give, that is rounding.
_NO_JUMP = 1e-6
# A state at the start, relative to the largest, that is rounding.
_NOTHING = 1e-13


def starting_states(
    system: LinearSystem, reference: Reference, at_rest: Array
) -> tuple[Array, str]:
    """Return the states at rest at 1 rad, where the command is zero, and what is left of it.

    Parameters
    ----------
    system : LinearSystem
        Sampled, from the sensors to the actuator.
    reference : Reference
    at_rest : ndarray, shape (sensors,)
        Readings at 1 rad.
    """
    entering = system.B @ at_rest + reference.B[:, 0]
    through = float(system.D[0] @ at_rest + reference.D[0, 0])
    left = np.vstack([np.eye(system.nstates) - system.A, -system.C])
    right = np.append(entering, through)
    size = np.abs(left).max(axis=1, initial=0.0)
    size[size == 0] = 1.0
    found = np.linalg.lstsq(left / size[:, None], right / size, rcond=None)[0]
    found[np.abs(found) <= _NOTHING * np.abs(found).max(initial=0.0)] = 0.0
    jump = abs(float(system.C[0] @ found) + through)
    whole = np.abs(system.C[0]) @ np.abs(found) + np.abs(system.D[0]) @ np.abs(at_rest)
    if jump <= _NO_JUMP * max(float(whole), abs(float(reference.D[0, 0]))):
        return np.asarray(found), ""
    return np.asarray(found), f"at the start it commands {jump:.3g} per rad of the angle"


def settled(system: LinearSystem, reference: Reference, at_rest: Array) -> Reference:
    """Return a reference by which rounded coefficients come to rest where exact ones do.

    An integrator is given what it reads at rest with the other sign, and the command what the
    states and the readings come to there.

    Parameters
    ----------
    system : LinearSystem
    reference : Reference
    at_rest : ndarray, shape (sensors,)
    """
    holds = np.all(np.eye(system.nstates) == system.A, axis=1)
    B = np.where(holds[:, None], -system.B @ at_rest[:, None], reference.B)
    entering = system.B @ at_rest + B[:, 0]
    states = np.linalg.lstsq(np.eye(system.nstates) - system.A, entering, rcond=None)[0]
    through = -(system.C[0] @ states + system.D[0] @ at_rest)
    return Reference(B, np.array([[through]]))


def entry_of(told: LinearSystem) -> Reference:
    """Return the path of a controller's last input."""
    return Reference(told.B[:, -1:], told.D[:, -1:])
