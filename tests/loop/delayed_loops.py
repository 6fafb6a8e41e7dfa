"""Random loops with dead time, and the exact number of their unstable poles.

While dead time grows from zero, a pole can reach the axis only where |L| = 1, which dead time
does not change; it leaves to the right where |L| falls with frequency and to the left where
it rises (Walton and Marshall 1987).  The crossings are roots of exact polynomials.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import control
import numpy as np
from exact_rational import ExactLoop, fraction, gain_crossings, unstable_poles
from flint import acb, acb_poly, arb, ctx
from mixed_loops import random_mixed_loop
from numpy.typing import NDArray

Array = NDArray[np.float64]
STEP = 1e-9


@dataclass(frozen=True, eq=False)
class DelayedLoop:
    """A plant and a controller under negative feedback, with a dead time in s."""

    plant: control.StateSpace
    controller: control.StateSpace
    loop: ExactLoop
    delay: float

    def unstable(self, factor: float = 1.0) -> int:
        """Number of unstable poles with the gain multiplied."""
        scaled = self.loop.scaled(factor)
        total = unstable_poles(scaled)
        omega = gain_crossings(scaled)
        for w, late, falls in zip(omega, *self._lags(scaled, omega), strict=True):
            if late < self.delay:
                turns = 1 + int((self.delay - late) * w / (2 * np.pi))
                total += 2 * turns * (1 if falls else -1)
        return total

    def _lags(self, loop: ExactLoop, omega: Array) -> tuple[Array, Array]:
        """Return the least dead time that puts a pole at jω, and whether |L| falls there."""
        before, ctx.prec = ctx.prec, 300
        try:
            up, down = (acb_poly([acb(c) for c in p.coeffs()]) for p in fraction(loop))
            up1, down1 = up.derivative(), down.derivative()
            lags, falls = [], []
            for w in omega.tolist():
                s = acb(0, w)
                value = up(s) / down(s)
                slope = (up1(s) / up(s) - down1(s) / down(s)) * acb(0, 1)
                lag = (-value).arg()
                lag = lag if lag > 0 else lag + 2 * arb.pi()
                lags.append(float(lag / w))
                falls.append(bool(slope.real < 0))
            return np.array(lags), np.array(falls)
        finally:
            ctx.prec = before

    @property
    def stable(self) -> bool:
        return self.unstable() == 0

    @cached_property
    def gain_crossings(self) -> Array:
        return gain_crossings(self.loop)

    @property
    def phase_and_delay(self) -> tuple[float, float]:
        """Smallest turn in rad, and smallest delay in s that is left."""
        omega = self.gain_crossings
        lag = np.mod((self._lags(self.loop, omega)[0] - self.delay) * omega, 2 * np.pi)
        turns = np.minimum(lag, 2 * np.pi - lag)
        return float(turns.min(initial=np.inf)), float((lag / omega).min(initial=np.inf))

    def is_limit(self, factor: float) -> bool:
        """Whether the loop is stable up to a factor of its gain, and not a little beyond.

        Asked at a few factors between and within 1e-9 of the limit.
        """
        if factor == 0 or np.isinf(factor):
            inside = [1e-4, 1e-2, 0.5] if factor == 0 else [2.0, 1e2, 1e4]
            return all(self.unstable(f) == 0 for f in inside)
        inside = factor ** np.array([0.2, 0.5, 0.8, 0.95])
        near = factor ** (1 - STEP / abs(np.log(factor)))
        beyond = factor ** (1 + STEP / abs(np.log(factor)))
        return all(self.unstable(f) == 0 for f in [*inside.tolist(), near]) and (
            self.unstable(beyond) != 0
        )


def random_delayed_loops(seed: int, count: int) -> Iterator[DelayedLoop]:
    """Yield loops that are stable without dead time, with parts of their delay margin to 3."""
    rng = np.random.default_rng(seed)
    while count:
        mixed = random_mixed_loop(rng, ("modal", "companion", "scales")[count % 3])
        if not mixed.stable or abs(mixed.loop.D[0, 0]) >= 1:
            continue
        whole = mixed.phase_and_delay[1]
        if not np.isfinite(whole):
            continue
        count -= 1
        K = mixed.controller
        minus = control.StateSpace(
            K.A,
            K.B,
            -mixed.sign * K.C,
            -mixed.sign * K.D,
            inputs=K.input_labels,
            outputs=K.output_labels,
        )
        delay = whole * float(
            rng.choice([rng.uniform(0.05, 0.95), rng.uniform(1, 3)], p=[0.8, 0.2])
        )
        yield DelayedLoop(mixed.plant, minus, mixed.exact, delay)
