"""A judged controller as data for other programs: what it is, its sign and where it comes from."""

from __future__ import annotations

from typing import Any

from slewctl.compare import Judgement
from slewctl.embedded.program import UNITS
from slewctl.plant.signals import signal

_SIGN = "u = K y: connected with a plus sign, its minus is inside"


def controller_data(judgement: Judgement, notes: tuple[str, ...]) -> dict[str, Any]:
    """Return a controller by name, as `slewctl.given` reads it, with units and sign in words.

    Parameters
    ----------
    judgement : Judgement
    notes : tuple of str
        Where it comes from.

    Returns
    -------
    dict of str to value

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> from slewctl.embedded import controller_data
    >>> data = controller_data(problem.judge(sc.lqg(problem.plant("clamped-free", n=1))), ())
    >>> data["input_units"], data["output_unit"], data["sample_time"]
    (['rad'], 'N*m', 0.0)
    """
    controller = judgement.controller
    units = [signal(name).unit.replace("·", "*").replace("²", "^2") for name in controller.sensors]
    return {
        **controller.data,
        "input_units": units,
        "output_unit": UNITS[controller.linear.output_labels[0]],
        "sign": _SIGN,
        "notes": list(notes),
    }
