"""The coordinates in which every controller leaves."""

from __future__ import annotations

import numpy as np

from slewctl._types import Array
from slewctl.numerics.balance import balance_realisation
from slewctl.numerics.linear_system import LinearSystem


def balanced(system: LinearSystem) -> tuple[LinearSystem, Array]:
    """Return a system with states x/s in which A, B and C are of comparable size, and s.

    The scales s are powers of two: no digit changes, and what is zero stays zero.

    Parameters
    ----------
    system : LinearSystem
    """
    A, B, C = (np.asarray(getattr(system, name)) for name in "ABC")
    scale = balance_realisation(A, B, C)
    return scaled(system, scale), scale


def scaled(system: LinearSystem, scale: Array) -> LinearSystem:
    """Return a system with states x/s.

    Parameters
    ----------
    system : LinearSystem
    scale : ndarray, shape (n,)
        s.
    """
    return LinearSystem(
        system.A / scale[:, None] * scale,
        system.B / scale[:, None],
        system.C * scale,
        system.D,
        system.dt,
        inputs=system.input_labels,
        outputs=system.output_labels,
        states=system.state_labels,
        name=system.name,
    )
