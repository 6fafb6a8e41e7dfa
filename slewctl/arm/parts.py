"""The arm and its parts: a beam clamped to a hub, with a payload at its tip."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from slewctl._types import Array
from slewctl.arm.beam import SAME_POINT, Beam, distinct
from slewctl.arm.damping import LAWS, DampingLaw, Drag
from slewctl.arm.dynamics import Actuator, Sensor
from slewctl.arm.hub import Hub
from slewctl.arm.joint import Joint
from slewctl.arm.masses import Bodies, LumpedMass, Payload
from slewctl.arm.modal_data import ModalData
from slewctl.arm.motor import Motor
from slewctl.arm.profiles import Stations
from slewctl.errors import (
    InputError,
    check_choice,
    check_damping_ratio,
    check_each,
    shown,
)
from slewctl.export import toml_text

DampedModes = Literal["free", "hub-locked"]
DAMPED_MODES: tuple[DampedModes, ...] = ("free", "hub-locked")


@dataclass(frozen=True)
class Arm:
    """A flexible arm turned by a torque at its hub.

    Modal damping ratios, a damping law and the hub's friction add up.

    Parameters
    ----------
    beam : Beam or ModalData
    hub : Hub
    payload : Payload
    damping_ratio : float or sequence of float
        Damping ratio ζ of every flexible mode, 0 <= ζ < 1; or of the first modes one by one,
        the last value holding for all that follow.
    damping_modes : {"free", "hub-locked"}, optional
        Whose ratios they are: those of the arm with its hub free to turn, or of the arm with
        its hub held, as a data sheet or a test on a clamp gives them.  A ratio of the held arm
        damps no turn of the hub; the modes of the free arm then have other, larger ones.  By
        default those of the free arm, and with modal data those of the held one.
    damping : Rayleigh, KelvinVoigt or Drag, optional
        A damping law.
    motor : Motor, optional
        What turns the hub; without one only the torque is known.
    joint : Joint, optional
        An elastic joint between the rotor and the hub, which without one turn as one.
    actuator : Actuator, optional
        Lag, dead time and torque limit of the drive; without it commands act at once.
    sensors : mapping of str to Sensor
        Lag and dead time of measured signals by name; without them they are read at once.
    masses : sequence of LumpedMass
        Fixed to the beam along its length, beside the payload at its tip.
    name : str
        For tables and reports.

    Examples
    --------
    >>> import slewctl as sc
    >>> beam = sc.Beam(length=1.0, mass_per_length=2.0, bending_stiffness=40.0)
    >>> arm = sc.Arm(beam, sc.Hub(inertia=0.2), sc.Payload(mass=0.1), damping_ratio=0.01)
    >>> sc.truth(arm, 2).n
    2
    """

    beam: Beam
    hub: Hub = field(default_factory=Hub)
    payload: Payload = field(default_factory=Payload)
    damping_ratio: float | Sequence[float] = 0.0
    damping: DampingLaw | None = None
    motor: Motor | None = None
    joint: Joint | None = None
    actuator: Actuator | None = None
    sensors: Mapping[str, Sensor] | tuple[tuple[str, Sensor], ...] = ()
    name: str = "arm"
    masses: Sequence[LumpedMass] = ()
    damping_modes: DampedModes | None = None

    def __post_init__(self) -> None:
        _check_part(self.beam, (Beam,), "beam")
        _check_part(self.hub, (Hub,), "hub")
        _check_part(self.payload, (Payload,), "payload")
        _check_part(self.damping, (*LAWS, type(None)), "damping")
        _check_part(self.motor, (Motor, type(None)), "motor")
        _check_part(self.joint, (Joint, type(None)), "joint")
        _check_part(self.actuator, (Actuator, type(None)), "actuator")
        if not isinstance(self.sensors, Mapping | tuple):
            raise InputError(
                f"{shown(self.sensors)} is not a mapping",
                where="arm.sensors",
                remedy="give one, as in {'theta': slewctl.Sensor(lag=0.001)}",
            )
        sensors = dict(self.sensors)
        for signal, sensor in sensors.items():
            _check_part(sensor, (Sensor,), f"sensors.{signal}")
        object.__setattr__(self, "sensors", tuple(sorted(sensors.items())))
        if self.joint is not None and self.rotor_inertia == 0:
            raise InputError(
                "a rotor without inertia",
                where="joint.rotor_inertia",
                remedy="give it, on the output side of the gear, or motor.rotor_inertia",
            )
        if not isinstance(self.name, str):
            raise InputError(
                f"{shown(self.name)} is not text", where="arm.name", remedy="give a str"
            )
        object.__setattr__(self, "damping_ratio", _damping_ratio(self.damping_ratio))
        modal = isinstance(self.beam, ModalData)
        if self.damping_modes is None:
            object.__setattr__(self, "damping_modes", "hub-locked" if modal else "free")
        check_choice(self.damping_modes, DAMPED_MODES, "arm.damping_modes")
        object.__setattr__(self, "masses", _masses(self.masses, self.beam))
        if isinstance(self.beam, ModalData):
            self._refuse_beside(self.beam)

    def _refuse_beside(self, data: ModalData) -> None:
        """Refuse what modal data contain already, or cannot have."""
        data.rigid_remainder(self.hub.inertia if self.joint else self.hub_inertia)
        wrong = {
            "payload": self.payload != Payload(),
            "hub.radius": self.hub.radius != 0,
            "damping": isinstance(self.damping, Drag),
        }
        for name, given in wrong.items():
            if given:
                raise InputError(
                    "modal data are of the whole structure, with all that is fixed to it",
                    where=f"arm.{name}",
                    remedy="leave it out, and give the data of the structure that has it",
                )

    @property
    def reach(self) -> float:
        """Distance of the tip from the axis, in m."""
        if isinstance(self.beam, ModalData):
            return self.beam.lever("tip")
        return self.hub.radius + self.beam.length

    @property
    def given_modes(self) -> int | None:
        """How many flexible modes modal data and an elastic joint give together; None of a beam,
        which has as many as anybody asks for."""
        if not isinstance(self.beam, ModalData):
            return None
        return self.beam.modes + (self.joint is not None)

    @cached_property
    def bodies(self) -> Bodies:
        """The payload and the masses along the beam."""
        tip, length = self.payload, self.beam.length
        each = [LumpedMass(length, tip.mass, tip.inertia), *self.masses]
        return Bodies(
            np.array([min(body.x / length, 1.0) for body in each]),
            np.array([body.mass for body in each]),
            np.array([body.inertia for body in each]),
        )

    @cached_property
    def breakpoints(self) -> tuple[float, ...]:
        """Inner points x/L where a profile has a kink or a step, or a mass is fixed."""
        return distinct((*self.beam.breakpoints, *(float(xi) for xi in self.bodies.xi)))

    @property
    def drive(self) -> Actuator:
        """The actuator; without one given, one that acts at once."""
        return self.actuator or Actuator()

    def sensor(self, signal: str) -> Sensor:
        """Return the sensor of a signal; without one given, one that reads at once."""
        return dict(self.sensors).get(signal, Sensor())

    @property
    def rotor_inertia(self) -> float:
        """Inertia J_m of the rotor on the output side, in kg·m²: the motor's and the joint's."""
        motor = self.motor.reflected_inertia if self.motor else 0.0
        return motor + (self.joint.rotor_inertia if self.joint else 0.0)

    @property
    def hub_inertia(self) -> float:
        """Inertia of hub and rotor in kg·m², which turn as one or with a joint between them."""
        return self.hub.inertia + self.rotor_inertia

    def exceeded(self, peak_torque: float, peak_voltage: float | None = None) -> tuple[str, ...]:
        """Return which limits of motor and actuator peaks exceed, in words.

        Parameters
        ----------
        peak_torque, peak_voltage : float
            Of |torque| in N·m and of |voltage| in V, where there is a motor.

        Examples
        --------
        >>> from slewctl.arm import Actuator, Arm, Beam
        >>> Arm(Beam(1.0, 2.0, 40.0), actuator=Actuator(torque_limit=2.0)).exceeded(2.5)
        ('2.5 N·m, the actuator has 2',)
        """
        motor = self.motor
        limits: list[tuple[float | None, float | None, str]] = [
            (peak_torque, self.drive.torque_limit, "N·m, the actuator"),
        ]
        if motor is not None:
            limits.append((peak_torque, motor.torque_limit, "N·m, the motor"))
            limits.append((peak_voltage, motor.voltage_limit, "V, the motor"))
        return tuple(
            f"{peak:.3g} {whose} has {limit:.3g}"
            for peak, limit, whose in limits
            if peak is not None and limit is not None and peak > limit
        )

    def command_limit(self, actuator: str) -> float:
        """Return the largest command that motor or actuator can do; infinite if none is known.

        Parameters
        ----------
        actuator : {"torque", "voltage"}

        Returns
        -------
        float
            In N·m or V.

        Examples
        --------
        >>> from slewctl.arm import Actuator, Arm, Beam
        >>> Arm(Beam(1.0, 2.0, 40.0), actuator=Actuator(torque_limit=2.0)).command_limit("torque")
        2.0
        """
        motor = self.motor
        limits = [motor.voltage_limit if motor else None]
        if actuator == "torque":
            limits = [self.drive.torque_limit, motor.torque_limit if motor else None]
        return min((limit for limit in limits if limit is not None), default=math.inf)

    def damping_ratios(self, modes: int) -> Array:
        """Return the damping ratio ζ of each of the first flexible modes, shape (modes,)."""
        ratio = self.damping_ratio
        given = (ratio,) if isinstance(ratio, float | int) else tuple(ratio)
        return np.array([given[min(k, len(given) - 1)] for k in range(modes)])

    @property
    def damping_told(self) -> str:
        """Whose damping ratios are given, and which hold for the modes beyond them."""
        ratio, modes = self.damping_ratio, self.damping_modes
        given = ratio if isinstance(ratio, Sequence) else (ratio,)
        if len(given) == 1:
            return f"ζ = {given[0]:g} of every {modes} mode"
        first = ", ".join(f"{value:g}" for value in given)
        return f"ζ = {first} of the first {modes} modes, {given[-1]:g} of all beyond"

    def to_toml(self) -> str:
        """Return the arm as the ``[arm]`` of a design file, or a file of its own.

        Raises
        ------
        InputError
            If a profile is a function, which a file cannot hold.

        Examples
        --------
        >>> from slewctl.arm import Arm, Beam, Hub
        >>> print(Arm(Beam(1.0, 2.0, 40.0), hub=Hub(inertia=0.2), damping_ratio=0.005).to_toml())
        [arm]
        name = "arm"
        damping_ratio = 0.005
        <BLANKLINE>
        [arm.beam]
        length = 1.0
        mass_per_length = 2.0
        bending_stiffness = 40.0
        <BLANKLINE>
        [arm.hub]
        inertia = 0.2
        <BLANKLINE>
        """
        return toml_text({"arm": arm_table(self)})


def arm_table(arm: Arm) -> dict[str, Any]:
    """Return an arm as the ``[arm]`` table of a design file; what is zero is left out."""
    flexible = _flexible_table(arm.beam)
    table: dict[str, Any] = {"name": arm.name, "damping_ratio": arm.damping_ratio or None}
    default = "hub-locked" if "modal_data" in flexible else "free"
    if arm.damping_modes != default:
        table |= {"damping_ratio": arm.damping_ratio, "damping_modes": arm.damping_modes}
    table |= flexible
    table["masses"] = [{"x": mass.x, **(_kept(asdict(mass)) or {})} for mass in arm.masses] or None
    for key in ("hub", "payload", "motor", "joint", "actuator"):
        part = getattr(arm, key)
        table[key] = None if part is None else _kept(asdict(part))
    kept = {signal: _kept(asdict(sensor)) for signal, sensor in dict(arm.sensors).items()}
    table["sensors"] = {signal: values for signal, values in kept.items() if values} or None
    if arm.damping is not None:
        table["damping"] = {"kind": arm.damping.kind, **asdict(arm.damping)}
    return table


def _flexible_table(beam: Beam) -> dict[str, Any]:
    """Return ``[arm.beam]`` or ``[arm.modal_data]``."""
    if isinstance(beam, ModalData):
        return {"modal_data": beam.table()}
    keys = ("length", "mass_per_length", "bending_stiffness")
    return {"beam": {key: _written(getattr(beam, key), f"beam.{key}") for key in keys}}


def _kept(values: Mapping[str, float | None]) -> dict[str, float] | None:
    return {key: value for key, value in values.items() if value} or None


def _written(spec: Any, where: str) -> Any:
    if isinstance(spec, Stations):
        return {"x": spec.x, "values": spec.values}
    if callable(spec):
        raise InputError(
            "a function cannot be written to a file",
            where=where,
            remedy="tabulate it as slewctl.Stations(x, values)",
        )
    return spec


def _masses(given: object, beam: Beam) -> tuple[LumpedMass, ...]:
    """Return the masses along a beam as a tuple."""
    if not isinstance(given, Sequence):
        raise InputError(
            f"{shown(given)} is not a list of masses",
            where="arm.masses",
            remedy="give a list of slewctl.LumpedMass",
        )
    for place, mass in enumerate(given):
        _check_part(mass, (LumpedMass,), f"masses.{place}")
        if mass.x > beam.length * (1 + SAME_POINT):
            raise InputError(
                f"{mass.x:g} m is beyond the tip of a beam of {beam.length:g} m",
                where=f"arm.masses.{place}.x",
                remedy="give a place on the beam, in m from the clamp",
            )
    return tuple(given)


def _check_part(part: object, kinds: tuple[type, ...], name: str) -> None:
    if not isinstance(part, kinds):
        wanted = [kind.__name__ for kind in kinds if kind is not type(None)]
        raise InputError(
            f"{shown(part)} is not a {' or '.join(wanted)}",
            where=f"arm.{name}",
            remedy=f"give a {' or '.join(f'slewctl.{kind}' for kind in wanted)}",
        )


def _damping_ratio(given: object) -> float | tuple[float, ...]:
    """Return one ratio as a float, several as a tuple."""
    if isinstance(given, np.ndarray):
        given = given.tolist()
    if isinstance(given, str) or not isinstance(given, Sequence):
        return check_damping_ratio(given, "arm.damping_ratio")
    ratios = check_each(given, "arm.damping_ratio", check_damping_ratio)
    if not ratios:
        raise InputError("no ratio", where="arm.damping_ratio", remedy="give at least one")
    return ratios


__all__ = ["Arm", "Beam", "Hub", "LumpedMass", "Payload", "Stations"]
