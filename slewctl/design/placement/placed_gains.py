"""Gains that place poles, in the coordinates of a plant, with what the poles came to."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.design.energy_coordinates import ScaledPlant
from slewctl.design.placement.assignment import (
    MISPLACED,
    Misplacement,
    PoleSensitivity,
    assign,
    misplacement,
    out_of_reach,
    pole_sensitivity,
)
from slewctl.design.placement.plain import Balanced
from slewctl.design.placement.pole_pairs import OpenLoop, Roots, mode_name
from slewctl.design.placement.sampled_energy import SampledEnergy
from slewctl.design.placement.wishes import Wanted
from slewctl.design.result import Check
from slewctl.errors import AccuracyError, DesignError

Coordinates = ScaledPlant | Balanced | SampledEnergy


@dataclass(frozen=True, eq=False)
class Placed:
    """A gain in the plant's coordinates and what its poles came to."""

    gain: Array
    error: Misplacement
    sensitivity: PoleSensitivity
    unit: Coordinates

    @property
    def verified(self) -> Placed:
        """The same, if its poles are where they should be."""
        if not self.error.change <= MISPLACED:
            raise AccuracyError(
                f"recomputed poles differ by up to {self.error.distance:.1e} of their magnitude "
                "from those wanted",
                where="poles",
                remedy="move fewer modes, or move them less far",
            )
        return self

    def check(self, what: str) -> Check:
        """Return the check that the poles are where they were wanted."""
        return Check(f"poles of the {what}, in changes of its matrix", self.error.change, MISPLACED)

    def described(self, what: str) -> str:
        """Return in words how sensitive the poles are."""
        found = self.sensitivity
        worst = int(np.argmax(found.condition))
        hertz = _speed(self.unit, found.poles[worst]) / (2 * np.pi)
        return (
            f"sensitivity of the {what}: eigenvectors of condition {found.eigenvectors:.3g} in "
            f"energy coordinates; the most sensitive pole, at {hertz:.4g} Hz, has condition "
            f"{found.condition[worst]:.3g}; recomputed poles differ by up to "
            f"{self.error.distance:.1e} of their magnitude"
        )


def _speed(energy: Coordinates, pole: complex) -> float:
    """Return the magnitude of a pole in rad/s; of a sampled one that of s = ln(z)/T."""
    if isinstance(energy, SampledEnergy):
        return abs(cmath.log(pole)) / energy.T if pole else math.inf
    return abs(pole) * energy.rate


def placed_feedback(actuator: str, energy: Coordinates, loop: OpenLoop, wanted: Wanted) -> Placed:
    """Return the state feedback that moves modes; refuse one that the actuator does not reach."""
    hidden = out_of_reach(loop, energy.B2, sorted(wanted))
    if hidden is not None:
        what = f"not reached by the {actuator}"
        raise _cannot_move(energy, loop, hidden, what, "leave", "leave it alone")
    gain = assign(loop, energy.B2, _scaled_down(wanted, energy.rate))
    closed = energy.A - energy.B2 @ gain
    return _placed(energy.state_feedback(gain), closed, loop, wanted, energy)


def placed_observer(energy: ScaledPlant | SampledEnergy, loop: OpenLoop, wanted: Wanted) -> Placed:
    """Return the observer gain that moves modes; refuse one that no sensor sees."""
    dual, sensors = loop.dual, energy.C2.T
    hidden = out_of_reach(dual, sensors, sorted(wanted))
    if hidden is not None:
        angle = "add a sensor of the angle itself, such as noise.theta"
        remedy = "name it in leave, or add a sensor that sees it" if hidden else angle
        raise _cannot_move(energy, loop, hidden, "not seen by any sensor", "noise", remedy)
    gain = assign(dual, sensors, _scaled_down(wanted, energy.rate)).T
    closed = energy.A - gain @ energy.C2
    return _placed(energy.observer_gain(gain), closed, loop, wanted, energy)


def _placed(
    gain: Array, closed: Array, loop: OpenLoop, wanted: Wanted, energy: Coordinates
) -> Placed:
    pairs = {**dict(enumerate(loop.pairs)), **_scaled_down(wanted, energy.rate)}
    roots = [pole for pair in pairs.values() for pole in pair.poles]
    return Placed(gain, misplacement(closed, roots), pole_sensitivity(closed), energy)


def _cannot_move(
    energy: Coordinates, loop: OpenLoop, mode: int, what: str, where: str, remedy: str
) -> DesignError:
    roots = loop.pairs[mode].times(energy.rate)
    if isinstance(energy, SampledEnergy):  # poles in z tell nobody which mode they are
        roots = energy.pairs[mode]
    if isinstance(energy, Balanced):  # no arm, whose modes have names
        where, remedy = "B", "keep it where it is, or give an input that moves it"
        name = f"one of the poles {', '.join(f'{pole:.4g}' for pole in roots.poles)}"
    else:
        name = mode_name(mode, roots)
    return DesignError(f"{name} is {what} and cannot be moved", where=where, remedy=remedy)


def own_pairs(energy: Coordinates, loop: OpenLoop) -> list[Roots]:
    """Return the plant's own pairs of poles in rad/s."""
    return [pair.times(energy.rate) for pair in loop.pairs]


def _scaled_down(wanted: Wanted, rate: float) -> Wanted:
    return {number: pair.times(1 / rate) for number, pair in wanted.items()}
