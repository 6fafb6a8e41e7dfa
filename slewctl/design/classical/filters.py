"""Filters of first and second order in series, and the rigid arm that they are tuned to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from scipy.linalg import block_diag

from slewctl._types import Array, ComplexArray
from slewctl.errors import DesignError, InputError, check_positive
from slewctl.model import Model
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant import GeneralisedPlant, check_plant
from slewctl.plant.statespace import drive

Point = TypeVar("Point", complex, ComplexArray)


@dataclass(frozen=True)
class Section:
    """A filter of first or second order.

    Parameters
    ----------
    numerator, denominator : tuple of float
        Coefficients of s, highest power first and equally many; the denominator's first is 1
        and its last is not zero.
    """

    numerator: tuple[float, ...]
    denominator: tuple[float, ...]

    def at(self, s: Point) -> Point:
        """Return the response at points of the complex plane."""
        return np.polyval(self.numerator, s) / np.polyval(self.denominator, s)  # type: ignore[return-value]

    def of(self, X: Array) -> Array:
        """Return the filter as a function of a matrix."""
        below, above = (_polynomial(c, X) for c in (self.denominator, self.numerator))
        return np.asarray(np.linalg.solve(below, above), dtype=float)

    def matrices(self) -> tuple[Array, Array, Array, Array]:
        """Return A, B, C, D with states of the size of the input: a response and its rate."""
        through, last = self.numerator[0], self.denominator[-1]
        rest = np.array(self.numerator[1:]) - through * np.array(self.denominator[1:])
        D = np.array([[through]])
        if len(self.denominator) == 2:
            return np.array([[-last]]), np.array([[last]]), np.array([rest / last]), D
        omega = math.sqrt(last)
        A = np.array([[0.0, omega], [-omega, -self.denominator[1]]])
        C = np.array([[rest[1] / last, rest[0] / omega]])
        return A, np.array([[0.0], [omega]]), C, D


def _polynomial(coefficients: Sequence[float], X: Array) -> Array:
    result: Array = np.zeros_like(X)
    for coefficient in coefficients:
        result = result @ X + coefficient * np.eye(len(X))
    return result


def low_pass(omega: float, damping_ratio: float = math.sqrt(0.5)) -> Section:
    """Return ω²/(s² + 2ζωs + ω²), by default Butterworth's."""
    return Section((0.0, 0.0, omega**2), (1.0, 2 * damping_ratio * omega, omega**2))


def notch(omega: float, depth: float, width: float) -> Section:
    """Return a notch: `depth` remains at ω, and it is `width`·ω wide between −3 dB points.

    (s² + depth·width·ωs + ω²)/(s² + width·ωs + ω²)
    """
    return Section((1.0, depth * width * omega, omega**2), (1.0, width * omega, omega**2))


def lead_section(omega: float, phase: float) -> Section:
    """Return (1 + s/z)/(1 + s/p) with its largest phase, in rad and below π/2, at ω."""
    spread = math.sqrt((1 + math.sin(phase)) / (1 - math.sin(phase)))
    return Section((spread**2, omega * spread), (1.0, omega * spread))


def response(sections: Sequence[Section], s: complex) -> complex:
    """Return the response of filters in series at a point of the complex plane."""
    return math.prod((section.at(s) for section in sections), start=1.0 + 0j)


def in_series(sections: Sequence[Section]) -> tuple[Array, Array, Array, Array]:
    """Return A, B, C, D of filters in series, the first one first."""
    A, B, C, D = sections[0].matrices()
    for section in sections[1:]:
        a, b, c, d = section.matrices()
        corner = np.zeros((len(A), len(a)))
        A = np.block([[A, corner], [b @ C, a]])
        B, C, D = np.vstack([B, b @ D]), np.hstack([d @ C, c]), d @ D
    return A, B, C, D


def summed(
    plant: GeneralisedPlant,
    branches: Sequence[tuple[Array, Sequence[Section], float]],
    name: str,
) -> LinearSystem:
    """Return the controller u = Σ gain · filters(row · y), named for a plant.

    Parameters
    ----------
    plant : GeneralisedPlant
    branches : sequence of (row, filters, gain)
        A combination of the plant's sensors, shape (sensors,), filters in series and a factor.
    name : str
    """
    parts = [in_series(sections) for _, sections, _ in branches]
    rows = [row[None] for row, _, _ in branches]
    gains = [gain for _, _, gain in branches]
    return LinearSystem(
        block_diag(*(part[0] for part in parts)),
        np.vstack([part[1] @ row for part, row in zip(parts, rows, strict=True)]),
        np.hstack([gain * part[2] for part, gain in zip(parts, gains, strict=True)]),
        sum(gain * part[3] @ row for part, row, gain in zip(parts, rows, gains, strict=True)),
        inputs=list(plant.sensors),
        outputs=[plant.actuator],
        name=name,
    )


@dataclass(frozen=True)
class RigidArm:
    """J θ̈ + c θ̇ = k u: the arm as if it did not bend.

    Attributes
    ----------
    inertia : float
        J in kg·m².
    drag : float
        c in N·m·s/rad: friction, mass-proportional damping and the motor's back-EMF.
    torque_per_unit : float
        k in N·m per unit of the actuator, 1 for the torque.
    """

    inertia: float
    drag: float
    torque_per_unit: float

    def __str__(self) -> str:
        drag = f" and drag {self.drag:.4g} N·m·s/rad" if self.drag else ""
        return f"the rigid arm with inertia {self.inertia:.4g} kg·m²{drag}"


def rigid_arm(plant: GeneralisedPlant) -> RigidArm:
    """Return the rigid arm of a plant's model."""
    model = model_of(plant)
    gain, back_emf = drive(model.arm, plant.actuator)
    return RigidArm(float(model.mass[0, 0]), float(model.damping[0, 0]) + back_emf, gain)


def model_of(plant: GeneralisedPlant) -> Model:
    """Return the model that a plant was made of; refuse a plant made by hand."""
    check_plant(plant, "design")
    if plant.model is None:
        raise InputError(
            "the plant carries no model of an arm",
            where="plant",
            remedy="make it with slewctl.generalised_plant",
        )
    return plant.model


def check_frequency(given: object, name: str, meaning: str) -> float:
    """Return a frequency in Hz that has no default; say what is missing."""
    if given is None:
        raise InputError("missing", where=name, remedy=f"give {meaning} in Hz")
    return check_positive(given, name)


def picked(plant: GeneralisedPlant, **factors: float) -> Array:
    """Return the row that adds up sensors by name with factors, shape (sensors,)."""
    return np.array([factors.get(name, 0.0) for name in plant.sensors])


ANGLES = ("theta", "theta_motor")
"""Sensors of the angle, the hub's first."""


def angle_of(plant: GeneralisedPlant) -> str:
    """Return the sensor of the angle, the hub's or else the rotor's; refuse a plant without."""
    for name in ANGLES:
        if name in plant.sensors:
            return name
    raise DesignError(
        f"neither the angle of the hub nor that of the rotor is measured, only "
        f"{', '.join(plant.sensors)}",
        where="noise",
        remedy="add the sensor noise.theta or noise.theta_motor",
    )


def not_used(plant: GeneralisedPlant, used: Sequence[str]) -> tuple[str, ...]:
    """Return a line on the sensors that a controller takes but does not feed back."""
    idle = [name for name in plant.sensors if name not in used]
    return (f"measured but not fed back: {', '.join(idle)}",) if idle else ()
