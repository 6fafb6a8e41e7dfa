"""The arm and its parts: a beam clamped to a hub, with a payload at its tip."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from slewctl._types import Array
from slewctl.arm.damping import KelvinVoigt, Rayleigh
from slewctl.arm.dynamics import Actuator, Sensor
from slewctl.arm.joint import Joint
from slewctl.arm.magnitudes import check_length, check_size_or_zero
from slewctl.arm.motor import Motor
from slewctl.arm.profiles import Profile, ProfileSpec, Stations, as_profile
from slewctl.errors import (
    InputError,
    check_damping_ratio,
    check_each,
    shown,
)
from slewctl.export import toml_text

# Stations nearer to each other, over the length, are one: rounding of what was written.
_SAME_POINT = 1e-12


@dataclass(frozen=True)
class Beam:
    """A slender beam in bending.

    Parameters
    ----------
    length : float
        L in m, measured from the clamp.
    mass_per_length : float, sequence of float, Stations or callable
        m̄(x) in kg/m; see `slewctl.arm.profiles.as_profile`.
    bending_stiffness : float, sequence of float, Stations or callable
        EI(x) in N·m².

    Raises
    ------
    InputError
        If the length or a profile is not positive, or a table does not cover the beam.

    Examples
    --------
    >>> import slewctl as sc
    >>> sc.Beam(1.0, [2.0, -1.0], sc.Stations([0, 0.5, 1], [40, 30, 10])).length
    1.0
    """

    length: float
    mass_per_length: ProfileSpec
    bending_stiffness: ProfileSpec

    def __post_init__(self) -> None:
        object.__setattr__(self, "length", check_length(self.length, "beam.length"))
        for name in ("mass_per_length", "bending_stiffness"):
            spec = getattr(self, name)
            if isinstance(spec, np.ndarray):
                spec = spec.tolist()
            object.__setattr__(self, name, tuple(spec) if isinstance(spec, list) else spec)
        # Built here, not when first asked for, so that a wrong profile is refused at once.
        _ = self.mass_profile, self.stiffness_profile

    @cached_property
    def mass_profile(self) -> Profile:
        """m̄ in kg/m as a function of x/L."""
        return as_profile(self.mass_per_length, self.length, "beam.mass_per_length")

    @cached_property
    def stiffness_profile(self) -> Profile:
        """EI in N·m² as a function of x/L."""
        return as_profile(self.bending_stiffness, self.length, "beam.bending_stiffness")

    @cached_property
    def breakpoints(self) -> tuple[float, ...]:
        """Inner points x/L where either profile has a kink or a step.

        Points that differ by rounding alone are one.
        """
        both = np.array(
            sorted({*self.mass_profile.breakpoints, *self.stiffness_profile.breakpoints})
        )
        apart = np.diff(both, prepend=0.0) > _SAME_POINT
        return tuple(float(point) for point in both[apart])


@dataclass(frozen=True)
class Hub:
    """The turning hub that carries the beam.

    Parameters
    ----------
    inertia : float
        J_h about the axis, in kg·m², without the rotor that `Motor` or `Joint` gives.
    radius : float
        r in m: the beam is clamped at this distance from the axis.
    friction : float
        Viscous friction c_h at the axis, in N·m·s/rad.

    Examples
    --------
    >>> import slewctl as sc
    >>> sc.Hub(inertia=0.2, radius=0.05)
    Hub(inertia=0.2, radius=0.05, friction=0.0)
    """

    inertia: float = 0.0
    radius: float = 0.0
    friction: float = 0.0

    def __post_init__(self) -> None:
        for name in ("inertia", "radius", "friction"):
            value = check_size_or_zero(getattr(self, name), f"hub.{name}")
            object.__setattr__(self, name, value)


@dataclass(frozen=True)
class Payload:
    """A rigid body at the tip.

    Parameters
    ----------
    mass : float
        m_t in kg.
    inertia : float
        J_t about its own centre, in kg·m².

    Examples
    --------
    >>> import slewctl as sc
    >>> sc.Payload(mass=0.1)
    Payload(mass=0.1, inertia=0.0)
    """

    mass: float = 0.0
    inertia: float = 0.0

    def __post_init__(self) -> None:
        for name in ("mass", "inertia"):
            value = check_size_or_zero(getattr(self, name), f"payload.{name}")
            object.__setattr__(self, name, value)


@dataclass(frozen=True)
class Arm:
    """A flexible arm turned by a torque at its hub.

    Modal damping ratios, a damping law and the hub's friction add up.

    Parameters
    ----------
    beam : Beam
    hub : Hub
    payload : Payload
    damping_ratio : float or sequence of float
        Damping ratio ζ of every flexible mode of the free arm, 0 <= ζ < 1; or of its first
        modes one by one, the last value holding for all that follow.
    damping : Rayleigh or KelvinVoigt, optional
        A damping law.
    motor : Motor, optional
        What turns the hub; without one only the torque is known.
    joint : Joint, optional
        An elastic joint between the rotor and the hub, which without one turn as one.
    actuator : Actuator, optional
        Lag, dead time and torque limit of the drive; without it commands act at once.
    sensors : mapping of str to Sensor
        Lag and dead time of measured signals by name; without them they are read at once.
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
    damping: Rayleigh | KelvinVoigt | None = None
    motor: Motor | None = None
    joint: Joint | None = None
    actuator: Actuator | None = None
    sensors: Mapping[str, Sensor] | tuple[tuple[str, Sensor], ...] = ()
    name: str = "arm"

    def __post_init__(self) -> None:
        _check_part(self.beam, (Beam,), "beam")
        _check_part(self.hub, (Hub,), "hub")
        _check_part(self.payload, (Payload,), "payload")
        _check_part(self.damping, (Rayleigh, KelvinVoigt, type(None)), "damping")
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

    def damping_ratios(self, modes: int) -> Array:
        """Return the damping ratio ζ of each of the first flexible modes, shape (modes,)."""
        ratio = self.damping_ratio
        given = (ratio,) if isinstance(ratio, float | int) else tuple(ratio)
        return np.array([given[min(k, len(given) - 1)] for k in range(modes)])

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
    beam = {key: _written(getattr(arm.beam, key), f"beam.{key}")
            for key in ("length", "mass_per_length", "bending_stiffness")}  # fmt: skip
    table: dict[str, Any] = {"name": arm.name, "damping_ratio": arm.damping_ratio or None}
    table["beam"] = beam
    for key in ("hub", "payload", "motor", "joint", "actuator"):
        part = getattr(arm, key)
        table[key] = None if part is None else _kept(asdict(part))
    kept = {signal: _kept(asdict(sensor)) for signal, sensor in dict(arm.sensors).items()}
    table["sensors"] = {signal: values for signal, values in kept.items() if values} or None
    if arm.damping is not None:
        kind = "rayleigh" if isinstance(arm.damping, Rayleigh) else "kelvin-voigt"
        table["damping"] = {"kind": kind, **asdict(arm.damping)}
    return table


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


__all__ = ["Arm", "Beam", "Hub", "Payload", "Stations"]
