"""One point of a study: a design made on the small model, judged on the truth, as a flat row."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from slewctl.arm import Arm
from slewctl.basis import create
from slewctl.compare.case import Case
from slewctl.compare.evaluation import Evaluation, Judge
from slewctl.compare.grid import (
    Point,
    Study,
    arm_of,
    objective_of,
    options_of,
    slew_of,
)
from slewctl.compare.study_result import StudyResult
from slewctl.compare.sweep import Piece, Row, rows, sweep
from slewctl.design import METHODS, Controller
from slewctl.errors import SlewctlError
from slewctl.loop import close
from slewctl.model import Model, assemble, total_inertia, truth
from slewctl.plant import generalised_plant

# What a row tells beside its axes, in this order.
_COLUMNS = (
    "outcome",
    "reason",
    "stable_on_twice",
    "verified",
    "unstable_ratio",
    "loss",
    "optimum_drift",
    "gain_margin_db",
    "phase_margin_deg",
    "delay_margin",
    "modulus_margin",
    "disk_margin",
    "damping_ratio_min",
    "settling",
    "residual",
    "peak_torque",
    "frequency_error",
    "worst_frequency_error",
    "condition",
)


@dataclass(frozen=True)
class Work:
    """A point with the arm and the truth that it belongs to; can be sent to another process."""

    arm: Arm
    truth_modes: int
    point: Point


def run_study(
    study: Study,
    results: Path,
    *,
    stamp: Mapping[str, Any],
    executor: Executor | None = None,
    workers: int | None = None,
    resume: bool = False,
    progress: Callable[[int], None] | None = None,
) -> StudyResult:
    """Try every point of a study; see `sweep` for the parameters and errors."""

    def pieces() -> Iterator[Piece]:
        for point in study.points():
            yield Piece(point.key, Work(study.arm, study.truth_modes, point))

    sweep(
        evaluate_point, pieces(), results, stamp=stamp, executor=executor, workers=workers,
        resume=resume, progress=progress,
    )  # fmt: skip
    return StudyResult(study, rows(results))


def evaluate_point(work: Work) -> list[Row]:
    """Return the row of one point: its axes, and what the design achieves on the truth.

    Lengths of time are in periods of the first flexible mode, the residual is relative to
    the tip's travel, the peak torque to that of the rigid arm.
    """
    point, setting = work.point, work.point.setting
    axes = {
        "hub_ratio": setting.hub_ratio,
        "payload_ratio": setting.payload_ratio,
        "damping_ratio": setting.damping_ratio,
        "bandwidth": setting.bandwidth,
        "sensors": "+".join(setting.sensors),
        "method": point.method,
        "basis": point.basis,
        "n": point.n,
    }
    arm = arm_of(work.arm, setting)
    place = place_of(arm, setting.bandwidth, setting.sensors, work.truth_modes)
    return [axes | place.row(point.basis, point.n, point.method)]


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

    def row(self, basis: str, n: int, method: str) -> dict[str, Any]:
        """Return what a design achieves; a design that cannot be made has a reason instead."""
        arm = self.judge.case.arm
        try:
            model = assemble(arm, create(basis, n, arm))
            plant = generalised_plant(model, self.judge.case.objective)
            controller = METHODS[method](plant, **options_of(method, arm, self.bandwidth))
            found = self.judge.assess(basis, n, model, controller).evaluation
            return _results(self, found, model, controller)
        except SlewctlError as error:
            return dict.fromkeys(_COLUMNS) | {"outcome": "no design", "reason": str(error)}


@lru_cache(maxsize=8)
def place_of(arm: Arm, bandwidth: float, sensors: tuple[str, ...], truth_modes: int) -> Place:
    """Return the place of an arm, a bandwidth and sensors; see `Place`."""
    objective = objective_of(arm, bandwidth, sensors)
    slew = slew_of(arm, bandwidth)
    judge = Judge(Case("study", arm, objective, slew=slew, truth_modes=truth_modes))
    finer = Judge(Case("study", arm, objective, truth_modes=2 * truth_modes))
    return Place(judge, bandwidth, finer.optimal.h2_cost / judge.optimal.h2_cost - 1)


def _results(
    place: Place, found: Evaluation, model: Model, controller: Controller
) -> dict[str, Any]:
    case = place.judge.case
    finer = close(truth(case.arm, 2 * case.truth_modes), case.objective, controller)
    margins, slew = found.margins, found.slew
    period = 2 * math.pi / float(place.judge.truth.omega[0])
    travel = math.radians(abs(case.slew.angle_deg)) * (case.arm.hub.radius + case.arm.beam.length)
    return {
        "outcome": "stable" if found.stable else "unstable",
        "reason": "",
        "stable_on_twice": finer.stable,
        "verified": found.verified,
        "unstable_ratio": _ratio(found.unstable_hz, period),
        "loss": found.loss,
        "optimum_drift": place.optimum_drift,
        "gain_margin_db": margins and margins.smaller_gain_db.value,
        "phase_margin_deg": margins and margins.phase_deg.value,
        "delay_margin": margins and margins.delay_s.value / period,
        "modulus_margin": margins and margins.modulus.value,
        "disk_margin": margins and margins.disk.value,
        "damping_ratio_min": found.damping_ratio.value,
        "settling": slew and slew.settling_time_s / period,
        "residual": slew and slew.residual_m / travel,
        "peak_torque": slew and slew.peak_torque / _rigid_peak(place),
        "frequency_error": abs(float(found.frequency_errors[0])),
        "worst_frequency_error": found.worst_frequency_error,
        "condition": float(np.linalg.cond(model.mass[1:, 1:])),
    }


def _ratio(unstable_hz: tuple[float, ...], period: float) -> float | None:
    """Return the frequency that grows over the first flexible one."""
    return unstable_hz[0] * period if unstable_hz else None


def _rigid_peak(place: Place) -> float:
    """Return the largest torque that turns the rigid arm along the slew's reference."""
    case = place.judge.case
    # The largest acceleration of a minimum-jerk turn is 10/√3 angle/T².
    turn = math.radians(abs(case.slew.angle_deg)) / case.slew.duration_s**2
    return total_inertia(case.arm) * 10 / math.sqrt(3) * turn
