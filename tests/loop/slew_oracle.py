"""Slews walked through in very fine steps: an oracle for peaks, settling and residuals.

Every step is a matrix exponential of the whole loop, with no modes and no bounds: what is
found at the steps is reached, so that no supremum can be smaller.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from slewctl import Loop, Slew
from slewctl.loop.motion.continuous_motion import tracking_system
from slewctl.loop.motion.slew_inputs import WATCHED, signals, told
from slewctl.loop.sampled import SampledLoop
from slewctl.plant import split_delay, state_space


@dataclass(frozen=True)
class Walked:
    """What is found at the steps."""

    settling: float
    residual: float
    overshoot: float
    torque: float
    voltage: float | None


def walked(loop: Loop, slew: Slew, end: float, steps: int) -> Walked:
    """Return the figures of a slew, read at about so many times up to `end`."""
    if isinstance(loop, SampledLoop):
        t, found = _sampled(loop, slew, end, steps)
    else:
        t, found = _continuous(loop, slew, end, steps)
    travel = (loop.model.arm.hub.radius + loop.model.arm.beam.length) * np.radians(slew.angle_deg)
    error = found[1] - travel
    outside = np.flatnonzero(np.abs(error) > 0.02 * abs(travel))
    return Walked(
        float(t[outside[-1]]),
        float(np.abs(error[t >= slew.duration_s * (1 - 1e-12)]).max()),
        max(float((error / travel).max()), 0.0),
        float(np.abs(found[3]).max()),
        float(np.abs(found[4]).max()) if len(found) > 4 else None,
    )


def _steps(whole: np.ndarray, start: np.ndarray, span: float, count: int) -> np.ndarray:
    """Return the states at count + 1 equal steps, as columns."""
    step, states = expm(whole * (span / count)), start[:, None]
    while states.shape[1] <= count:
        states, step = np.hstack([states, step @ states]), step @ step
    return states[:, : count + 1]


def tip_error(loop: Loop, slew: Slew, t: float) -> float:
    """Return how far the tip of a continuous loop is beyond its travel at one time, in m."""
    moving, resting, seen, held = _equations(loop, slew)
    T, n = slew.duration_s, len(resting) - 1
    state = expm(moving * min(t, T)) @ np.eye(n + 6)[n]
    found = seen @ state
    if t > T:
        found = held @ (expm(resting * (t - T)) @ np.append(state[:n], 1.0))
    reach = loop.model.arm.hub.radius + loop.model.arm.beam.length
    return float((signals(loop) @ found)[1] - reach * np.radians(slew.angle_deg))


def _equations(loop: Loop, slew: Slew) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return ẋ = A x of loop and reference while it turns and at rest, and both outputs."""
    system, T = tracking_system(loop), slew.duration_s
    A, B, C, D = (np.asarray(getattr(system, name)) for name in "ABCD")
    turn, held = told(loop) @ slew.coefficients, told(loop)[:, :1] * np.radians(slew.angle_deg)
    n, powers = len(A), np.diag(np.arange(1.0, 6.0), -1) / T  # of s = t/T: each from the last
    moving = np.block([[A, B @ turn], [np.zeros((6, n)), powers]])
    resting = np.block([[A, B @ held], [np.zeros((1, n + 1))]])
    return moving, resting, np.hstack([C, D @ turn]), np.hstack([C, D @ held])


Piece = tuple[np.ndarray, np.ndarray, np.ndarray, float, float]


def _pieces(loop: Loop, slew: Slew, end: float, steps: int) -> list[Piece]:
    """Return matrix, signals, states at equal steps, start and step: of the slew, and after it."""
    moving, resting, seen, held = _equations(loop, slew)
    T, n, rows = slew.duration_s, len(resting) - 1, signals(loop)
    count = max(int(steps * T / end), 200)
    first = _steps(moving, np.eye(n + 6)[n], T, count)
    last = _steps(resting, np.append(first[:n, -1], 1.0), end - T, steps)
    return [
        (moving, rows @ seen, first, 0.0, T / count),
        (resting, rows @ held, last, T, (end - T) / steps),
    ]


