"""The movement of an arm, as it is drawn: read off the states of a simulated slew."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from slewctl._types import Array
from slewctl.animation.movement import FRAMES, STATIONS, Movement, frames_of
from slewctl.arm import ModalData
from slewctl.model import Model

# What is drawn below, with its unit, where there is such a signal.
_CURVES = {"torque": "torque (N·m)", "voltage": "voltage (V)"}


def movement_of(model: Model, t: Array, states: Array, signals: Mapping[str, Array]) -> Movement:
    """Return what is drawn of a slew.

    Parameters
    ----------
    model : Model
    t : ndarray, shape (times,)
    states : ndarray, shape (times, states)
        Coordinates of the modes first.
    signals : mapping
        Of a `Simulation`.
    """
    arm = model.arm
    kept = frames_of(t, np.stack([signals["theta"], signals["tip_deflection"]], axis=1))
    xi = np.linspace(0.0, 1.0, STATIONS)
    if isinstance(arm.beam, ModalData):
        # Of the shape between its places modal data say nothing.
        bent = np.multiply.outer(signals["tip_deflection"][kept], xi**2 * (3 - xi) / 2)
        told = "Between axis and tip, of which the modal data tell, its shape is a guess."
        root = 0.0
    else:
        shapes = model.basis.evaluate(xi) @ model.mode_shapes[1:]
        bent, told, root = states[kept, : model.n + 1] @ shapes.T, "", arm.hub.radius
    if len(kept) >= FRAMES:
        told = " ".join([told, "Its fastest vibration is drawn coarsely."]).strip()
    error = 1e3 * (signals["tip"] - signals["tip_ref"])
    curves = {"tip error (mm)": (t, error)}
    curves |= {label: (t, signals[name]) for name, label in _CURVES.items() if name in signals}
    return Movement(
        t[kept],
        signals["theta"][kept],
        signals["theta_ref"][kept],
        root + (arm.reach - root) * xi,
        bent,
        curves,
        told,
    )
