"""What a controller achieves on its design plant, recomputed from the plant as it was given.

The loop is python-control's own linear fractional transformation of the plant and the
controller, never a matrix that a design method has kept.
"""

from __future__ import annotations

import math

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.numerics.h2_norm import H2Cost, discrete_h2_cost, h2_cost
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.observability import pole_rounding
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
    return _of_loop(*_loop(plant, system), plant.sample_time)[2]


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
        cost = sampled.h2 if sampled.stable else H2Cost(math.inf, 0.0)
        return continuous_equivalent(sampled.poles, float(system.dt)), growth, cost
    return _of_loop(*_loop(plant, system), plant.sample_time)


def _loop(plant: GeneralisedPlant, system: LinearSystem) -> tuple[Array, Array, Array, Array]:
    """Return A, B, C and D of the loop from w to z."""
    loop: LinearSystem = plant.close(plant.fitting(system, plant.sample_time or None))
    return loop.matrices


def _of_loop(
    A: Array, B: Array, C: Array, D: Array, sample_time: float
) -> tuple[ComplexArray, float, H2Cost]:
    poles, rounding = pole_rounding(A)
    if sample_time:
        growth = float((np.abs(poles) + rounding).max()) - 1
        cost = discrete_h2_cost(A, B, C, D) if growth < 0 else H2Cost(math.inf, 0.0)
        return continuous_equivalent(poles, sample_time), growth, cost
    growth = float((poles.real + rounding).max())
    finite = growth < 0 and not np.any(D)
    return poles, growth, h2_cost(A, B, C) if finite else H2Cost(math.inf, 0.0)
