"""Filters that a given law has beside its gains: notches, low-passes and leads, from a table."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from slewctl.arm.magnitudes import check_size
from slewctl.design.classical.filters import Section, lead_section, low_pass, notch
from slewctl.errors import (
    Faults,
    InputError,
    check_count,
    check_given,
    check_positive,
    shown,
    suggest,
)

# Of a Butterworth filter; more is a wall that no loop has phase for.
_MOST_ORDER = 8


def read_sections(given: object, where: str = "sections") -> tuple[Section, ...]:
    """Return filters in series, each of first or second order and of gain one at rest.

    Parameters
    ----------
    given : sequence of mapping
        ``{notch_hz, width, depth}``: `depth` (default 0.1) remains at the frequency, and it is
        `width` (default 0.5) times the frequency wide between its −3 dB points.
        ``{lowpass_hz, order, damping_ratio}``: Butterworth's of order 1 to 8 (default 2); with
        a damping ratio that of a filter of second order.
        ``{lead_hz, lead_deg}``: that phase lead at the frequency, less than 90°.
    where : str
        For messages.

    Raises
    ------
    InputError
        For anything else.
    """
    if isinstance(given, str | Mapping) or not isinstance(given, Sequence):
        raise InputError(
            f"{shown(given)} is not a list of filters",
            where=where,
            remedy="give one, as in [{ notch_hz = 4.0, width = 0.5, depth = 0.1 }]",
        )
    faults = Faults()
    found = [
        faults.attempt(_section, table, f"{where}.{index}") for index, table in enumerate(given)
    ]
    faults.tell()
    return tuple(section for sections in found for section in sections or ())


def _section(table: object, where: str) -> tuple[Section, ...]:
    keys = dict(table) if isinstance(table, Mapping) else {}
    kinds = [kind for kind in _KINDS if kind in keys]
    if len(kinds) != 1:
        raise InputError(
            f"{shown(table)} is no filter",
            where=where,
            remedy=f"give one of {', '.join(_KINDS)} in each",
        )
    known, make = _KINDS[kinds[0]]
    faults = Faults()
    faults.add(
        InputError(
            f"a filter with {kinds[0]} has no such key",
            where=f"{where}.{key}",
            remedy=suggest(str(key), known),
        )
        for key in keys
        if key not in (kinds[0], *known)
    )
    return faults.settled(faults.attempt(make, keys, where))


def _omega(keys: Mapping[str, object], key: str, where: str) -> float:
    return 2 * math.pi * check_size(keys[key], f"{where}.{key}")


def _notch(keys: Mapping[str, object], where: str) -> tuple[Section, ...]:
    faults = Faults()
    omega = faults.attempt(_omega, keys, "notch_hz", where)
    depth = faults.attempt(_depth, keys.get("depth", 0.1), f"{where}.depth")
    width = faults.attempt(check_positive, keys.get("width", 0.5), f"{where}.width")
    return (notch(*(faults.settled(number) for number in (omega, depth, width))),)


def _depth(value: object, where: str) -> float:
    depth = check_positive(value, where)
    if depth > 1:
        raise InputError(
            f"{depth:g} is no depth of a notch",
            where=where,
            remedy="give the part of the gain that remains, from above 0 to 1",
        )
    return depth


def _low_pass(keys: Mapping[str, object], where: str) -> tuple[Section, ...]:
    omega = _omega(keys, "lowpass_hz", where)
    order = check_count(keys.get("order", 2), f"{where}.order")
    if "damping_ratio" in keys:
        if order != 2:
            raise InputError(
                f"a damping ratio belongs to a filter of order 2, not {order}",
                where=f"{where}.damping_ratio",
                remedy="leave it out: Butterworth's filter has its own",
            )
        return (low_pass(omega, check_positive(keys["damping_ratio"], f"{where}.damping_ratio")),)
    if order > _MOST_ORDER:
        raise InputError(
            f"order {order}", where=f"{where}.order", remedy=f"give at most {_MOST_ORDER}"
        )
    pairs = [low_pass(omega, math.sin((2 * k + 1) * math.pi / (2 * order)))
             for k in range(order // 2)]  # fmt: skip
    single = (Section((0.0, omega), (1.0, omega)),) if order % 2 else ()
    return (*single, *pairs)


def _lead(keys: Mapping[str, object], where: str) -> tuple[Section, ...]:
    faults = Faults()
    omega = faults.attempt(_omega, keys, "lead_hz", where)
    degrees = faults.attempt(_degrees, keys, f"{where}.lead_deg")
    return (lead_section(faults.settled(omega), math.radians(faults.settled(degrees))),)


def _degrees(keys: Mapping[str, object], where: str) -> float:
    degrees = check_positive(check_given(keys.get("lead_deg"), where, "the phase lead"), where)
    if degrees >= 90:
        raise InputError(
            f"{degrees:g} degrees are more than one lead can give",
            where=where,
            remedy="give less than 90, or two leads",
        )
    return degrees


_Maker = Callable[[Mapping[str, object], str], tuple[Section, ...]]
_KINDS: dict[str, tuple[tuple[str, ...], _Maker]] = {
    "notch_hz": (("width", "depth"), _notch),
    "lowpass_hz": (("order", "damping_ratio"), _low_pass),
    "lead_hz": (("lead_deg",), _lead),
}
