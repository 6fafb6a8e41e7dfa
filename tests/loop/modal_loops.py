"""Single loops given by poles, zeros and residues, with their transfer function in closed form."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import control
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class ModalLoop:
    """k · Π(1 + s/zero)/Π(1 + s/lag) · Σ residue/(s² + 2ζωs + ω²), more lags than zeros."""

    omega: Sequence[float]
    zeta: Sequence[float]
    residues: Sequence[float]
    zeros: Sequence[float]
    lags: Sequence[float]
    gain: float

    @property
    def function(self) -> Callable[[Array], ComplexArray]:
        """L(jω), infinite at a pole on the axis."""

        def value(omega: Array) -> ComplexArray:
            s = 1j * np.asarray(omega, dtype=float)[:, None]
            w, z, r = (np.array(v) for v in (self.omega, self.zeta, self.residues))
            with np.errstate(all="ignore"):
                modes = np.sum(r / (s**2 + 2 * z * w * s + w**2), axis=1)
                lead = np.prod(1 + s / np.array(self.zeros), axis=1)
                result = self.gain * modes * lead / np.prod(1 + s / np.array(self.lags), axis=1)
            return np.where(np.isfinite(result), result, complex(np.inf, 0))

        return value

    @property
    def system(self) -> control.StateSpace:
        """The same loop as a chain of first- and second-order blocks."""
        blocks = [
            np.array([[0, 1], [-(w**2), -2 * z * w]])
            for w, z in zip(self.omega, self.zeta, strict=True)
        ]
        A = np.kron(np.eye(len(blocks)), np.zeros((2, 2)))
        for i, block in enumerate(blocks):
            A[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = block
        B = np.kron(np.ones((len(blocks), 1)), [[0.0], [1.0]])
        C = np.kron(self.gain * np.array([self.residues]), [[1.0, 0.0]])
        loop = control.StateSpace(A, B, C, 0)
        for i, lag in enumerate(self.lags):
            if i < len(self.zeros):  # (1 + s/z)/(1 + s/p) = p/z + p(1 − p/z)/(s + p)
                ratio = lag / self.zeros[i]
                loop = control.StateSpace(-lag, 1, lag * (1 - ratio), ratio) * loop
            else:
                loop = control.StateSpace(-lag, 1, lag, 0) * loop
        return loop

    @property
    def poles(self) -> ComplexArray:
        """Open- and closed-loop poles."""
        A, B, C = (np.asarray(getattr(self.system, name)) for name in "ABC")
        return np.concatenate([np.linalg.eigvals(A), np.linalg.eigvals(A - B @ C)])
