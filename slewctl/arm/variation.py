"""The same arm with another payload, hub, beam or damping: what uncertainty is made of."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from slewctl._types import Array
from slewctl.arm.beam import Beam
from slewctl.arm.damping import DampingLaw
from slewctl.arm.dynamics import Actuator, Sensor
from slewctl.arm.joint import Joint
from slewctl.arm.masses import LumpedMass
from slewctl.arm.modal_data import ModalData
from slewctl.arm.parts import Arm
from slewctl.arm.profiles import ProfileSpec, Stations
from slewctl.errors import (
    InputError,
    check_damping_ratio,
    check_nonnegative,
    check_positive,
    shown,
)


@dataclass(frozen=True)
class _Scaled:
    """A function of x times a factor; equal to another if both are, so that arms compare."""

    function: Callable[[Array], Array]
    factor: float

    def __call__(self, x: Array) -> Array:
        return np.asarray(self.factor * np.asarray(self.function(x)))


def vary(
    arm: Arm,
    *,
    payload_mass: float | None = None,
    payload_inertia: float | None = None,
    hub_inertia: float | None = None,
    hub_friction: float | None = None,
    hub_radius: float | None = None,
    damping_ratio: float | Sequence[float] | None = None,
    payload_mass_factor: float | None = None,
    hub_inertia_factor: float | None = None,
    stiffness_factor: float | None = None,
    mass_factor: float | None = None,
    lumped_mass_factor: float | None = None,
    frequency_factor: float | None = None,
    coupling_factor: float | None = None,
    inertia_factor: float | None = None,
    damping_factor: float | None = None,
    joint_stiffness: float | None = None,
    joint_damping: float | None = None,
    joint_rotor_inertia: float | None = None,
    joint_rotor_friction: float | None = None,
    joint_stiffness_factor: float | None = None,
    actuator_lag: float | None = None,
    actuator_delay: float | None = None,
    sensor_lag: float | None = None,
    sensor_delay: float | None = None,
) -> Arm:
    """Return `arm` with some of its properties changed and everything else kept.

    Parameters
    ----------
    arm : Arm
    payload_mass, payload_inertia : float, optional
        New values in kg and kg·m².
    hub_inertia, hub_friction : float, optional
        New values in kg·m² (without the motor's rotor) and N·m·s/rad.
    hub_radius : float, optional
        New value in m.
    damping_ratio : float or sequence of float, optional
        New modal damping ratios, as `Arm` has them.
    payload_mass_factor, hub_inertia_factor : float, optional
        Times the present payload mass, and the hub's present inertia without the rotor.
        The payload's own inertia stays.
    stiffness_factor, mass_factor : float, optional
        Times EI and m̄ all along the beam, whatever kind of profile they are.
    lumped_mass_factor : float, optional
        Times the mass and the inertia of every lumped mass on the beam.
    frequency_factor : float, optional
        Times the frequencies with the hub held: EI times its square.
    coupling_factor, inertia_factor : float, optional
        Times the couplings and the inertia of `ModalData`, for an arm that is made of them.
    damping_factor : float, optional
        Times the modal damping ratios and the coefficients of the damping law; the hub's
        friction has its own parameter.
    joint_stiffness, joint_damping : float, optional
        New values of an elastic joint, in N·m/rad and N·m·s/rad.
    joint_rotor_inertia, joint_rotor_friction : float, optional
        New values of its rotor, in kg·m² (beside the motor's own) and N·m·s/rad.
    joint_stiffness_factor : float, optional
        Times its present stiffness.
    actuator_lag, actuator_delay : float, optional
        New time constant and dead time of the drive, in s; an arm without an actuator gets one.
    sensor_lag, sensor_delay : float, optional
        New time constant and dead time of each of the arm's sensors, in s.

    Returns
    -------
    Arm

    Raises
    ------
    InputError
        Naming the parameter: for a value that is not a number or negative, a factor that is
        not positive or multiplies nothing, a damping ratio that would reach 1, or a value
        and a factor for the same property.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> heavy = sc.vary(arm, payload_mass=0.1, stiffness_factor=0.9)
    >>> heavy.payload.mass, arm.payload.mass
    (0.1, 0.0)
    """
    if not isinstance(arm, Arm):
        raise InputError(f"{shown(arm)} is not an Arm", where="vary", remedy="give a slewctl.Arm")
    if damping_ratio is not None:
        arm = replace(arm, damping_ratio=_ratios(damping_ratio, damping_factor))
    hub, payload = arm.hub, arm.payload
    if isinstance(arm.beam, ModalData):
        _refuse_payload({"payload_mass": payload_mass, "payload_inertia": payload_inertia})
    ratio, law = _damping(arm, _factor(damping_factor, "damping_factor"))
    return replace(
        arm,
        beam=_beam(
            arm.beam,
            mass=_factor(mass_factor, "mass_factor"),
            stiffness=_factor(stiffness_factor, "stiffness_factor"),
            frequency=_factor(frequency_factor, "frequency_factor"),
            coupling=_factor(coupling_factor, "coupling_factor"),
            inertia=_factor(inertia_factor, "inertia_factor"),
        ),
        hub=replace(
            hub,
            inertia=_changed(hub.inertia, hub_inertia, hub_inertia_factor, "hub_inertia"),
            friction=_changed(hub.friction, hub_friction, None, "hub_friction"),
            radius=_changed(hub.radius, hub_radius, None, "hub_radius"),
        ),
        payload=replace(
            payload,
            mass=_changed(payload.mass, payload_mass, payload_mass_factor, "payload_mass"),
            inertia=_changed(payload.inertia, payload_inertia, None, "payload_inertia"),
        ),
        masses=_masses(arm, lumped_mass_factor),
        damping_ratio=ratio,
        damping=law,
        joint=_joint(
            arm.joint,
            joint_stiffness_factor,
            stiffness=joint_stiffness,
            damping=joint_damping,
            rotor_inertia=joint_rotor_inertia,
            rotor_friction=joint_rotor_friction,
        ),
        actuator=_actuator(arm, {"lag": actuator_lag, "delay": actuator_delay}),
        sensors=_sensors(arm, {"lag": sensor_lag, "delay": sensor_delay}),
    )


def _joint(joint: Joint | None, factor: float | None, **values: float | None) -> Joint | None:
    """Return the joint with new values and its stiffness times the factor."""
    if joint is None:
        for name, value in {**values, "stiffness_factor": factor}.items():
            if value is not None:
                raise InputError(
                    "the arm has no elastic joint",
                    where=f"joint_{name}",
                    remedy="give it one, a slewctl.Joint",
                )
        return None
    factors = {"stiffness": factor}
    found = {
        name: _changed(getattr(joint, name), value, factors.get(name), f"joint_{name}")
        for name, value in values.items()
    }
    check_positive(found["stiffness"], "joint_stiffness")
    return replace(joint, **found)


def _actuator(arm: Arm, values: Mapping[str, float | None]) -> Actuator | None:
    given = _given("actuator", values)
    return replace(arm.drive, **given) if given else arm.actuator


def _sensors(arm: Arm, values: Mapping[str, float | None]) -> Mapping[str, Sensor]:
    given = _given("sensor", values)
    if given and not arm.sensors:
        raise InputError(
            "the arm has no sensor to change",
            where=f"sensor_{next(iter(given))}",
            remedy="give the arm its sensors, as in sensors={'theta': slewctl.Sensor()}",
        )
    return {name: replace(sensor, **given) for name, sensor in dict(arm.sensors).items()}


def _given(part: str, values: Mapping[str, float | None]) -> dict[str, float]:
    """Return those values that are not None."""
    return {
        name: check_nonnegative(value, f"{part}_{name}")
        for name, value in values.items()
        if value is not None
    }


def _factor(value: float | None, name: str) -> float:
    return 1.0 if value is None else check_positive(value, name)


def _changed(present: float, value: float | None, factor: float | None, name: str) -> float:
    """Return the new value, or the present one times the factor."""
    if value is not None and factor is not None:
        raise InputError(
            f"both {name} and {name}_factor are given",
            where=f"{name}_factor",
            remedy="keep one of them",
        )
    if value is not None:
        return check_nonnegative(value, name)
    scale = _factor(factor, f"{name}_factor")
    if factor is not None and present == 0:
        raise InputError(
            f"the arm has no {name.replace('_', ' ')} to multiply",
            where=f"{name}_factor",
            remedy=f"give {name} itself, in SI units",
        )
    return present * scale


def _ratios(given: object, factor: float | None) -> float | tuple[float, ...]:
    """Return new damping ratios; refuse a factor beside them."""
    if factor is not None:
        raise InputError(
            "both damping_ratio and damping_factor are given",
            where="damping_factor",
            remedy="keep one of them",
        )
    if isinstance(given, Sequence) and not isinstance(given, str):
        if not given:
            raise InputError("no ratio", where="damping_ratio", remedy="give at least one")
        return tuple(check_damping_ratio(ratio, "damping_ratio") for ratio in given)
    return check_damping_ratio(given, "damping_ratio")


def _masses(arm: Arm, factor: float | None) -> Sequence[LumpedMass]:
    """Return the masses along the beam times the factor."""
    scale = _factor(factor, "lumped_mass_factor")
    if factor is not None and not arm.masses:
        raise InputError(
            "the arm has no lumped mass to multiply",
            where="lumped_mass_factor",
            remedy="give the arm its masses",
        )
    return tuple(mass.scaled(scale) for mass in arm.masses)


def _beam(
    beam: Beam,
    *,
    mass: float,
    stiffness: float,
    frequency: float,
    coupling: float,
    inertia: float,
) -> Beam:
    if isinstance(beam, ModalData):
        _refuse_factor({"mass_factor": mass}, "modal data tell of no mass by itself")
        frequencies = frequency * math.sqrt(stiffness)
        return beam.scaled(frequency=frequencies, coupling=coupling, inertia=inertia)
    of_data = {"coupling_factor": coupling, "inertia_factor": inertia}
    _refuse_factor(of_data, "the arm has a beam and no modal data")
    stiffness *= frequency**2
    if mass == stiffness == 1:
        return beam
    return Beam(
        beam.length,
        scaled(beam.mass_per_length, mass),
        scaled(beam.bending_stiffness, stiffness),
    )


def _refuse_payload(values: Mapping[str, float | None]) -> None:
    """Refuse a payload beside modal data, which are of the structure that has it."""
    for name, value in values.items():
        if value is not None and check_nonnegative(value, name):
            raise InputError(
                "modal data are of the whole structure, with its payload",
                where=name,
                remedy="vary frequencies, couplings and inertia instead",
            )


def _refuse_factor(factors: Mapping[str, float], why: str) -> None:
    """Refuse factors that multiply nothing."""
    for name, factor in factors.items():
        if factor != 1:
            raise InputError(why, where=name, remedy="leave it out")


def scaled(spec: ProfileSpec, factor: float) -> ProfileSpec:
    """Return a profile times a factor, as the same kind of profile."""
    if factor == 1:
        return spec
    if isinstance(spec, Stations):
        return Stations(spec.x, tuple(factor * value for value in spec.values))
    if isinstance(spec, _Scaled):
        return _Scaled(spec.function, factor * spec.factor)
    if callable(spec):
        return _Scaled(spec, factor)
    if isinstance(spec, Sequence):
        return tuple(factor * value for value in spec)
    return factor * spec


def _damping(arm: Arm, factor: float) -> tuple[float | Sequence[float], DampingLaw | None]:
    """Return the damping ratios and the damping law times the factor."""
    ratio, law = arm.damping_ratio, arm.damping
    if factor == 1:
        return ratio, law
    several = isinstance(ratio, Sequence)
    ratios = (
        [factor * value for value in ratio] if isinstance(ratio, Sequence) else [factor * ratio]
    )
    if not any(ratios) and not (law and any(asdict(law).values())):
        raise InputError(
            "the arm has no damping to multiply",
            where="damping_factor",
            remedy="give the arm a damping_ratio or a damping law",
        )
    if max(ratios) >= 1:
        raise InputError(
            f"{factor:g} raises a damping ratio to {max(ratios):g}",
            where="damping_factor",
            remedy="keep every damping ratio below 1",
        )
    return (tuple(ratios) if several else ratios[0]), law and law.scaled(factor)
