"""H2-optimal output feedback by linear matrix inequalities, never believed unverified.

By the separation principle the optimal output feedback consists of the optimal state feedback
and the optimal estimator, so two small inequalities (`slewctl.design.lmi.riccati_gain`) are enough:
``formulation="separated"``.  ``formulation="joint"`` is one large inequality by a change of
variables (`slewctl.design.lmi.h2_joint`), which carries constraints that couple the two.

Building and solving are two functions each: a problem can be inspected, and constraints added
to it, before it is solved.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter
from typing import Literal

import numpy as np

from slewctl._types import Array
from slewctl.design.breakdown import guarded
from slewctl.design.clocked import with_clock
from slewctl.design.energy_coordinates import ScaledPlant
from slewctl.design.lmi.clarabel import solve
from slewctl.design.lmi.h2_joint import h2_joint
from slewctl.design.lmi.h2_problem import H2Setting, finished_h2, h2_setting, observer
from slewctl.design.lmi.riccati_gain import FILTER, REGULATOR, GainLMI, gain_lmi
from slewctl.design.result import Controller
from slewctl.errors import check_choice
from slewctl.plant import GeneralisedPlant

Formulation = Literal["separated", "joint"]


@dataclass(frozen=True, eq=False)
class H2Problem:
    """The two inequalities of an H2 problem, and the plant they are for.

    Attributes
    ----------
    setting : H2Setting
        The plant, and how it is scaled.
    regulator, filter : GainLMI
        State feedback and, for the transposed plant, the estimator.
    seconds : float
        What building took.
    """

    setting: H2Setting
    regulator: GainLMI
    filter: GainLMI
    seconds: float

    @property
    def plant(self) -> GeneralisedPlant:
        """The plant as it was given."""
        return self.setting.plant


@guarded
@with_clock
def h2_lmi(plant: GeneralisedPlant, *, formulation: Formulation = "separated") -> Controller:
    """Return the H2-optimal controller of a plant by matrix inequalities.

    Parameters
    ----------
    plant : GeneralisedPlant
        From `slewctl.generalised_plant`, in any coordinates: it is scaled first, and the
        gains are taken back.  The controller's own states are estimates of the plant's if
        these are modal, else of its modes' energy states.
    formulation : {"separated", "joint"}
        Two small inequalities, or one large one; the optimum is the same.

    Returns
    -------
    Controller
        Verified when its cost, recomputed in modal coordinates, is within 1e-6 of the Riccati
        optimum, whatever the solver said.  The inequalities' own bound is a guarantee, beside
        what is achieved; ``seconds`` has ``build`` and ``solve``.

    Raises
    ------
    DesignError
        If a mode is not penalised, not seen or not reached.
    AccuracyError
        If the solver returns nothing, or the modes of a plant in raw coordinates cannot be
        told apart.
    InputError
        For an unknown formulation.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> K = sc.h2_lmi(plant)
    >>> bool(abs(K.h2_cost / sc.lqg(plant).h2_cost - 1) < 1e-6)
    True
    """
    check_choice(formulation, ("separated", "joint"), "formulation")
    if formulation == "joint":
        return h2_joint(plant)
    return solve_h2(build_h2(plant))


def build_h2(plant: GeneralisedPlant) -> H2Problem:
    """Return the two inequalities of a plant, scaled; see `h2_lmi` for errors.

    Parameters
    ----------
    plant : GeneralisedPlant

    Returns
    -------
    H2Problem

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> from slewctl.design import build_h2
    >>> type(build_h2(plant)).__name__
    'H2Problem'
    """
    start = perf_counter()
    setting = h2_setting(plant)
    regulator, observer = regulator_lmi(setting.scaled), filter_lmi(setting.scaled)
    return H2Problem(setting, regulator, observer, perf_counter() - start)


def regulator_lmi(plant: ScaledPlant) -> GainLMI:
    """Return the inequality of the state feedback; its gain is F with u_s = −F x_s."""
    return gain_lmi(plant.A, plant.B2, plant.C1, plant.D12, plant.omega, REGULATOR)


def filter_lmi(plant: ScaledPlant) -> GainLMI:
    """Return the inequality of the estimator; its gain is Lᵀ.

    The dual problem: Aᵀ for A, sensors for inputs, disturbances for performance.
    """
    return gain_lmi(plant.A.T, plant.C2.T, plant.B1.T, plant.D21.T, plant.omega, FILTER)


def solve_h2(problem: H2Problem) -> Controller:
    """Return the controller of a built problem, with what it achieves recomputed.

    Parameters
    ----------
    problem : H2Problem
        From `build_h2`.

    Returns
    -------
    Controller

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> from slewctl.design import build_h2, solve_h2
    >>> solve_h2(build_h2(plant)).method
    'h2-lmi'
    """
    start = perf_counter()
    first = solve(problem.regulator.problem, problem.regulator.tolerance, "h2_lmi")
    second = solve(problem.filter.problem, problem.filter.tolerance, "h2_lmi")
    spent = perf_counter() - start
    F, L = problem.regulator.gain, problem.filter.gain.T
    return finished_h2(
        problem.setting,
        observer(problem.setting, F, L),
        (F, L),
        said=f"{first}; {second}",
        bound=_bound(problem, F),
        sense="at least",
        seconds={
            "build": problem.seconds,
            "solve": spent,
            "solver": first.seconds + second.seconds,
        },
    )


def _bound(problem: H2Problem, F: Array) -> float:
    """Return what no controller's cost is below, by the two inequalities' solutions.

    With X and Y below the Riccati solutions, completing the squares leaves at least
    tr B1ᵀXB1 and the cost tr F Y Fᵀ of estimating F x, F = B2ᵀX + D12ᵀC1.
    """
    plant = problem.setting.scaled
    X, Y = problem.regulator.below, problem.filter.below
    return plant.rate * float(np.trace(plant.B1.T @ X @ plant.B1) + np.trace(F @ Y @ F.T))
