"""Closing a loop: the controller's signals are checked, and its clock decides the kind."""

from __future__ import annotations

from typing import TYPE_CHECKING

from slewctl._threads import single_threaded
from slewctl.design import Controller, given
from slewctl.errors import InputError, shown
from slewctl.loop.closed import Loop
from slewctl.loop.sampled import SampledLoop
from slewctl.model import Model
from slewctl.model.assembly import check_model
from slewctl.numerics.linear_system import clock_unknown, linear
from slewctl.plant import Objective

if TYPE_CHECKING:
    import control


@single_threaded
def close(
    model: Model, objective: Objective, controller: Controller | control.StateSpace
) -> Loop | SampledLoop:
    """Return the loop of `controller` around `model`, judged by `objective`.

    Parameters
    ----------
    model : Model
    objective : Objective
    controller : Controller or control.StateSpace
        A design's result, or a system of your own from the objective's sensors to its
        actuator, by name; it is connected with a plus sign.  If it has a sample time the
        loop is a `SampledLoop`; a computational delay can be given by `slewctl.design.given`.

    Returns
    -------
    Loop or SampledLoop
        The latter, which is a `Loop` too, if the controller has a sample time.

    Raises
    ------
    InputError
        If the controller takes other sensors than the objective names, or commands another
        actuator.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> loop = sc.close(problem.truth, problem.objective, sc.lqg(plant))
    >>> loop.stable
    True
    """
    check_model(model, "close")
    if not isinstance(objective, Objective):
        raise InputError(
            f"{shown(objective)} is not an Objective",
            where="close",
            remedy="give model, objective and controller in this order",
        )
    if linear(controller) is not None or clock_unknown(controller):
        controller = given(controller)
    if not isinstance(controller, Controller):
        raise InputError(
            f"{shown(controller)} is no controller",
            where="close",
            remedy="give a Controller, or a control.StateSpace with named signals",
        )
    commanded = controller.linear.output_labels[0]
    if commanded != objective.actuator:
        raise InputError(
            f"the controller commands {commanded!r}, the objective limits {objective.actuator!r}",
            where="close",
            remedy="use the objective that the controller was designed for",
        )
    if controller.sensors != objective.sensors:
        raise InputError(
            f"the controller takes {list(controller.sensors)}, the objective measures "
            f"{list(objective.sensors)}",
            where="close",
            remedy="use the objective that the controller was designed for",
        )
    kind = SampledLoop if controller.sample_time else Loop
    return kind(model, objective, controller)
