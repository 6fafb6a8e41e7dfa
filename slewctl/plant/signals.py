"""The signals of an arm by name: what can be measured, watched or penalised.

Every output is a row of [θ, q] taken of the displacements, the rates or the accelerations.
Beside the fixed names there are sensors at a station on the beam, such as ``moment@50mm``:
the station is a whole number of millimetres or micrometres (``um``) from the clamp, since
python-control allows no decimal point in the name of a signal.  At an arm from modal data
there are places with names instead, such as ``deflection@tip``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from slewctl._types import Array
from slewctl.arm import Beam, ModalData
from slewctl.errors import InputError, check_choice, shown
from slewctl.model import Model
from slewctl.plant.places import FIXED, Seen, check_fixed, place_row, seen_at

TORQUE = "torque"
VOLTAGE = "voltage"
ACTUATORS = (TORQUE, VOLTAGE)

# A station this close to a step of the beam (a fraction of its length) is on the step.
_ON_A_STEP = 1e-9


@dataclass(frozen=True)
class Signal:
    """An output: its unit, and the row of [θ, q] and its time derivative that give it.

    Attributes
    ----------
    unit : str
    row : callable
        From a `Model` to the row, shape (n+1,).
    of : {"displacement", "rate", "acceleration"}
    station : float or None
        Where on the beam a sensor named with a station sits, in m from the clamp.
    """

    unit: str
    row: Callable[[Model], Array]
    of: Literal["displacement", "rate", "acceleration"] = "displacement"
    station: float | None = None


def _theta(model: Model) -> Array:
    return model.turning


def _theta_motor(model: Model) -> Array:
    """The rotor's angle: that of the hub too, where no elastic joint is between them."""
    return np.eye(model.n + 1)[0]


def _displacement(model: Model, x: float) -> Array:
    """(r + x)θ + Φ(x) q: the displacement along the arc."""
    return model.displacement(np.array([x]))[0]


def _deflection(model: Model, x: float) -> Array:
    shapes = model.basis.evaluate(np.array([x / model.arm.beam.length]))[0]
    return np.concatenate([[0.0], shapes])


def _moment(model: Model, x: float) -> Array:
    """EI(x) Φ''(x) q: the bending moment by which a strain gauge at x is calibrated.

    At a step of EI it is that just outboard of the step.  With Kelvin–Voigt damping the
    beam carries EI η v̇'' beside it, which no strain shows.  An arm's own modes bend less at
    the clamp the less inertia the hub has: without any, the moment near the clamp converges
    only like 1/n in their number.
    """
    if x == 0:
        _refuse_blind_root(model)
    beam = model.arm.beam
    xi = x / beam.length
    # The profile and the shapes could round to different sides of the same step.
    steps = np.array([*model.arm.breakpoints, *model.basis.breakpoints])
    for step in steps[np.abs(steps - xi) <= _ON_A_STEP]:
        xi = step + _ON_A_STEP
    at = np.array([xi])
    stiffness = beam.stiffness_profile(at)[0] / beam.length**2
    return np.concatenate([[0.0], stiffness * model.basis.evaluate(at, 2)[0]])


def _refuse_blind_root(model: Model) -> None:
    """Refuse the root moment of a hub without inertia when no function bends at the root."""
    curvature = model.basis.evaluate(np.linspace(0.0, 1.0, 33), 2)
    seen = np.abs(curvature[0]).max() > 1e-9 * np.abs(curvature).max()
    if model.arm.hub_inertia == 0 and not seen:
        raise InputError(
            f"without hub inertia the root moment is minus the torque, but no function of the "
            f"{model.basis.name} basis bends at the root",
            where="root_moment",
            remedy="use the torque, give the hub its inertia, or take another basis",
        )


def _tip(model: Model) -> Array:
    return _displacement(model, model.arm.beam.length)


def _tip_deflection(model: Model) -> Array:
    return _deflection(model, model.arm.beam.length)


def _root_moment(model: Model) -> Array:
    return _moment(model, 0.0)


def _fixed(name: str, of_a_beam: Callable[[Model], Array]) -> Callable[[Model], Array]:
    """Return the row of a signal that modal data tell of at a place of theirs."""

    def row(model: Model) -> Array:
        beam = model.arm.beam
        if isinstance(beam, ModalData):
            return place_row(model, beam, *FIXED[name])
        return of_a_beam(model)

    return row


SIGNALS: dict[str, Signal] = {
    "theta": Signal("rad", _theta),
    "theta_dot": Signal("rad/s", _theta, "rate"),
    "theta_motor": Signal("rad", _theta_motor),
    "theta_motor_dot": Signal("rad/s", _theta_motor, "rate"),
    "tip": Signal("m", _fixed("tip", _tip)),
    "tip_dot": Signal("m/s", _fixed("tip_dot", _tip), "rate"),
    "tip_acceleration": Signal("m/s²", _fixed("tip_acceleration", _tip), "acceleration"),
    "tip_deflection": Signal("m", _fixed("tip_deflection", _tip_deflection)),
    "root_moment": Signal("N·m", _fixed("root_moment", _root_moment)),
}


