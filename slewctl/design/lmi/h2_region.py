"""H2 control with its closed-loop poles in a region: decay rate, damping ratio, radius.

A matrix F has its eigenvalues in the region exactly if one P ≻ 0 satisfies the inequalities
(Chilali and Gahinet, IEEE Trans. Automatic Control 41, 1996)

    decay rate α      M + Mᵀ + 2αP ≺ 0,                    M = FP
    damping ratio ζ   ⎡ s(M + Mᵀ)  c(M − Mᵀ) ⎤ ≺ 0,        c = ζ, s = √(1 − ζ²)
                      ⎣ c(Mᵀ − M)  s(M + Mᵀ) ⎦
    radius r          ⎡ −rP   M  ⎤ ≺ 0.
                      ⎣  Mᵀ  −rP ⎦

The same P bounds the H2 cost, which makes the bound, but not the region, conservative.
Regulator and observer get one problem each; the loop's poles are those of both.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.design.achieved import closed_cost
from slewctl.design.breakdown import guarded
from slewctl.design.clocked import with_clock
from slewctl.design.lmi.blocks import largest
from slewctl.design.lmi.region import Region
from slewctl.design.lmi.separation_principle import Half, Innovations, innovations
from slewctl.design.lmi.state_feedback import (
    Disturbance,
    Feedback,
    Regulator,
    solve_regulator,
)
from slewctl.design.observer import observer_feedback
from slewctl.design.result import Check, Controller, Guarantee, finished
from slewctl.errors import (
    DesignError,
    check_damping_ratio,
    check_nonnegative,
    check_positive,
)
from slewctl.plant import GeneralisedPlant, check_plant

# Of the solver, relative, where only whether a rate can be met is asked.
_COARSE = 1e-5
# How far back from what a coarse one found, towards what is easy, on a logarithmic scale.
_BACK = (0.0, 0.05, 0.15, 0.4, 1.0)


@guarded
@with_clock
def h2_region(
    plant: GeneralisedPlant,
    *,
    decay_rate_min: float = 0.0,
    damping_ratio_min: float = 0.0,
    radius_max: float | None = None,
    observer_decay_rate_min: float | None = None,
    observer_damping_ratio_min: float | None = None,
    observer_radius_max: float | None = None,
) -> Controller:
    """Return an H2 controller whose closed-loop poles lie in a region.

    Parameters
    ----------
    plant : GeneralisedPlant
    decay_rate_min : float
        Every motion decays at least like exp(−decay_rate_min·t), in 1/s.
    damping_ratio_min : float
        Least damping ratio ζ of every pole, 0 <= ζ < 1.
    radius_max : float, optional
        Largest |s| in rad/s: neither faster nor stiffer than the actuator can follow.
    observer_decay_rate_min, observer_damping_ratio_min, observer_radius_max : float, optional
        The same for the observer's poles; by default as for the regulator's.

    Returns
    -------
    Controller
        A half whose Riccati optimum lies within keeps it; the other halves come from matrix
        inequalities.  The guarantees say what was asked and what the loop's poles achieve,
        and the inequalities' bound on the cost.

    Raises
    ------
    DesignError
        If no such controller was found, with what would be possible; or as `lqg`.
    InputError
        For an impossible wish.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> K = sc.h2_region(plant, decay_rate_min=0.5)
    >>> bool(sc.close(plant.model, problem.objective, K).poles.real.max() <= -0.5)
    True
    """
    check_plant(plant, "h2_region")
    wish = _region("", decay_rate_min, damping_ratio_min, radius_max)
    observer_wish = _region(
        "observer_",
        wish.decay if observer_decay_rate_min is None else observer_decay_rate_min,
        wish.damping if observer_damping_ratio_min is None else observer_damping_ratio_min,
        _finite(wish.radius) if observer_radius_max is None else observer_radius_max,
    )
    both = innovations(plant)
    rate = both.scaled.rate
    regulator = _placed(both.regulator, wish, rate, "")
    observer = _placed(_seen_by(both, regulator), observer_wish, rate, "observer_")
    if not (regulator.optimal or observer.optimal):
        # What the estimate is driven by depends on the observer: once more, with this one.
        regulator = _joint(both, regulator, observer, wish, rate)
    K, Kf = both.state_feedback(regulator.gain), both.observer_gain(observer.gain)
    system = observer_feedback(plant, K, Kf, "h2_region")
    poles = (
        np.linalg.eigvals(plant.A - plant.B2 @ K).astype(complex),
        np.linalg.eigvals(plant.A - Kf @ plant.C2).astype(complex),
    )
    closed = plant.close(system)
    found = np.linalg.eigvals(np.asarray(closed.A)).astype(complex)
    cost = closed_cost(plant, system).value
    guarantees = [
        *wish.promises(poles[0], " of the regulator"),
        *observer_wish.promises(poles[1], " of the observer"),
    ]
    if wish == observer_wish:
        guarantees = wish.promises(found)
    bound = _cost_bound(both, regulator, observer)
    if math.isfinite(bound):
        guarantees.append(Guarantee("H2 cost", bound, cost, "at most"))
    seconds = {
        key: regulator.feedback.seconds.get(key, 0.0) + observer.feedback.seconds.get(key, 0.0)
        for key in ("build", "solve")
    }
    return finished(
        plant,
        system,
        "h2-region",
        {"state_feedback": K, "observer": Kf},
        checks=(
            *_named(regulator.feedback.checks, "regulator"),
            *_named(observer.feedback.checks, "observer"),
            _spectrum(found, np.concatenate(poles)),
        ),
        guarantees=guarantees,
        assumptions=_words(cost, bound, both.optimum, regulator, observer),
        seconds=seconds,
    )


def _finite(radius: float) -> float | None:
    return radius if math.isfinite(radius) else None


def _region(prefix: str, decay: float, damping: float, radius: float | None) -> Region:
    ratio = check_damping_ratio(damping, f"{prefix}damping_ratio_min")
    slowest = check_nonnegative(decay, f"{prefix}decay_rate_min")
    farthest = math.inf if radius is None else check_positive(radius, f"{prefix}radius_max")
    return Region(slowest, ratio, farthest)


@dataclass(frozen=True, eq=False)
class _Placed:
    """One half's gain: its Riccati optimum, or that of the matrix inequalities."""

    half: Half
    gain: Array
    feedback: Feedback
    joint: bool = True  # if both halves are constrained: its bound is on the whole loop

    @property
    def optimal(self) -> bool:
        return self.feedback.K is None


