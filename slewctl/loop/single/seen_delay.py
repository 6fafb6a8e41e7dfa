"""The delay that a sampled loop around a continuous plant stands, as its curves show it.

With the delay dT + m the held input falls into two periods (Åström and Wittenmark,
Computer-Controlled Systems, section 2.3), and

    L = z^(−d) R(z) (Γ(T−m) + z⁻¹ (Γ(T) − Γ(T−m))),    R = K(z) C (zI − e^(AT))⁻¹,

where R knows nothing of the delay: one evaluation on a grid serves all delays.  Where |L| = 1
on it and the turn that is left is a whole number of samples, L is near −1: from there both the
frequency and the delay are found by Newton's method.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.loop.single.hybrid_delay import (
    HybridDelay,
    confirmed,
    delayed_loop,
    fastest_that_matters,
    held,
    smallest_delay,
)
from slewctl.loop.single.return_ratio import BrokenLoop
from slewctl.numerics.balance import balance
from slewctl.numerics.frequency_response import FrequencyResponse, with_resonances
from slewctl.numerics.linear_system import LinearSystem

# Fractions of a sample at which curves are looked at, and their frequencies besides poles.
_PARTS, _POINTS = 64, 240
# Where a resonance is looked at, in its half-widths from its middle.
_WIDTHS = np.array([0.0, 0.3, 0.6, 1.0, 1.5, 2.5, 4.0, 8.0, 16.0])
# Newton's method: steps, those of its differences, and how near to −1 it comes.
_STEPS, _DIFFERENCE, _MET = 12, 1e-7, 1e-10
_BISECTIONS = 50
# From how many beginnings at most.
_TRIES = 40


def seen_delay(plant: LinearSystem, controller: LinearSystem, late: float) -> HybridDelay:
    """Return the smallest delay of the continuous signal that makes a sampled loop unstable.

    Parameters
    ----------
    plant : LinearSystem
        Continuous, one input.
    controller : LinearSystem
        Sampled, from the plant's outputs to its input, under negative feedback; the loop is
        stable as it is.
    late : float
        In s, that the loop has already: from the sample to the input computed from it.

    Returns
    -------
    HybridDelay
        As `smallest_delay` finds it, which is asked where poles at 1 ∓ 1e-6 of what is seen
        do not confirm it, or nothing is seen.
    """
    with_delay = delayed_loop(plant, controller, late)
    nominal = with_delay(0.0)
    found = None if np.any(plant.D) else _least(_Curves(plant, controller, late), nominal)
    if found is not None and confirmed(with_delay, found[0]):
        return HybridDelay(found[0], found[1], _PARTS, True)
    fastest = fastest_that_matters(plant, nominal)
    return smallest_delay(with_delay, controller.sample_time, fastest)


class _Curves:
    """L at frequencies in rad/s and delays in s, from the sample to the input in all."""

    def __init__(self, plant: LinearSystem, controller: LinearSystem, late: float) -> None:
        self.T, self.late = controller.sample_time, late
        A, B, C = (np.asarray(getattr(plant, name), dtype=float) for name in "ABC")
        scale = balance(A)
        self._A, self._B = A / scale[:, None] * scale, B / scale[:, None]
        turned, self._whole = held(self._A, self._B, self.T)
        states = LinearSystem(turned.T, (C * scale).T, np.eye(len(A)), np.zeros(C.T.shape), self.T)
        self._states, self._law = FrequencyResponse(states), FrequencyResponse(controller)

    def rows(self, omega: Array) -> ComplexArray:
        """Return R at each frequency, shape (ω, n)."""
        law = self._law(omega).reshape(len(omega), 1, -1)
        states = self._states(omega).reshape(len(omega), len(self._A), -1)
        return np.asarray((states * law).sum(axis=2))

    def at(self, omega: Array, rows: ComplexArray, delays: Array) -> ComplexArray:
        """Return L, shape (ω, delays), of additional delays."""
        whole, left = self._split(delays)
        later = np.hstack([held(self._A, self._B, h)[1] for h in left])
        return self._delayed(omega, rows, whole, later)

    def swept(self, omega: Array) -> tuple[Array, ComplexArray]:
        """Return additional delays of equal parts of a sample, and L, shape (ω, delays).

        Γ goes from each to the next by one map.
        """
        delays = np.arange(_PARTS) / _PARTS * self.T
        whole, left = self._split(delays)
        order = np.argsort(left)
        later = np.empty((len(self._A), _PARTS))
        map_, step = held(self._A, self._B, self.T / _PARTS)
        _, now = held(self._A, self._B, left[order[0]])
        for k in order:
            later[:, k] = now[:, 0]
            now = map_ @ now + step
        return delays, self._delayed(omega, self.rows(omega), whole, later)

    def _split(self, delays: Array) -> tuple[Array, Array]:
        """Return whole samples d, and T − m."""
        whole = np.floor((self.late + delays) / self.T + 1e-12)
        return whole, self.T - np.maximum(self.late + delays - whole * self.T, 0.0)

    def _delayed(
        self, omega: Array, rows: ComplexArray, whole: Array, later: Array
    ) -> ComplexArray:
        z = np.exp(1j * omega * self.T)[:, None]
        first, second = rows @ later, rows @ (self._whole - later)
        return np.asarray(z**-whole * (first + second / z))

    def met(self, omega: float, delay: float) -> tuple[float, float] | None:
        """Return a delay and its frequency with L = −1, from near ones; None if there is none."""
        for _ in range(_STEPS):
            step_omega, step = _DIFFERENCE * omega, _DIFFERENCE * self.T
            near = np.array([omega, omega + step_omega])
            values = self.at(near, self.rows(near), np.array([delay, delay + step])) + 1
            missing = values[0, 0]
            if abs(missing) < _MET:
                return delay, omega
            slopes = (values[1, 0] - missing) / step_omega, (values[0, 1] - missing) / step
            matrix = np.array([[s.real for s in slopes], [s.imag for s in slopes]])
            try:
                moved = np.linalg.solve(matrix, [-missing.real, -missing.imag])
            except np.linalg.LinAlgError:
                return None
            omega, delay = omega + float(moved[0]), delay + float(moved[1])
            if not (0 < omega <= np.pi / self.T and -self.T < delay < np.inf):
                return None
        return None

    def flipped(self, values: Array) -> tuple[float, float] | None:
        """Return the first delay with L = −1 at half the sampling frequency, where L is real.

        There a sample turns its sign: after two it begins again.
        """
        last = np.array([np.pi / self.T])
        rows, size = self.rows(last), len(values)
        both = np.concatenate([values, -values, values[:1]])
        passed = np.flatnonzero((both[:-1] > -1) & (both[1:] <= -1))
        if not len(passed):
            return None
        low, high = (self.T * (passed[0] + k) / size for k in (0, 1))
        for _ in range(_BISECTIONS):
            middle = (low + high) / 2
            value = float(self.at(last, rows, np.array([middle]))[0, 0].real)
            low, high = (middle, high) if value > -1 else (low, middle)
        return high, float(last[0])


def _least(curves: _Curves, nominal: LinearSystem) -> tuple[float, float] | None:
    """Return the smallest delay that is met and its frequency; None if there is none."""
    T = curves.T
    omega = _frequencies(nominal, T)
    delays, values = curves.swept(omega)
    if not np.isfinite(values).all():
        return None
    best = curves.flipped(values[-1].real)
    begun = sorted(_beginnings(omega, values, delays, T))
    for delay, at in begun[:_TRIES]:
        if best is not None and delay > best[0] + T:
            break
        found = curves.met(at, delay)
        if found is not None and found[0] > 0 and (best is None or found[0] < best[0]):
            best = found
    return best


def _beginnings(
    omega: Array, values: ComplexArray, delays: Array, T: float
) -> Iterator[tuple[float, float]]:
    """Yield delays and frequencies near which L = −1."""
    gain = np.log(np.abs(values))
    low, column = np.nonzero((gain[1:] > 0) != (gain[:-1] > 0))
    first, last = gain[low, column], gain[low + 1, column]
    part = first / (first - last)
    at = omega[low] + part * (omega[low + 1] - omega[low])
    turn = np.angle(values[low + 1, column] / values[low, column])
    left = np.mod(np.angle(-values[low, column]) + part * turn, 2 * np.pi)
    for lap in (0, 1):  # what has just become too late has a whole turn left
        samples = (left - 2 * np.pi * lap) / (at * T)
        whole = np.round(samples)
        near = (np.abs(samples - whole) <= 1.5 / _PARTS) & (whole >= 0)
        yield from zip(
            np.maximum(delays[column] + samples * T, 0.0)[near].tolist(),
            at[near].tolist(),
            strict=True,
        )


def _frequencies(nominal: LinearSystem, T: float) -> Array:
    """Return frequencies up to half that of sampling, dense at poles of both loops."""
    loop = BrokenLoop(nominal)
    z = np.concatenate([loop.poles + 1, loop.response.poles])
    with np.errstate(divide="ignore"):
        s = np.log(z[np.abs(z) > 0]) / T
    size = np.abs(s)[(np.abs(s) > 0) & np.isfinite(s)]
    last = np.pi / T
    grid = np.geomspace(min(float(size.min(initial=last)), last) / 10, last, _POINTS)
    ringing = s[s.imag > 0]
    return with_resonances(grid, ringing.imag, np.abs(ringing.real), _WIDTHS)
