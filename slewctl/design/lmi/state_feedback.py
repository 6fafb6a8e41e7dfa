"""State feedback by matrix inequalities that a solver can be trusted with.

The unknowns are P, a bound on the covariance of the state under white noise N w, and L = KP.
With M = AP − BL the closed loop's (A − BK)P,

    −(M + Mᵀ) − NNᵀ ⪰ 0,   ⎡ W   L ⎤ ⪰ 0,   minimise tr CPCᵀ + tr W
                           ⎣ Lᵀ  P ⎦

is the regulator problem (Boyd, El Ghaoui, Feron and Balakrishnan, Linear Matrix Inequalities
in System and Control Theory, SIAM 1994, chapter 7); pole regions, norms and variances
are further blocks that are linear in P and L.

What makes them solvable are the coordinates: the inequalities are written where a covariance
that is known already, that of the Riccati regulator, is the identity and its control has unit
variance.  In those the answer is of size one however unevenly the modes are excited.  A
result that the solver is not sure of gives the next, better coordinates.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.linalg import solve_continuous_lyapunov

from slewctl._types import Array
from slewctl.design.lmi.blocks import MARGINS, Block, definiteness, gap, run
from slewctl.design.result import Check

# Noise on every state, relative to the true one: it makes P positive definite, adds as much to
# the bound, and changes no Riccati optimum.
NOISE_FLOOR = 1e-6
TOLERANCE = 1e-8  # of the solver, relative: half of the digits
_LOOSE = 1e-4  # tried where the solver does not reach that; the result is checked all the same
# How far the cost's bound may be from the inequalities' optimum.  It is a bound all the same;
# sharing one Lyapunov matrix costs far more.
GAP = 1e-4


@dataclass(frozen=True, eq=False)
class Dynamics:
    """x' = A x + B u + N w with white noise w of unit intensity, and u = −K x to be found."""

    A: Array
    B: Array
    N: Array


@dataclass(frozen=True, eq=False)
class Disturbance:
    """A coloured disturbance that no control changes: x' = … + H e, e' = E e + N w.

    Attributes
    ----------
    E, N, H : ndarray
    C : ndarray
        What e itself adds to the cost's rows.
    """

    E: Array
    N: Array
    H: Array
    C: Array


@dataclass(frozen=True, eq=False)
class _Scaled:
    """A disturbance where a known covariance of e is the identity; `P` bounds it."""

    P: Any
    at: Disturbance


@dataclass(frozen=True, eq=False)
class Unknowns:
    """The unknowns in coordinates x = T ξ, u = diag(units) υ, and the data in the same.

    Attributes
    ----------
    P, L, W : cvxpy.Variable
        Of the scaled problem.
    dynamics : tuple of Dynamics
        In the scaled coordinates.
    T : ndarray, shape (n, n)
    units : ndarray, shape (m,)
    """

    P: Any
    L: Any
    W: Any
    dynamics: tuple[Dynamics, ...]
    T: Array
    units: Array
    disturbance: _Scaled | None = None

    def moved(self, vertex: int = 0) -> Any:
        """Return M = AP − BL, the closed loop's (A − BK)P."""
        at = self.dynamics[vertex]
        return at.A @ self.P - at.B @ self.L

    def variance(self, row: Array) -> Any:
        """Return tr c P cᵀ for rows c of the states."""
        import cvxpy as cp  # only those who synthesise by matrix inequalities wait for it

        scaled = np.atleast_2d(row) @ self.T
        return cp.sum(cp.multiply(scaled.T @ scaled, self.P))

    @property
    def control_variance(self) -> Any:
        """A bound on the variance of u, summed over the inputs."""
        return sum(float(unit**2) * self.W[i, i] for i, unit in enumerate(self.units))

    @property
    def disturbance_variance(self) -> Any:
        """A bound on what the coloured disturbance itself adds to the cost."""
        import cvxpy as cp  # see variance

        if self.disturbance is None:
            return 0.0
        rows = self.disturbance.at.C
        return cp.sum(cp.multiply(rows.T @ rows, self.disturbance.P))


Blocks = Callable[[Unknowns], Sequence[Block]]


def _no_blocks(unknowns: Unknowns) -> Sequence[Block]:
    return ()


