"""The motion of a continuous loop during and after a slew, exact at all times."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from slewctl._types import Array, IntArray
from slewctl.errors import AccuracyError
from slewctl.loop.closed import Loop
from slewctl.loop.motion.decoupled import decoupled
from slewctl.loop.motion.extremes import Part
from slewctl.loop.motion.modal_motion import Motion, driven
from slewctl.loop.motion.slew_inputs import TIP, WATCHED, Slew, signals, told
from slewctl.numerics.interconnect import closed_matrix
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant import arm_signals

# Where a search first cuts the slew, in fractions of it …
_TURNING = np.linspace(0.0, 1.0, 33)
# … and what follows, in fractions of the time until nothing more can happen.
_RESTING = np.concatenate([[0.0], np.exp2(np.arange(-30.0, 1.0))])
# Part of the travel that rounding may take from the tip.
_LOST = 1e-6


class ContinuousMotion:
    """Signals of a slew (see `signals`): one piece while the reference turns, one after it.

    Parameters
    ----------
    loop : Loop
        Continuous and stable.
    slew : Slew

    Attributes
    ----------
    final : ndarray, shape (signals,)
        What they tend to.
    turning : list of list of (Motion, ndarray)
        The motion until the reference is at rest, as `SlewMotion` has it.

    Raises
    ------
    AccuracyError
        For a slew so short that rounding hides what it leaves behind.
    """

    def __init__(self, loop: Loop, slew: Slew) -> None:
        system = tracking_system(loop)
        A, B, C, D = (np.asarray(getattr(system, name)) for name in "ABCD")
        T, n = slew.duration_s, len(A)
        modes, rows = decoupled(A), signals(loop)
        inputs = told(loop)
        # The states are read too: what the slew ends with is what the rest begins with.
        outputs = np.vstack([rows @ C, np.eye(n)])
        through = np.vstack([rows @ D, np.zeros((n, D.shape[1]))])

        def piece(state: Array, drive: Array, start: float, length: float) -> Motion:
            entering, direct = B @ drive, through @ drive
            begun = np.array([start])
            return driven(modes, outputs, state[None], entering[None], direct[None], begun, length)

        turn = piece(np.zeros(n), inputs @ slew.coefficients, 0.0, T)
        reached = turn.at(np.zeros(1, dtype=int), np.array([T]))[len(rows) :, 0]
        rounding = np.finfo(float).eps * np.abs(modes.left) @ turn.sizes()[0, len(rows) :]
        held = inputs[:, :1] * np.radians(slew.angle_deg)
        self._turn, self._rest = turn, piece(reached, held, T, np.inf)
        self.final = self._rest.polynomials[0, : len(rows), 0]
        self.turning = [[(turn, T * _TURNING[None])]]
        if np.abs(outputs[TIP] @ modes.right) @ rounding > _LOST * abs(self.final[TIP]):
            raise AccuracyError(
                f"what a slew of {T:g} s leaves behind is lost in the rounding of what moves it",
                where="slew.duration_s",
                remedy="give the time in seconds, and leave out lags far faster than the arm",
            )

    def resting(
        self, signals: IntArray, margins: Callable[[], Array], *, backwards: bool = False
    ) -> Iterator[list[Part]]:
        """Yield the motion after the slew, all of it at once."""
        pairs = zip(signals, margins(), strict=True)
        until = np.array([self._rest.until(signal, margin) for signal, margin in pairs])
        yield [(self._rest, until[:, None] * _RESTING)]

    def curves(self, end: float, points: int) -> tuple[Array, Array]:
        """Return times from 0 to `end` and the signals there, shape (signals, points)."""
        T = float(self._rest.starts[0])
        moving = min(max(round((points - 1) * T / end), 1), points - 2)
        t = np.linspace(0.0, T, moving + 1)
        t = np.concatenate([t, np.linspace(T, end, points - moving)[1:]])
        resting = t > T
        found = np.empty((len(self.final), points))
        for motion, chosen in ((self._turn, ~resting), (self._rest, resting)):
            tau = t[chosen] - motion.starts[0]
            seen = motion.at(np.zeros(len(tau), dtype=int), tau)
            found[:, chosen] = seen[: len(found)]
        return t, found


def tracking_system(loop: Loop) -> LinearSystem:
    """Return the loop from [sensor references, feedforward] to `WATCHED`."""
    actuator = loop.objective.actuator
    watched = arm_signals(loop.plant, WATCHED)
    G, K = loop.plant.path, loop.controller.linear
    _, Bk, Ck, Dk = K.matrices
    B, C = np.asarray(G.B), np.asarray(G.C)
    A = closed_matrix(G.A, B, C, K.matrices)
    inputs = np.block([[-B @ Dk, B], [-Bk, np.zeros((K.nstates, 1))]])
    outputs = np.hstack([watched.C + watched.D @ Dk @ C, watched.D @ Ck])
    through = watched.D @ np.hstack([-Dk, np.ones((1, 1))])
    return LinearSystem(
        A,
        inputs,
        outputs,
        through,
        inputs=[*(f"{name}_ref" for name in loop.controller.sensors), f"{actuator}_forward"],
        outputs=list(WATCHED),
    )
