"""The signals of an arm by name: what can be measured, watched or penalised.

Every output is a row of [θ, q] taken of the displacements, the rates or the
accelerations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from slewctl._types import Array
from slewctl.errors import InputError, check_choice, shown
from slewctl.model import Model

TORQUE = "torque"


@dataclass(frozen=True)
class Signal:
    """An output: its unit, and the row of [θ, q] and its time derivative that give it."""

    unit: str
    row: Callable[[Model], Array]
    of: Literal["displacement", "rate", "acceleration"] = "displacement"


def _theta(model: Model) -> Array:
    return np.eye(model.n + 1)[0]


def _tip(model: Model) -> Array:
    return model.displacement(np.array([model.arm.beam.length]))[0]


def _tip_deflection(model: Model) -> Array:
    return np.concatenate([[0.0], model.basis.evaluate(np.ones(1))[0]])


def _root_moment(model: Model) -> Array:
    """EI(0) φ''(0) q: the bending moment that a strain gauge at the clamp reads."""
    curvature = model.basis.evaluate(np.linspace(0.0, 1.0, 33), 2)
    seen = np.abs(curvature[0]).max() > 1e-9 * np.abs(curvature).max()
    if model.arm.hub.inertia == 0 and not seen:
        raise InputError(
            f"without hub inertia the root moment is minus the torque, but no function of the "
            f"{model.basis.name} basis bends at the root",
            where="root_moment",
            remedy="use the torque, give the hub its inertia, or take another basis",
        )
    stiffness = model.arm.beam.stiffness_profile(np.zeros(1))[0] / model.arm.beam.length**2
    return np.concatenate([[0.0], stiffness * curvature[0]])


SIGNALS: dict[str, Signal] = {
    "theta": Signal("rad", _theta),
    "theta_dot": Signal("rad/s", _theta, "rate"),
    "tip": Signal("m", _tip),
    "tip_dot": Signal("m/s", _tip, "rate"),
    "tip_acceleration": Signal("m/s²", _tip, "acceleration"),
    "tip_deflection": Signal("m", _tip_deflection),
    "root_moment": Signal("N·m", _root_moment),
}


def check_signals(given: Iterable[str] | str, where: str) -> tuple[str, ...]:
    """Return output names as a tuple; refuse unknown, repeated or no names.

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
        check_choice(name, SIGNALS, where)
    if not names or len(set(names)) != len(names):
        raise InputError(
            f"{list(names)} names no output or one twice",
            where=where,
            remedy="give each output once, for example 'theta', 'tip'",
        )
    return names
