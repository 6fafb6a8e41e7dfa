"""One point of a study: a design made on the small model, judged on the truth, as a flat row."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from slewctl.arm import Arm
from slewctl.breakdown import computing
from slewctl.compare.case import Case
from slewctl.compare.design_basis import DesignModel, design_model
from slewctl.compare.evaluation import Evaluation, Judge
from slewctl.compare.judgement import Judgement
from slewctl.compare.quantities import QUANTITIES, Quantity
from slewctl.compare.reading import read
from slewctl.compare.study.grid import (
    Point,
    arm_of,
    objective_of,
    omega_of,
    options_of,
    reading_units,
    slew_of,
)
from slewctl.compare.study.results_file import Row
from slewctl.compare.study.varied import words
from slewctl.design import Controller
from slewctl.errors import AccuracyError, SlewctlError
from slewctl.loop import Loop, PlantGraph, gap_between, ncf_margin, plant_graph
from slewctl.loop.robust.destabilised_mode import destabilised_mode
from slewctl.model import total_inertia

# Left out of a row: the same in decibels, and what has no size without units.  The noise of a
# study is known up to a factor only, so that cost and levels under noise say nothing.
_LEFT_OUT = ("stable", "h2_cost", "sensitivity_peak_db", "complementary_peak_db")
_MEASURED = tuple(
    q
    for q in QUANTITIES.values()
    if not (q.name in _LEFT_OUT or q.kind == "noise" or q.unit == "V" or q.simulated)
)


def column(quantity: Quantity) -> str:
    """Return the name of a quantity's column: without its unit where it is counted in another."""
    return (
        quantity.name.removesuffix(f"_{quantity.unit.lower()}") if quantity.scale else quantity.name
    )


# What a row tells beside its axes, in this order.
COLUMNS = (
    "outcome",
    "reason",
    "stable_on_twice",
    "verified",
    "unstable_ratio",
    "unstable_mode",
    "optimum_drift",
    *(column(quantity) for quantity in _MEASURED),
    "nu_gap",
    "generalised_margin",
    "frequency_error",
    "worst_frequency_error",
    "condition",
    "error_bound",
)


@dataclass(frozen=True)
class Work:
    """A point with the arm and the truth that it belongs to; can be sent to another process.

    Attributes
    ----------
    arm : Arm
    truth_modes : int
        Flexible modes of the truth.
    point : Point
    """

    arm: Arm
    truth_modes: int
    point: Point


def evaluate_point(work: Work) -> list[Row]:
    """Return the row of one point: its axes, and what the design achieves on the truth.

    Parameters
    ----------
    work : Work

    Returns
    -------
    list of mapping
        One row.  Beside the axes:

        outcome
            ``stable``, ``unstable`` or ``no design``; then `reason` says why not, and all
            else is None.
        stable_on_twice
            The verdict on a truth of twice the modes.
        verified
            Whether the design's own checks passed.
        unstable_ratio
            The frequency that grows over that of the first flexible mode.
        unstable_mode
            Number of the mode that was lost, 0 for the rigid body; on the larger truth
            where only that one is unstable.
        optimum_drift
            Relative change of the optimal cost on a truth of twice the modes.
        gain_margin_db … torque_peak
            The quantities of `slewctl.compare.QUANTITIES`: times in periods of the first
            flexible mode, rates and frequencies times this period, lengths over the travel
            of the tip, torques over the largest that the rigid arm needs.
        nu_gap, generalised_margin
            ν-gap between design model and truth, and b(P, C) on the design model: the loop
            on the truth is stable for certain where b is larger.  Signals are counted in
            what the rigid arm reads, and needs, when it swings at the bandwidth by 1 rad.
            None where they are not known to working precision, as without damping.
        condition
            Condition number of M_e; None for a reduction.
        error_bound
            Of a reduction, see `slewctl.plant.Reduced`; None for a basis.

    Examples
    --------
    >>> import slewctl as sc
    >>> from slewctl.compare import Grid, Study, Work, evaluate_point
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> grid = Grid(bases=("slewing",), orders=(1,), hub_ratios=(1.0,), payload_ratios=(0.0,),
    ...     damping_ratios=(0.01,), bandwidths=(0.5,))
    >>> study = Study("hubs", "", arm, (grid,), truth_modes=10)
    >>> work = Work(arm, study.truth_modes, next(study.points()))
    >>> evaluate_point(work)[0]["outcome"]
    'stable'
    """
    point, setting = work.point, work.point.setting
    axes = {
        "hub_ratio": setting.hub_ratio,
        "payload_ratio": setting.payload_ratio,
        "damping_ratio": setting.damping_ratio,
        "bandwidth": setting.bandwidth,
        "sensors": "+".join(setting.sensors),
        **({} if setting.variation is None else {"variation": words(setting.variation)}),
        "method": point.method,
        "basis": point.basis,
        "n": point.n,
    }
    try:
        arm = arm_of(work.arm, setting)
    except SlewctlError as error:
        return [axes | _no_design(str(error))]
    return [
        axes
        | design_row(
            arm, setting.bandwidth, setting.sensors, work.truth_modes,
            basis=point.basis, n=point.n, method=point.method,
        )
    ]  # fmt: skip


