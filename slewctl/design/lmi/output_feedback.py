"""Output feedback by one matrix inequality with two kinds of norm, in tamed coordinates.

For a controller of the plant's order the closed loop's Lyapunov inequality becomes linear in
R, S, Â, B̂, Ĉ (Scherer, Gahinet and Chilali, IEEE Trans. Automatic Control 42, 1997):

    ⎡R  I⎤         ⎡AR + B₂Ĉ      A    ⎤        ⎡    B₁     ⎤
    ⎣I  S⎦ ≻ 0,    ⎣   Â      SA + B̂C₂⎦,       ⎣SB₁ + B̂D₂₁⎦,      [CR + DĈ   C]

are positive definite, state matrix, disturbance and output.  For the LQG design R = P + Y and
S = Y⁻¹, with P the covariance of the estimate and Y that of its error.  So the inequalities
are written in the coordinates of estimate and error in which both are the identity:

    R = Y₀ + T_P R' T_Pᵀ,   S = T_Y⁻ᵀ S' T_Y⁻¹,    P₀ = T_P T_Pᵀ,   Y₀ = T_Y T_Yᵀ,

a congruence by [[T_P⁻ᵀ, 0], [−Y₀T_P⁻ᵀ, T_Y]], under which LQG has R' = S' = I.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from slewctl._types import Array
from slewctl.design.lmi.blocks import MARGINS, Block, definiteness, gap, run
from slewctl.design.result import Check

# A coarser tolerance asks whether there is a controller at all; one try answers that.
_FINE = 1e-7
# How far from the inequalities' optimum the cost's bound may be; it is a bound all the same.
_GAP = 1e-3


@dataclass(frozen=True, eq=False)
class Channel:
    """x' = A x + B w + …, z = C x + D u, y = C₂ x + E w: one disturbance and one output."""

    B: Array
    C: Array
    D: Array
    E: Array


@dataclass(frozen=True, eq=False)
class OutputProblem:
    """Minimise the H2 norm of one channel, with the H∞ norm of another at most `level`.

    Attributes
    ----------
    A, B2, C2 : ndarray
    cost, bounded : Channel
    level : float
    P, Y : ndarray, shape (n, n)
        Covariances of estimate and error of a known controller, such as the LQG design.
    control : float
        Standard deviation of its control.
    """

    A: Array
    B2: Array
    C2: Array
    cost: Channel
    bounded: Channel
    level: float
    P: Array
    Y: Array
    control: float


@dataclass(frozen=True, eq=False)
class OutputFeedback:
    """u = C x_k, x_k' = A x_k + B y, as the solver found it, with its checks.

    `A` is None if nothing was found.
    """

    A: Array | None = None
    B: Array = field(default_factory=lambda: np.zeros((0, 0)))
    C: Array = field(default_factory=lambda: np.zeros((0, 0)))
    bound: float = np.inf
    checks: tuple[Check, ...] = ()
    status: str = "nothing was solved"
    near: OutputProblem | None = None  # the same problem in the coordinates of this answer

    @property
    def sound(self) -> bool:
        """Whether there is a controller and every check passed."""
        return self.A is not None and all(check.passed for check in self.checks)