def _placed(half: Half, wish: Region, rate: float, prefix: str) -> _Placed:
    """Return the half's best gain with its poles in the region, or raise what is possible.

    Only wishes that the best gain without them breaks are imposed: one that is kept anyway
    costs optimality, by the Lyapunov matrix that all share, and may stop the solver.
    """
    region, asked = wish.scaled(rate), Region()
    gain, found = half.optimal, Feedback()
    while not region.holds(poles := _poles(half, gain)):
        wider = asked.and_also(region.broken(poles))
        if wider == asked:
            raise _impossible(half, wish, rate, prefix, found.status)
        asked, found = wider, _solve(half, wider)
        if found.K is None:
            raise _impossible(half, wish, rate, prefix, found.status)
        gain = found.K
    return _Placed(half, gain, found)


def _poles(half: Half, gain: Array) -> ComplexArray:
    return np.linalg.eigvals(half.dynamics.A - half.dynamics.B @ gain).astype(complex)


def _solve(half: Half, region: Region, tolerance: float | None = None) -> Feedback:
    problem = Regulator((half.dynamics,), half.C, blocks=region.blocks)
    if tolerance is None:
        return solve_regulator(problem, half.optimal)
    return solve_regulator(problem, half.optimal, tolerance=tolerance)


def _impossible(half: Half, wish: Region, rate: float, prefix: str, status: str) -> DesignError:
    """Return the error that says which wish to relax, and how far, the others kept."""

    def possible(region: Region, tolerance: float | None = _COARSE) -> bool:
        found = _solve(half, region.scaled(rate), tolerance)
        if found.K is None or (tolerance is None and not found.sound):
            return False
        return region.scaled(rate).holds(_poles(half, found.K))

    poles = rate * _poles(half, half.optimal)
    spread = float(np.abs(poles).max())
    own = (float(-poles.real.max()), float((-poles.real / np.abs(poles)).min()))
    advice = []
    for key, text, released, start in (
        ("decay", f"{prefix}decay_rate_min", 0.0, own[0] / 2),
        ("damping", f"{prefix}damping_ratio_min", 0.0, own[1] / 2),
        ("radius", f"{prefix}radius_max", math.inf, 10 * max(spread, wish.decay)),
    ):
        value = getattr(wish, key)
        within = start < value if key != "radius" else start > value
        if value == released or not within or not possible(_changed(wish, key, start)):
            continue
        found = largest(_trial(possible, wish, key), start, value)
        # What a coarse solver allows the other one may not, this near to what nobody can.
        for back in _BACK:
            told = _rounded(found * (start / found) ** back, key)
            if possible(_changed(wish, key, float(told)), None):
                advice.append(f"{text} = {told}")
                break
    wishes = " and ".join(_asked(wish, prefix))
    return DesignError(
        f"no controller was found that keeps {wishes} (solver: {status})",
        where=f"{prefix}region" if prefix else "region",
        remedy=(
            f"possible with the others kept: {', or '.join(advice)}"
            if advice
            else "relax more than one of them, or use another sensor or model"
        ),
    )