def design_row(
    arm: Arm,
    bandwidth: float,
    sensors: tuple[str, ...],
    truth_modes: int,
    *,
    basis: str,
    n: int,
    method: str,
) -> dict[str, Any]:
    """Return what `evaluate_point` tells of a design beside its axes.

    A design that cannot be made, or judged in double precision, has a reason instead.
    """
    try:
        with computing():
            place = place_of(arm, bandwidth, sensors, truth_modes)
            return _results(place, place.evaluate(basis, n, method))
    except SlewctlError as error:
        return _no_design(str(error))


def _no_design(reason: str) -> dict[str, Any]:
    return dict.fromkeys(COLUMNS) | {"outcome": "no design", "reason": reason}


@dataclass(frozen=True, eq=False)
class Place:
    """What all designs for one arm, bandwidth and set of sensors share.

    Attributes
    ----------
    judge : Judge
    bandwidth : float
    optimum_drift : float
        Relative change of the optimal cost on a truth of twice the modes.
    """

    judge: Judge
    bandwidth: float
    optimum_drift: float

    @cached_property
    def scales(self) -> dict[str, float]:
        """What a quantity of each scale is divided by; see `Quantity`."""
        case = self.judge.case
        period = 2 * math.pi / float(self.judge.truth.omega[0])
        reach = case.arm.hub.radius + case.arm.beam.length
        turn = math.radians(abs(case.slew.angle_deg))
        return {
            "": 1.0,
            "time": period,
            "rate": 1 / period,
            "length": reach * turn,
            "torque": total_inertia(case.arm) * case.slew.peak_acceleration,
        }

    @cached_property
    def units(self) -> dict[str, Any]:
        """Units of the signals for the ν-gap: of the rigid arm's swing at the bandwidth."""
        arm = self.judge.case.arm
        omega = omega_of(arm, self.bandwidth)
        readings = reading_units(arm, omega, self.judge.case.objective.sensors)
        return {
            "output_scale": list(readings.values()),
            "input_scale": total_inertia(arm) * omega**2,
        }

    @cached_property
    def truth_graph(self) -> PlantGraph:
        """The truth, for the ν-gap to every design model."""
        return plant_graph(self.judge.yardstick.plant.path, **self.units)

    @cached_property
    def _models(self) -> dict[tuple[str, int], DesignModel]:
        return {}

    @cached_property
    def _gaps(self) -> dict[tuple[str, int], float]:
        return {}

    def model(self, basis: str, n: int) -> DesignModel:
        """Return the model of a basis or a reduction, made once for all methods.

        Raises
        ------
        SlewctlError
            If it cannot be made.
        """
        if (basis, n) not in self._models:
            case = self.judge.case
            self._models[basis, n] = design_model(self.judge.truth, case.objective, basis, n)
        return self._models[basis, n]

    def gap(self, design: DesignModel) -> float:
        """Return the ν-gap from the truth to one of the models, found once for all methods.

        Raises
        ------
        SlewctlError
            If it is not known to working precision.
        """
        key = design.source, design.n
        if key not in self._gaps:
            graph = plant_graph(design.path, **self.units)
            self._gaps[key] = gap_between(graph, self.truth_graph).value
        return self._gaps[key]

    def evaluate(
        self, basis: str, n: int, method: str, clock: Mapping[str, float] | None = None
    ) -> Evaluation:
        """Return a design, on a clock or continuous, with its judgement on the truth.

        Raises
        ------
        SlewctlError
            If it cannot be made.
        """
        design = self.model(basis, n)
        options = {**options_of(method, self.judge.case.arm, self.bandwidth), **(clock or {})}
        return Evaluation(design, self.judge.judge(design.controller(method, options)))


