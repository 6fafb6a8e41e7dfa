"""Names of measured columns: what is measured, and after an underscore its unit.

``theta_deg`` is the hub angle in degrees; without a unit a signal is in the unit that the
toolbox has for it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

from slewctl.errors import InputError, check_positive, shown
from slewctl.plant.signals import ACTUATORS, SIGNALS, TORQUE, signal

# Of one unit in the toolbox's own.
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
FREQUENCIES = {"hz": 1.0, "rad_s": 1 / (2 * math.pi)}
_ANGLES = {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180}
_LENGTHS = {"m": 1.0, "mm": 1e-3, "um": 1e-6}
_BY_UNIT = {
    "rad": _ANGLES,
    "m": _LENGTHS,
    "N·m": {"nm": 1.0, "mnm": 1e-3},
    "V": {"v": 1.0, "mv": 1e-3},
    "rad/s": {"rad_s": 1.0, "deg_s": math.pi / 180, "rpm": math.pi / 30},
    "m/s": {"m_s": 1.0, "mm_s": 1e-3},
    "m/s²": {"m_s2": 1.0, "g": 9.80665},
}
COUNTS = "counts"


class Named(NamedTuple):
    """What a column's name says.

    Attributes
    ----------
    signal : str
    factor : float
        From the column's unit to the signal's own.
    unit : str
        As written; empty for the signal's own.
    """

    signal: str
    factor: float
    unit: str


def unit_of(name: str) -> str:
    """Return the unit that the toolbox has for an actuator or a sensor."""
    if name in ACTUATORS:
        return "N·m" if name == TORQUE else "V"
    return signal(name).unit


def named(name: str, counts_per_turn: float | None = None) -> Named | None:
    """Return what a column's name says; None if it names no signal of an arm.

    Parameters
    ----------
    name : str
        Such as ``voltage``, ``theta``, ``theta_deg``, ``theta_counts`` or ``tip_mm``.
    counts_per_turn : float, optional
        Of the encoder, after quadrature, for ``_counts``.

    Raises
    ------
    InputError
        For counts without their number per turn.
    """
    for known in sorted((*ACTUATORS, *SIGNALS, *_stations(name)), key=len, reverse=True):
        if name == known:
            return Named(known, 1.0, "")
        if not name.startswith(f"{known}_"):
            continue
        unit = name.removeprefix(f"{known}_").lower()
        own = unit_of(known)
        if unit == COUNTS and own == "rad":
            return Named(known, 2 * math.pi / _counts(counts_per_turn, name), unit)
        if unit in _BY_UNIT.get(own, {}):
            return Named(known, _BY_UNIT[own][unit], unit)
    return None


def known_units(name: str) -> str:
    """Return the names under which a signal may stand, for a message."""
    units: Iterable[str] = _BY_UNIT.get(unit_of(name), {})
    return ", ".join([name, *(f"{name}_{unit}" for unit in units)])


def _stations(name: str) -> tuple[str, ...]:
    """Return the sensor at a station that a name begins with."""
    if "@" not in name:
        return ()
    return (name.split("_")[0],)


def _counts(given: float | None, name: str) -> float:
    if given is None:
        raise InputError(
            f"{shown(name)} needs the encoder's counts per turn",
            where="counts_per_turn",
            remedy="give counts_per_turn, after quadrature, such as 2048",
        )
    return check_positive(given, "counts_per_turn")
