"""Two findings that qualify the paper's conclusions: the integrator, and the hub.

The first is in `slewctl.paper.integrators`; the second sweeps the hub's inertia and asks
of both bases how far their frequencies are off, and what an LQG controller designed on
two of their functions loses on the converged arm.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from slewctl._types import Array
from slewctl.arm import Arm, Hub
from slewctl.arm.catalogue import paper_beam
from slewctl.basis import Basis, ClampedFree, Slewing
from slewctl.design import lqg
from slewctl.loop import Loop, close
from slewctl.model import Truth, assemble, beam_inertia, truth
from slewctl.paper.integrators import IntegratorFinding, integrator_finding
from slewctl.plant import Objective, generalised_plant

# From none to a hub that hardly turns, three to a decade.
HUB_RATIOS = (0.0, *(float(ratio) for ratio in np.geomspace(0.01, 100.0, 13)))
DAMPING_RATIO = 0.005  # a lightly damped beam's, chosen
LIMITS = {"tip": 0.1, "torque": 1.0}  # m, N·m
NOISE = {"torque": 0.1, "theta": 1e-3, "theta_dot": 1e-2}  # N·m, rad and rad/s per √Hz
TRUTH_MODES = 20  # ten times the functions of the design
FREQUENCY_FUNCTIONS = 4  # of the bases whose frequencies are compared
COMPARED_MODES = 3  # the first of them
DESIGN_FUNCTIONS = 2  # the fewest with a mode to lose beside the first


@dataclass(frozen=True)
class Judgement:
    """One controller on one converged model.

    Attributes
    ----------
    truth_modes : int
        Flexible modes that the converged model keeps.
    stable : bool
    loss : float or None
        H2 cost relative to the optimum of the same converged model, minus 1; None when
        unstable.
    unstable_hz : tuple of float
        Frequencies of the poles that are not stable, fastest growing first.
    """

    truth_modes: int
    stable: bool
    loss: float | None
    unstable_hz: tuple[float, ...]


@dataclass(frozen=True)
class DesignLoss:
    """An LQG controller designed on a small model and judged on the converged arm.

    Attributes
    ----------
    verified : bool
        Whether the checks of the design on its own model passed.
    usual, finer : Judgement
        On the converged model with its usual number of modes and with twice as many:
        where the two differ, neither figure is converged.
    """

    verified: bool
    usual: Judgement
    finer: Judgement


@dataclass(frozen=True)
class HubPoint:
    """Both bases at one hub inertia.

    Attributes
    ----------
    ratio : float
        J_h / J_beam, J_beam the beam's moment of inertia about the axis.
    hub_inertia : float
        J_h in kg·m².
    clamped_free_error, slewing_error : float
        Worst relative frequency error over the first modes.
    optimal_cost, finer_optimal_cost : float
        Optimal squared H2 norm on the converged model with its usual number of modes and
        with twice as many.
    cost_drift : float
        finer_optimal_cost / optimal_cost − 1.
    verified, certificate : bool, str
        Checks of the optimal controller (usual number of modes): whether all passed, and
        one line that names them.
    clamped_free, slewing : DesignLoss
    """

    ratio: float
    hub_inertia: float
    clamped_free_error: float
    slewing_error: float
    optimal_cost: float
    finer_optimal_cost: float
    cost_drift: float
    verified: bool
    certificate: str
    clamped_free: DesignLoss
    slewing: DesignLoss


@dataclass(frozen=True, eq=False)
class HubFinding:
    """Which basis is better depends on the hub's inertia.

    Attributes
    ----------
    beam_inertia : float
        J_beam in kg·m².
    frequency_functions, compared_modes : int
        The frequency errors are the worst over the first `compared_modes` modes of a
        model of `frequency_functions` functions.
    design_functions, truth_modes, finer_truth_modes : int
        Functions of the design models; modes of the converged models.
    damping_ratio : float
        Of every flexible mode, in the LQG part.
    limits, noise : dict of str to float
        The objective of the LQG part (see `slewctl.plant.Objective`), SI units.
    first_mode_errors_clamped_free, first_mode_errors_slewing : ndarray, shape (5,)
        Relative error of the first frequency with 1 … 5 functions and no hub.
    points : tuple of HubPoint
    """

    beam_inertia: float
    frequency_functions: int
    compared_modes: int
    design_functions: int
    truth_modes: int
    finer_truth_modes: int
    damping_ratio: float
    limits: dict[str, float]
    noise: dict[str, float]
    first_mode_errors_clamped_free: Array
    first_mode_errors_slewing: Array
    points: tuple[HubPoint, ...]


@dataclass(frozen=True, eq=False)
class Findings:
    """What a reader of the paper must know beside its tables."""

    integrators: IntegratorFinding
    hub: HubFinding


def findings() -> Findings:
    """Return both findings for the paper's beam."""
    return Findings(integrator_finding(), hub_finding())


