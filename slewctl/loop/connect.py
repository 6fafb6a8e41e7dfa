"""Closing a loop: the controller's signals are checked, and its clock decides the kind."""

from __future__ import annotations

from slewctl import design
from slewctl._threads import single_threaded
from slewctl.design import Controller, fitted
from slewctl.errors import InputError, shown
from slewctl.loop.closed import Loop
from slewctl.loop.delayed import DelayedLoop
from slewctl.loop.parts import System, feedback_sign, state_space
from slewctl.loop.sampled import SampledLoop
from slewctl.model import Model
from slewctl.model.assembly import check_model
from slewctl.numerics.linear_system import LinearSystem, nameless, of_kind
from slewctl.plant import Objective, loop_dead_time


@single_threaded
def close(
    model: Model,
    objective: Objective,
    controller: Controller | System,
    *,
    sign: int | None = None,
) -> Loop | SampledLoop:
    """Return the loop of `controller` around `model`, judged by `objective`.

    Parameters
    ----------
    model : Model
    objective : Objective
    controller : Controller, control.StateSpace or control.TransferFunction
        A design's result; or a system of your own from sensors of the objective to its
        actuator, by name, or by position where it has no names.  If it has a sample time the
        loop is a `SampledLoop`; a computational delay can be given by `slewctl.given`.
    sign : {-1, 1}, optional
        Of the feedback, u = sign·K y, as in `margins` and `control.feedback`: −1 for a system
        of your own.  A slewctl `Controller` knows its own, +1, because its minus is inside;
        its bare `system` needs ``sign=1``.

    Returns
    -------
    Loop or SampledLoop
        The latter, which is a `Loop` too, if the controller has a sample time; a
        `DelayedLoop`, another one, if it has none and the arm a dead time.

    Raises
    ------
    InputError
        If the controller takes other sensors than the objective names, or commands another
        actuator; for a sign that is none, or contradicts a `Controller`.

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
    direction = feedback_sign(sign, controller)
    if not isinstance(controller, Controller):
        if not is_system(controller):
            raise InputError(
                f"{shown(controller)} is no controller",
                where="close",
                remedy="give a Controller, or a system of python-control",
            )
        controller = _bare(controller, objective, direction)
    try:
        controller = fitted(controller, objective.sensors, objective.actuator)
    except InputError as error:
        raise error.at("close") from error
    if controller.sample_time:
        return SampledLoop(model, objective, controller)
    late = loop_dead_time(model.arm, objective.sensors)
    return (DelayedLoop if late else Loop)(model, objective, controller)


def is_system(value: object) -> bool:
    """Return whether a user gave a system, of python-control or of slewctl."""
    return isinstance(value, LinearSystem) or any(
        of_kind(value, kind) for kind in ("StateSpace", "TransferFunction")
    )


def _bare(system: System, objective: Objective, sign: int) -> Controller:
    """Return a user's own system; without names its signals are the objective's, in order."""
    light = state_space(system, "close")
    inputs = objective.sensors if nameless(light.input_labels) else None
    output = objective.actuator if nameless(light.output_labels) else None
    feedback = "negative" if sign < 0 else "positive"
    return design.given(light, feedback=feedback, inputs=inputs, output=output)
