"""H2-optimal output feedback by one matrix inequality, with a change of variables.

Scherer, Gahinet and Chilali (IEEE Trans. Automatic Control 42, 1997): with the controller
(A_k, B_k, C_k), its closed loop and a Lyapunov matrix whose inverse's and whose own leading
block are X and Y, the variables Â, B̂ and Ĉ make

    ⎡AX + B2Ĉ + (·)ᵀ        ·               ·⎤            ⎡W   C1X + D12Ĉ   C1⎤
    ⎢Â + Aᵀ        YA + B̂C2 + (·)ᵀ          ·⎥ ⪯ 0,       ⎢·       X         I⎥ ⪰ 0
    ⎣B1ᵀ           (YB1 + B̂D21)ᵀ           −I⎦            ⎣·       ·         Y⎦

linear, and tr W bounds the squared H2 norm from above.  Here B1 is scaled against C2 and C1
against B2, so that Y and X are of the size of one, and the rows of each mode are weighted by
(ω/ω₁)^(−1/2).

Constraints on X, Y, Â, B̂ and Ĉ that couple regulator and estimator can be added to the
problem before it is solved.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from slewctl._types import Array
from slewctl.design.lmi.clarabel import solve
from slewctl.design.lmi.h2_problem import H2Setting, Realised, finished_h2, h2_setting, observer
from slewctl.design.result import Controller
from slewctl.errors import AccuracyError, check_positive
from slewctl.numerics.interconnect import behind_feedthrough
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant import GeneralisedPlant

if TYPE_CHECKING:
    import cvxpy

# Rows are weighted by ω to this power, found by trial as those of `riccati_gain`.
_POWER = -0.5
_TOLERANCE = 1e-10  # of the solver, relative: the cost is that of a gain good to its root
# z and u are measured in this times the unit that makes C1 and B2 equally large: what is tried
# first, found over arms, bases and orders, and what is tried where that is not verified.
PERFORMANCE_UNITS = (2.0, 1.0)


@dataclass(frozen=True, eq=False)
class JointVariables:
    """The variables X, Y (n, n), Â (n, n), B̂ (n, sensors), Ĉ (1, n) and W."""

    X: cvxpy.Variable
    Y: cvxpy.Variable
    A: cvxpy.Variable
    B: cvxpy.Variable
    C: cvxpy.Variable
    W: cvxpy.Variable


@dataclass(frozen=True, eq=False)
class JointMatrices:
    """The plant in the inequality's units: x_s = state_unit·x and u_s = control_unit·u."""

    A: Array
    B1: Array
    B2: Array
    C1: Array
    C2: Array
    D12: Array
    D21: Array
    weight: Array
    state_unit: float
    control_unit: float


@dataclass(frozen=True, eq=False)
class JointH2Problem:
    """The inequality of an H2 problem, ready to be inspected, extended and solved.

    Attributes
    ----------
    setting : H2Setting
    matrices : JointMatrices
    variables : JointVariables
    problem : cvxpy.Problem
        Minimises tr W.
    seconds : float
        What building took.
    """

    setting: H2Setting
    matrices: JointMatrices
    variables: JointVariables
    problem: cvxpy.Problem
    seconds: float

    @property
    def plant(self) -> GeneralisedPlant:
        """The plant as it was given."""
        return self.setting.plant


def h2_joint(plant: GeneralisedPlant) -> Controller:
    """Return the controller of the joint inequality; see `slewctl.design.h2_lmi`.

    A result that its recomputation does not verify is tried again in other units, and the
    better one of the two returned.
    """
    found: list[Controller] = []
    failures: list[AccuracyError] = []
    for unit in PERFORMANCE_UNITS:
        try:
            found.append(solve_h2_joint(build_h2_joint(plant, unit)))
        except AccuracyError as error:
            failures.append(error)
            continue
        if found[-1].certificate.verified:
            return found[-1]
    if not found:
        raise failures[0]
    return min(found, key=lambda controller: controller.h2_cost)


def build_h2_joint(
    plant: GeneralisedPlant, performance_unit: float = PERFORMANCE_UNITS[0]
) -> JointH2Problem:
    """Return the joint inequality of a plant, scaled.

    Parameters
    ----------
    plant : GeneralisedPlant
    performance_unit : float
        z and u are measured in this times the unit that makes C1 and B2 equally large.

    Returns
    -------
    JointH2Problem

    Raises
    ------
    DesignError, AccuracyError
        As `slewctl.design.h2_lmi`.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> from slewctl.design import build_h2_joint
    >>> joint = build_h2_joint(plant)
    >>> joint.problem.is_dcp()
    True
    """
    import cvxpy as cp  # only those who synthesise by matrix inequalities wait for it

    start = perf_counter()
    setting = h2_setting(plant)
    p = _matrices(setting, check_positive(performance_unit, "performance_unit"))
    n, sensors, actuators, outputs = len(p.A), len(p.C2), p.B2.shape[1], len(p.C1)
    v = JointVariables(
        cp.Variable((n, n), symmetric=True, name="X"),
        cp.Variable((n, n), symmetric=True, name="Y"),
        cp.Variable((n, n), name="A"),
        cp.Variable((n, sensors), name="B"),
        cp.Variable((actuators, n), name="C"),
        cp.Variable((outputs, outputs), symmetric=True, name="W"),
    )
    problem = cp.Problem(
        cp.Minimize(cp.trace(v.W)), [_lyapunov(p, v) >> 0, _performance(p, v) >> 0]
    )
    return JointH2Problem(setting, p, v, problem, perf_counter() - start)


