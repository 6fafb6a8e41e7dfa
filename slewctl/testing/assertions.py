"""`assert_margins`: a loop's margins in any test of Python."""

from __future__ import annotations

import math

from slewctl.check.measured import READ, judge_measured
from slewctl.check.words import number_text
from slewctl.compare import QUANTITIES, Quantity
from slewctl.design import Controller
from slewctl.errors import InputError, check_nonnegative
from slewctl.loop import Crossing, Loop, Margins, UnstableLoopError
from slewctl.loop.margin_functions import margins as margins_of
from slewctl.loop.measured_margin_results import MeasuredMargins
from slewctl.loop.parts import Plant, System


def assert_margins(
    loop: Loop | Plant,
    controller: Controller | System | float | None = None,
    *,
    sign: int | None = None,
    gain_margin_db: float | None = None,
    gain_margin_up_db: float | None = None,
    gain_margin_down_db: float | None = None,
    phase_margin_deg: float | None = None,
    delay_margin_s: float | None = None,
    modulus_margin: float | None = None,
    disk_margin: float | None = None,
) -> None:
    """Fail unless a loop is stable and has at least the margins named.

    Parameters
    ----------
    loop : Loop, GeneralisedPlant, control.StateSpace or control.TransferFunction
        From `slewctl.close`; or a return ratio L; or, with a controller, the plant.
        Continuous or sampled.  Of a `Response`, or a control.FrequencyResponseData, the whole
        interval of a margin must hold, and stability be decided.
    controller : Controller, control.StateSpace, control.TransferFunction or float, optional
        Its signals are matched with the plant's by name; see `slewctl.margins`.
    sign : {-1, 1}, optional
        Of the feedback, −1 unless told otherwise; a slewctl `Controller` knows its own.
    gain_margin_db : float, optional
        Least change of the gain, up or down, in dB, that makes it unstable.
    gain_margin_up_db, gain_margin_down_db : float, optional
        Least rise, and least fall, alone.
    phase_margin_deg : float, optional
        Least turn of the phase in degrees.
    delay_margin_s : float, optional
        Least added delay in s.
    modulus_margin : float, optional
        Least distance of the Nyquist curve from −1.
    disk_margin : float, optional
        Least α of the balanced disk margin.

    Raises
    ------
    AssertionError
        Naming each margin that falls short with value, limit and frequency.  An unstable loop
        has no margin, NaN is none, and a margin that is not confirmed does not count.
    InputError
        For something that is no loop, or an impossible limit; as `slewctl.margins`.

    Examples
    --------
    >>> import control
    >>> loop = control.tf([1], [1, 1, 0])  # L, closed by negative feedback
    >>> assert_margins(loop, gain_margin_db=6, phase_margin_deg=30)
    """
    __tracebackhide__ = True
    limits = {
        "gain_margin_db": gain_margin_db,
        "gain_margin_up_db": gain_margin_up_db,
        "gain_margin_down_db": gain_margin_down_db,
        "phase_margin_deg": phase_margin_deg,
        "delay_margin_s": delay_margin_s,
        "modulus_margin": modulus_margin,
        "disk_margin": disk_margin,
    }
    asked = {
        name: check_nonnegative(limit, name) for name, limit in limits.items() if limit is not None
    }
    try:
        margins = margins_of(loop, controller, sign=sign)
    except UnstableLoopError as error:
        raise AssertionError(f"{error.what}; an unstable loop has no margin") from None
    if isinstance(margins, MeasuredMargins):
        short = _measured_shortfalls(margins, asked)
    else:
        short = _shortfalls(margins, asked) if asked else []
    if short:
        raise AssertionError("\n".join(short))


def _shortfalls(margins: Margins, asked: dict[str, float]) -> list[str]:
    """Return a line for each margin that is smaller than asked, or doubtful."""
    lines = []
    for name, limit in asked.items():
        quantity = QUANTITIES[name]
        if quantity.margin is None:
            raise TypeError(f"{name} is not read from margins")
        crossing = quantity.margin(margins)
        if not quantity.holds(crossing.proved, limit):
            lines.append(_short(quantity, crossing, limit))
    if margins.unproved:
        lines.append("the margins are not confirmed: " + "; ".join(margins.unproved))
    return lines


def _measured_shortfalls(margins: MeasuredMargins, asked: dict[str, float]) -> list[str]:
    """Return a line for each margin whose whole interval is not as large as asked."""
    if untold := [name for name in asked if name not in READ]:
        raise InputError(
            "a measured response does not tell it",
            where=untold[0],
            remedy=f"ask for {', '.join(name for name in READ if 'margin' in name)}",
        )
    stable, *others = judge_measured(margins, asked)
    if not stable.passed:  # then there is nothing else to tell
        return [stable.note]
    lines = []
    for (name, limit), verdict in zip(asked.items(), others, strict=True):
        if not verdict.passed:
            at = READ[name](margins)
            short = _short(QUANTITIES[name], Crossing(at.value, at.frequency_hz), limit)
            lines.append(f"{short} ({verdict.note})")
    return lines


def _short(quantity: Quantity, crossing: Crossing, limit: float) -> str:
    required = f"required >= {number_text(limit, quantity.unit)}"
    if math.isnan(crossing.value):
        return f"{quantity.name}: not a number, {required}"
    at = "" if crossing.frequency_hz is None else f" at {crossing.frequency_hz:.4g} Hz"
    mode = f" near {crossing.mode}" if crossing.mode else ""
    return f"{quantity.name}: {number_text(crossing.proved, quantity.unit)}{at}{mode}, {required}"
