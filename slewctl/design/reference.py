"""How the reference angle enters a controller, so that a step in it leaves no steady error.

An observer-based controller commands the state: u = −K(x̂ − N_x θ_ref) + N_u θ_ref with the
observer driven by the same u, where N_x and N_u are the state and the input at rest at unit
angle (Franklin, Powell and Emami-Naeini, Feedback Control of Dynamic Systems, section 7.5).
The reference then excites no estimation error.  Any other controller is given y − y_ref,
where y_ref is what each sensor would read on the rigid arm at rest at the reference angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.model import Model
from slewctl.numerics.balance import balance
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant import GeneralisedPlant, signal

# What the reference angle is called among a controller's inputs.
REFERENCE = "theta_ref"


@dataclass(frozen=True, eq=False)
class Reference:
    """The columns by which θ_ref enters a controller.

    Attributes
    ----------
    B : ndarray, shape (states, 1)
        To the controller's states.
    D : ndarray, shape (1, 1)
        To the actuator.
    """

    B: Array
    D: Array


def rigid_readings(model: Model, sensors: Sequence[str]) -> Array:
    """Return what each sensor reads on the rigid arm at rest at 1 rad, shape (sensors,)."""
    named = [signal(name, "sensors", model.arm.beam) for name in sensors]
    return np.array([s.row(model)[0] if s.of == "displacement" else 0.0 for s in named])


def rigid_reference(system: LinearSystem, readings: Array) -> Reference:
    """Return the reference of a controller that is given y − readings·θ_ref."""
    column = -readings[:, None]
    return Reference(np.asarray(system.B) @ column, np.asarray(system.D) @ column)


def at_rest(plant: GeneralisedPlant) -> tuple[Array, float] | None:
    """Return N_x, shape (n, 1), and N_u: state and input that hold the arm at an angle of 1 rad.

    Returns
    -------
    tuple or None
        None if nothing says which state that is: the plant has neither a model nor a sensor
        called ``theta``, or no sensor that sees the angle.
    """
    row = _angle_row(plant)
    if row is None:
        return None
    scale = balance(plant.A)
    n = len(scale)
    whole = np.zeros((n + 1, n + 1))
    moved = plant.A - np.eye(n) if plant.sample_time else plant.A
    whole[:n, :n] = moved / scale[:, None] * scale
    whole[:n, n:] = plant.B2 / scale[:, None]
    whole[n, :n], whole[n, n] = row[0] * scale, row[1]
    # Each equation and the input in units of their own: the arm may be measured in microns.
    unit = np.linalg.norm(whole[:, n]) or 1.0
    whole[:, n] /= unit
    size = np.abs(whole).max(axis=1)
    right = np.zeros(n + 1)
    right[n] = 1 / size[n]
    try:
        found = np.linalg.solve(whole / size[:, None], right)
    except np.linalg.LinAlgError:
        return None
    return (found[:n] * scale)[:, None], float(found[n] / unit)


def _angle_row(plant: GeneralisedPlant) -> tuple[Array, float] | None:
    """Return what reads the angle off a state at rest, and off the input."""
    angles = [name for name in ("theta", "theta_motor") if name in plant.sensors]
    if angles:
        best, reading = plant.sensors.index(angles[0]), 1.0
    elif plant.model is not None:
        readings = rigid_readings(plant.model, plant.sensors)
        best = int(np.argmax(np.abs(readings)))
        reading = float(readings[best])
    else:
        return None
    return (plant.C2[best] / reading, float(plant.D22[best, 0]) / reading) if reading else None


def with_reference(system: LinearSystem, reference: Reference) -> LinearSystem:
    """Return a controller with ``theta_ref`` as its last input."""
    return LinearSystem(
        system.A,
        np.hstack([system.B, reference.B]),
        system.C,
        np.hstack([system.D, reference.D]),
        system.dt,
        inputs=[*system.input_labels, REFERENCE],
        outputs=list(system.output_labels),
        states=list(system.state_labels),
        name=f"{system.name}_tracking",
    )