class _Joint:
    """The unknowns and the blocks, in the coordinates of estimate and error."""

    def __init__(self, problem: OutputProblem) -> None:
        import cvxpy as cp  # only those who synthesise by matrix inequalities wait for it

        n, m, p = len(problem.A), problem.B2.shape[1], len(problem.C2)
        self.problem = problem
        self.TP, self.TY = np.linalg.cholesky(problem.P), np.linalg.cholesky(problem.Y)
        self.G = np.linalg.solve(self.TP, self.TY)
        self.AP = np.linalg.solve(self.TP, problem.A @ self.TP)
        self.AY = np.linalg.solve(self.TY, problem.A @ self.TY)
        self.BP = np.linalg.solve(self.TP, problem.B2) * problem.control
        self.CY, self.CP = problem.C2 @ self.TY, problem.C2 @ self.TP
        self.R = cp.Variable((n, n), symmetric=True)
        self.S = cp.Variable((n, n), symmetric=True)
        self.Z = cp.Variable((n, n))
        self.b = cp.Variable((n, p))
        self.c = cp.Variable((m, n))
        self.W: Any = None

    def gram(self) -> Any:
        """Return the Lyapunov matrix."""
        import cvxpy as cp  # see __init__

        eye, G = np.eye(len(self.G)), self.G
        corner = G @ (eye - self.S)
        return cp.bmat([[self.R + G @ (self.S - eye) @ G.T, corner], [corner.T, self.S]])

    def moved(self) -> Any:
        """Return state matrix times Lyapunov matrix."""
        import cvxpy as cp  # see __init__

        error = self.S @ self.AY + self.b @ self.CY
        first = self.AP @ self.R + self.BP @ self.c - self.G @ self.Z
        return cp.bmat([[first, self.G @ (self.AY - error)], [self.Z, error]])

    def disturbed(self, channel: Channel) -> Any:
        """Return the disturbance's columns."""
        import cvxpy as cp  # see __init__

        B = np.linalg.solve(self.TY, channel.B)
        error = self.S @ B + self.b @ channel.E
        return cp.vstack([self.G @ (B - error), error])

    def output(self, channel: Channel) -> Any:
        """Return the output's rows."""
        import cvxpy as cp  # see __init__

        control = self.problem.control * channel.D
        first = (channel.C @ self.TP) @ self.R + control @ self.c
        return cp.hstack([first, channel.C @ self.TY])

    def blocks(self, ratio: float) -> list[Block]:
        """Return the inequalities; the norm's Lyapunov matrix is `ratio` times the cost's."""
        import cvxpy as cp  # see __init__

        problem = self.problem
        gram, M = self.gram(), self.moved()
        B, Z = self.disturbed(problem.cost), self.output(problem.cost)
        self.W = cp.Variable((Z.shape[0], Z.shape[0]), symmetric=True)
        # Each channel in the unit in which its own entries are of size one.
        size = problem.control * np.linalg.norm(problem.bounded.D) or 1.0
        E, z = self.disturbed(problem.bounded), self.output(problem.bounded) / size
        k, rows = E.shape[1], z.shape[0]
        norm = cp.bmat(
            [
                [-(M + M.T), E, z.T],
                [E.T, ratio * np.eye(k), np.zeros((k, rows))],
                [z, np.zeros((rows, k)), (problem.level / size) ** 2 / ratio * np.eye(rows)],
            ]
        )
        return [
            Block("covariance", cp.bmat([[-(M + M.T), B], [B.T, np.eye(B.shape[1])]])),
            Block("output", cp.bmat([[self.W, Z], [Z.T, gram]])),
            Block("bounded real", norm),
        ]

    def recentred(self) -> OutputProblem | None:
        """Return the problem with the values found for known covariances, if they are any."""
        inverse = np.linalg.inv((self.S.value + self.S.value.T) / 2)
        Y = self.TY @ inverse @ self.TY.T
        estimate = self.R.value + self.G @ (np.eye(len(self.G)) - inverse) @ self.G.T
        P = self.TP @ estimate @ self.TP.T
        P, Y = (P + P.T) / 2, (Y + Y.T) / 2
        if min(np.linalg.eigvalsh(estimate).min(), np.linalg.eigvalsh(inverse).min()) <= 0:
            return None
        gain = np.linalg.solve(estimate.T, self.c.value.T).T
        spread = float(np.trace(gain @ estimate @ gain.T))
        return replace(self.problem, P=P, Y=Y, control=self.problem.control * np.sqrt(spread))

    def controller(self) -> tuple[Array, Array, Array]:
        """Return A_k, B_k and C_k of the values found, in the plant's coordinates."""
        R, S, G = self.R.value, self.S.value, self.G
        inverse = np.linalg.inv((S + S.T) / 2)
        estimate = R + G @ (np.eye(len(G)) - inverse) @ G.T
        b = G @ inverse @ self.b.value
        moved = self.AP @ R + self.BP @ self.c.value + b @ self.CP @ R - G @ inverse @ self.Z.value
        A = np.linalg.solve(estimate.T, moved.T).T
        C = self.problem.control * np.linalg.solve(estimate.T, self.c.value.T).T
        back = np.linalg.inv(self.TP)
        return np.asarray(self.TP @ A @ back), np.asarray(-self.TP @ b), np.asarray(C @ back)


def solve_output(
    problem: OutputProblem,
    spent: dict[str, float],
    *,
    tolerance: float,
    ratio: float = 1.0,
) -> OutputFeedback:
    """Return the output feedback of a problem; `spent` gains the seconds it took.

    Parameters
    ----------
    problem : OutputProblem
    spent : dict
        With keys ``build`` and ``solve``.
    tolerance : float
    ratio : float
        Of the two norms' Lyapunov matrices.
    """
    best = found = OutputFeedback()
    # The first margin is below what a problem of this size leaves unsolved; the second try of
    # the next one is in the coordinates of the first answer.
    for margin in (MARGINS[1], MARGINS[1], MARGINS[2]):
        found = _attempt(best.near or problem, spent, tolerance, margin, ratio)
        if found.A is not None and not best.sound:
            best = found
        if best.sound or found.A is None or tolerance > _FINE:
            break
    return best if best.A is not None else found


def _attempt(
    problem: OutputProblem,
    spent: dict[str, float],
    tolerance: float,
    margin: float,
    ratio: float,
) -> OutputFeedback:
    import cvxpy as cp  # see _Joint

    start = time.perf_counter()
    joint = _Joint(problem)
    blocks: Sequence[Block] = joint.blocks(ratio)
    scale = float(
        np.linalg.norm(problem.cost.C @ np.hstack([joint.TP, joint.TY])) ** 2
        + (np.linalg.norm(problem.cost.D) * problem.control) ** 2
    )
    cost = cp.trace(joint.W) / scale
    status, lmi, imposed = run(cost, blocks, tolerance, margin)
    solving = float(lmi.solver_stats.solve_time or 0.0) if lmi.solver_stats else 0.0
    spent["solve"] += solving
    spent["build"] += time.perf_counter() - start - solving
    if joint.R.value is None or not np.isfinite(joint.R.value).all():
        return OutputFeedback(status=status)
    A, B, C = joint.controller()
    near = joint.recentred()
    checks = (*definiteness(blocks), gap(imposed, float(cost.value), margin, _GAP))
    return OutputFeedback(A, B, C, float(cost.value) * scale, checks, status, near)
