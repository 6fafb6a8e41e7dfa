"""One Riccati gain from one matrix inequality.

The largest X with

    ⎡AᵀX + XA + Q   XB⎤
    ⎣    BᵀX         I⎦ ⪰ 0

is the stabilising solution of the Riccati equation AᵀX + XA − XBBᵀX + Q = 0 (Willems, IEEE
Trans. Automatic Control 16, 1971, theorem 5), and BᵀX its gain.  Every X that satisfies the
inequality lies below it, so that its value bounds the optimum from below.

What decides whether an interior-point solver gets there is the scaling: energy states
(`slewctl.design.energy_coordinates`), X in units of a multiple of √(‖Q‖/‖BBᵀ‖), and for the
filter a weight (ω/ω₁)^(−3/4) on the rows of each mode, a congruence that changes neither the
feasible set nor the optimum.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import solve_continuous_lyapunov

from slewctl._types import Array
from slewctl.numerics.matrix_equations import Regulator

if TYPE_CHECKING:
    import cvxpy


@dataclass(frozen=True)
class Tuning:
    """How one inequality is scaled, found by trial over arms, bases and orders.

    Attributes
    ----------
    unit : float
        X is measured in this times √(‖Q‖/‖BBᵀ‖).
    power : float
        Rows are weighted by (ω/ω₁) to this power.
    tolerance : float
        What the solver is asked for.  The cost is stationary at the optimum, so its error is
        the square of the gain's.
    """

    unit: float
    power: float
    tolerance: float


# Found by trial, see `Tuning`; the filter is the dual in other units.
REGULATOR = Tuning(unit=10.0, power=0.0, tolerance=7e-11)
FILTER = Tuning(unit=0.1, power=-0.75, tolerance=1e-8)


@dataclass(frozen=True, eq=False)
class GainLMI:
    """One matrix inequality, ready to be inspected, extended and solved.

    Attributes
    ----------
    problem : cvxpy.Problem
        Maximises tr X in scaled coordinates.
    X : cvxpy.Variable
        Symmetric, shape (n, n); the solution of the scaled Riccati equation is unit·X.
    A, B, Q : ndarray, shapes (n, n), (n, m), (n, n)
        The inequality's data, without cross term: the scaled gain is √unit·BᵀX …
    preliminary : ndarray, shape (m, n)
        … on top of this one, which takes the cross term out.
    unit : float
    tolerance : float
        What the solver is asked for.
    """

    problem: cvxpy.Problem
    X: cvxpy.Variable
    A: Array
    B: Array
    Q: Array
    preliminary: Array
    unit: float
    tolerance: float

    @property
    def below(self) -> Array:
        """A matrix below the scaled Riccati solution, once the problem is solved.

        The solver's X violates the inequality by its tolerance; a Lyapunov equation with the
        closed loop takes off what that can have raised it by.
        """
        X = np.asarray(self.X.value)
        half = X @ self.B
        residual = self.A.T @ X + X @ self.A + self.Q - half @ half.T
        closed = self.A - self.B @ half.T
        if np.linalg.eigvals(closed).real.max() < 0:
            values, vectors = np.linalg.eigh((residual + residual.T) / 2)
            violation = (vectors * np.minimum(values, 0.0)) @ vectors.T
            X = X - solve_continuous_lyapunov(closed.T, violation)
        return self.unit * X

    @property
    def gain(self) -> Array:
        """The scaled gain, shape (m, n), once the problem is solved."""
        return self.preliminary + np.sqrt(self.unit) * (self.B.T @ np.asarray(self.X.value))


def gain_lmi(A: Array, B: Array, C: Array, D: Array, omega: Array, tuning: Tuning) -> GainLMI:
    """Return the problem max tr X for the cost |Cx + Du|².

    Parameters
    ----------
    A, B, C, D : ndarray, shapes (n, n), (n, m), (p, n), (p, m)
        With DᵀD = I.
    omega : ndarray, shape (n,)
        Frequency of each state's mode over the lowest.
    tuning : Tuning
    """
    import cvxpy as cp  # only those who synthesise by matrix inequalities wait for it

    kept = Regulator.of(A, B, C, D)
    size = np.linalg.norm(kept.C, 2) or np.linalg.norm(C, 2) or 1.0
    A, B, C = kept.A, kept.B, kept.C
    unit = tuning.unit * float(size / np.linalg.norm(B, 2))
    B, Q = B * np.sqrt(unit), C.T @ C / unit
    n, m = B.shape
    weight = omega**tuning.power
    rows = np.vstack([np.diag(weight), np.zeros((m, n))])
    columns = np.hstack([A * weight, B])
    constant = np.zeros((n + m, n + m))
    constant[:n, :n], constant[n:, n:] = Q * np.outer(weight, weight), np.eye(m)
    X = cp.Variable((n, n), symmetric=True, name="X")
    # One product instead of blocks: the solver, not the modelling, takes the time.
    half = rows @ X @ columns
    problem = cp.Problem(cp.Maximize(cp.trace(X)), [half + half.T + constant >> 0])
    return GainLMI(problem, X, A, B, Q, kept.gain, unit, tuning.tolerance)