@dataclass(frozen=True, eq=False)
class Regulator:
    """A state-feedback problem: dynamics (several: one gain for all), cost and constraints.

    Attributes
    ----------
    dynamics : tuple of Dynamics
    C : ndarray, shape (p, n)
        The cost's rows.
    control_weight : float
        Weight of the control's variance in the cost.
    blocks : callable
        Further blocks, from `Unknowns`.
    noise_floor : float
    gap : float
        Largest complementarity gap over the cost that counts as the optimum.
    disturbance : Disturbance, optional
        With one dynamics only.
    """

    dynamics: tuple[Dynamics, ...]
    C: Array
    control_weight: float = 1.0
    blocks: Blocks = _no_blocks
    noise_floor: float = NOISE_FLOOR
    gap: float = GAP
    disturbance: Disturbance | None = None
    nominal: Dynamics | None = None


@dataclass(frozen=True, eq=False)
class Feedback:
    """What the solver found, and what a recomputation says of it.

    Attributes
    ----------
    K : ndarray or None
        None if nothing was found.
    P : ndarray or None
        The Lyapunov matrix that certifies it.
    bound : float
        On the cost, infinite if nothing was found.
    checks : tuple of Check
        Every block's definiteness, from the numbers, and the complementarity gap.
    status : str
        What the solver said last; never relied upon.
    seconds : mapping of str to float
    """

    K: Array | None = None
    P: Array | None = None
    bound: float = np.inf
    checks: tuple[Check, ...] = ()
    status: str = "nothing was solved"
    seconds: Mapping[str, float] = field(default_factory=dict)

    @property
    def sound(self) -> bool:
        """Whether there is a gain and every check passed."""
        return self.K is not None and all(check.passed for check in self.checks)


def covariance(dynamics: Dynamics, K: Array, noise_floor: float = NOISE_FLOOR) -> Array:
    """Return the stationary covariance under u = −K x, with a little noise on every state."""
    closed = dynamics.A - dynamics.B @ K
    N = _with_floor(dynamics.N, noise_floor)
    P = solve_continuous_lyapunov(closed, -N @ N.T)
    return np.asarray((P + P.T) / 2)


def _with_floor(N: Array, floor: float) -> Array:
    """Return the noise N with a little noise of its own on every state."""
    return np.hstack([N, np.sqrt(floor) * np.linalg.norm(N, 2) * np.eye(len(N))])


def solve_regulator(problem: Regulator, guess: Array, *, tolerance: float = TOLERANCE) -> Feedback:
    """Return the state feedback u = −K x of a problem, recomputed.

    Parameters
    ----------
    problem : Regulator
    guess : ndarray, shape (m, n)
        A gain that stabilises the first dynamics, such as the Riccati optimum: it gives the
        first coordinates.
    tolerance : float
        What the solver is asked for; a coarse one answers, once, whether there is a gain.
    """
    K, P = guess, covariance(problem.nominal or problem.dynamics[0], guess, problem.noise_floor)
    best, spent = Feedback(), {"build": 0.0, "solve": 0.0}
    for asked, margin in _attempts(tolerance):
        if best.K is not None and asked == _LOOSE:
            continue  # the coarse try is for coordinates that were too far off for a finer one
        unknowns = _unknowns(problem, K, P)
        if unknowns is None:
            break
        found = _solved(problem, unknowns, asked, margin, spent)
        if found.K is None or found.P is None:
            best = replace(best, status=found.status) if best.K is None else best
            if found.status == "infeasible":
                break
            continue
        K, P = found.K, found.P
        if best.K is None or not best.sound:
            best = found
        if best.sound and asked == tolerance:
            break
    return replace(best, seconds=spent)


def _attempts(tolerance: float) -> list[tuple[float, float]]:
    """Return the tolerances and margins to try in turn."""
    if tolerance > TOLERANCE:
        return [(tolerance, MARGINS[0])]
    return [(tolerance, MARGINS[0]), (_LOOSE, MARGINS[0])] + [
        (tolerance, margin) for margin in MARGINS
    ]


