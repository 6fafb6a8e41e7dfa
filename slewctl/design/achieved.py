"""What a controller achieves on its design plant, recomputed from the plant as it was given.

The loop is python-control's own linear fractional transformation of the plant and the
controller, never a matrix that a design method has kept.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from slewctl._types import ComplexArray
from slewctl.errors import AccuracyError
from slewctl.numerics.h2_norm import H2Cost, system_cost
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.observability import poles_and_growth
from slewctl.plant import GeneralisedPlant, continuous_equivalent, sampled_plant


def closed_cost(plant: GeneralisedPlant, system: LinearSystem) -> H2Cost:
    """Return the squared H2 norm of a controller around its plant, recomputed.

    Infinite where the loop is unstable, or white noise passes straight to an output of a
    continuous one.

    Parameters
    ----------
    plant : GeneralisedPlant
    system : LinearSystem
        On the plant's clock, from the sensors to the actuator, connected with a plus sign.
    """
    return _of_loop(plant.closed(system))[2]


def achieved(
    plant: GeneralisedPlant, system: LinearSystem, delay: float
) -> tuple[ComplexArray, float, H2Cost]:
    """Return closed-loop poles in rad/s, how far one may be from stable, and the H2 cost.

    Parameters
    ----------
    plant : GeneralisedPlant
    system : LinearSystem
        Of a continuous plant's sampled controller the loop is the hybrid one.
    delay : float
        Of a sampled controller, in s.

    Returns
    -------
    tuple
        The second is positive where a pole is not stable by more than rounding.
    """
    if system.dt and not plant.sample_time:
        sampled = sampled_plant(plant, float(system.dt), delay).close(system)
        growth = float(np.abs(sampled.poles).max() - sampled.largest_stable)
        cost = _known(lambda: sampled.h2) if sampled.stable else H2Cost(math.inf, 0.0)
        return continuous_equivalent(sampled.poles, float(system.dt)), growth, cost
    return _of_loop(plant.closed(system))


def _of_loop(loop: LinearSystem) -> tuple[ComplexArray, float, H2Cost]:
    poles, growth = poles_and_growth(loop.A, loop.sample_time)
    cost = _known(lambda: system_cost(loop)) if growth < 0 else H2Cost(math.inf, 0.0)
    if loop.sample_time:
        poles = continuous_equivalent(poles, loop.sample_time)
    return poles, growth, cost


def _known(cost: Callable[[], H2Cost]) -> H2Cost:
    """Return a cost, or one that nothing confirms where none can be computed."""
    try:
        return cost()
    except AccuracyError:
        return H2Cost(math.inf, math.inf)
