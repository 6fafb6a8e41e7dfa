"""What a fit may adjust of an arm: how to read, how to replace, and how large it typically is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from slewctl.arm import Arm, Joint, vary
from slewctl.errors import InputError
from slewctl.model.rigid import beam_inertia, beam_mass


@dataclass(frozen=True)
class Adjustable:
    """A property of an arm that a fit may adjust.

    Parameters
    ----------
    name : str
        As the user writes it.
    unit : str
        Unit of its value; "×" is a factor on what the arm had.
    read : callable
        Its value for an arm.
    write : callable
        Returns the arm with another value.
    scale : callable
        A typical size for an arm, > 0, in the same unit; it makes a fit independent of units.
    positive : bool
        Whether it must be > 0; otherwise >= 0.
    """

    name: str
    unit: str
    read: Callable[[Arm], float]
    write: Callable[[Arm, float], Arm]
    scale: Callable[[Arm], float]
    positive: bool = False


def _joint(arm: Arm) -> Joint:
    if arm.joint is None:
        raise InputError(
            "the arm has no elastic joint",
            where="fit.free",
            remedy="leave joint.stiffness out, or give the arm its joint to begin with",
        )
    return arm.joint


ADJUSTABLE: dict[str, Adjustable] = {
    each.name: each
    for each in (
        Adjustable(
            "beam.stiffness",
            "×",
            lambda arm: 1.0,
            lambda arm, value: vary(arm, stiffness_factor=value),
            lambda arm: 1.0,
            positive=True,
        ),
        Adjustable(
            "beam.mass",
            "×",
            lambda arm: 1.0,
            lambda arm, value: vary(arm, mass_factor=value),
            lambda arm: 1.0,
            positive=True,
        ),
        Adjustable(
            "payload.mass",
            "kg",
            lambda arm: arm.payload.mass,
            lambda arm, value: replace(arm, payload=replace(arm.payload, mass=value)),
            beam_mass,
        ),
        Adjustable(
            "payload.inertia",
            "kg·m²",
            lambda arm: arm.payload.inertia,
            lambda arm, value: replace(arm, payload=replace(arm.payload, inertia=value)),
            beam_inertia,
        ),
        Adjustable(
            "hub.inertia",
            "kg·m²",
            lambda arm: arm.hub.inertia,
            lambda arm, value: replace(arm, hub=replace(arm.hub, inertia=value)),
            beam_inertia,
        ),
        Adjustable(
            "hub.radius",
            "m",
            lambda arm: arm.hub.radius,
            lambda arm, value: replace(arm, hub=replace(arm.hub, radius=value)),
            lambda arm: arm.beam.length,
        ),
        Adjustable(
            "joint.stiffness",
            "N·m/rad",
            lambda arm: _joint(arm).stiffness,
            lambda arm, value: vary(arm, joint_stiffness=value),
            lambda arm: _joint(arm).stiffness,
            positive=True,
        ),
    )
}
