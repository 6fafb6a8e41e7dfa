"""The tip under the bang-bang torque of eq. 51, stepped mode by mode.

With x = Uη the linear model falls apart into η̈ + ω²η = φτ, one equation a mode, so that a
step is a 2×2 map for each mode and nothing else.  The torque is constant over every step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.model import Model
from slewctl.paper import published

# A run is cut off where the tip leaves this range (m): a rigid arm turns by about 20 m.
TIP_LIMIT = 1e3
_TAYLOR_ORDER = 4  # one step of it is one of Runge–Kutta 4


@dataclass(frozen=True, eq=False)
class StepMap:
    """One step of every mode: state [η, η̇] → transition @ state + input · torque.

    Attributes
    ----------
    transition : ndarray, shape (n+1, 2, 2)
    input : ndarray, shape (n+1, 2)
        Per N·m.
    """

    transition: Array
    input: Array


@dataclass(frozen=True, eq=False)
class TipRun:
    """The tip's arc displacement against time.

    Attributes
    ----------
    t, tip : ndarray, shape (steps,)
        s and m.  Cut off at the first sample beyond `TIP_LIMIT`, which is kept.
    left_range_s : float or None
        When |tip| first exceeded `TIP_LIMIT`; None if it never did.
    overflow_s : float or None
        When the numbers left the range of double precision; None if they never did.
    """

    t: Array
    tip: Array
    left_range_s: float | None
    overflow_s: float | None


def exact_map(model: Model, step: float) -> StepMap:
    """Return the exact step of an undamped model under a zero-order hold.

    Parameters
    ----------
    model : Model
        Without damping or hub friction.
    step : float
        In s.
    """
    omega = np.concatenate([[0.0], model.omega])
    angle = omega * step
    cos, sinc = np.cos(angle), np.sinc(angle / np.pi) * step  # sinc = sin(ωh)/ω
    half = np.sinc(angle / (2 * np.pi)) ** 2 * step**2 / 2  # (1 − cos ωh)/ω²
    transition = np.stack(
        [np.stack([cos, sinc], axis=-1), np.stack([-(omega**2) * sinc, cos], axis=-1)], axis=-2
    )
    return StepMap(transition, np.stack([half, sinc], axis=-1) * _forces(model))


def taylor_map(model: Model, step: float) -> StepMap:
    """Return the step of the Taylor series of order 4, which is also that of Runge–Kutta 4.

    Parameters
    ----------
    model, step
        As for `exact_map`.
    """
    omega = np.concatenate([[0.0], model.omega])
    rate = np.zeros((len(omega), 2, 2))
    rate[:, 0, 1] = step
    rate[:, 1, 0] = -(omega**2) * step
    power = np.broadcast_to(np.eye(2), rate.shape)
    transition, held = power.copy(), power.copy()
    for k in range(1, _TAYLOR_ORDER + 1):
        power = power @ rate
        transition = transition + power / math.factorial(k)
        if k < _TAYLOR_ORDER:
            held = held + power / math.factorial(k + 1)
    return StepMap(transition, held[:, :, 1] * step * _forces(model))


def _forces(model: Model) -> Array:
    return (model.mode_shapes.T @ model.input)[:, None]


def times(horizon: float) -> Array:
    """Return the sampling times 0, h, 2h … up to `horizon` in s."""
    steps = round(horizon / published.SAMPLE_TIME)
    return np.arange(steps + 1, dtype=float) * published.SAMPLE_TIME


def bang_bang(t: Array) -> Array:
    """Return the torque of eq. 51 in N·m over the step that begins at each `t`."""
    # Times are multiples of the step; half a step decides clear of rounding.
    start = t + published.SAMPLE_TIME / 2
    first, second = published.SWITCHES
    direction = np.where(start < first, 1.0, np.where(start < second, -1.0, 0.0))
    return np.asarray(published.TORQUE * direction, dtype=float)


def run(model: Model, steps: StepMap, horizon: float) -> TipRun:
    """Return the tip's arc displacement (r + L)θ + v(L) from rest under eq. 51.

    Parameters
    ----------
    model : Model
    steps : StepMap
        Of that model at the paper's sampling period.
    horizon : float
        In s.
    """
    t = times(horizon)
    row = model.displacement(np.array([model.arm.beam.length]))[0] @ model.mode_shapes
    state = np.zeros((len(row), 2))
    tip = np.zeros(len(t))
    overflow = None
    with np.errstate(over="ignore", invalid="ignore"):
        for k, torque in enumerate(bang_bang(t[:-1]), start=1):
            state = np.einsum("mij,mj->mi", steps.transition, state) + steps.input * torque
            tip[k] = row @ state[:, 0]
            if not np.all(np.isfinite(state)):
                overflow = float(t[k])
                tip[k:] = np.inf
                break
    beyond = np.flatnonzero(~(np.abs(tip) <= TIP_LIMIT))
    if not len(beyond):
        return TipRun(t, tip, None, overflow)
    cut = int(beyond[0]) + 1
    return TipRun(t[:cut], tip[:cut], float(t[cut - 1]), overflow)