def hub_finding() -> HubFinding:
    """Return the sweep of J_h / J_beam for the paper's beam."""
    bare = truth(paper_beam(), TRUTH_MODES)
    inertia = beam_inertia(paper_beam())
    objective = Objective(LIMITS, NOISE)
    return HubFinding(
        inertia,
        FREQUENCY_FUNCTIONS,
        COMPARED_MODES,
        DESIGN_FUNCTIONS,
        TRUTH_MODES,
        2 * TRUTH_MODES,
        DAMPING_RATIO,
        dict(LIMITS),
        dict(NOISE),
        _first_mode_errors(ClampedFree, bare),
        _first_mode_errors(Slewing, bare),
        tuple(_point(ratio, ratio * inertia, objective) for ratio in HUB_RATIOS),
    )


def _first_mode_errors(kind: type[Basis], exact: Truth) -> Array:
    omega = np.array([assemble(exact.arm, kind(n)).omega[0] for n in range(1, 6)])
    return omega / exact.omega[0] - 1


def _point(ratio: float, inertia: float, objective: Objective) -> HubPoint:
    arm = replace(paper_beam(), hub=Hub(inertia=inertia), damping_ratio=DAMPING_RATIO)
    usual, finer = truth(arm, TRUTH_MODES), truth(arm, 2 * TRUTH_MODES)
    best, finer_best = (lqg(generalised_plant(exact, objective)) for exact in (usual, finer))
    optima = ((usual, best.h2_cost), (finer, finer_best.h2_cost))
    return HubPoint(
        ratio,
        inertia,
        _worst_error(arm, ClampedFree(FREQUENCY_FUNCTIONS), usual),
        _worst_error(arm, Slewing(FREQUENCY_FUNCTIONS), usual),
        best.h2_cost,
        finer_best.h2_cost,
        finer_best.h2_cost / best.h2_cost - 1,
        best.certificate.verified,
        str(best.certificate),
        _design_loss(arm, ClampedFree(DESIGN_FUNCTIONS), objective, optima),
        _design_loss(arm, Slewing(DESIGN_FUNCTIONS), objective, optima),
    )


def _worst_error(arm: Arm, basis: Basis, exact: Truth) -> float:
    omega = assemble(arm, basis).omega[:COMPARED_MODES]
    return float(np.abs(omega / exact.omega[:COMPARED_MODES] - 1).max())


def _design_loss(
    arm: Arm, basis: Basis, objective: Objective, optima: tuple[tuple[Truth, float], ...]
) -> DesignLoss:
    """Design on the small model alone; judge on the converged ones against their optima."""
    controller = lqg(generalised_plant(assemble(arm, basis), objective))
    usual, finer = (_judge(close(exact, objective, controller), best) for exact, best in optima)
    return DesignLoss(controller.certificate.verified, usual, finer)


def _judge(loop: Loop, optimum: float) -> Judgement:
    stable = loop.stable
    return Judgement(
        loop.model.n,
        stable,
        loop.h2.value / optimum - 1 if stable else None,
        () if stable else loop.unstable_hz,
    )
