"""A design's controller on the measured response beside its arm."""

from __future__ import annotations

from collections.abc import Mapping

from slewctl.check.measured import MEASURED, judge_measured, measure_measured
from slewctl.check.requirements import Verdict
from slewctl.compare import Reading
from slewctl.design import Controller
from slewctl.errors import SlewctlError
from slewctl.files.measured_table import MeasuredPlant
from slewctl.loop.measured_margins import measured_margins


def judge_on_measured(
    plant: MeasuredPlant, controller: Controller
) -> tuple[tuple[Verdict, ...], Mapping[str, Reading], tuple[str, ...]]:
    """Return the verdicts on a measured plant, its margins for a baseline, and what to say of it.

    Parameters
    ----------
    plant : MeasuredPlant
    controller : Controller

    Raises
    ------
    InputError
        If the two have different clocks.
    """
    try:
        margins = measured_margins(
            plant.response,
            controller,
            unstable_poles=plant.unstable_poles,
            poles_at_zero=plant.poles_at_zero,
        )
    except SlewctlError as error:
        raise error.at("measured.file") from error
    notes = [f"{MEASURED}: {plant.response.source}, assumed: {'; '.join(margins.assumptions)}"]
    if plant.left_out:
        notes.append(f"{MEASURED}: no response tells {', '.join(plant.left_out)}")
    return judge_measured(margins, plant.requirements), measure_measured(margins), tuple(notes)
