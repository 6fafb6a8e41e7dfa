"""The units in which a reduction counts the signals of a system."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from slewctl._types import Array
from slewctl.errors import InputError, check_positive, shown, suggest
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant.problem import GeneralisedPlant


def given_sizes(system: LinearSystem, sizes: Mapping[str, float]) -> tuple[Array, Array]:
    """Return the size given for each input and one over that of each output; 1 where absent."""
    known = [*system.input_labels, *system.output_labels]
    for name in sizes:
        if name not in known:
            raise InputError(
                f"the system has no signal {shown(name)}",
                where="sizes",
                remedy=suggest(str(name), known),
            )
    checked = {name: check_positive(value, f"sizes.{name}") for name, value in sizes.items()}
    inputs = np.array([checked.get(name, 1.0) for name in system.input_labels])
    return inputs, 1 / np.array([checked.get(name, 1.0) for name in system.output_labels])


def own_sizes(plant: GeneralisedPlant) -> tuple[Array, Array]:
    """Return the limit of the actuator and one over the noise of each sensor; 1 elsewhere."""
    inputs, outputs = np.ones(plant.linear.ninputs), np.ones(plant.linear.noutputs)
    weight = float(np.linalg.norm(plant.D12))
    noise = np.linalg.norm(plant.D21, axis=1)
    inputs[-1] = 1 / weight if weight else 1.0
    outputs[plant.performance :] = 1 / np.where(noise > 0, noise, 1.0)
    return inputs, outputs