def _changed(wish: Region, key: str, value: float) -> Region:
    if key == "decay":
        return replace(wish, decay=value)
    return replace(wish, damping=value) if key == "damping" else replace(wish, radius=value)


def _trial(possible: Callable[[Region], bool], wish: Region, key: str) -> Callable[[float], bool]:
    return lambda value: possible(_changed(wish, key, value))


def _rounded(value: float, key: str) -> str:
    """Return two or three digits, on the safe side."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    count = math.ceil(value / unit) if key == "radius" else math.floor(value / unit)
    return f"{count * unit:.4g}"


def _asked(wish: Region, prefix: str) -> list[str]:
    asked = []
    if wish.decay > 0:
        asked.append(f"{prefix}decay_rate_min = {wish.decay:g} 1/s")
    if wish.damping > 0:
        asked.append(f"{prefix}damping_ratio_min = {wish.damping:g}")
    if math.isfinite(wish.radius):
        asked.append(f"{prefix}radius_max = {wish.radius:g} rad/s")
    return asked


def _seen_by(both: Innovations, regulator: _Placed) -> Half:
    """Return the observer's problem with an error weighted by what the regulator makes of it."""
    half = both.observer
    feedback = both.regulator.preliminary + regulator.gain
    return replace(half, dynamics=replace(half.dynamics, N=feedback.T))


def _joint(
    both: Innovations, first: _Placed, observer: _Placed, wish: Region, rate: float
) -> _Placed:
    """Return the regulator for an observer that is no Kalman filter, with a bound on the loop.

    Where the solver finds none, the first regulator stays, without a bound on the loop's cost.

    The estimate and the error are then correlated: x̂' = A x̂ + B₂ u + K_f (C₂ e + D₂₁ w).
    """
    s, half = both.scaled, both.regulator
    Kf = (both.observer.preliminary + observer.gain).T
    error = Disturbance(s.A - Kf @ s.C2, s.B1 - Kf @ s.D21, Kf @ s.C2, s.C1)
    dynamics = replace(half.dynamics, N=Kf @ s.D21)
    problem = Regulator((dynamics,), half.C, blocks=wish.scaled(rate).blocks, disturbance=error)
    found = solve_regulator(problem, half.optimal)
    if found.K is None or not wish.scaled(rate).holds(_poles(half, found.K)):
        return replace(first, joint=False)
    return _Placed(half, found.K, found)


def _cost_bound(both: Innovations, regulator: _Placed, observer: _Placed) -> float:
    """Return what the inequalities promise of the loop's cost."""
    rate = both.scaled.rate
    if regulator.optimal and observer.optimal:
        return both.optimum
    if observer.optimal:
        return both.unavoidable + rate * regulator.feedback.bound
    if regulator.optimal:
        return both.unavoidable_dual + rate * observer.feedback.bound
    return rate * regulator.feedback.bound if regulator.joint else math.inf


def _words(
    cost: float, bound: float, optimum: float, regulator: _Placed, observer: _Placed
) -> tuple[str, ...]:
    """Return what was assumed, with J/J* promised and achieved."""
    promised = (
        f"at most {bound / optimum:.6g} promised by the inequalities"
        if math.isfinite(bound)
        else "recomputed but not bounded: the inequalities for both halves together gave nothing"
    )
    words = [
        f"J/J* = {cost / optimum:.6g} achieved, {promised}; J* is the optimum without a region"
    ]
    for name, part in (("regulator", regulator), ("observer", observer)):
        if part.optimal:
            words.append(f"the {name}'s Riccati optimum lies within the region and is kept")
        else:
            words.append(
                f"the {name} comes from matrix inequalities (solver: {part.feedback.status})"
            )
    if not observer.optimal and cost > 2 * optimum:
        words.append(
            "most of the cost may be the observer's region: its poles are moved by sensor noise "
            "alone; observer_decay_rate_min = 0, observer_damping_ratio_min = 0 release it"
        )
    return tuple(words)


def _named(checks: Sequence[Check], part: str) -> list[Check]:
    return [Check(f"{part}: {check.name}", check.error, check.tolerance) for check in checks]


def _spectrum(closed: ComplexArray, expected: ComplexArray) -> Check:
    """Return the check that the loop's poles are the regulator's and the observer's."""
    gaps = np.abs(closed[:, None] - expected)
    size = np.maximum(np.abs(closed[:, None]), np.abs(expected))
    worst = max((gaps / size).min(axis=0).max(), (gaps / size).min(axis=1).max())
    return Check("closed-loop poles against regulator and observer", float(worst), 1e-4)
