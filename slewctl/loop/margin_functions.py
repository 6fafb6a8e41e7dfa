"""Margins of what a user has: a loop of this toolbox, a return ratio, or its two parts."""

from __future__ import annotations

from typing import overload

from slewctl._threads import single_threaded
from slewctl.design import Controller
from slewctl.errors import InputError, check_nonnegative, check_number
from slewctl.loop.closed import Loop
from slewctl.loop.measured_margin_results import MeasuredMargins
from slewctl.loop.measured_margins import measured_margins
from slewctl.loop.parts import (
    Pair,
    Plant,
    System,
    feedback_sign,
    negated,
    paired,
    state_space,
)
from slewctl.loop.single.classical_margins import classical_margins
from slewctl.loop.single.factored_loop import factored
from slewctl.loop.single.hybrid_delay import (
    HybridDelay,
    delayed_loop,
    fastest_that_matters,
    held_plant,
    smallest_delay,
)
from slewctl.loop.single.margin_results import Margins
from slewctl.loop.single.mode_names import modes_of_pair
from slewctl.loop.single.stability import check_single, require_stable
from slewctl.measured.response import Response, as_response, is_frd
from slewctl.numerics.interconnect import series
from slewctl.plant import GeneralisedPlant


@overload
def margins(
    plant: Response,
    controller: Controller | System | float,
    *,
    sign: int | None = None,
    delay: float = 0.0,
) -> MeasuredMargins: ...
@overload
def margins(
    plant: Loop | Plant,
    controller: Controller | System | float | None = None,
    *,
    sign: int | None = None,
    skew: float = 0.0,
    delay: float = 0.0,
) -> Margins: ...
@single_threaded
def margins(
    plant: Loop | Plant | Response,
    controller: Controller | System | float | None = None,
    *,
    sign: int | None = None,
    skew: float = 0.0,
    delay: float = 0.0,
) -> Margins | MeasuredMargins:
    """Return the exact margins of a single loop, continuous or sampled.

    Stability comes first, of every state of plant and controller: a loop in which an
    unstable pole is cancelled has no margins however well its return ratio looks.

    Parameters
    ----------
    plant : Loop, GeneralisedPlant, control.StateSpace or control.TransferFunction
        A closed `Loop`, or, without a controller, the return ratio L; else the plant, with
        one input, at which the loop is broken, and as many outputs as the controller reads.
        A measured `Response`, or a control.FrequencyResponseData, has margins with intervals;
        `measured_margins` takes what is known of its poles.
    controller : Controller, control.StateSpace, control.TransferFunction or float, optional
        Its signals are matched with the plant's by name where both have names of their own,
        else by position.  With a sample time and a continuous plant, the plant is sampled
        exactly with a zero-order hold.  The margins are then those at the hold, exact for the
        hybrid loop as far as gain and phase there are concerned; for the delay of the
        continuous signal see `hybrid_delay_margin`.
    sign : {-1, 1}, optional
        Of the feedback, u = sign·K y, as in `control.feedback`: −1 unless told otherwise.  A
        slewctl `Controller` knows its own, +1, because its minus is inside; its bare
        `system` needs ``sign=1``.
    skew : float
        σ of the disk margin (Seiler, Packard and Gahinet 2020); zero is balanced.
    delay : float
        Dead time in s: of a continuous loop, anywhere in it and exact, no Padé approximation;
        of a sampled controller around a continuous plant, from the sample to the input
        computed from it.  A `Controller` brings its own, to which this is added.

    Returns
    -------
    Margins or MeasuredMargins
        `MeasuredMargins` of a measured response.

    Raises
    ------
    UnstableLoopError
        An unstable loop has no margin; the poles are named, hidden ones called so, and where
        the opposite sign makes it stable the message says so.
    InputError
        For several inputs, unlike or unknown sample times, 1 + D = 0, an improper system,
        signals that do not fit together, or an option that means nothing here.
    AccuracyError
        If nothing can be proved of the loop.

    Examples
    --------
    An integrator with one second of dead time: 90° less one radian of phase margin.

    >>> import control as ct
    >>> import slewctl as sc
    >>> m = sc.margins(ct.tf([1], [1, 0]), 1.0, delay=1.0)
    >>> round(m.phase_deg.value, 3), m.confirmed
    (32.704, True)
    """
    if isinstance(plant, Response) or is_frd(plant):
        return _measured(plant, controller, sign, skew, delay)
    check_number(skew, "skew")
    late = check_nonnegative(delay, "delay")
    if isinstance(plant, Loop):
        if controller is not None:
            raise _has_its_own("margins")
        if not late:
            return _of_closed(plant, sign, skew)
        feedback_sign(sign, plant.controller)
        late += plant.late - plant.controller.delay
        return margins(plant.plant.exact, plant.controller, skew=skew, delay=late)
    if isinstance(plant, GeneralisedPlant):
        late, plant = late + plant.dead_time, plant.exact
    if controller is None:
        loop = state_space(plant, "plant")
        check_single(loop)
        loop = loop if feedback_sign(sign) < 0 else negated(loop)
        _continuous_if(late, loop.sample_time)
        return classical_margins(loop, skew=skew, factors=factored(loop, None, late))
    pair = _single(paired(plant, controller, sign))
    late += _own_delay(controller)
    own, clock = pair.clocks
    named = modes_of_pair(pair, late)
    if clock and not own:
        path = held_plant(pair.plant, clock, late)
        late = 0.0
    else:
        _continuous_if(late, own)
        path = pair.on_one_clock().plant
    factors = factored(path, pair.negative, late)
    loop = series(path, pair.negative)
    return classical_margins(loop, skew=skew, modes=named, factors=factors)


