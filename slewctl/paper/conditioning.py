"""The third finding: whether "stiff coefficient matrices" hurt a solver, and what cures it.

The paper says that its functions give better-conditioned matrices.  Here the numerical task
is the H2-optimal state feedback by a matrix inequality, solved as textbooks print it: once in
the raw coordinates [θ, q] of each basis and once, the same inequality with the same solver,
in scaled modal coordinates.  The solver's verdict is not believed: each gain's cost is
recomputed in modal coordinates and compared with the Riccati optimum.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from slewctl._types import Array
from slewctl.arm import Hub
from slewctl.arm.catalogue import paper_beam
from slewctl.basis import Basis, ClampedFree, Slewing
from slewctl.design import lqr
from slewctl.design.lmi.h2_gains import h2_state_feedback
from slewctl.design.lmi.h2_problem import GAP, H2Setting, h2_setting, stable_cost
from slewctl.model import assemble
from slewctl.paper.findings import DAMPING_RATIO, LIMITS, NOISE
from slewctl.paper.textbook_lmi import TextbookRun, covariance_form, riccati_form
from slewctl.plant import Objective, generalised_plant

# No hub, as in the paper, and one as heavy as the beam.
HUB_RATIOS = (0.0, 1.0)
MOST_FUNCTIONS = 8  # a row of the table each
BASES: dict[str, Callable[[int], Basis]] = {"clamped-free": ClampedFree, "slewing": Slewing}
# Gaps smaller than this are rounding errors.
_FLOOR = 1e-12
_INFORMATIVE = 1e-6  # gaps larger than this say more than the solver's own tolerance


@dataclass(frozen=True)
class Attempt:
    """One inequality, solved.

    Attributes
    ----------
    status : str
        What the solver said: ``optimal``, ``optimal_inaccurate`` or, without a point,
        ``failed`` or another refusal.
    gap : float or None
        J/J_Riccati − 1, recomputed; below 1e-6 rounded up to a power of ten, from 1e-12 on.
        None without a gain, or if the closed loop is not stable.
    optimal : bool
        Whether the gap is at most 1e-6.
    believed : bool
        Whether the solver called it optimal, without reserve.
    """

    status: str
    gap: float | None
    optimal: bool
    believed: bool


@dataclass(frozen=True)
class ConditioningPoint:
    """One basis with n functions at one hub inertia.

    Attributes
    ----------
    hub_ratio : float
        J_h / J_beam.
    basis : str
    n : int
    mass_condition, stiffness_condition : float
        Condition numbers of M and of K without the row of the angle.
    raw_condition, scaled_condition : float
        Largest over smallest singular value, but for the zero of the rigid body, of the state
        matrix in raw coordinates and in scaled ones.
    covariance_raw, covariance_scaled : Attempt
        The inequalities in the state's covariance, in raw and in scaled coordinates.
    riccati_raw, riccati_scaled : Attempt
        The inequality in the Riccati solution.
    own : Attempt
        `slewctl.design.h2_state_feedback`, given the raw coordinates.
    """

    hub_ratio: float
    basis: str
    n: int
    mass_condition: float
    stiffness_condition: float
    raw_condition: float
    scaled_condition: float
    covariance_raw: Attempt
    covariance_scaled: Attempt
    riccati_raw: Attempt
    riccati_scaled: Attempt
    own: Attempt


@dataclass(frozen=True)
class Reach:
    """How far one inequality gets with one basis at one hub inertia.

    Attributes
    ----------
    hub_ratio : float
    basis, form : str
    raw, scaled : int
        The largest n up to which every result is optimal, recomputed.
    without_point : int
        Of the raw results, how many ended without a gain.
    misleading : int
        How many the solver called optimal, without reserve, that are not.
    modest : int
        How many the solver had reserves about that are optimal.
    """

    hub_ratio: float
    basis: str
    form: str
    raw: int
    scaled: int
    without_point: int
    misleading: int
    modest: int


@dataclass(frozen=True)
class ConditioningFinding:
    """Raw against scaled coordinates, by hub inertia, basis and number of functions.

    Attributes
    ----------
    damping_ratio : float
    limits, noise : dict of str to float
        The objective, SI units.
    most_functions : int
    points : tuple of ConditioningPoint
    reaches : tuple of Reach
    """

    damping_ratio: float
    limits: dict[str, float]
    noise: dict[str, float]
    most_functions: int
    points: tuple[ConditioningPoint, ...]
    reaches: tuple[Reach, ...]

    def of(self, hub_ratio: float, basis: str) -> tuple[ConditioningPoint, ...]:
        """Return the points of one basis at one hub inertia, by n."""
        return tuple(p for p in self.points if (p.hub_ratio, p.basis) == (hub_ratio, basis))

    @property
    def misleading(self) -> int:
        """How many raw results the solver called optimal, without reserve, that are not."""
        return sum(reach.misleading for reach in self.reaches)

    @property
    def without_point(self) -> int:
        """How many raw results ended without a stabilising gain."""
        return sum(reach.without_point for reach in self.reaches)

    @property
    def modest(self) -> int:
        """How many raw results the solver had reserves about that are optimal."""
        return sum(reach.modest for reach in self.reaches)

    @property
    def own_gap(self) -> float | None:
        """The largest gap of slewctl's own inequality; None if one has none."""
        gaps = [p.own.gap for p in self.points]
        return None if any(gap is None for gap in gaps) else max(g for g in gaps if g is not None)