def _unknowns(problem: Regulator, K: Array, P: Array) -> Unknowns | None:
    """Return the unknowns in coordinates where P = I and K x has unit variance."""
    import cvxpy as cp  # see Unknowns.variance

    try:
        T: Array = np.asarray(np.linalg.cholesky(P), dtype=float)
    except np.linalg.LinAlgError:
        return None
    spread = np.linalg.norm(K @ T, axis=1)
    units = np.maximum(spread, 1e-6 * spread.max() or 1.0)
    dynamics = tuple(
        Dynamics(
            _solve(T, at.A @ T),
            _solve(T, at.B * units),
            _solve(T, _with_floor(at.N, problem.noise_floor)),
        )
        for at in problem.dynamics
    )
    n, m = problem.dynamics[0].B.shape
    return Unknowns(
        cp.Variable((n, n), symmetric=True),
        cp.Variable((m, n)),
        cp.Variable((m, m), symmetric=True),
        dynamics,
        T,
        units,
        _disturbance(problem.disturbance, T, problem.noise_floor),
    )


def _solve(T: Array, right: Array) -> Array:
    return np.asarray(np.linalg.solve(T, right), dtype=float)


def _disturbance(given: Disturbance | None, T: Array, floor: float) -> _Scaled | None:
    """Return a disturbance in coordinates where its covariance is the identity."""
    import cvxpy as cp  # see Unknowns.variance

    if given is None:
        return None
    error = Dynamics(given.E, np.zeros((len(given.E), 0)), given.N)
    P = covariance(error, np.zeros((0, len(given.E))), floor)
    S: Array = np.asarray(np.linalg.cholesky(P), dtype=float)
    at = Disturbance(
        _solve(S, given.E @ S),
        _solve(S, given.N),
        _solve(T, given.H @ S),
        given.C @ S,
    )
    return _Scaled(cp.Variable(given.E.shape, symmetric=True), at)


def regulator_blocks(unknowns: Unknowns) -> list[Block]:
    """Return the blocks of the cost: covariance at every vertex, and the control's variance."""
    import cvxpy as cp  # see Unknowns.variance

    blocks = []
    for i, at in enumerate(unknowns.dynamics):
        M = unknowns.moved(i)
        name = "covariance" if len(unknowns.dynamics) == 1 else f"covariance, vertex {i + 1}"
        moved, N = M, at.N
        if unknowns.disturbance is not None:
            # x and e together, with diag(P, P_e) for Lyapunov matrix.
            e, Pe = unknowns.disturbance.at, unknowns.disturbance.P
            moved = cp.bmat([[M, e.H @ Pe], [np.zeros((len(e.E), M.shape[1])), e.E @ Pe]])
            N = np.vstack([N, np.pad(e.N, ((0, 0), (0, N.shape[1] - e.N.shape[1])))])
        blocks.append(Block(name, -(moved + moved.T) - N @ N.T))
    joint = cp.bmat([[unknowns.W, unknowns.L], [unknowns.L.T, unknowns.P]])
    return [*blocks, Block("control", joint)]


def _solved(
    problem: Regulator,
    unknowns: Unknowns,
    tolerance: float,
    margin: float,
    spent: dict[str, float],
) -> Feedback:
    """Build and solve once; what took how long is added to `spent`."""
    start = time.perf_counter()
    blocks = [*regulator_blocks(unknowns), *problem.blocks(unknowns)]
    cost = (
        unknowns.variance(problem.C)
        + problem.control_weight * unknowns.control_variance
        + unknowns.disturbance_variance
    )
    scale = float(
        np.linalg.norm(problem.C @ unknowns.T) ** 2
        + problem.control_weight * (unknowns.units**2).sum()
    )
    status, lmi, imposed = run(cost / scale, blocks, tolerance, margin)
    solving = float(lmi.solver_stats.solve_time or 0.0) if lmi.solver_stats else 0.0
    spent["solve"] += solving
    spent["build"] += time.perf_counter() - start - solving
    P = unknowns.P.value
    if P is None or not np.isfinite(P).all() or np.linalg.eigvalsh((P + P.T) / 2)[0] <= 0:
        return Feedback(status=status)
    P = (P + P.T) / 2
    K = np.linalg.solve(P, unknowns.L.value.T).T
    reached = float(cost.value)
    return Feedback(
        unknowns.units[:, None] * np.linalg.solve(unknowns.T.T, K.T).T,
        unknowns.T @ P @ unknowns.T.T,
        reached,
        (*definiteness(blocks), gap(imposed, reached / scale, margin, problem.gap)),
        status,
    )
