"""A sampled controller closed around a continuous arm: exact at and between the samples."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from slewctl._types import ComplexArray
from slewctl.errors import AccuracyError
from slewctl.loop.closed import Loop
from slewctl.loop.parts import negated
from slewctl.loop.single.factored_loop import FactoredLoop, factored
from slewctl.loop.single.hybrid_delay import HybridDelay
from slewctl.loop.single.margin_results import Crossing, Margins, doubts_of
from slewctl.loop.single.seen_delay import seen_delay
from slewctl.numerics.h2_norm import H2Cost
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.pairing import paired
from slewctl.plant import (
    GeneralisedPlant,
    SampledClosed,
    SampledPlant,
    continuous_equivalent,
    loop_dead_time,
    sampled_plant,
)
from slewctl.plant.sampled import Rounding

# How far a pole z may be from where the arm's own would be, and is its.
_NEAR = 0.5


@dataclass(frozen=True, eq=False, repr=False)
class SampledLoop(Loop):
    """A controller with a clock closed around a model, usually the truth.

    The arm runs on between the samples: its modes above half the sampling frequency are in
    the loop too, and the H2 cost is the mean of Σ z² over all times.  `poles` are the
    equivalents s = ln(z)/T of the poles from sample to sample, with the decay and the
    oscillation of z.  A mode above half the sampling frequency appears at the instants as a
    slower one; of all logarithms its pole is given that next to the arm's own pole, so that
    frequency and damping ratio are those of the arm.  A pole at z = 0, which is gone after a
    sample, has no equivalent and is left out.
    `return_ratio`, and so `margins` and `response`, are of the loop broken where the
    computer hands the torque to the hold; they are exact for changes of gain and phase
    there.  The delay margin is that of the torque itself, on its way to the arm.

    Parameters
    ----------
    model, objective, controller
        As for `Loop`; the controller has a sample time.
    """

    @property
    def sample_time(self) -> float:
        """T in s."""
        return self.controller.sample_time

    @cached_property
    def plant(self) -> GeneralisedPlant:
        """The generalised plant without the arm's dead time, which delays the hold."""
        return self._planted.exact

    @cached_property
    def late(self) -> float:
        """Time in s from a sample to the torque computed from it, the arm's dead time too."""
        return self.controller.delay + loop_dead_time(self.model.arm, self.objective.sensors)

    @property
    def reading_late(self) -> float:
        """Dead time of the sensors in s: of that age are readings at a sample."""
        return max(self.model.arm.sensor(name).delay for name in self.objective.sensors)

    @cached_property
    def sampled(self) -> SampledPlant:
        """The generalised plant between the hold, with the controller's delay, and the sampler."""
        return sampled_plant(self.plant, self.sample_time, self.late)

    @cached_property
    def factors(self) -> FactoredLoop:
        """L as sampled plant and controller."""
        return factored(self._path, negated(self.controller.linear))

    def margins_at(self, skew: float) -> Margins:
        """Return the margins of a stable loop with this skew of the disk.

        Its delay margin is of the continuous signal, and any part of a sample; that of the
        samples alone, whole ones, is another, and may be far larger.
        """
        found = super().margins_at(skew)
        try:
            delay = self.delay_margin
        except AccuracyError as error:  # as it is, the loop is nearly unstable
            crossing, sure = Crossing(math.nan, None, note=str(error)), False
        else:
            crossing, sure = self._reached(delay, found.delay_s.note), delay.confirmed
        own = () if sure else ("poles do not confirm the delay margin",)
        doubts = (*own, *found.unproved, *doubts_of({**found.each, "delay_s": crossing}))
        return replace(found, delay_s=crossing, doubts=doubts, confirmed=not doubts)

    def _reached(self, delay: HybridDelay, why: str) -> Crossing:
        if delay.omega is None:
            return Crossing(delay.seconds, None, note=why)
        hertz = np.array([delay.omega / (2 * math.pi)])
        (mode,) = self.modes.largest(hertz, self.response(2 * math.pi * hertz))
        return Crossing(delay.seconds, float(hertz[0]), mode)

    @cached_property
    def delay_margin(self) -> HybridDelay:
        """The smallest dead time of the drive that makes a stable loop unstable."""
        return seen_delay(self.plant.path, negated(self.controller.linear), self.late)

    @cached_property
    def closed(self) -> SampledClosed:
        """The closed loop from sample to sample, with the cost between the samples."""
        return self.sampled.close(self.controller.linear, self.rounding)

    @property
    def rounding(self) -> Rounding | None:
        """What words add to the controller's signals; None of one in double or single precision."""
        arithmetic = self.controller.arithmetic
        return arithmetic.noise if arithmetic is not None else None

    @cached_property
    def linear(self) -> LinearSystem:
        """The closed loop from a torque or voltage added at the hold to the sensors."""
        path, size = self._path, len(self.closed.A)
        B = np.zeros((size, 1))
        B[: path.nstates] = path.B
        C = np.hstack([path.C, np.zeros((path.noutputs, size - path.nstates))])
        return LinearSystem(
            self.closed.A,
            B,
            C,
            np.zeros((path.noutputs, 1)),
            self.sample_time,
            inputs=[f"{self.objective.actuator}_added"],
            outputs=list(path.output_labels),
            name=f"{self.plant.linear.name}_closed",
        )

    @cached_property
    def poles(self) -> ComplexArray:
        """Equivalents s = ln(z)/T of the closed-loop poles, rad/s, by increasing magnitude."""
        values = self.equivalents[np.isfinite(self.equivalents)]
        return values[np.argsort(np.abs(values))]

    @cached_property
    def equivalents(self) -> ComplexArray:
        """One s for each of `closed.poles`, infinite for z = 0: that of the arm, not an alias."""
        z, T = self.closed.poles, self.sample_time
        s = np.full(len(z), complex(-np.inf, 0))
        kept = np.flatnonzero(np.abs(z) > np.finfo(float).eps)
        s[kept] = continuous_equivalent(z[kept], T)
        own = np.linalg.eigvals(self.plant.A).astype(complex)
        own = own[np.abs(own.imag) > self.nyquist_rad_s]
        # The controller hardly moves these, so that each has its z next to where it was.
        distance = np.abs(np.exp(own * T)[:, None] - z[kept])
        rows, columns = paired(distance)
        near = distance[rows, columns] < _NEAR  # feedback has made something else of the others
        rows, found = rows[near], kept[columns[near]]
        turns = np.round((own[rows].imag - s[found].imag) * T / (2 * np.pi))
        s[found] += 2j * np.pi / T * turns
        return s

    @cached_property
    def stable_by_poles(self) -> bool:
        """Whether every pole z lies within the unit circle by more than rounding."""
        return self.closed.stable

    @property
    def _near_limit(self) -> bool:
        return bool(np.abs(self.closed.poles).max() <= 2 - self.closed.largest_stable)

    @property
    def unstable_hz(self) -> tuple[float, ...]:
        """Frequencies of the poles that may not be stable, fastest growing first."""
        z, s = self.closed.poles, self.equivalents
        # A real z has no partner: a negative one oscillates at half the sampling frequency.
        bad = (np.abs(z) >= self.closed.largest_stable) & ((s.imag >= 0) | (z.imag == 0))
        return tuple(float(abs(p) / (2 * np.pi)) for p in s[bad][np.argsort(-np.abs(z[bad]))])

    @property
    def _path(self) -> LinearSystem:
        return self.sampled.path

    @property
    def nyquist_rad_s(self) -> float:
        """Half the sampling frequency."""
        return np.pi / self.sample_time

    @cached_property
    def open_poles(self) -> ComplexArray:
        """Equivalents s = ln(z)/T of the poles of L."""
        poles = np.linalg.eigvals(np.asarray(self.opened.A)).astype(complex)
        return continuous_equivalent(poles, self.sample_time)

    @cached_property
    def h2_by_poles(self) -> H2Cost:
        """Mean of Σ z² over all times, at and between the samples, rounding of words included."""
        return self.closed.h2
