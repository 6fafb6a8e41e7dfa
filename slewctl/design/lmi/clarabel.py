"""The one call of the interior-point solver, with what it says put into plain words."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

from slewctl.errors import AccuracyError

if TYPE_CHECKING:
    import cvxpy


@dataclass(frozen=True)
class SolverRun:
    """What the solver says of itself; whether it is true, a recomputation decides.

    Attributes
    ----------
    status : str
        ``optimal`` or ``optimal_inaccurate``.
    iterations : int
    seconds : float
        Inside the solver, without what modelling costs.
    value : float
        Of the objective.
    """

    status: str
    iterations: int
    seconds: float
    value: float

    def __str__(self) -> str:
        return f"{self.status.replace('_', ', ')} in {self.iterations} iterations"


def run_clarabel(problem: cvxpy.Problem, tolerance: float, iterations: int = 200) -> bool:
    """Run Clarabel on a problem and return whether it left a point, of whatever worth.

    Parameters
    ----------
    problem : cvxpy.Problem
        Its variables and status hold what was found.
    tolerance : float
        For the duality gap and for feasibility.
    iterations : int
        The most that it may take.
    """
    import cvxpy as cp  # only those who synthesise by matrix inequalities wait for it

    limits = dict.fromkeys(("tol_gap_abs", "tol_gap_rel", "tol_feas"), tolerance)
    try:
        with warnings.catch_warnings():
            # "Solution may be inaccurate": whether it is, the recomputed result decides.
            warnings.simplefilter("ignore", UserWarning)
            problem.solve(
                solver=cp.CLARABEL,
                direct_solve_method="faer",
                max_iter=iterations,
                ignore_dpp=True,
                **limits,
            )
    except cp.error.SolverError:
        return False
    return True


def solve(problem: cvxpy.Problem, tolerance: float, where: str) -> SolverRun:
    """Solve a problem of matrix inequalities with Clarabel.

    Parameters
    ----------
    problem : cvxpy.Problem
        Its variables hold the solution afterwards.
    tolerance : float
        For the duality gap and for feasibility.
    where : str
        Named in errors.

    Raises
    ------
    AccuracyError
        If the solver stops without a point, or calls the problem infeasible or unbounded.
    """
    import cvxpy as cp  # only those who synthesise by matrix inequalities wait for it

    if not run_clarabel(problem, tolerance):
        raise AccuracyError(
            "the solver stopped without a solution",
            where=where,
            remedy="use method lqg, or bring limits and noises closer together",
        )
    if problem.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
        raise AccuracyError(
            f"the solver calls the matrix inequalities {problem.status}",
            where=where,
            remedy="relax the constraints that were added to them",
        )
    stats = problem.solver_stats
    return SolverRun(
        str(problem.status),
        int(stats.num_iters or 0),
        float(stats.solve_time or 0.0),
        float(problem.value),
    )