def conditioning() -> ConditioningFinding:
    """Return the finding for the paper's beam."""
    beam_inertia = float(assemble(paper_beam(), ClampedFree(1)).mass[0, 0])
    points = tuple(
        _point(ratio, beam_inertia, name, n)
        for ratio in HUB_RATIOS
        for name in BASES
        for n in range(1, MOST_FUNCTIONS + 1)
    )
    reaches = tuple(
        _reach([p for p in points if (p.hub_ratio, p.basis) == (ratio, name)], form)
        for ratio in HUB_RATIOS
        for name in BASES
        for form in ("covariance", "riccati")
    )
    return ConditioningFinding(
        DAMPING_RATIO, dict(LIMITS), dict(NOISE), MOST_FUNCTIONS, points, reaches
    )


def _point(ratio: float, beam_inertia: float, name: str, n: int) -> ConditioningPoint:
    arm = replace(paper_beam(), hub=Hub(ratio * beam_inertia), damping_ratio=DAMPING_RATIO)
    model = assemble(arm, BASES[name](n))
    plant = generalised_plant(model, Objective(LIMITS, NOISE), coordinates="physical")
    setting = h2_setting(plant)
    s, twin = setting.scaled, setting.twin
    optimum = float(np.trace(twin.B1.T @ lqr(twin).X @ twin.B1))
    own = h2_state_feedback(plant)

    def raw(run: TextbookRun) -> Attempt:
        gain = None if run.gain is None else setting.twin_state_feedback(run.gain)
        return _attempt(setting, run.status, gain, optimum)

    def rescaled(run: TextbookRun) -> Attempt:
        gain = None if run.gain is None else setting.twin_scaled.state_feedback(run.gain)
        return _attempt(setting, run.status, gain, optimum)

    return ConditioningPoint(
        ratio,
        name,
        n,
        float(np.linalg.cond(model.mass)),
        float(np.linalg.cond(model.stiffness[1:, 1:])),
        _spread(plant.A),
        _spread(s.A),
        raw(covariance_form(plant.A, plant.B1, plant.B2, plant.C1, plant.D12)),
        rescaled(covariance_form(s.A, s.B1, s.B2, s.C1, s.D12)),
        raw(riccati_form(plant.A, plant.B2, plant.C1, plant.D12)),
        rescaled(riccati_form(s.A, s.B2, s.C1, s.D12)),
        raw(TextbookRun(own.status, own.gain)),
    )


def _spread(A: Array) -> float:
    """Return the largest over the smallest singular value but for the rigid body's zero."""
    values = np.linalg.svd(A, compute_uv=False)
    return float(values[0] / values[-2])


def _attempt(setting: H2Setting, status: str, gain: Array | None, optimum: float) -> Attempt:
    """Return an attempt with its gap recomputed on the twin of the plant."""
    twin = setting.twin
    gap = math.inf
    if gain is not None and np.isfinite(gain).all():
        cost = stable_cost(twin.A - twin.B2 @ gain, twin.B1, twin.C1 - twin.D12 @ gain)
        gap = cost / optimum - 1
    shown = _rounded(gap) if math.isfinite(gap) else None
    return Attempt(status, shown, gap <= GAP, status == "optimal")


def _rounded(gap: float) -> float:
    """Return a gap to two digits, or, where its digits are the solver's noise, to a decade."""
    if abs(gap) >= _INFORMATIVE:
        return float(f"{gap:.1e}")
    return 10.0 ** math.ceil(math.log10(max(abs(gap), _FLOOR)))


def _reach(points: list[ConditioningPoint], form: str) -> Reach:
    raw: list[Attempt] = [getattr(p, f"{form}_raw") for p in points]
    scaled: list[Attempt] = [getattr(p, f"{form}_scaled") for p in points]
    return Reach(
        points[0].hub_ratio,
        points[0].basis,
        form,
        _unbroken(raw),
        _unbroken(scaled),
        sum(a.gap is None for a in raw),
        sum(a.believed and not a.optimal for a in raw),
        sum(a.optimal and not a.believed for a in raw),
    )


def _unbroken(attempts: Iterable[Attempt]) -> int:
    """Return how many of the first attempts are optimal."""
    count = 0
    for attempt in attempts:
        if not attempt.optimal:
            break
        count += 1
    return count
