"""Margins of a controller on a measured response, and how often L encircles −1."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from slewctl._types import BoolArray
from slewctl.design import Controller
from slewctl.errors import check_count, check_nonnegative
from slewctl.loop.measured_loop import MeasuredLoop, check_reads, measured_loop
from slewctl.loop.measured_margin_results import MARGINS, MeasuredMargins
from slewctl.loop.measured_strip import Strip
from slewctl.loop.parts import System, feedback_sign, negated, state_space
from slewctl.measured.response import Response, as_response
from slewctl.numerics.given_system import static
from slewctl.numerics.linear_system import LinearSystem

if TYPE_CHECKING:
    from control import FrequencyResponseData

# How far a count of encirclements may be from a whole number.
_WHOLE = 0.15


def measured_margins(
    response: Response | FrequencyResponseData,
    controller: Controller | System | float,
    *,
    sign: int | None = None,
    delay: float = 0.0,
    unstable_poles: int = 0,
    poles_at_zero: int | None = None,
) -> MeasuredMargins:
    """Return the margins of a controller on a measured response, as intervals.

    Parameters
    ----------
    response : Response or control.FrequencyResponseData
        Of the plant.
    controller : Controller, control.StateSpace, control.TransferFunction or float
        Reads what was measured, alone.
    sign : {-1, 1}, optional
        Of the feedback, as in `margins`: −1 unless told otherwise, +1 of a `Controller`.
    delay : float
        Further dead time in s.
    unstable_poles : int
        Of the plant, known from elsewhere: no response shows them.
    poles_at_zero : int, optional
        Of the plant: 2 for a hub angle that turns freely, 1 with friction or a voltage as
        input.  By default from the phase of the first point.

    Returns
    -------
    MeasuredMargins
        With the assumptions that the count of encirclements stands on.

    Raises
    ------
    InputError
        For a controller that reads something else, or has another clock.

    Examples
    --------
    >>> import numpy as np
    >>> import slewctl as sc
    >>> s = 2j * np.pi * np.geomspace(0.01, 10, 200)
    >>> plant = sc.Response(np.geomspace(0.01, 10, 200), 1 / (s * (s + 1) ** 2))
    >>> found = sc.measured_margins(plant, 1.0)
    >>> found.stable, round(found.gain_db.value, 2)
    (True, 6.02)
    """
    measured = as_response(response, "response")
    check_count(unstable_poles, "unstable_poles", 0)
    loop = loop_on(measured, controller, sign=sign, delay=delay, poles_at_zero=poles_at_zero)
    return _found(loop, measured, unstable_poles)


def loop_on(
    response: Response,
    controller: Controller | System | float,
    *,
    sign: int | None = None,
    delay: float = 0.0,
    poles_at_zero: int | None = None,
) -> MeasuredLoop:
    """Return the loop that `measured_margins` looks at."""
    direction = feedback_sign(sign, controller)
    late = check_nonnegative(delay, "delay")
    if poles_at_zero is not None:
        check_count(poles_at_zero, "poles_at_zero", 0)
    K = _read(controller, response)
    if isinstance(controller, Controller):
        late += controller.delay
    return measured_loop(response, K if direction < 0 else negated(K), late, poles_at_zero)


def _read(controller: Controller | System | float, response: Response) -> LinearSystem:
    if isinstance(controller, Controller):
        controller = controller.linear
    if isinstance(controller, int | float) and not isinstance(controller, bool):
        return static(float(controller), response.sample_time)
    K = state_space(controller, "controller")
    check_reads(K, response)
    return K


def _found(loop: MeasuredLoop, response: Response, unstable: int) -> MeasuredMargins:
    doubts: list[str] = []
    if not np.all(np.isfinite(response.known_deviation)):
        doubts.append("the points have no deviations: intervals are those of interpolation alone")
    strip = Strip(loop)
    count = _encirclements(loop, strip.near(-1.0), doubts)
    poles = unstable + loop.unstable_poles
    assumed = (
        *loop.assumptions,
        f"{unstable} unstable poles of the plant, {loop.unstable_poles} of the controller",
        f"below {loop.hz[0]:.4g} Hz L is c/s^{loop.poles_at_zero}, of which "
        f"{loop.controller_poles_at_zero} are the controller's",
        f"above {loop.hz[-1]:.4g} Hz |L| stays below one; there it is {abs(loop.L[-1]):.2g}",
        "between points the curve is Akima's, uncertain by its distance from straight lines, and "
        "by circles where they turn; nothing passes between two points that none of them shows",
        "the disks around the points are those of 95 % at each",
    )
    stable = None if count is None else count + poles == 0
    phase, delay, crossings = strip.phases()
    rise, fall = strip.gains()
    found = MeasuredMargins(
        stable, count, poles, rise, fall, phase, delay, strip.modulus(), crossings, assumed,
        tuple(doubts),
    )  # fmt: skip
    if not _crossed_before(loop):
        return found
    unknown = {name: replace(getattr(found, name), low=0.0) for name in MARGINS}
    return replace(found, **unknown)


def _crossed_before(loop: MeasuredLoop) -> bool:
    """Whether |L| = 1 is passed below the first point: at poles at zero it is large."""
    return bool(loop.poles_at_zero) and abs(loop.L[0]) - loop.radius[0] < 1


def _encirclements(loop: MeasuredLoop, unsure: BoolArray, doubts: list[str]) -> int | None:
    """Return how often 1 + L turns around zero clockwise as the axis is run through.

    Parameters
    ----------
    loop : MeasuredLoop
    unsure : ndarray of bool, shape (m - 1,)
        Between which places −1 may be passed on either side.
    doubts : list of str
        To add to.
    """
    before = len(doubts)
    if unsure.any():
        first, last = loop.hz[:-1][unsure][0], loop.hz[1:][unsure][-1]
        doubts.append(f"−1 lies within the uncertainty of L, {first:.4g} to {last:.4g} Hz")
    if abs(loop.L[-1]) + loop.radius[-1] >= 1:
        doubts.append(f"|L| is {abs(loop.L[-1]):.2g} at the last point: what follows is not known")
    if _crossed_before(loop):
        doubts.append(
            f"|L| is {abs(loop.L[0]):.2g} at the first point, {loop.hz[0]:.4g} Hz, and passes one "
            "below the first point, where nothing was measured"
        )
    if len(doubts) > before:
        return None
    distance = 1 + loop.L
    turned = float(np.sum(np.angle(distance[1:] / distance[:-1])))
    order = loop.poles_at_zero
    # From zero to the first point, and from the last, where L vanishes, to the end.
    asymptote = np.exp(-1j * order * np.pi / 2) if order else 1.0
    far = loop.L[0] if order else distance[0]
    asymptote = asymptote if (far / asymptote).real > 0 else -asymptote
    turned += float(np.angle(distance[0] / asymptote) - np.angle(distance[-1]))
    whole = (2 * turned - order * np.pi) / (2 * np.pi)
    if abs(whole - round(whole)) > _WHOLE:
        doubts.append(f"1 + L turns {whole:.2f} times: what is assumed beyond the band is wrong")
        return None
    return -round(whole)
