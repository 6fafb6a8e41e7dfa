"""How a controller takes into account that its command is cut off at a limit.

A controller x⁺ = A x + B y, v = C x + D y whose actuator does u = sat(v) goes on as

    x⁺ = A x + B y + H (u − v),

the same loop where nothing is cut off.  Where the reference passes straight to the command,
H = B_r/D_r is the conditioning technique of Hanus, Kinnaert and Henrotte (Automatica 23, 1987):
the states go on as if the reference had been the one that gives u.  Of an observer that is the
observer driven by u instead of v, and of a PI controller back-calculation with its integral
time.  Where that would not settle, or the reference does not pass, H is the stationary Kalman
gain of the controller seen through its command, with its readings as the noise.  What would
forget a cut-off command more slowly with H than without has none.
"""

from __future__ import annotations

import numpy as np

from slewctl._types import Array
from slewctl.design.reference import Reference
from slewctl.errors import AccuracyError
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.matrix_equations import solve_discrete_riccati


def anti_windup_gain(system: LinearSystem, reference: Reference | None) -> Array:
    """Return H of a sampled controller, shape (n, 1); zero of one that nothing winds up.

    Parameters
    ----------
    system : LinearSystem
        From the sensors to the actuator, connected with a plus sign.
    reference : Reference or None
        How the reference angle enters.

    Examples
    --------
    A PI controller, kp = 2 and ki = 0.5/s, every 0.1 s:

    >>> from slewctl.design.reference import Reference
    >>> pi = LinearSystem(1.0, -0.1, 0.5, -2.0, 0.1)
    >>> H = anti_windup_gain(pi, Reference(-pi.B, -pi.D))
    >>> round(float((pi.A - H @ pi.C)[0, 0]), 3)
    0.975
    """
    n = system.nstates
    if not n:
        return np.zeros((0, 1))
    none = np.zeros((n, 1))
    alone = _slowest(system, none)
    if reference is not None and reference.D[0, 0]:
        H = reference.B / reference.D[0, 0]
        if _slowest(system, H) < 1:
            return H if _slowest(system, H) < alone else none
    noise = system.B @ system.B.T
    try:
        found = solve_discrete_riccati(system.A.T, system.C.T, noise, np.ones((1, 1)))
    except AccuracyError:
        return none
    H = np.asarray(found.gain.T)
    return H if _slowest(system, H) < alone else none


def _slowest(system: LinearSystem, H: Array) -> float:
    """Return the largest |z| of the states while the command is cut off."""
    return float(np.abs(np.linalg.eigvals(system.A - H @ system.C)).max())
