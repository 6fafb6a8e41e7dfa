"""Evaluation of a transfer function at many frequencies together."""

from __future__ import annotations

import control
import numpy as np
from scipy.linalg import schur

from slewctl._types import Array, ComplexArray
from slewctl.linalg import balance


class FrequencyResponse:
    """G(s) of a single-input single-output system, from one complex Schur form.

    The back substitution runs over the states once for all frequencies, so that a
    thousand frequencies of a 60-state loop take milliseconds.

    Parameters
    ----------
    system : control.StateSpace
        One input, one output, continuous.
    """

    def __init__(self, system: control.StateSpace) -> None:
        scale = balance(np.asarray(system.A))
        A = np.asarray(system.A) / scale[:, None] * scale
        self._T, Z = schur(A, output="complex")
        self._b = Z.conj().T @ (np.asarray(system.B)[:, 0] / scale)
        self._c = (np.asarray(system.C)[0] * scale) @ Z
        self._d = float(system.D[0, 0])

    @property
    def poles(self) -> ComplexArray:
        """Poles of the system."""
        return np.diag(self._T)

    def __call__(self, omega: Array) -> ComplexArray:
        """Return G(jω) for each ω in rad/s; infinite at a pole on the axis."""
        return self.with_rounding(omega)[0]

    def with_rounding(self, omega: Array) -> tuple[ComplexArray, Array]:
        """Return G(jω) and an estimate of its absolute rounding error.

        Far above the poles the terms of C x cancel to a high order and what is left is
        rounding; no sign of G may be trusted there.
        """
        s = 1j * np.asarray(omega, dtype=float)
        size = len(self._b)
        x = np.empty((size, s.size), dtype=complex)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            for i in range(size - 1, -1, -1):
                x[i] = (self._b[i] + self._T[i, i + 1 :] @ x[i + 1 :]) / (s - self._T[i, i])
            values = self._c @ x + self._d
            rounding = size * np.finfo(float).eps * (np.abs(self._c) @ np.abs(x))
        finite = np.isfinite(values)
        return np.where(finite, values, complex(np.inf, 0)), np.where(finite, rounding, np.inf)