def solve_h2_joint(joint: JointH2Problem) -> Controller:
    """Return the controller of a built problem, with what it achieves recomputed.

    Parameters
    ----------
    joint : JointH2Problem
        From `build_h2_joint`.

    Returns
    -------
    Controller

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> from slewctl.design import build_h2_joint, solve_h2_joint
    >>> solve_h2_joint(build_h2_joint(plant)).method
    'h2-lmi'
    """
    start = perf_counter()
    run = solve(joint.problem, _TOLERANCE, "h2_lmi")
    spent = perf_counter() - start
    setting = joint.setting
    # A_k from Â carries the errors of all variables; with A_k = A + B2 C_k − B_k C2, which
    # it is at the optimum, only those of the gains are left.  Added constraints may make it
    # another, so the better one is taken.
    made, gains = _reconstructed(joint)
    as_observer = observer(setting, *gains)
    if setting.cost(as_observer.system) <= setting.cost(made.system):
        made = as_observer
    bound = setting.scaled.rate * joint.matrices.control_unit**2 * run.value
    return finished_h2(
        setting,
        made,
        gains,
        said=str(run),
        bound=bound,
        sense="at most",
        seconds={"build": joint.seconds, "solve": spent, "solver": run.seconds},
    )


def _matrices(setting: H2Setting, performance_unit: float) -> JointMatrices:
    s = setting.scaled
    state = float(np.sqrt(np.linalg.norm(s.B1, 2) / np.linalg.norm(s.C2, 2)))
    size = np.linalg.norm(s.C1, 2) * state / (np.linalg.norm(s.B2, 2) / state)
    control_unit = performance_unit * float(np.sqrt(size))
    return JointMatrices(
        s.A,
        s.B1 / state,
        s.B2 * (control_unit / state),
        s.C1 * (state / control_unit),
        s.C2 * state,
        s.D12,
        s.D21,
        np.maximum(1.0, s.omega) ** _POWER,
        state,
        control_unit,
    )


def _lyapunov(p: JointMatrices, v: JointVariables) -> cvxpy.Expression:
    """Return the negative of the left matrix, its first two block rows weighted."""
    n, w = p.B1.shape
    S = np.diag(p.weight)
    first, second = np.eye(2 * n + w, n) @ S, np.eye(2 * n + w, n, -n) @ S
    # Half of the matrix: its transpose is added below.
    right = np.hstack([np.zeros((n, n)), p.A * p.weight, p.B1])
    measured = np.hstack([np.zeros((len(p.C2), n)), p.C2 * p.weight, p.D21])
    half = (
        (first @ p.A) @ v.X @ first.T
        + (first @ p.B2) @ v.C @ first.T
        + second @ v.Y @ right
        + second @ v.B @ measured
        + second @ v.A @ first.T
    )
    constant = np.zeros((2 * n + w, 2 * n + w))
    constant[:n, n : 2 * n], constant[:n, 2 * n :] = S @ p.A @ S, S @ p.B1
    constant = constant + constant.T
    constant[2 * n :, 2 * n :] = -np.eye(w)
    return -(half + half.T + constant)


def _performance(p: JointMatrices, v: JointVariables) -> cvxpy.Expression:
    """Return the right matrix."""
    outputs, n = p.C1.shape
    size = outputs + 2 * n
    cost = np.eye(size, outputs)
    first, second = np.eye(size, n, -outputs), np.eye(size, n, -outputs - n)
    half = (
        cost @ v.W @ cost.T / 2
        + first @ v.X @ first.T / 2
        + second @ v.Y @ second.T / 2
        + (cost @ p.C1) @ v.X @ first.T
        + (cost @ p.D12) @ v.C @ first.T
    )
    constant = (cost @ p.C1 + first) @ second.T
    return half + half.T + constant + constant.T


def _reconstructed(joint: JointH2Problem) -> tuple[Realised, tuple[Array, Array]]:
    """Return the controller of the variables, and its scaled gains F and L.

    Of the factorisations M Nᵀ = I − XY the one with M = X − Y⁻¹ and N = −Y needs no root:
    the controller's state is then the estimate, X − Y⁻¹ its covariance and Y⁻¹ that of its
    error.
    """
    p, v = joint.matrices, joint.variables
    X, Y = np.asarray(v.X.value), np.asarray(v.Y.value)
    A_hat, B_hat, C_hat = (np.asarray(m.value) for m in (v.A, v.B, v.C))
    covariance = X - np.linalg.inv(Y)
    L = -np.linalg.solve(Y, B_hat)
    F = -np.linalg.solve(covariance, C_hat.T).T
    whole = p.A @ X + p.B2 @ C_hat - L @ p.C2 @ X - np.linalg.solve(Y, A_hat)
    system = LinearSystem(
        np.linalg.solve(covariance, whole.T).T,
        p.state_unit * L,
        -(p.control_unit / p.state_unit) * F,
        np.zeros((len(F), len(p.C2))),
        inputs=list(joint.plant.sensors),
        outputs=[joint.plant.actuator],
        name="h2_lmi",
    )
    made = Realised(
        behind_feedthrough(joint.setting.scaled.controller(system), joint.plant.D22),
        None,
        "u = K(s) y of the variables Â, B̂ and Ĉ",
    )
    return made, ((p.control_unit / p.state_unit) * F, p.state_unit * L)