def hybrid_delay_margin(
    plant: Loop | Plant,
    controller: Controller | System | float | None = None,
    *,
    sign: int | None = None,
    delay: float = 0.0,
) -> HybridDelay:
    """Return the delay that a sampled controller's loop around a continuous plant stands.

    The delay may be any fraction of a sample; it acts on the continuous signal into the
    plant, and changes the sampled plant.  See `smallest_delay` for what is guaranteed.

    Parameters
    ----------
    plant : Loop, GeneralisedPlant, control.StateSpace or control.TransferFunction
        A closed `SampledLoop`, or a continuous plant with one input.
    controller : Controller, control.StateSpace or control.TransferFunction, optional
        Sampled; signals are matched as in `margins`.
    sign : {-1, 1}, optional
        As in `margins`.
    delay : float
        In s, that the loop has already.  A `Controller` brings its own, to which this is
        added.

    Raises
    ------
    UnstableLoopError
        If the loop is unstable without additional delay.
    InputError
        If the plant is not continuous or the controller not sampled, or a closed loop is
        given a second controller.

    Returns
    -------
    HybridDelay

    Examples
    --------
    >>> import control as ct
    >>> import slewctl as sc
    >>> sc.hybrid_delay_margin(ct.tf([1], [1, 0]), ct.tf([1], [1], 0.1)).seconds > 1.4
    True
    """
    late = check_nonnegative(delay, "delay")
    if isinstance(plant, Loop):
        if controller is not None:
            raise _has_its_own("hybrid_delay_margin")
        late += plant.late - plant.controller.delay
        controller, plant = plant.controller, plant.plant.exact
    if isinstance(plant, GeneralisedPlant):
        late, plant = late + plant.dead_time, plant.exact
    if controller is None:
        raise InputError(
            "there is no controller",
            where="hybrid_delay_margin",
            remedy="give a SampledLoop, or a continuous plant and a sampled controller",
        )
    pair = _single(paired(plant, controller, sign))
    if not pair.clocks[1] or pair.clocks[0]:
        raise InputError(
            "this wants a continuous plant and a sampled controller",
            where="hybrid_delay_margin",
            remedy="for one clock alone, margins(...).delay_s is exact",
        )
    with_delay = delayed_loop(pair.plant, pair.negative, late + _own_delay(controller))
    nominal = with_delay(0.0)
    require_stable(nominal)
    fastest = fastest_that_matters(pair.plant, nominal)
    return smallest_delay(with_delay, pair.clocks[1], fastest)


def _measured(
    plant: object,
    controller: Controller | System | float | None,
    sign: int | None,
    skew: float,
    delay: float,
) -> MeasuredMargins:
    if skew:
        raise InputError(
            "a measured response has no disk margin", where="skew", remedy="leave it out"
        )
    return measured_margins(
        as_response(plant, "plant"),
        1.0 if controller is None else controller,
        sign=sign,
        delay=delay,
    )


def _has_its_own(where: str) -> InputError:
    return InputError(
        "a loop has its controller already", where=where, remedy="give the loop alone"
    )


def _of_closed(loop: Loop, sign: int | None, skew: float) -> Margins:
    feedback_sign(sign, loop.controller)
    loop.require_stable("margins")
    return loop.margins if skew == 0 else loop.margins_at(skew)


def _continuous_if(late: float, clock: float) -> None:
    """Refuse a delay of a loop that has but one clock."""
    if late and clock:
        raise InputError(
            "a sampled loop is delayed by whole samples alone",
            where="delay",
            remedy="put z**-k into the loop, or compare margins.delay_s with the delay",
        )


def _single(pair: Pair) -> Pair:
    """Return the pair; refuse a plant that is not broken at one input."""
    if pair.plant.ninputs != 1:
        raise InputError(
            f"the plant has {pair.plant.ninputs} inputs",
            where="margins",
            remedy="break one loop at the plant's only input, or use multiloop_margins",
        )
    return pair


def _own_delay(controller: object) -> float:
    return controller.delay if isinstance(controller, Controller) else 0.0