@lru_cache(maxsize=8)
def place_of(arm: Arm, bandwidth: float, sensors: tuple[str, ...], truth_modes: int) -> Place:
    """Return the place of an arm, a bandwidth and sensors; see `Place`."""
    objective = objective_of(arm, bandwidth, sensors)
    slew = slew_of(arm, bandwidth)
    judge = Judge(Case("study", arm, objective, slew=slew, truth_modes=truth_modes))
    finer = judge.yardstick.finer
    if finer is None:
        raise TypeError("a study keeps no more modes than can be doubled")
    optimal, again = judge.yardstick.optimum(), finer.optimum()
    for found in (optimal, again):
        if not found.certificate.verified:
            raise AccuracyError(
                f"the optimum to compare with is {found.certificate}",
                where="study",
                remedy="use a milder bandwidth",
            )
    return Place(judge, bandwidth, again.h2_cost / optimal.h2_cost - 1)


def _results(place: Place, found: Evaluation) -> dict[str, Any]:
    design, judged = found.design, found.judgement
    if design is None:
        raise TypeError("a study makes its designs")
    finer = on_twice(judged)
    gap, margin = _gap(place, design, found.controller)
    return {
        "outcome": "stable" if judged.stable else "unstable",
        "reason": "",
        "stable_on_twice": finer.stable,
        "verified": found.verified,
        "unstable_ratio": judged.unstable_hz[0] * place.scales["time"]
        if judged.unstable_hz
        else None,
        "unstable_mode": _mode_lost((finer if judged.stable else judged).loop, design.n),
        "optimum_drift": place.optimum_drift,
        **_measured(place, judged),
        "nu_gap": gap,
        "generalised_margin": margin,
        "frequency_error": abs(float(found.frequency_errors[0])),
        "worst_frequency_error": found.worst_frequency_error,
        "condition": float(np.linalg.cond(design.model.mass[1:, 1:])) if design.model else None,
        "error_bound": design.reduced.bound if design.reduced else None,
    }


def on_twice(judged: Judgement) -> Judgement:
    """Return the judgement on twice the modes, which a study and a recommendation always have."""
    if judged.finer is None:
        raise TypeError("no more modes are kept than can be doubled")
    return judged.finer


def _measured(place: Place, judged: Judgement) -> dict[str, float | None]:
    """Return every quantity that has a column, free of units."""
    values = {}
    for quantity in _MEASURED:
        value = read(judged, quantity.name).value / place.scales[quantity.scale]
        values[column(quantity)] = None if math.isnan(value) else value
    return values


def _mode_lost(loop: Loop, kept: int) -> int | None:
    lost = destabilised_mode(loop, kept)
    return lost.number if lost else None


def _gap(place: Place, design: DesignModel, controller: Controller) -> tuple[float | None, ...]:
    """Return the ν-gap from the truth and b(P, C), in units of the rigid arm's own swing."""
    try:
        return place.gap(design), ncf_margin(design.path, controller, **place.units).value
    except SlewctlError:  # undamped modes that nothing moves have no graph to compare
        return None, None
