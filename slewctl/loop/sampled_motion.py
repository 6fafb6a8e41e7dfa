"""The motion of an arm under a sampled controller, exact at and between the samples."""

from __future__ import annotations

from dataclasses import dataclass

import control
import numpy as np
from scipy.linalg import expm

from slewctl._types import Array
from slewctl.loop.sampled import SampledLoop
from slewctl.plant import split_delay


@dataclass(frozen=True, eq=False)
class _Part:
    """A part of a sample in which one input is held.

    Attributes
    ----------
    times : ndarray, shape (m,)
        From the beginning of the part; its end belongs to the next one.
    outputs : ndarray, shape (m, outputs, n + 1)
        From [x; u] at the beginning to the outputs at these times.
    end : ndarray, shape (n, n + 1)
    """

    times: Array
    outputs: Array
    end: Array


def _part(watched: control.StateSpace, h: float, count: int) -> _Part:
    n = watched.nstates
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n:] = watched.A, watched.B
    step = expm(whole * (h / count))
    rows = np.hstack([watched.C, np.zeros((watched.noutputs, 1))])
    outputs, reached = [], np.eye(n + 1)
    for _ in range(count):
        outputs.append(rows @ reached)
        reached = step @ reached
    times = np.asarray(h / count * np.arange(count), dtype=float)
    return _Part(times, np.array(outputs), reached[:n])


def sampled_motion(
    loop: SampledLoop,
    watched: control.StateSpace,
    references: Array,
    forward: Array,
    substeps: int,
) -> tuple[Array, Array]:
    """Return times and outputs of a sampled loop that starts at rest.

    Parameters
    ----------
    loop : SampledLoop
    watched : control.StateSpace
        From the actuator to what is watched, with the states of the loop's plant.
    references : ndarray, shape (samples, sensors)
        y_ref at each sampling instant: the controller is given y − y_ref.
    forward : ndarray, shape (samples,)
        What is added to the controller's output of each instant.
    substeps : int
        At least so many times a sample.

    Returns
    -------
    t : ndarray, shape (m,)
        The sampling instants, those at which the input changes, and times between them.
    outputs : ndarray, shape (outputs + 1, m)
        What is watched, and the input that acts from each time on.
    """
    T, K = loop.sample_time, loop.controller.system
    Ak, Bk, Ck, Dk = (np.asarray(m) for m in (K.A, K.B, K.C, K.D))
    C = loop.plant.C2
    whole, fraction = split_delay(T, loop.controller.delay)
    spans = [(h, lag) for h, lag in ((fraction, whole + 1), (T - fraction, whole)) if h > 0]
    parts = [(_part(watched, h, max(round(substeps * h / T), 1)), lag) for h, lag in spans]
    x, state = np.zeros(watched.nstates), np.zeros(len(Ak))
    inputs = np.zeros(whole + 2)  # those computed last, the latest first
    seen: list[Array] = []
    for reference, added in zip(references, forward, strict=True):
        error = C @ x - reference
        inputs = np.roll(inputs, 1)
        inputs[0] = (Ck @ state + Dk @ error)[0] + added
        state = Ak @ state + Bk @ error
        for part, lag in parts:
            start = np.append(x, inputs[lag])
            held = np.full((len(part.times), 1), inputs[lag])
            seen.append(np.hstack([part.outputs @ start, held]))
            x = part.end @ start
    offsets = np.cumsum([0.0, *(h for h, _ in spans)])[:-1]
    inside = [o + part.times for o, (part, _) in zip(offsets, parts, strict=True)]
    within = np.concatenate(inside)
    t = (T * np.arange(len(forward))[:, None] + within).ravel()
    return t, np.concatenate(seen).T
