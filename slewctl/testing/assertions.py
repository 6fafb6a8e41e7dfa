"""`assert_margins`: a loop's margins in any test of Python."""

from __future__ import annotations

import math

from slewctl.check.words import number_text
from slewctl.design import Controller
from slewctl.errors import check_nonnegative
from slewctl.loop import Crossing, Loop, Margins, UnstableLoopError
from slewctl.loop.parts import Plant, System
from slewctl.loop.public import margins as margins_of


def assert_margins(
    loop: Loop | Plant,
    controller: Controller | System | float | None = None,
    *,
    sign: int | None = None,
    gain_db: float | None = None,
    phase_deg: float | None = None,
    delay_s: float | None = None,
    modulus: float | None = None,
    disk: float | None = None,
) -> None:
    """Fail unless a loop is stable and has at least the margins named.

    Parameters
    ----------
    loop : Loop, GeneralisedPlant, control.StateSpace or control.TransferFunction
        From `slewctl.close`; or a return ratio L; or, with a controller, the plant.
        Continuous or sampled.
    controller : Controller, control.StateSpace, control.TransferFunction or float, optional
        Its signals are matched with the plant's by name; see `slewctl.margins`.
    sign : {-1, 1}, optional
        Of the feedback, −1 unless told otherwise; a slewctl `Controller` knows its own.
    gain_db : float, optional
        Least change of the gain, up or down, in dB, that makes it unstable.
    phase_deg : float, optional
        Least turn of the phase in degrees.
    delay_s : float, optional
        Least added delay in s.
    modulus : float, optional
        Least distance of the Nyquist curve from −1.
    disk : float, optional
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
    >>> assert_margins(loop, gain_db=6, phase_deg=30, disk=0.4)  # doctest: +SKIP
    """
    __tracebackhide__ = True
    limits = {
        "gain_db": gain_db,
        "phase_deg": phase_deg,
        "delay_s": delay_s,
        "modulus": modulus,
        "disk": disk,
    }
    asked = {
        name: check_nonnegative(limit, name) for name, limit in limits.items() if limit is not None
    }
    try:
        margins = margins_of(loop, controller, sign=sign)
    except UnstableLoopError as error:
        raise AssertionError(f"{error.what}; an unstable loop has no margin") from None
    short = _shortfalls(margins, asked) if asked else []
    if short:
        raise AssertionError("\n".join(short))


_UNITS = {"gain_db": "dB", "phase_deg": "deg", "delay_s": "s", "modulus": "", "disk": ""}


def _shortfalls(margins: Margins, asked: dict[str, float]) -> list[str]:
    """Return a line for each margin that is smaller than asked, or doubtful."""
    lines = []
    for name, limit in asked.items():
        found = [getattr(margins, name)]
        if name == "gain_db":
            found.append(margins.gain_reduction_db)
        lines += [
            _short(name, crossing, limit) for crossing in found if not crossing.value >= limit
        ]
    if not margins.confirmed:
        lines.append("the margins are not confirmed: " + "; ".join(margins.doubts))
    return lines


def _short(name: str, crossing: Crossing, limit: float) -> str:
    unit = _UNITS[name]
    if math.isnan(crossing.value):
        return f"{name}: not a number, required >= {number_text(limit, unit)}"
    at = "" if crossing.frequency_hz is None else f" at {crossing.frequency_hz:.4g} Hz"
    mode = f" near {crossing.mode}" if crossing.mode else ""
    value = number_text(crossing.value, unit)
    return f"{name}: {value}{at}{mode}, required >= {number_text(limit, unit)}"
