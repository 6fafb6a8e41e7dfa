"""A controller fitted to the signals of a plant or an objective."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from slewctl.design.result import Controller
from slewctl.errors import InputError
from slewctl.numerics.linear_system import LinearSystem


def fitted(controller: Controller, sensors: Sequence[str], actuator: str) -> Controller:
    """Return a controller that takes all sensors of a plant, in their order.

    What it does not read of them does not move it.

    Parameters
    ----------
    controller : Controller
    sensors : sequence of str
        All that the plant measures.
    actuator : {"torque", "voltage"}

    Returns
    -------
    Controller

    Raises
    ------
    InputError
        If it reads what is not measured, or commands another actuator.

    Examples
    --------
    >>> from slewctl.design import given
    >>> K = given(pid={"kp": 20.0})
    >>> fitted(K, ["theta", "root_moment"], "torque").sensors
    ('theta', 'root_moment')
    """
    system = controller.linear
    commanded = system.output_labels[0]
    if commanded != actuator:
        raise InputError(
            f"the controller commands {commanded!r}, the objective limits {actuator!r}",
            where="output",
            remedy="limit what the controller commands",
        )
    if controller.sensors == tuple(sensors):
        return controller
    unknown = [name for name in controller.sensors if name not in sensors]
    if unknown:
        raise InputError(
            f"the controller takes {list(controller.sensors)}, the objective measures "
            f"{list(sensors)}",
            where="inputs",
            remedy=f"add the noise of {' and '.join(unknown)}",
        )
    chosen = np.zeros((len(controller.sensors), len(sensors)))
    for row, name in enumerate(controller.sensors):
        chosen[row, list(sensors).index(name)] = 1.0
    wide = LinearSystem(
        system.A, system.B @ chosen, system.C, system.D @ chosen, system.dt,
        inputs=sensors, outputs=system.output_labels, states=system.state_labels,
        name=system.name,
    )  # fmt: skip
    before = controller.continuous
    if before is not None:
        before = fitted(before, sensors, actuator)
    words = controller.arithmetic
    if words is not None and words.kind == "fixed":
        # Of what it does not read whole numbers are enough.
        bits = dict(zip(controller.sensors, words.readings, strict=True))
        words = replace(words, readings=tuple(bits.get(name, 0) for name in sensors))
    return replace(controller, system=wide, continuous=before, arithmetic=words)