def _continuous(loop: Loop, slew: Slew, end: float, steps: int) -> tuple[np.ndarray, np.ndarray]:
    pieces = _pieces(loop, slew, end, steps)
    times = [start + h * np.arange(states.shape[1]) for _, _, states, start, h in pieces]
    return np.concatenate(times), np.hstack([rows @ states for _, rows, states, _, _ in pieces])


def zoomed(loop: Loop, slew: Slew, end: float, steps: int) -> Walked:
    """Return the figures of a continuous slew, the steps around each of them cut again."""
    pieces = _pieces(loop, slew, end, steps)
    travel = (loop.model.arm.hub.radius + loop.model.arm.beam.length) * np.radians(slew.angle_deg)
    level = 0.02 * abs(travel) * (1 + 1e-9)

    def highest(read: Callable[[np.ndarray], np.ndarray], among: list[Piece]) -> float:
        found = []
        for whole, rows, states, _, h in among:
            near = max(int(np.argmax(read(rows @ states))) - 1, 0)
            found.append(read(rows @ _steps(whole, states[:, near], 2 * h, 2000)).max())
        return float(max(found))

    for whole, rows, walked_, start, h in reversed(pieces):
        states, settling = walked_, start
        for _ in range(3):
            outside = np.flatnonzero(np.abs((rows @ states)[1] - travel) > level)
            if not len(outside):
                break
            settling, state = settling + h * outside[-1], states[:, outside[-1]]
            states, h = _steps(whole, state, h, 1000), h / 1000
        else:
            break
    return Walked(
        settling,
        highest(lambda seen: np.abs(seen[1] - travel), pieces[1:]),
        highest(lambda seen: np.maximum((seen[1] - travel) / travel, 0), pieces),
        highest(lambda seen: np.abs(seen[3]), pieces),
        highest(lambda seen: np.abs(seen[4]), pieces) if len(pieces[0][1]) > 4 else None,
    )


def _sampled(
    loop: SampledLoop, slew: Slew, end: float, steps: int
) -> tuple[np.ndarray, np.ndarray]:
    T, delay, K = loop.sample_time, loop.controller.delay, loop.controller.system
    plant = state_space(
        loop.model, WATCHED[:-1], input=loop.objective.actuator, coordinates="modal"
    )
    n, inputs = plant.nstates, told(loop)
    samples = int(end / T) + 1
    late, fraction = split_delay(T, delay)
    whole = np.block([[plant.A, plant.B], [np.zeros((1, n + 1))]])
    out = signals(loop) @ np.block([[plant.C, np.zeros((4, 1))], [np.zeros((1, n)), np.eye(1)]])
    parts = []
    for h, lag in ((fraction, late + 1), (T - fraction, late)):
        if h > 0:
            count = max(int(steps / samples * h / T), 2)
            step = expm(whole * (h / count))
            parts.append((h, lag, [np.linalg.matrix_power(step, j) for j in range(count + 1)]))
    x, k, computed = np.zeros(n), np.zeros(K.nstates), [0.0] * (late + 2)
    times, found = [], []
    for instant in T * np.arange(samples):
        reference = [float(part[0]) for part in slew.reference(np.array([instant]))]
        error = loop.plant.C2 @ x - inputs[:-1] @ reference
        held = slew.reference(np.array([instant, instant + T]) + delay)
        added = inputs[-1, 1:] @ [np.diff(held[0])[0] / T, np.diff(held[1])[0] / T]
        computed = [float((K.C @ k + K.D @ error)[0]) + added, *computed[:-1]]
        k = K.A @ k + K.B @ error
        start = instant
        for h, lag, reached in parts:
            state = np.append(x, computed[lag])
            times.append(start + np.linspace(0, h, len(reached)))
            found.append(np.array([out @ (step @ state) for step in reached]))
            x, start = (reached[-1] @ state)[:n], start + h
    return np.concatenate(times), np.vstack(found).T
