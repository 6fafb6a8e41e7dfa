"""The motion of an arm under a sampled controller during and after a slew, exact at all times.

Between two instants at which its input changes the arm moves freely under a held input; from
sample to sample the loop is a linear map.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cached_property

import numpy as np
from scipy.linalg import expm

from slewctl._types import Array, ComplexArray, IntArray
from slewctl.errors import AccuracyError, InputError
from slewctl.loop.motion.block_motion import triangle
from slewctl.loop.motion.decoupled import Decoupled, decoupled
from slewctl.loop.motion.extremes import Part
from slewctl.loop.motion.modal_motion import Motion, decayed, driven
from slewctl.loop.motion.slew_inputs import WATCHED, Slew, signals, told
from slewctl.loop.sampled import SampledLoop
from slewctl.plant import arm_signals, split_delay

# Relative: an instant this little after the end is the end.
_ROUNDING = 1e-12
# Samples of a stretch of motion, and of a whole slew at most.
_FEWEST, _MANIEST, _MOST = 64, 4096, 200_000
# So many stretches are kept, for all searches begin with them.
_KEPT = 8
# Samples are counted up to here.
_COUNTED = 2.0**53
# A motion that loses more than this in a sample is taken to lose this.
_LEAST = 1e-2


class SampledMotion:
    """Signals of a slew (see `signals`), in pieces between the changes of the input.

    Parameters
    ----------
    loop : SampledLoop
        Stable.
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
        For a slew of very many samples.
    """

    def __init__(self, loop: SampledLoop, slew: Slew) -> None:
        self._T, K = loop.sample_time, loop.controller.linear
        # When that is which is read at the first sample.
        self._first_read = -loop.reading_late
        self._map, rows = loop.closed.A, signals(loop)
        self._plant = arm_signals(loop.plant, WATCHED)
        self._outputs, self._through = rows @ self._plant.C, rows @ self._plant.D[:, 0]
        whole, fraction = split_delay(self._T, loop.late)
        spans = ((fraction, whole + 1), (self._T - fraction, whole))
        # How the signals and the states move while an input that is so late acts.
        modes = decoupled(np.asarray(self._plant.A), lambda rates: np.full(len(rates), self._T))
        self._spans = [(lag, *self._held(modes, h)) for h, lag in spans if h > 0]
        # From the states at an instant to what is computed there, and what is added to both.
        Bk, Ck, Dk = (np.asarray(m) for m in (K.B, K.C, K.D))
        self._computed = np.hstack([Dk @ loop.sampled.C, Ck])[0]
        given = sampled_inputs(loop, slew)
        added = given @ np.append(-Dk[0], 1.0)
        pushed = np.hstack([added[:, None] * loop.sampled.B[:, 0], -given[:, :-1] @ Bk.T])
        states = [np.zeros(len(self._map))]
        for push in pushed[:-1]:
            states.append(self._map @ states[-1] + push)
        # At the last of these instants the reference is at rest.
        self._states, self._added = np.array(states), added
        self._end = np.linalg.solve(np.eye(len(self._map)) - self._map, pushed[-1])
        size, turned = len(self._plant.A), len(given) - 1
        held = self._computed @ self._end + added[-1]
        self.final = self._outputs @ self._end[:size] + self._through * held
        self._made: dict[int, list[Part]] = {}
        # The first stretch is about as long as the slew; then they double, up to the longest.
        self._width = min(max(turned, _FEWEST), _MANIEST)
        self._doublings = math.floor(math.log2(_MANIEST / self._width))
        self.turning = [
            self._pieces(self._states[k], k)
            for k in np.array_split(np.arange(turned), -(-turned // _MANIEST))
        ]

    def _held(self, modes: Decoupled, h: float) -> tuple[Motion, Array]:
        """Return the signals for a time h from unit states and input, and the states after it."""
        A, B = np.asarray(self._plant.A), np.asarray(self._plant.B)
        n = len(A)
        drive, direct = np.zeros((n + 1, n, 1)), np.zeros((n + 1, len(self._through), 1))
        drive[n], direct[n, :, 0] = B, self._through
        states, starts = np.eye(n + 1, n), np.zeros(n + 1)
        basis = driven(modes, self._outputs, states, drive, direct, starts, h)
        whole = np.block([[A, B], [np.zeros((1, n + 1))]])
        return basis, expm(whole * h)[:n].T

    def resting(
        self, signals: IntArray, margins: Callable[[], Array], *, backwards: bool = False
    ) -> Iterator[list[Part]]:
        """Yield the motion after the slew, in stretches of many samples."""

        def until() -> IntArray:
            """Return how many stretches each signal needs."""
            pairs = zip(signals, margins(), strict=True)
            return np.array([self._stretches(self._decayed(*pair)) for pair in pairs])

        if backwards:
            yield from map(self._stretch, reversed(range(until().max())))
            return
        k = 0
        while np.any(awaited := until() > k):
            # No interval of a signal that has decayed: its cuts run backwards.
            sign = np.where(awaited, 1.0, -1.0)[:, None]
            yield [(motion, sign * cuts) for motion, cuts in self._stretch(k)]
            k += 1

    def _decayed(self, signal: int, margin: float) -> float:
        """Return after how many samples a signal stays within `margin` of its last value."""
        parts = [(float(size[signal]), a, b, order) for size, a, b, order in self._decays]
        return decayed(parts, margin)

    @cached_property
    def _decays(self) -> list[tuple[Array, float, float, int]]:
        """Size of each signal, decay, coupling and order of each mode from sample to sample."""
        # Of what changes in a sample: at a fast clock all factors are near to one, and which
        # modes are near to each other only their differences from it tell.
        still = np.eye(len(self._map))
        modes = decoupled(self._map - still, lambda changes: _lasting(1 + changes))
        left = self._states[-1] - self._end
        columns = modes.right * (modes.left @ left)
        decays = np.log(np.maximum(np.abs(1 + modes.rates), _LEAST))
        sizes = self._sizes(columns)
        found = [(size, float(a), 0.0, 1) for size, a in zip(sizes, decays, strict=True)]
        for block in modes.blocks:
            size = np.linalg.norm(self._sizes(block.right), axis=0)
            T = block.T + np.eye(len(block.T))
            largest = max(float(np.abs(np.diag(T)).max()), _LEAST)
            coupling = triangle(T) / largest
            start = float(np.linalg.norm(block.left @ left))
            found.append((size * start, math.log(largest), coupling, len(T)))
        return found

    def _sizes(self, columns: ComplexArray) -> Array:
        """Bound the signals over a sample that starts with each column, shape (k, signals)."""
        both = np.concatenate([columns.real.T, columns.imag.T])
        none = np.zeros(len(both))
        parts = [motion.bounds() for motion, _ in self._moved(both, none, none)]
        largest = np.maximum.reduce(parts)
        return np.hypot(largest[: columns.shape[1]], largest[columns.shape[1] :])

    def _first(self, k: int) -> int:
        """Return the first sample after the slew of the k-th stretch."""
        early = min(k, self._doublings)
        return self._width * (2**early * (1 + k - early) - 1)

    def _stretches(self, samples: float) -> int:
        """Return how many stretches hold so many samples."""
        early = math.ceil(math.log2(samples / self._width + 1))
        if early <= self._doublings:
            return max(early, 1)
        longest = self._width * 2**self._doublings
        return self._doublings + math.ceil((samples - self._first(self._doublings)) / longest)

    def _stretch(self, k: int) -> list[Part]:
        """Return the k-th stretch of samples after the slew."""
        if k in self._made:
            return self._made[k]
        first, count = self._first(k), self._first(k + 1) - self._first(k)
        samples = len(self._added) - 1 + first + np.arange(count)
        made = self._pieces(self._resting(first, 1, count), samples)
        if k < _KEPT:
            self._made[k] = made
        return made

    def _resting(self, first: int, stride: int, count: int) -> Array:
        """Return the states at `count` instants after the slew, from `first` on."""
        away = np.linalg.matrix_power(self._map, first) @ (self._states[-1] - self._end)
        step, found = np.linalg.matrix_power(self._map, stride), away[None]
        while len(found) < count:
            found = np.concatenate([found, found @ step.T])
            step = step @ step
        return self._end + found[:count]

    def _pieces(self, states: Array, samples: IntArray) -> list[Part]:
        """Return the motion from states (p, N) at the samples of these numbers."""
        added = self._added[np.minimum(samples, len(self._added) - 1)]
        starts = np.asarray(self._first_read + self._T * samples, dtype=float)
        return self._moved(states, added, starts)

    def _moved(self, states: Array, added: Array, starts: Array) -> list[Part]:
        """Return the motion from states (p, N), where so much is added to what is computed."""
        n = len(self._plant.A)
        x, computed, parts = states[:, :n], states @ self._computed + added, []
        for lag, basis, transition in self._spans:
            shares = np.column_stack([x, states[:, n + lag - 1] if lag else computed])
            parts.append((basis.combined(shares, starts), np.array([[0.0, basis.length]])))
            x, starts = shares @ transition, starts + basis.length
        return parts

    def curves(self, end: float, points: int) -> tuple[Array, Array]:
        """Return about so many times from 0 to `end`, and the signals there."""
        whole = end - self._first_read
        if not whole / self._T < _COUNTED:
            raise InputError(
                f"{end:g} s are too many samples of {self._T:g} s",
                where="slew.horizon_s",
                remedy="draw a shorter time",
            )
        samples = math.floor(whole / self._T * (1 + _ROUNDING)) + 1
        first = math.floor(-self._first_read / self._T * (1 + _ROUNDING))  # the last until 0
        drawn, turned = samples - first, len(self._added) - 1
        stride = max(drawn // points, 1)
        early = np.arange(first, min(samples, turned), stride)
        later = np.arange(first + len(early) * stride, samples, stride)
        states = self._states[early]
        if len(later):
            states = np.concatenate(
                [states, self._resting(int(later[0]) - turned, stride, len(later))]
            )
        parts = self._pieces(states, np.append(early, later))
        if stride > 1:
            parts = parts[:1]
        wanted, times, found = -(-points // drawn), [], []
        for motion, _ in parts:
            within = max(round(wanted * motion.length / self._T), 1)
            tau = motion.length / within * np.arange(within)
            piece = np.repeat(np.arange(len(states)), within)
            times.append((motion.starts[:, None] + tau).ravel())
            found.append(motion.at(piece, np.tile(tau, len(states))))
        t, values = np.concatenate(times), np.hstack(found)
        if self._first_read:  # the slew begins within a sample, whatever is drawn of it
            kept = t > 0
            t, values = (
                np.append(0.0, t[kept]),
                np.column_stack([self._beginning(first), values[:, kept]]),
            )
        order = np.argsort(t, kind="stable")
        order = order[t[order] <= end * (1 + _ROUNDING)]
        return t[order], values[:, order]

    def _beginning(self, first: int) -> Array:
        """Return the signals at the slew's start, which is in the motion from this sample on."""
        parts = self._pieces(self._states[first : first + 1], np.array([first]))
        begun = [motion for motion, _ in parts if motion.starts[0] <= _ROUNDING * self._T]
        since = np.maximum(-begun[-1].starts, 0.0)
        return np.asarray(begun[-1].at(np.array([0]), since)[:, 0])


def _lasting(factors: ComplexArray) -> Array:
    """Return how many samples a motion lasts that is multiplied by so much in each."""
    return np.asarray(1 / np.maximum(1 - np.abs(factors), np.finfo(float).eps))


def sampled_inputs(loop: SampledLoop, slew: Slew) -> Array:
    """Return [sensor references, feedforward] at each sample until the reference is at rest.

    Readings that are late are held against the reference of their own time; what is added to
    the command waits for the drive alone.
    """
    T = loop.sample_time
    turned = (slew.duration_s + loop.reading_late) / T
    if turned > _MOST:
        raise AccuracyError(
            f"a slew of {slew.duration_s:g} s has more than {_MOST} samples of {T:g} s",
            where="slew.duration_s",
            remedy="make it shorter, or sample more slowly",
        )
    read = T * np.arange(max(math.ceil(turned), 1) + 2.0) - loop.reading_late
    inputs = told(loop)
    # Each input acts from one of these times to the next.
    angle, rate, _ = slew.reference(loop.late + read)
    means = np.array([np.diff(angle), np.diff(rate)]) / T
    readings = inputs[:-1] @ np.array(slew.reference(read[:-1]))
    return np.vstack([readings, inputs[-1:, 1:] @ means]).T
