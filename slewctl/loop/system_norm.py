"""The H2 and the H∞ norm of a system, its stability decided first."""

from __future__ import annotations

import math

from slewctl.design.result import COST_TOLERANCE
from slewctl.errors import AccuracyError, check_choice
from slewctl.loop.parts import Plant, state_space
from slewctl.numerics.h2_norm import system_cost
from slewctl.numerics.hinf_norm import peak_gain
from slewctl.numerics.observability import poles_and_growth


def norm(system: Plant, p: float | str = 2) -> float:
    """Return ‖G‖₂ or ‖G‖∞.

    Parameters
    ----------
    system : control.StateSpace, control.TransferFunction or GeneralisedPlant
        Continuous or sampled, with any inputs and outputs; of a generalised plant the path
        from the actuator to the sensors.
    p : {2, "inf"}
        2: the root-mean-square output under white noise of unit density (of unit variance if
        sampled).  ``"inf"``: the largest singular value at any frequency.

    Returns
    -------
    float
        Infinite if the system is not stable by more than rounding, and for p = 2 if white
        noise passes straight to an output of a continuous system.

    Raises
    ------
    InputError
        For anything else.
    AccuracyError
        If the level sets do not close in on the peak, or two Gramians do not give one norm.

    Examples
    --------
    >>> import control, slewctl as sc
    >>> lag = control.tf([1], [0.5, 1])
    >>> sc.norm(lag), sc.norm(lag, "inf")
    (1.0, 1.0)
    """
    kind = check_choice(
        "inf" if isinstance(p, float) and p == math.inf else str(p), ("2", "inf"), "p"
    )
    found = state_space(system, "norm")
    if found.nstates and not poles_and_growth(found.A, found.sample_time)[1] < 0:
        return math.inf
    if kind == "inf":
        return peak_gain(found).value
    cost = system_cost(found)
    if cost.discrepancy > COST_TOLERANCE:
        raise AccuracyError(
            f"the two Gramians give squares of the norm that differ by {cost.discrepancy:.0e}",
            where="norm",
            remedy="scale the states, inputs or outputs, whose units differ by many decades",
        )
    return math.sqrt(cost.value)
