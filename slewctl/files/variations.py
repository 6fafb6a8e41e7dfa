"""``[variations.NAME]``: the arm with another payload, hub, beam or damping."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from slewctl.arm import Arm, vary
from slewctl.check import NOMINAL, check_limits
from slewctl.errors import InputError, SlewctlError, shown, suggest
from slewctl.files.faults import Faults

# A day's work at a minute each.
MOST_VARIATIONS = 1000

KEYS = tuple(
    name
    for name, parameter in inspect.signature(vary).parameters.items()
    if parameter.kind is parameter.KEYWORD_ONLY
)


@dataclass(frozen=True)
class Variation:
    """A named variation of a design's arm, with what is required on it.

    Attributes
    ----------
    name : str
    arm : Arm
        The design's arm, changed.
    requirements : mapping of str to float
    """

    name: str
    arm: Arm
    requirements: Mapping[str, float | bool]


def read_variations(
    tables: Mapping[str, Mapping[str, Any]], arm: Arm, requirements: Mapping[str, float | bool]
) -> tuple[Variation, ...]:
    """Return the variations that a design file describes, in its order.

    Parameters
    ----------
    tables : mapping of str to mapping
        By name: keyword arguments of `slewctl.arm.vary`, and the variation's own
        ``requirements`` where it has such a table.
    arm : Arm
        What they change.
    requirements : mapping of str to float
        For those that state none.

    Raises
    ------
    InputError
        For each key that `vary` does not know, impossible value, and variation that changes
        nothing; for more variations than anybody waits for.
    """
    if len(tables) > MOST_VARIATIONS:
        raise InputError(
            f"{len(tables)} variations", where="variations", remedy=f"keep {MOST_VARIATIONS}"
        )
    faults = Faults()
    found = [
        faults.attempt(_within, name, dict(table), arm, requirements)
        for name, table in tables.items()
    ]
    faults.tell()
    return tuple(variation for variation in found if variation is not None)


def _within(
    name: str, table: dict[str, Any], arm: Arm, requirements: Mapping[str, float | bool]
) -> Variation:
    try:
        return _read(name, table, arm, requirements)
    except SlewctlError as error:
        raise error.within(f"variations.{name}", ".") from error


def _read(
    name: str, table: dict[str, Any], arm: Arm, requirements: Mapping[str, float | bool]
) -> Variation:
    if name == NOMINAL or not name.isprintable() or not name.strip():
        raise InputError(
            f"{shown(name)} cannot name a variation",
            remedy=f"give a name in printable characters other than {NOMINAL!r}",
        )
    own = table.pop("requirements", None)
    if own is not None and not isinstance(own, Mapping):
        raise InputError(
            f"{shown(own)} is not allowed", where="requirements", remedy="give a table"
        )
    if not table:
        raise InputError("changes nothing", remedy=f"give at least one of {', '.join(KEYS)}")
    faults = Faults()
    for key, value in table.items():
        if key not in KEYS:
            faults.add([InputError("unknown key", where=key, remedy=partial(suggest, key, KEYS))])
        else:
            faults.attempt(_varied, arm, {key: value})
    varied = None if faults else faults.attempt(_varied, arm, table)
    limits = requirements if own is None else own
    for required, limit in limits.items():
        faults.attempt(check_limits, {required: limit})
    return Variation(name, faults.settled(varied), dict(limits))


def _varied(arm: Arm, table: Mapping[str, Any]) -> Arm:
    """Return an arm with some properties changed; refuse a single one at its key."""
    try:
        return vary(arm, **table)
    except InputError as error:
        if error.where.partition(".")[0] in KEYS:
            raise
        raise error.at("".join(table) if len(table) == 1 else "") from error
