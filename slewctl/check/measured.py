"""Requirements on a measured response: what it tells, and with which uncertainty."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType

from slewctl.check.requirements import REQUIREMENTS, Verdict, check_limits
from slewctl.compare import Reading
from slewctl.compare.quantities import RECORDED
from slewctl.loop.measured_margin_results import MeasuredMargin, MeasuredMargins

MEASURED = "measured"
"""What the gate calls the measured plant, beside the arm and its variations."""


def _smaller_gain(margins: MeasuredMargins) -> MeasuredMargin:
    up, down = margins.gain_db, margins.gain_reduction_db
    least = min(up, down, key=lambda margin: margin.value)
    return MeasuredMargin(
        least.value, min(up.low, down.low), min(up.high, down.high), least.frequency_hz
    )


def _peak(margins: MeasuredMargins) -> MeasuredMargin:
    at = margins.modulus
    value, low, high = (1 / x if x else math.inf for x in (at.value, at.high, at.low))
    return MeasuredMargin(value, low, high, at.frequency_hz)


def _peak_db(margins: MeasuredMargins) -> MeasuredMargin:
    peak = _peak(margins)
    value, low, high = (20 * math.log10(x) for x in (peak.value, peak.low, peak.high))
    return MeasuredMargin(value, low, high, peak.frequency_hz)


READ: Mapping[str, Callable[[MeasuredMargins], MeasuredMargin]] = MappingProxyType(
    {
        "stable": lambda margins: MeasuredMargin(float(bool(margins.stable)), 0.0, 1.0, None),
        "gain_margin_db": _smaller_gain,
        "gain_margin_up_db": lambda margins: margins.gain_db,
        "gain_margin_down_db": lambda margins: margins.gain_reduction_db,
        "phase_margin_deg": lambda margins: margins.phase_deg,
        "delay_margin_s": lambda margins: margins.delay_s,
        "modulus_margin": lambda margins: margins.modulus,
        "sensitivity_peak_max": _peak,
        "sensitivity_peak_db_max": _peak_db,
    }
)
"""What a measured response tells, by requirement."""


def judge_measured(
    margins: MeasuredMargins, limits: Mapping[str, float | bool]
) -> tuple[Verdict, ...]:
    """Return the verdict on each requirement; stability is always the first.

    A requirement holds where the whole interval of its margin does.

    Parameters
    ----------
    margins : MeasuredMargins
    limits : mapping of str to float
        Of requirements in `READ`.

    Returns
    -------
    tuple of Verdict

    Examples
    --------
    >>> import numpy as np
    >>> import slewctl as sc
    >>> s = 2j * np.pi * np.geomspace(0.01, 10, 200)
    >>> plant = sc.Response(np.geomspace(0.01, 10, 200), 1 / (s * (s + 1) ** 2))
    >>> from slewctl.check.measured import judge_measured
    >>> judged = judge_measured(sc.measured_margins(plant, 1.0), {"gain_margin_db": 5.9})
    >>> [(v.requirement, v.passed) for v in judged]
    [('stable', True), ('gain_margin_db', True)]
    """
    numbers = {"stable": 1.0, **check_limits(limits)}
    return tuple(_verdict(margins, name, limit) for name, limit in numbers.items())


def _verdict(margins: MeasuredMargins, requirement: str, limit: float) -> Verdict:
    if not margins.stable or requirement == "stable":
        told = "; ".join((margins.caption, *margins.doubts) if not margins.stable else ())
        value = float(margins.stable) if margins.stable is not None else None
        value = value if requirement == "stable" else None
        return Verdict(requirement, value, limit, None, bool(margins.stable), told or MEASURED)
    found, quantity = READ[requirement](margins), REQUIREMENTS[requirement]
    worst = found.low if quantity.better == "greater" else found.high
    passed = quantity.holds(worst, limit)
    note = f"measured: {found.low:.4g} to {found.high:.4g}"
    if not passed and quantity.holds(found.value, limit):
        note = f"undecided, {note}"
    return Verdict(requirement, found.value, limit, found.frequency_hz, passed, note)


def measure_measured(margins: MeasuredMargins) -> dict[str, Reading]:
    """Return the margins that a baseline records, by name; none of a loop that is not stable.

    Parameters
    ----------
    margins : MeasuredMargins
    """
    if not margins.stable:
        return {}
    found = {name: READ[name](margins) for name in RECORDED if name in READ}
    return {name: Reading(each.value, each.frequency_hz) for name, each in found.items()}