@dataclass(frozen=True)
class _Sensor:
    """A kind of sensor that can sit anywhere on the beam."""

    unit: str
    row: Callable[[Model, float], Array]  # of the model and the station in m
    seen: Seen
    of: Literal["displacement", "acceleration"] = "displacement"

    def at_place(self, name: str) -> Signal:
        """Return the signal of this sensor at a place of modal data."""

        def row(model: Model) -> Array:
            beam = model.arm.beam
            if not isinstance(beam, ModalData):
                raise _no_station(f"{self.seen}@{name}", "outputs")
            return place_row(model, beam, name, self.seen)

        return Signal(self.unit, row, self.of)


STATION_SENSORS: dict[str, _Sensor] = {
    "moment": _Sensor("N·m", _moment, "moment"),
    "deflection": _Sensor("m", _deflection, "deflection"),
    "acceleration": _Sensor("m/s²", _displacement, "displacement", "acceleration"),
}
_PLACE_NAME = re.compile(r"(\w+)@([A-Za-z]\w*)", re.ASCII)
_STATION_NAME = re.compile(r"(\w+)@(0|[1-9][0-9]{0,8})(mm|um)", re.ASCII)
_UNITS_PER_METRE = {"mm": 1000, "um": 1_000_000}


def signal(name: str, where: str = "outputs", beam: Beam | None = None) -> Signal:
    """Return the output called `name`.

    Parameters
    ----------
    name : str
        A key of `SIGNALS`, or ``moment@…`` (N·m), ``deflection@…`` (m) or
        ``acceleration@…`` (m/s², along the arc) with a station such as ``50mm`` or
        ``12700um``, measured from the clamp; or with the name of a place of modal data.
    where : str
        For the error: what named it.
    beam : Beam, optional
        Given, a station beyond its tip is refused.

    Returns
    -------
    Signal

    Raises
    ------
    InputError
        If there is no such output, with the nearest name.

    Examples
    --------
    >>> from slewctl.plant import signal
    >>> signal("moment@50mm").unit
    'N·m'
    """
    parts = _STATION_NAME.fullmatch(name) if isinstance(name, str) else None
    if parts is None:
        place = _of_place(name, where, beam)
        if place is not None:
            return place
        _refuse_station(name, where)
        check_choice(name, SIGNALS, where)
        check_fixed(beam, name, where)
        return SIGNALS[name]
    kind, count, unit = parts.groups()
    sensor = STATION_SENSORS[check_choice(kind, STATION_SENSORS, where)]
    x = int(count) / _UNITS_PER_METRE[unit]
    if isinstance(beam, ModalData):
        raise InputError(
            f"{name} is at a station, and the arm is known by its modes alone",
            where=where,
            remedy="name a place of its data, as in 'deflection@tip'",
        )
    if beam is not None and x > beam.length:
        if x > beam.length * (1 + _ON_A_STEP):
            raise InputError(
                f"{name} is beyond the tip of a beam of {beam.length:g} m",
                where=where,
                remedy=f"give a station from 0mm to {_whole(beam.length)}",
            )
        x = beam.length
    return Signal(sensor.unit, lambda model: sensor.row(model, x), sensor.of, x)


def _of_place(name: object, where: str, beam: Beam | None) -> Signal | None:
    """Return the signal at a place of modal data, None where the name is of something else."""
    parts = _PLACE_NAME.fullmatch(name) if isinstance(name, str) else None
    if parts is None or (beam is not None and not isinstance(beam, ModalData)):
        return None
    kind, place = parts.groups()
    sensor = STATION_SENSORS[check_choice(kind, STATION_SENSORS, where)]
    if beam is not None:
        seen_at(beam, place, sensor.seen, where)
    return sensor.at_place(place)


def _refuse_station(name: object, where: str) -> None:
    """Refuse what is meant as a sensor at a station but is not spelt as one."""
    kind = str(name).partition("@")[0]
    if "@" in str(name) or kind in STATION_SENSORS:
        raise _no_station(name, where)


def _no_station(name: object, where: str) -> InputError:
    kind = str(name).partition("@")[0]
    return InputError(
        f"{shown(name)} names no station in whole millimetres (mm) or micrometres (um)",
        where=where,
        remedy=f"write it as in '{kind if kind in STATION_SENSORS else 'moment'}@50mm'",
    )


def _whole(length: float) -> str:
    """Return the last whole millimetre, or else micrometre, on a beam."""
    for unit, count in _UNITS_PER_METRE.items():
        if length * count >= 1:
            return f"{int(length * count * (1 + _ON_A_STEP))}{unit}"
    return "0mm"


def check_signals(
    given: Iterable[str] | str, where: str, beam: Beam | None = None
) -> tuple[str, ...]:
    """Return output names as a tuple; refuse unknown, repeated or no names.

    Parameters
    ----------
    given : str or iterable of str
    where : str
        For the error: what named them.
    beam : Beam, optional
        Given, a station beyond its tip is refused.

    Raises
    ------
    InputError
        Naming the output that is wrong and the nearest known one.
    """
    if not isinstance(given, Iterable):
        raise InputError(
            f"{shown(given)} is not a list of names", where=where, remedy="give one, as in ['tip']"
        )
    names = (given,) if isinstance(given, str) else tuple(given)
    for name in names:
        signal(name, where, beam)
    if not names or len(set(names)) != len(names):
        raise InputError(
            f"{list(names)} names no output or one twice",
            where=where,
            remedy="give each output once, for example 'theta', 'tip'",
        )
    return names
