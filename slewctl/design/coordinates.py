"""The coordinates in which every controller leaves."""

from __future__ import annotations

import control
import numpy as np

from slewctl._types import Array
from slewctl.linalg import balance


def balanced(system: control.StateSpace) -> tuple[control.StateSpace, Array]:
    """Return a system with states x/s in which A, B and C are of comparable size, and s.

    The scales s are powers of two: no digit changes, and what is zero stays zero.  They
    balance [A, b; c, 0], where b and c are the sizes of B's rows and C's columns, in units
    of inputs and outputs that make b and c as large as A.

    Parameters
    ----------
    system : control.StateSpace
    """
    A, B, C = (np.asarray(getattr(system, name)) for name in "ABC")
    n = len(A)
    if not n:
        return system, np.ones(0)
    inner = balance(A)
    A, B, C = A / inner[:, None] * inner, B / inner[:, None], C * inner
    b, c = np.linalg.norm(B, axis=1), np.linalg.norm(C, axis=0)
    through = np.linalg.norm(b) ** 0.5 * np.linalg.norm(c) ** 0.5
    if not through:
        return system, np.ones(n)
    unit = (np.linalg.norm(A) or 1.0) / through
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n], whole[n, :n] = A, unit * b, unit * c
    scale = balance(whole)
    scale = inner * scale[:n] / scale[n]
    turned = control.StateSpace(
        np.asarray(system.A) / scale[:, None] * scale,
        np.asarray(system.B) / scale[:, None],
        np.asarray(system.C) * scale,
        system.D,
        system.dt,
        inputs=system.input_labels,
        outputs=system.output_labels,
        states=system.state_labels,
        name=system.name,
    )
    return turned, scale
