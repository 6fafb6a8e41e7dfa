"""Margins of a controller on a measured response: crossings, distance from −1, encirclements."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from slewctl._types import Array
from slewctl.design import Controller
from slewctl.errors import check_count, check_nonnegative
from slewctl.loop.measured_loop import MeasuredLoop, check_reads, measured_loop
from slewctl.loop.measured_margin_results import MeasuredMargin, MeasuredMargins
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
    count = _encirclements(loop, doubts)
    poles = unstable + loop.unstable_poles
    assumed = (
        *loop.assumptions,
        f"{unstable} unstable poles of the plant, {loop.unstable_poles} of the controller",
        f"below {loop.hz[0]:.4g} Hz L is c/s^{loop.poles_at_zero}, of which "
        f"{loop.controller_poles_at_zero} are the controller's",
        f"above {loop.hz[-1]:.4g} Hz |L| stays below one; there it is {abs(loop.L[-1]):.2g}",
        "between points the curve is Akima's, uncertain by its distance from straight lines",
        "the disks around the points are those of 95 % at each",
    )
    stable = None if count is None else count + poles == 0
    gains = _gains(loop)
    phase, delay, crossings = _phases(loop)
    return MeasuredMargins(
        stable,
        count,
        poles,
        *gains,
        phase,
        delay,
        _modulus(loop),
        crossings,
        assumed,
        tuple(doubts),
    )


def _encirclements(loop: MeasuredLoop, doubts: list[str]) -> int | None:
    """Return how often 1 + L turns around zero clockwise as the axis is run through."""
    distance = 1 + loop.L
    unsure = np.abs(distance) <= loop.radius
    if unsure.any():
        where = loop.hz[unsure]
        doubts.append(f"−1 lies within the uncertainty of L, {where[0]:.4g} to {where[-1]:.4g} Hz")
    if abs(loop.L[-1]) + loop.radius[-1] >= 1:
        doubts.append(f"|L| is {abs(loop.L[-1]):.2g} at the last point: what follows is not known")
    if unsure.any() or abs(loop.L[-1]) + loop.radius[-1] >= 1:
        return None
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


def _modulus(loop: MeasuredLoop) -> MeasuredMargin:
    distance = np.abs(1 + loop.L)
    k = int(np.argmin(distance))
    return MeasuredMargin(
        float(distance[k]),
        float(max(np.min(distance - loop.radius), 0.0)),
        float(np.min(distance + loop.radius)),
        float(loop.hz[k]),
    )


def _gains(loop: MeasuredLoop) -> tuple[MeasuredMargin, MeasuredMargin]:
    """Return how much the gain may rise and fall."""
    L, radius = loop.L, loop.radius
    change = np.flatnonzero(
        (np.signbit(L.imag[1:]) != np.signbit(L.imag[:-1])) & ((L.real[1:] < 0) | (L.real[:-1] < 0))
    )
    share = L.imag[change] / (L.imag[change] - L.imag[change + 1])
    at = L.real[change] + share * (L.real[change + 1] - L.real[change])
    hz = loop.hz[change] + share * (loop.hz[change + 1] - loop.hz[change])
    real, spread = at < 0, np.maximum(radius[change], radius[change + 1])
    at, hz, spread = at[real], hz[real], spread[real]
    # Everywhere a disk meets the negative real axis the crossing may be.
    touch = np.abs(L.imag) <= radius
    half = np.sqrt(np.maximum(radius[touch] ** 2 - L.imag[touch] ** 2, 0))
    low, high = L.real[touch] - half, L.real[touch] + half
    reach = np.concatenate([at, low[low < 0], np.minimum(high, -1e-300)[low < 0]])
    unsure = bool(np.any((low <= -1) & (high >= -1)))

    def margin(inside: bool) -> MeasuredMargin:
        chosen = (at > -1) if inside else (at < -1)
        size = np.abs(20 * np.log10(np.abs(at[chosen]))) if chosen.any() else np.array([])
        near = reach[(reach > -1) if inside else (reach < -1)]
        least = (
            0.0 if unsure else float(np.min(np.abs(20 * np.log10(np.abs(near))), initial=np.inf))
        )
        if not len(size):
            return MeasuredMargin(np.inf, least, np.inf, None)
        k = int(np.argmin(size))
        edge = at[chosen][k] + (1 if inside else -1) * spread[chosen][k]
        most = np.inf if edge >= 0 else abs(20 * np.log10(-edge))
        value = float(size[k])
        return MeasuredMargin(value, min(least, value), float(most), float(hz[chosen][k]))

    return margin(True), margin(False)


def _phases(loop: MeasuredLoop) -> tuple[MeasuredMargin, MeasuredMargin, tuple[float, ...]]:
    """Return phase and delay margin, and where |L| = 1."""
    size = np.abs(loop.L)
    log = np.log(size)
    change = np.flatnonzero(np.signbit(log[1:]) != np.signbit(log[:-1]))
    share = log[change] / (log[change] - log[change + 1])
    hz = loop.hz[change] + share * (loop.hz[change + 1] - loop.hz[change])
    step = np.angle(loop.L[change + 1] / loop.L[change])
    # The turn from −1, positive where L lags less than 180°.
    turn = np.angle(-loop.L[change]) + share * step
    turn = np.angle(np.exp(1j * turn))
    wide = np.arcsin(np.minimum(np.maximum(loop.radius[change], loop.radius[change + 1]), 1.0))
    touch = np.abs(size - 1) <= loop.radius
    near = np.angle(-loop.L[touch])
    near_wide = np.arcsin(np.minimum(loop.radius[touch] / size[touch], 1.0))
    near_hz = loop.hz[touch]
    angles = np.concatenate([turn, near])
    widths, places = np.concatenate([wide, near_wide]), np.concatenate([hz, near_hz])
    phase = _least(np.abs(turn), wide, np.maximum(np.abs(angles) - widths, 0.0), hz)
    degrees = 180 / np.pi
    phase = MeasuredMargin(
        phase.value * degrees, phase.low * degrees, phase.high * degrees, phase.frequency_hz
    )
    late, omega = np.mod(turn, 2 * np.pi), 2 * np.pi * hz
    latest = np.maximum(np.mod(angles, 2 * np.pi) - widths, 0.0) / (2 * np.pi * places)
    delay = _least(late / omega, wide / omega, latest, hz)
    return phase, delay, tuple(float(f) for f in hz)


def _least(values: Array, spread: Array, low: Array, hz: Array) -> MeasuredMargin:
    least = float(np.min(low, initial=np.inf))
    if not len(values):
        return MeasuredMargin(np.inf, least, np.inf, None)
    k = int(np.argmin(values))
    return MeasuredMargin(float(values[k]), least, float(values[k] + spread[k]), float(hz[k]))
