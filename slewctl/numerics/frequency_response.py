"""Evaluation of a transfer function at many frequencies together."""

from __future__ import annotations

import numpy as np
from scipy.linalg import schur, solve_triangular

from slewctl._types import Array, ComplexArray
from slewctl.numerics.balance import balance_system
from slewctl.numerics.linear_system import LinearSystem

# States that are solved for together; what lies behind them is one matrix product.
_BLOCK = 16


def sample_time(system: LinearSystem) -> float:
    """Return the sample time of a system in s, zero for a continuous one."""
    return float(system.dt or 0.0)


class FrequencyResponse:
    """G at points of the s or z plane, from one complex Schur form.

    The back substitution runs over the states once for all points, so that a thousand
    frequencies of a 60-state loop take milliseconds.  A sampled system is evaluated in
    δ = z − 1, which keeps the digits that z loses where the sampling is fast.

    Parameters
    ----------
    system : LinearSystem
        Continuous, or sampled with a known sample time.
    """

    def __init__(self, system: LinearSystem) -> None:
        self.sample_time = sample_time(system)
        scale = balance_system(*(np.asarray(getattr(system, name)) for name in "ABC"))
        A = np.asarray(system.A, dtype=float) / scale[:, None] * scale
        if self.sample_time:
            A = A - np.eye(len(A))
        self._T: ComplexArray = A.astype(complex)
        Z = self._T
        if len(A):
            self._T, Z = schur(A, output="complex")
        self._B = Z.conj().T @ (np.asarray(system.B) / scale[:, None])
        self._C = (np.asarray(system.C) * scale) @ Z
        self._D = np.asarray(system.D, dtype=float)

    @property
    def poles(self) -> ComplexArray:
        """Poles of the system, in the s plane or in the z plane."""
        return np.asarray(np.diag(self._T) + (1.0 if self.sample_time else 0.0), dtype=complex)

    @property
    def nyquist(self) -> float:
        """The highest frequency in rad/s: infinite, or half the sampling frequency."""
        return np.pi / self.sample_time if self.sample_time else np.inf

    @property
    def landmarks(self) -> Array:
        """Frequencies in rad/s near which G may change quickly: |p| and |Im p| of each pole."""
        return landmarks(np.diag(self._T), self.sample_time)

    def __call__(self, omega: Array) -> ComplexArray:
        """Return G at each ω in rad/s; infinite at a pole on the axis.

        Returns
        -------
        ndarray, shape (ω,) for one input and output, else (ω, outputs, inputs)
        """
        return self.with_rounding(omega)[0]

    def with_rounding(self, omega: Array) -> tuple[ComplexArray, Array]:
        """Return G at each ω and an estimate of its absolute rounding error.

        Far above the poles the terms of C x cancel to a high order and what is left is
        rounding; no sign of G may be trusted there.
        """
        return self._evaluated(axis_points(np.asarray(omega, dtype=float), self.sample_time))

    def at(self, points: ComplexArray) -> ComplexArray:
        """Return G at each s, or for a sampled system at each δ = z − 1."""
        return self._evaluated(np.asarray(points, dtype=complex))[0]

    def slope(self, points: ComplexArray) -> ComplexArray:
        """Return dG/ds = −C(sI − A)⁻²B of a single loop at each s, or at each δ = z − 1."""
        points = np.asarray(points, dtype=complex)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            once = self._solved(points, self._B[:, :, None])
            return np.asarray(-(self._C @ self._solved(points, once)[:, 0])[0])

    def uncertainty(self, omega: Array) -> Array:
        """Return how far a single loop may move at each ω when T moves by its rounding, ε‖T‖.

        This is ε‖C(sI − T)⁻¹‖‖T‖‖(sI − T)⁻¹B‖, from one pair of solves a frequency.
        """
        eye, size = np.eye(len(self._T)), float(np.linalg.norm(self._T))
        found = []
        for point in axis_points(np.asarray(omega, dtype=float), self.sample_time):
            matrix = point * eye - self._T
            if not np.all(np.diag(matrix)):
                found.append(np.inf)
                continue
            x = solve_triangular(matrix, self._B[:, 0])
            y = solve_triangular(matrix, self._C[0].conj(), trans="C")
            found.append(float(np.finfo(float).eps * np.linalg.norm(y) * size * np.linalg.norm(x)))
        return np.array(found)

    def _evaluated(self, points: ComplexArray) -> tuple[ComplexArray, Array]:
        outputs, inputs = self._D.shape
        size = len(self._T)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            x = self._solved(points, self._B[:, :, None]).reshape(size, inputs * points.size)
            values = (self._C @ x).reshape(outputs, inputs, points.size) + self._D[:, :, None]
            rounding = size * np.finfo(float).eps * (np.abs(self._C) @ np.abs(x))
        finite = np.isfinite(values)
        values = np.where(finite, values, complex(np.inf, 0))
        rounding = np.where(finite, rounding.reshape(outputs, inputs, points.size), np.inf)
        if outputs == inputs == 1:
            return values[0, 0], rounding[0, 0]
        return np.moveaxis(values, 2, 0), np.moveaxis(rounding, 2, 0)

    def _solved(self, points: ComplexArray, right: ComplexArray) -> ComplexArray:
        """Return (sI − T)⁻¹·right for each s, shape (states, inputs, points)."""
        T, inputs = self._T, self._B.shape[1]
        x = np.empty((len(T), inputs, points.size), dtype=complex)
        flat = x.reshape(len(T), inputs * points.size)
        for stop in range(len(T), 0, -_BLOCK):
            start = max(stop - _BLOCK, 0)
            x[start:stop] = right[start:stop]
            flat[start:stop] += T[start:stop, stop:] @ flat[stop:]
            for i in range(stop - 1, start - 1, -1):
                flat[i] += T[i, i + 1 : stop] @ flat[i + 1 : stop]
                x[i] /= points - T[i, i]
        return x


def axis_points(omega: Array, step: float) -> ComplexArray:
    """Return s = jω, or δ = e^(jωT) − 1 without cancellation, for each ω in rad/s."""
    if not step:
        return np.asarray(1j * omega, dtype=complex)
    half = np.asarray(omega) * step / 2
    return np.asarray(2j * np.sin(half) * np.exp(1j * half))


def with_resonances(grid: Array, middle: Array, half: Array, widths: Array) -> Array:
    """Return a grid of frequencies with more of them within it, dense at resonances.

    Parameters
    ----------
    grid : ndarray
        Increasing.
    middle, half : ndarray, shapes (resonances,)
        Where they are, and their half-widths.
    widths : ndarray
        Where each is looked at, in half-widths from its middle.
    """
    off = half[:, None] * widths
    around = np.concatenate([middle[:, None] - off, middle[:, None] + off]).ravel()
    within = around[(around > grid[0]) & (around < grid[-1])]
    return np.unique(np.concatenate([grid, within]))


def landmarks(poles: ComplexArray, step: float) -> Array:
    """Return |p| and |Im p| in rad/s of poles in s, or in δ = z − 1 with sample time `step`."""
    s = np.asarray(poles, dtype=complex)
    if step:
        with np.errstate(divide="ignore", invalid="ignore"):
            # log(1 + δ) with the digits of a small δ kept.
            size = 0.5 * np.log1p(2 * s.real + np.abs(s) ** 2)
            s = (size + 1j * np.angle(1 + s)) / step
        s = np.where(np.isfinite(s), s, 0)
    found = np.concatenate([np.abs(s), np.abs(s.imag)])
    return found[found <= np.pi / step] if step else found
