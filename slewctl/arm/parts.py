"""The arm and its parts: a beam clamped to a hub, with a payload at its tip."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from slewctl._types import Array
from slewctl.arm.beam import SAME_POINT, Beam, distinct
from slewctl.arm.damping import LAWS, DampingLaw, Drag
from slewctl.arm.magnitudes import check_size_or_zero
from slewctl.arm.masses import Bodies, LumpedMass
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
class Hub:
    """The turning hub that carries the beam.

    Parameters
    ----------
    inertia : float
        J_h about the axis, in kg·m², without the rotor that `Motor.rotor_inertia` gives.
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
    name: str = "arm"
    masses: Sequence[LumpedMass] = ()
    damping_modes: DampedModes | None = None

    def __post_init__(self) -> None:
        _check_part(self.beam, (Beam,), "beam")
        _check_part(self.hub, (Hub,), "hub")
        _check_part(self.payload, (Payload,), "payload")
        _check_part(self.damping, (*LAWS, type(None)), "damping")
        _check_part(self.motor, (Motor, type(None)), "motor")
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
        data.rigid_remainder(self.hub_inertia)
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
    def hub_inertia(self) -> float:
        """Inertia that turns with the hub, in kg·m²: the hub's own and the motor's rotor's."""
        return self.hub.inertia + (self.motor.reflected_inertia if self.motor else 0.0)

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
    for key in ("hub", "payload", "motor"):
        part = getattr(arm, key)
        table[key] = None if part is None else _kept(asdict(part))
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
