"""A log as least squares, whole and without windows.

In the discrete Fourier transform over the record, Y = G U + C(zI − Φ)⁻¹z δ + noise holds
exactly, where δ = x(0) − x(N) is what the state gained over the record: nothing leaks, however
light a mode.  δ is eliminated, linear as it is and as large as the input makes it, and so is dry
friction at the hub, an input that a measured hub angle tells but for its size.  What is left is
divided by the spectrum of the noise, which is read from the residual itself.  That is the
prediction error method with a free noise model; with white or coloured noise at the output it is
right in closed loop too.
(L. Ljung, System Identification, 2nd ed., 1999, chapters 7 and 13; R. Pintelon and
J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012, chapter 6.)
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import numpy as np
from scipy.linalg import qr

from slewctl._types import Array, ComplexArray
from slewctl.errors import AccuracyError
from slewctl.measured.dry_friction import RUBBED, STEPS, Rubbing, at_the_drive, pushes
from slewctl.measured.estimate import noise_power
from slewctl.measured.log import Log
from slewctl.measured.noise_spectrum import drawn, smooth
from slewctl.measured.response_data import channel_of
from slewctl.measured.rig_model import HeldRig, Modes, equations
from slewctl.measured.rig_parameters import Rig
from slewctl.numerics.frequency_response import FrequencyResponse, axis_points
from slewctl.numerics.linear_system import LinearSystem

# Longest dead time: in samples, or over what it is at first.
_LATE, _LONGER = 40, 2
# Bins that are all taken, and how far above what a log shows more of them are.
_MANY, _ABOVE = 12_000, 1.5
# A state of so many deviations is seen in the log itself.
_SEEN = 5.0
# Deviations from which dry friction is there, and its share of the input that is worth a word.
_CLEAR, _WORTH = 5.0, 1e-3
# Where there is no dry friction: so much of what the input moves by.
_LEAST_DRY = 1e-6
# Relative size of a direction in which the state's part does not count.
_DEPENDENT = 1e-12


class RecordData:
    """The transforms of a log, the spectrum of its noise, and residuals of unit variance.

    Parameters
    ----------
    log : Log
    modes : Modes
        Of the model.
    highest_hz : float, optional
        Up to where the log shows the arm: of a long log nothing far above it is taken.
    delay : float
        About what the dead time is in s; twice of it can be told.
    """

    def __init__(
        self, log: Log, modes: Modes, highest_hz: float = np.inf, delay: float = 0.0
    ) -> None:
        self.modes = modes
        self.channel = channel_of(log)
        # What was held before the record is not known: it begins where that has passed.
        longest = _LONGER * int(delay / log.sample_time)
        self.late = min(max(_LATE, longest), log.samples // 4)
        self.count = log.samples - self.late - 1
        bins = np.arange(1, (self.count + 1) // 2)
        if len(bins) > _MANY:
            last = _ABOVE * highest_hz * self.count * log.sample_time
            bins = bins[: max(_MANY, int(min(last, len(bins))))]
        self.omega: Array = np.asarray(2 * np.pi * bins / (self.count * log.sample_time))
        self.z = np.exp(1j * self.omega * log.sample_time)
        self._u = log.input
        self._rounding = log.resolution / np.sqrt(12)
        # Of no log less is left than its numbers are rounded to.
        self._least = float(np.finfo(float).eps * np.abs(log.output).max()) ** 2
        self._inputs: dict[int, ComplexArray] = {}
        self._bins = bins
        self._pull: Array = np.zeros(0)
        self.Y = self._transform(log.output[self.late + 1 :])
        self._log = log
        self._rubs: ComplexArray | None = None
        if log.sensor == "theta":
            # To begin with, that of the angle from each sample to the next.
            rates = np.sign(np.diff(log.output, append=log.output[-1]))
            self._rub(np.repeat(rates[:, None], STEPS, axis=1))
        self.weight: Array = 1 / np.sqrt(noise_power(log, self.omega))
        self._read = False  # whether these weights come from what a fit left

    def _transform(self, column: Array) -> ComplexArray:
        return np.asarray(np.fft.rfft(column)[self._bins] / np.sqrt(self.count))

    def _delayed(self, samples: int) -> ComplexArray:
        """Return the transform of the input so many samples before."""
        if samples not in self._inputs:
            first = self.late + 1 - samples
            self._inputs[samples] = self._transform(self._u[first : first + self.count])
        return self._inputs[samples]

    def errors(self, rig: Rig, gained: Array | float = 0.0) -> ComplexArray:
        """Return Y − G U at each bin, less the part of a state that gained so much."""
        system, held = self._held(rig)
        wanted = [held.now, held.before]
        if not isinstance(gained, float):
            # `_columns` times what was gained, without making them.
            size = len(held.transition)
            wanted.append(gained[:size])
            if self._rubs is not None:
                wanted.append(self._pushes(rig, system) * gained[size])
        seen = held.rows(self.omega, np.column_stack(wanted)).T
        found = self._errors(held, seen[0], seen[1], float(system.D[0, 0]), rig.gain)
        if len(seen) > 2:
            found -= self.z * seen[2]
        if len(seen) > 3 and self._rubs is not None:
            found += np.einsum("mk,km->k", seen[3:], self._rubs)
        return found

    def _rub(self, signs: Array) -> None:
        """Take dry friction to have these signs in the steps of each sample, shape (n, steps)."""
        self._rubs = np.column_stack([self._transform(part[self.late + 1 :]) for part in signs.T])

    def _pushes(self, rig: Rig, system: LinearSystem) -> Array:
        return pushes(system, self._where_it_rubs(rig), self.channel.sample_time)

    def _where_it_rubs(self, rig: Rig) -> Array:
        return at_the_drive(rig.arm, self.channel.actuator, self.channel.sensor, self.modes)

    def _columns(self, rig: Rig, system: LinearSystem, rows: ComplexArray) -> ComplexArray:
        """Return what a state that gains one gives at each bin, and what dry friction of one."""
        state = rows * self.z[:, None]
        if self._rubs is None:
            return state
        dry = np.einsum("km,km->k", rows @ self._pushes(rig, system), self._rubs)
        return np.column_stack([state, -dry])

    def _errors(
        self,
        held: HeldRig,
        seen_now: ComplexArray,
        seen_before: ComplexArray,
        through: float,
        gain: float,
    ) -> ComplexArray:
        """Return Y − G U from what Γ₀ and Γ₁ give at each bin."""
        d = min(held.whole, self.late - 1)
        now, before = self._delayed(d), self._delayed(d + 1)
        found = seen_now * now + seen_before * before
        found = found + through * (before if held.part else now)
        return self.Y - gain * found

    def _held(self, rig: Rig) -> tuple[LinearSystem, HeldRig]:
        system = equations(rig.arm, self.channel.actuator, self.channel.sensor, self.modes)
        return system, HeldRig.of(system, self.channel.sample_time, rig.delay)

    def state_part(self, rig: Rig) -> Remainder:
        """Return the projection that takes the state's part out at a rig, with its errors."""
        system, held = self._held(rig)
        rows = held.rows(self.omega)
        now, before = rows @ held.now, rows @ held.before
        errors = self._errors(held, now, before, float(system.D[0, 0]), rig.gain)
        return Remainder(errors, self._columns(rig, system, rows), self.weight, self._pull)

    def expect(self, rig: Rig) -> None:
        """Take from a rig how large its state may be, and what it gains over the record.

        It moved before the record, or moves in it, as the input makes it, or as far as the log
        itself shows plainly.  Without that a mode that the input hardly moves could be any size,
        a line in the noise would be its free vibration, and tell its frequency and damping.
        Where an angle is counted from is anything.
        """
        system, held = self._held(rig)
        points = axis_points(self.omega, self.channel.sample_time)
        size = len(held.transition)
        both = LinearSystem(
            held.transition, np.column_stack([held.now, held.before]), np.eye(size),
            np.zeros((size, 2)), self.channel.sample_time,
        )  # fmt: skip
        moved = FrequencyResponse(both).at(points)
        d = min(held.whole, self.late - 1)
        inputs = np.stack([self._delayed(d), self._delayed(d + 1)], axis=1)
        power = np.abs(rig.gain * np.einsum("kij,kj->ki", moved, inputs)) ** 2
        # The state at one end less that at the other, in the scale of the transforms.
        sizes = np.sqrt(2 * 2 * power.sum(axis=0) / self.count) / np.sqrt(self.count)
        self._pull = np.zeros(0)
        free = self.state_part(rig)
        gained, deviation = np.abs(free.gained[:size]), free.deviation[:size]
        sizes = np.where(gained > _SEEN * deviation, np.maximum(sizes, gained), sizes)
        held_back = system.A.any(axis=0) & (sizes > 0)
        self._pull = np.where(held_back, 1 / np.where(held_back, sizes, 1.0), 0.0)

    def dry_friction(self, remainder: Remainder) -> tuple[float, float]:
        """Return the dry friction that a log of the hub angle shows, with its deviation.

        In the actuator's unit; NaN of another sensor's log, and where there is none.
        """
        if self._rubs is None:
            return float("nan"), float("nan")
        return float(remainder.gained[-1]), float(remainder.deviation[-1])

    def driven(self, remainder: Remainder) -> bool:
        """Return whether dry friction drives what it should brake, plainly: it is none.

        The signs of the steps of a coarse encoder are the output once more, which any rig can
        be made to fit with: then those of a rig are what is to be taken.
        """
        dry, deviation = self.dry_friction(remainder)
        return dry < -_CLEAR * deviation

    def rub(self, rig: Rig, remainder: Remainder | None) -> Remainder:
        """Take the sign of dry friction from a rig that has as much as is left, led by the log.

        Where none stands out of the noise there is none from here on.  Return what is left.
        Without a remainder the rig has no friction worth a word.
        """
        if self._rubs is None:
            return self.state_part(rig) if remainder is None else remainder
        log = self._log
        moves = float(np.std(log.input))
        known = 0.0 if remainder is None else self.dry_friction(remainder)[0]
        dry = max(known, _LEAST_DRY * moves)
        try:
            model = self._rubbing(rig, dry)
        except AccuracyError:  # readings too exact to doubt the rig by
            self._rubs = None
            return self.state_part(rig)
        self._rub(model.signs(rig.gain * log.input, log.output, dry))
        remainder = self.state_part(rig)
        dry, deviation = self.dry_friction(remainder)
        if self._read and not dry > max(_CLEAR * deviation, _WORTH * moves):
            self._rubs = None
            return self.state_part(rig)
        return remainder

    def _rubbing(self, rig: Rig, dry: float) -> Rubbing:
        channel, where = self.channel, self._where_it_rubs(rig)
        system = equations(rig.arm, channel.actuator, channel.sensor, self.modes, beside=(RUBBED,))
        return Rubbing.of(system, where, channel.sample_time, rig.delay, dry, self.noise)

    def drawn_anew(
        self, rig: Rig, dry: float, generator: np.random.Generator, times: int
    ) -> list[RecordData]:
        """Return records of a rig with so much dry friction, its noise drawn anew.

        Their weights and the signs of friction are the true ones.

        Raises
        ------
        AccuracyError
            If there is no filter, as for `rub`.
        """
        log = self._log
        output, signs = self._rubbing(rig, dry).simulated(rig.gain * log.input, dry)
        found = []
        for _ in range(times):
            other, noise = copy(self), drawn(generator, self.weight, self._bins, self.count)
            # The bins are those of the end of the record: that has one whole period.
            other._log = replace(log, output=output + np.resize(noise, len(output))[::-1])
            other.Y = self._transform(other._log.output[self.late + 1 :])
            other._rub(signs)
            other._read = False
            found.append(other)
        return found

    def unlikely(self, rig: Rig) -> float:
        """Return −2 ln of the likelihood at a rig with the noise that it leaves, but a constant."""
        return 2 * float(np.sum(np.log(smooth(np.abs(self.state_part(rig).left) ** 2))))

    @property
    def latest(self) -> float:
        """The longest dead time that can be told, in s."""
        return (self.late - 1) * self.channel.sample_time

    def explained(self, remainder: Remainder) -> float:
        """Return how much of the output the input makes through the rig, at most 1.

        Of what is left of the output beside the state's part and dry friction's, which the same
        record tells and which would make much of it without any input.
        """
        alone = remainder.unweighted(remainder.without(self.Y))
        return 1 - float(np.linalg.norm(remainder.left) / np.linalg.norm(alone))

    @property
    def noise(self) -> float:
        """Deviation of the noise, in the median of its spectrum."""
        return float(np.sqrt(np.median(1 / self.weight**2)))

    @property
    def times_rounding(self) -> float:
        """How many times an encoder's rounding the noise is, in the median; NaN without one."""
        if not self._rounding:
            return float("nan")
        return self.noise / self._rounding

    def weigh(self, remainder: Remainder, jacobian: Array) -> None:
        """Take the spectrum of the noise from what is left at a rig.

        Parameters
        ----------
        remainder : Remainder
        jacobian : ndarray, shape (2k, p)
            Of what is left by the properties that were fitted: they, too, have taken a part of
            the noise, most of it in the few bins of a light mode.  Without that part weights
            would grow there from round to round, and intervals be too narrow (restricted
            maximum likelihood: H. D. Patterson and R. Thompson, Biometrika 58 (1971) 545–554).
        """
        free = remainder.free(jacobian)
        power = smooth(np.abs(remainder.left) ** 2, free)
        self.weight = 1 / np.sqrt(np.maximum(power, self._least))
        self._read = True


