"""H2-optimal output feedback by linear matrix inequalities, never believed unverified.

The largest X with

    ⎡AᵀX + XA + Q   XB⎤
    ⎣    BᵀX         R⎦ ⪰ 0

is the stabilising solution of the Riccati equation (Willems, IEEE Trans. Automatic Control
16, 1971, theorem 5), so maximising tr X gives the regulator, and the same problem for the
transposed plant gives the filter; by the separation principle both together are the optimal
output feedback.  An interior-point solver only gets there in good coordinates: states
[ωη, η̇] of equal energy, time in units of 1/ω₁, unit weight on the control, and X measured
so that Q and BBᵀ are equally large.  The filter also wants each mode's rows weighted by
(ω/ω₁)^(−1/2), a congruence that changes neither the feasible set nor the optimum.

Building and solving are two functions: the problem can be inspected, and constraints added
to it, before it is solved.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from slewctl._types import Array
from slewctl.design.lqg import observer_feedback, optimal_cost
from slewctl.design.lqr import check_assumptions, kalman, lqr
from slewctl.design.result import Check, Controller, finished
from slewctl.errors import AccuracyError, InputError
from slewctl.linalg import h2_cost
from slewctl.plant import GeneralisedPlant

if TYPE_CHECKING:
    import cvxpy

# The regulator's problem is well enough conditioned to be solved to rounding; the filter's
# stops at the solver's own limit near 1e-10, and asking for more only ends in warnings.
_REGULATOR_TOLERANCE = 1e-11
_FILTER_TOLERANCE = 1e-8
# A controller whose recomputed cost lies further above the optimum is not called optimal.
GAP = 1e-6


@dataclass(frozen=True, eq=False)
class GainLMI:
    """One matrix inequality, ready to be solved.

    Attributes
    ----------
    problem : cvxpy.Problem
        Maximises tr X in scaled coordinates.
    X : cvxpy.Variable
        Symmetric, shape (n, n).
    B : ndarray, shape (n, m)
        Scaled input matrix with R = I: the scaled gain is BᵀX.
    left, right : ndarray
        The gain in the plant's coordinates is left @ BᵀX @ right.
    tolerance : float
        What the solver is asked for.
    """

    problem: cvxpy.Problem
    X: cvxpy.Variable
    B: Array
    left: Array
    right: Array
    tolerance: float


@dataclass(frozen=True, eq=False)
class H2Problem:
    """The two inequalities of an H2 problem, and the plant they are for."""

    plant: GeneralisedPlant
    regulator: GainLMI
    filter: GainLMI


def h2_lmi(plant: GeneralisedPlant) -> Controller:
    """Return the H2-optimal controller of a plant by two matrix inequalities.

    Parameters
    ----------
    plant : GeneralisedPlant
        From `slewctl.generalised_plant`, in modal coordinates.

    Returns
    -------
    Controller
        Verified when its recomputed cost is within 1e-6 of the Riccati optimum.

    Raises
    ------
    DesignError
        If a mode is not penalised, not seen or not reached.
    AccuracyError
        If the solver returns nothing.
    InputError
        If the plant is not in modal coordinates.
    """
    return solve_h2(build_h2(plant))


def build_h2(plant: GeneralisedPlant) -> H2Problem:
    """Return the two inequalities of a plant, scaled; see `h2_lmi` for errors."""
    check_assumptions(plant)
    omega = _frequencies(plant)
    rate = omega[1] if len(omega) > 1 else 1.0
    omega[0] = rate  # the rigid body has no frequency of its own
    scale = np.concatenate([1 / omega, np.ones_like(omega)])
    A = plant.A / scale[:, None] * scale / rate
    weight = np.tile(np.sqrt(rate / omega), 2)
    regulator = _gain_lmi(
        A,
        plant.B2 / scale[:, None] / rate,
        plant.C1 * scale,
        plant.D12.T @ plant.D12,
        np.ones_like(scale),
        _REGULATOR_TOLERANCE,
    )
    # The dual problem: Aᵀ for A, sensors for inputs, disturbances for performance.
    observer = _gain_lmi(
        A.T,
        (plant.C2 * scale).T / rate,
        plant.B1.T / scale,
        plant.D21 @ plant.D21.T,
        weight,
        _FILTER_TOLERANCE,
    )
    return H2Problem(
        plant, _in_plant_coordinates(regulator, 1 / scale), _in_plant_coordinates(observer, scale)
    )


def solve_h2(problem: H2Problem) -> Controller:
    """Return the controller of a built problem, with what it achieves recomputed."""
    plant = problem.plant
    K, status = _solved(problem.regulator)
    Kf, filter_status = _solved(problem.filter)
    system = observer_feedback(plant, K, Kf.T, "h2_lmi")
    closed = plant.close(system)
    stable = np.linalg.eigvals(np.asarray(closed.A)).real.max() < 0
    cost = h2_cost(closed.A, closed.B, closed.C).value if stable else np.inf
    optimum = optimal_cost(plant, lqr(plant), kalman(plant))
    gap = Check(
        f"cost over the Riccati optimum ({status}, {filter_status})", abs(cost / optimum - 1), GAP
    )
    return finished(plant, system, "h2-lmi", {"state_feedback": K, "observer": Kf.T}, checks=(gap,))


def _frequencies(plant: GeneralisedPlant) -> Array:
    """Return ω of the rigid body (zero) and the flexible modes from a modal state matrix."""
    half = len(plant.A) // 2
    upper, lower = plant.A[:half], plant.A[half:, :half]
    modal = np.array_equal(upper, np.eye(half, 2 * half, half))
    if not modal or np.any(lower != np.diag(np.diag(lower))):
        raise InputError(
            "the plant is not in modal coordinates",
            where="h2_lmi",
            remedy="make it with slewctl.generalised_plant",
        )
    return np.sqrt(-np.diag(lower))


def _gain_lmi(A: Array, B: Array, C: Array, R: Array, weight: Array, tolerance: float) -> GainLMI:
    """Return the problem max tr X with Q = CᵀC; X is measured in units of √(‖Q‖/‖BR⁻¹Bᵀ‖)."""
    import cvxpy as cp  # only those who synthesise by matrix inequalities wait for it

    root = np.linalg.inv(np.linalg.cholesky(R))
    B = B @ root.T
    unit = np.linalg.norm(C, 2) / np.linalg.norm(B, 2)
    B, Q = B * np.sqrt(unit), C.T @ C / unit
    n, m = B.shape
    X = cp.Variable((n, n), symmetric=True)
    S = np.diag(weight)
    corner = S @ (X @ B)
    matrix = cp.bmat([[S @ (A.T @ X + X @ A + Q) @ S, corner], [corner.T, np.eye(m)]])
    problem = cp.Problem(cp.Maximize(cp.trace(X)), [(matrix + matrix.T) / 2 >> 0])
    return GainLMI(problem, X, B, np.sqrt(unit) * root.T, np.eye(n), tolerance)


def _in_plant_coordinates(lmi: GainLMI, right: Array) -> GainLMI:
    """Return the problem with its gain taken back to the plant's states."""
    return GainLMI(lmi.problem, lmi.X, lmi.B, lmi.left, np.diag(right), lmi.tolerance)


def _solved(lmi: GainLMI) -> tuple[Array, str]:
    """Return the gain in the plant's coordinates and what the solver said of it."""
    import cvxpy as cp  # see _gain_lmi

    limits = dict.fromkeys(("tol_gap_abs", "tol_gap_rel", "tol_feas"), lmi.tolerance)
    try:
        with warnings.catch_warnings():
            # "Solution may be inaccurate": whether it is, the recomputed cost decides.
            warnings.simplefilter("ignore", UserWarning)
            lmi.problem.solve(solver=cp.CLARABEL, direct_solve_method="faer", **limits)
    except cp.error.SolverError as error:
        raise AccuracyError(
            "the solver stopped without a solution",
            where="h2_lmi",
            remedy="use method lqg, or bring limits and noises closer together",
        ) from error
    if lmi.X.value is None:
        raise AccuracyError(
            f"the solver calls the inequality {lmi.problem.status}",
            where="h2_lmi",
            remedy="relax the constraints that were added to it",
        )
    return lmi.left @ (lmi.B.T @ lmi.X.value) @ lmi.right, str(lmi.problem.status)
