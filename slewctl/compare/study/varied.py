"""The axis of a study that holds everything else that may vary of an arm: keys of `vary`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from slewctl.arm import Arm, vary
from slewctl.compare.arm_box import PROPERTIES
from slewctl.errors import InputError, SlewctlError, check_number, shown, suggest

Varied = tuple[tuple[str, float], ...]
"""Keys of `slewctl.vary` with their values, by name; none for the arm as it is."""

# These are what a setting says already.
_SET = ("hub_inertia", "hub_inertia_factor", "payload_mass", "payload_mass_factor",
        "damping_ratio", "damping_factor")  # fmt: skip
KEYS = tuple(name for name in PROPERTIES if name not in _SET)


def check_varied(given: object, where: str) -> Varied | None:
    """Return a change of the arm in a form that compares; None where there is no such axis."""
    if given is None:
        return None
    if isinstance(given, tuple):
        given = dict(given)
    if not isinstance(given, Mapping):
        raise InputError(
            f"{shown(given)} is no change of an arm",
            where=where,
            remedy="give a table, as in { actuator_delay = 0.002 }, or {} for the arm as it is",
        )
    for name in given:
        if name not in KEYS:
            raise InputError(
                f"{shown(name)} is varied by an axis of its own" if name in _SET else "unknown key",
                where=f"{where}.{name}",
                remedy="use hub_ratios, payload_ratios or damping_ratios"
                if name in _SET
                else suggest(str(name), KEYS),
            )
    return tuple(sorted((name, check_number(v, f"{where}.{name}")) for name, v in given.items()))


def check_on(arm: Arm, changes: Sequence[Varied | None], where: str) -> None:
    """Refuse what cannot be changed of an arm."""
    for place, change in enumerate(changes):
        try:
            vary(arm, **dict(change or ()))
        except SlewctlError as error:
            raise error.within(f"{where}.{place}", ".") from error


def words(change: Varied) -> str:
    """Return a change as a row tells it."""
    told = ", ".join(f"{name} = {value:g}".replace("e+", "e") for name, value in change)
    return told or "none"