class Remainder:
    """What is left of the errors without the state's part.

    Parameters
    ----------
    errors : ndarray, shape (k,)
    columns : ndarray, shape (k, n)
        Of the state.
    weight : ndarray, shape (k,)
        One over the noise's deviation.
    pull : ndarray, shape (m,)
        One over the deviation that is expected of each of the first columns' coefficients; zero
        where nothing is.

    Attributes
    ----------
    vector : ndarray, shape (2k + m,)
        What is left, in deviations of the noise, and the coefficients, in those expected.
    gained, deviation : ndarray, shape (n,)
        What the state gained over the record, δ, and dry friction, with their deviations.
    """

    def __init__(
        self, errors: ComplexArray, columns: ComplexArray, weight: Array, pull: Array
    ) -> None:
        self.weight = weight
        self._expected = len(pull)
        weighted = _real(columns * weight[:, None])
        weighted = np.vstack([weighted, np.eye(len(pull), weighted.shape[1]) * pull[:, None]])
        size = np.linalg.norm(weighted, axis=0)
        weighted = weighted / np.where(size > 0, size, 1.0)
        Q, R = qr(weighted, mode="economic")
        left, values, right = np.linalg.svd(R)
        kept = values > _DEPENDENT * values[0]
        # Orthonormal: the state's part can be nothing else than a sum of these.
        self.basis: Array = Q @ left[:, kept]
        self.vector = self.without(errors)
        part = self.basis.T @ self._weighted(errors)
        sizes = np.where(size > 0, size, 1.0)
        self.gained = right[kept].T @ (part / values[kept]) / sizes
        self.deviation = np.linalg.norm(right[kept].T / values[kept], axis=1) / sizes

    def _weighted(self, errors: ComplexArray) -> Array:
        real = _real((errors * self.weight)[:, None])[:, 0]
        return np.concatenate([real, np.zeros(self._expected)])

    def without(self, errors: ComplexArray) -> Array:
        """Return errors in deviations of the noise, real, without the state's part, (2k + m,)."""
        weighted = self._weighted(errors)
        return np.asarray(weighted - self.basis @ (self.basis.T @ weighted))

    @property
    def left(self) -> ComplexArray:
        """The errors that are left at each bin, not weighted."""
        return self.unweighted(self.vector)

    def unweighted(self, vector: Array) -> ComplexArray:
        """Return what `without` gives as errors at each bin."""
        half = len(self.weight)
        parts = vector[:half] + 1j * vector[half : 2 * half]
        return np.asarray(parts / (np.sqrt(2) * self.weight))

    def free(self, jacobian: Array) -> Array:
        """Which part of the noise's power state and properties leave at each bin, shape (k,)."""
        taken = np.sum(self.basis**2, axis=1) + np.sum(_spanning(jacobian) ** 2, axis=1)
        half = len(self.weight)
        return np.asarray(1 - (taken[:half] + taken[half : 2 * half]) / 2)

    @property
    def taken(self) -> int:
        """How many real numbers the state's part has."""
        return self.basis.shape[1]


def _spanning(columns: Array) -> Array:
    """Return orthonormal columns that span the given ones, but for what is rounding."""
    size = np.linalg.norm(columns, axis=0)
    Q, R, _ = qr(columns / np.where(size > 0, size, 1.0), mode="economic", pivoting=True)
    pivots = np.abs(np.diag(R))
    return np.asarray(Q[:, pivots > _DEPENDENT * pivots[0]])


def _real(columns: ComplexArray) -> Array:
    """Return real and imaginary parts one below the other; equal parts of the noise's power."""
    return np.asarray(np.sqrt(2) * np.concatenate([columns.real, columns.imag]))
