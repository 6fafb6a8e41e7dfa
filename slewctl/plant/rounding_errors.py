"""What rounding in a sampled controller adds to the cost of its loop.

Where signals are busy, rounding is white noise.  Where a state moves by less than half a step in
a sample it stands still, as an integrator does whose reading is small: its error is half a step,
always the same.  What both add, each at its largest, is added.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from slewctl._types import Array
from slewctl.numerics.linear_system import LinearSystem


class _Plant(Protocol):
    @property
    def A(self) -> Array: ...
    @property
    def B(self) -> Array: ...
    @property
    def cost(self) -> Array: ...
    @property
    def sample_time(self) -> float: ...


class Closed(Protocol):
    """A stable loop from sample to sample; `SampledClosed` is one."""

    @property
    def plant(self) -> _Plant: ...
    @property
    def controller(self) -> LinearSystem: ...
    @property
    def A(self) -> Array: ...
    @property
    def cost_to_go(self) -> Array: ...
    @property
    def driven(self) -> tuple[Array, Array]: ...


def white_cost(closed: Closed, readings: Array, states: Array, command: float) -> float:
    """Return what white errors in the controller add to the mean of zᵀz.

    Parameters
    ----------
    closed : Closed
    readings, states, command
        Variances; see `SampledClosed.cost_of_rounding`.
    """
    p, (_, Bk, _, Dk) = closed.plant, closed.controller.matrices
    n, price = len(p.A), closed.cost_to_go
    held = np.vstack([p.B, np.zeros((len(Bk), 1))])
    read = np.vstack([p.B @ Dk, Bk])
    through = command + float((Dk**2 @ readings)[0])
    added = float(np.sum((price @ read) * read, axis=0) @ readings)
    added += float(np.diag(price)[n:] @ states) + command * float((held.T @ price @ held)[0, 0])
    return (added + through * float(p.cost[-1, -1])) / p.sample_time


def standing_cost(closed: Closed, states: Array) -> float:
    """Return the largest mean of zᵀz where each state is off by half a step in every sample.

    Parameters
    ----------
    closed : Closed
    states : ndarray
        Variances of the states' rounding: a twelfth of the square of a step.
    """
    p, size = closed.plant, len(closed.A)
    entering = np.eye(size)[:, size - len(states) :] * np.sqrt(3 * states)
    seen = closed.driven[0] @ np.linalg.solve(np.eye(size) - closed.A, entering)
    each = np.sum(seen * (p.cost @ seen), axis=0)
    # Of unknown signs they add up at most.
    return float(np.sum(np.sqrt(np.maximum(each, 0.0))) ** 2 / p.sample_time)
