"""Reading quantities of a judgement, and saying why one is missing."""

from __future__ import annotations

import math

from slewctl._threads import single_threaded
from slewctl.compare.judgement import Judgement
from slewctl.compare.quantities import QUANTITIES, UNWEIGHTED, WEIGHTED, Quantity, Reading
from slewctl.errors import AccuracyError
from slewctl.model.large_deflection import LargeDeflectionError


def read(judgement: Judgement, name: str) -> Reading:
    """Return a quantity of a judgement.

    Parameters
    ----------
    judgement : Judgement
    name : str
        Key of `QUANTITIES`.

    Returns
    -------
    Reading
        Of an unstable loop the frequency that grows, and no value; only ``stable`` has one.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> from slewctl.compare import read
    >>> read(problem.judge(sc.lqg(plant)), "phase_margin_deg").value > 10
    True
    """
    kept = judgement._read
    if name not in kept:
        kept[name] = _reading(judgement, QUANTITIES[name])
    return kept[name]


@single_threaded
def _reading(judgement: Judgement, quantity: Quantity) -> Reading:
    if not judgement.stable:
        hertz = judgement.unstable_hz[0]
        value = 0.0 if quantity.kind == "stability" else math.nan
        return Reading(value, hertz, note=judgement.loop.fault)
    if quantity.kind in WEIGHTED and not judgement.loop.objective.weighted:
        return Reading(math.nan, note=UNWEIGHTED)
    if quantity.kind == "slew":
        try:
            beyond = judgement.saturation
        except (AccuracyError, LargeDeflectionError) as error:  # nothing is known of its extremes
            return Reading(math.nan, note=str(error))
        if beyond:
            return Reading(math.nan, note=beyond)
    try:
        reading = quantity.read(judgement)
    except AccuracyError as error:
        return Reading(math.nan, note=str(error))  # nothing is known, and so nothing holds
    if math.isnan(reading.value) and not reading.note:
        return reading._replace(note=quantity.needs)
    if math.isinf(reading.value) and not reading.note:
        return reading._replace(note=quantity.infinite)
    return reading


def row(judgement: Judgement) -> dict[str, float | bool | None]:
    """Return every quantity of a judgement by name; None where there is no value."""
    values = {name: read(judgement, name).value for name in QUANTITIES}
    found: dict[str, float | bool | None] = {
        name: None if math.isnan(value) else value for name, value in values.items()
    }
    return found | {"stable": judgement.stable}


def describe(judgement: Judgement) -> str:
    """Return what was achieved: one line a quantity, with unit and frequency.

    Parameters
    ----------
    judgement : Judgement

    Returns
    -------
    str

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> from slewctl.compare import describe
    >>> describe(problem.judge(sc.lqg(plant))).splitlines()[0]
    'stable                           yes'
    """
    if not judgement.stable:
        return f"{judgement.loop.loud_fault}: an unstable loop has nothing else"
    lines = []
    for name, quantity in QUANTITIES.items():
        reading = read(judgement, name)
        if math.isnan(reading.value):
            continue
        value = "yes" if name == "stable" else f"{reading.value:.4g} {quantity.unit}".rstrip()
        at = f" at {reading.frequency_hz:.4g} Hz" if reading.frequency_hz is not None else ""
        doubt = f"  NOT confirmed: {reading.doubt}" if reading.doubt else ""
        lines.append(f"{name:<32} {value}{at}{doubt}")
    return "\n".join(lines)
