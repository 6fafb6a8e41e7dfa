"""Dead time of an arm's actuator and sensors: exact where it can be, else a Padé approximation.

Wherever in a single loop it lies, between command and torque or between motion and reading,
the loop's dead time is the sum.  Stability and margins of a continuous loop take it exactly,
as e^(−jωT), and a sampled controller's loop as an exactly delayed hold.  What needs a
continuous state space (H2 designs and costs, slews, noise levels) has the all-pass Padé
approximation of order `ORDER`, whose phase is wrong by less than 1e-7 rad up to ωT = 1,
5e-5 at 2 and 0.011 at 4.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from slewctl._types import Array
from slewctl.arm import Arm
from slewctl.errors import InputError
from slewctl.numerics.linear_system import LinearSystem

ORDER = 4
"""Of the Padé approximation."""


def loop_dead_time(arm: Arm, sensors: Sequence[str]) -> float:
    """Return the dead time in s of a loop through an arm's actuator and these sensors.

    Parameters
    ----------
    arm : Arm
    sensors : sequence of str
        What is measured.

    Returns
    -------
    float

    Raises
    ------
    InputError
        If the sensors are not equally late: their loops have no dead time in common.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.Beam(1.0, 2.0, 40.0), actuator=sc.Actuator(delay=0.002),
    ...              sensors={"theta": sc.Sensor(delay=0.001)})
    >>> loop_dead_time(arm, ["theta"])
    0.003
    """
    late = {name: arm.sensor(name).delay for name in sensors}
    if len(set(late.values())) > 1:
        told = ", ".join(f"{name} {delay:g} s" for name, delay in late.items())
        raise InputError(
            f"sensors of unlike dead times in one loop: {told}",
            where="arm.sensors",
            remedy="give all that are measured the same delay, or the later ones' as a lag",
        )
    return arm.drive.delay + max(late.values(), default=0.0)


def pade(seconds: float) -> tuple[Array, Array, Array, Array]:
    """Return (A, B, C, D) of the Padé approximation of e^(−sT), an all-pass of order `ORDER`.

    Parameters
    ----------
    seconds : float
        T > 0.

    Returns
    -------
    tuple of ndarray

    Examples
    --------
    >>> import numpy as np
    >>> A, B, C, D = pade(0.1)
    >>> found = (C @ np.linalg.solve(2j * np.eye(4) - A, B) + D)[0, 0]
    >>> bool(abs(found - np.exp(-0.2j)) < 1e-12)
    True
    """
    n = ORDER
    # P(z) and P(−z) of z = sT in powers of z/n, whose coefficients are alike in size.
    powers = np.arange(n + 1)
    top = np.array([math.factorial(2 * n - k) // math.factorial(n - k) for k in powers])
    denominator = top * n**powers / np.array([math.factorial(k) for k in powers])
    denominator = denominator / denominator[n]
    numerator = denominator * (-1.0) ** powers
    A = np.eye(n, k=1)
    A[-1] = -denominator[:n]
    D = numerator[n]
    rate = n / seconds
    C = (numerator - D * denominator)[:n]
    return A * rate, np.eye(n)[:, -1:] * rate, C[None], np.array([[D]])


def late(system: LinearSystem, seconds: float) -> LinearSystem:
    """Return a continuous system with its last input behind a dead time, approximated.

    Parameters
    ----------
    system : LinearSystem
    seconds : float
        The states of the approximation come after the system's; zero changes nothing.

    Returns
    -------
    LinearSystem

    Examples
    --------
    >>> integrator = LinearSystem(0.0, 1.0, 1.0, 0.0)
    >>> late(integrator, 0.01).nstates
    5
    """
    if not seconds:
        return system
    A, B, C, D = pade(seconds)
    n, before = system.nstates, system.ninputs - 1
    driving, through = system.B[:, before:], system.D[:, before:]
    entering = np.zeros((n + ORDER, before + 1))
    entering[:n] = np.hstack([system.B[:, :before], driving @ D])
    entering[n:, before:] = B
    actuator = system.input_labels[-1]
    return LinearSystem(
        np.block([[system.A, driving @ C], [np.zeros((ORDER, n)), A]]),
        entering,
        np.hstack([system.C, through @ C]),
        np.hstack([system.D[:, :before], through @ D]),
        inputs=system.input_labels,
        outputs=system.output_labels,
        states=[*system.state_labels, *(f"{actuator}_late{k + 1}" for k in range(ORDER))],
        name=system.name,
    )
