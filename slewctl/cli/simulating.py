"""The command ``simulate``."""

from __future__ import annotations

import math
from pathlib import Path

from slewctl.check.words import number_text
from slewctl.cli.options import options_named
from slewctl.cli.terminal import OUT, next_step, progress
from slewctl.compare import QUANTITIES, Judge, Judgement
from slewctl.errors import InputError, check_choice
from slewctl.files import DesignFile, read_design
from slewctl.loop import Simulation, simulate


def simulate_design(
    design: Path,
    variation: str | None,
    step: float | None,
    out: Path | None,
    *,
    beside: Path | None = None,
    gif: Path | None = None,
) -> None:
    """Print the measures of a design's slew, and write its report where one is wanted."""
    if beside is not None and out is None and gif is None:
        raise InputError(
            "slews stand side by side in a report or a GIF",
            where="--beside",
            remedy="give --out DIR or --gif FILE too",
        )
    if gif is not None and gif.suffix.lower() != ".gif":
        raise InputError(f"{gif} does not end in .gif", where="--gif", remedy="name such a file")
    title, judged, found = _simulated(design, variation, step)
    other = None if beside is None else _simulated(beside, None, step)
    for line in _told(judged, found):
        OUT.print(line)
    next_step(f"slewctl shape {design}", "commands that leave less vibration")
    if out is None and gif is None:
        return
    names = [title] if other is None else [title, other[0]]
    animation = found.animate(None if other is None else other[2], names=names)
    if gif is not None:
        OUT.print(f"animation: {animation.save(gif)}")
    if out is not None:
        from slewctl.report import write_simulation  # matplotlib is only needed here

        OUT.print(f"report: {write_simulation(found, out, title, animation)}")


def _simulated(
    design: Path, variation: str | None, step: float | None
) -> tuple[str, Judgement, Simulation]:
    """Return a design's name, its judgement and its slew."""
    file = read_design(design, slew=True)
    arms = {one.name: one.arm for one in file.variations}
    with options_named({"variation": "--variation"}):
        if variation is not None and not arms:
            raise InputError(
                f"{design} has no variations", where="variation", remedy="leave it out"
            )
        if variation is not None:
            check_choice(variation, arms, "variation")
    with file.source.computing(), options_named({"step": "--step"}), progress(2) as told:
        told("designing")
        judged = _judged(file, variation)
        told("simulating")
        found = simulate(judged.loop, judged.slew, step=step)
    title = f"{file.case.name} [{variation}]" if variation else file.case.name
    return title, judged, found


def _judged(file: DesignFile, variation: str | None) -> Judgement:
    judging = Judge(file.case)
    if variation is None:
        return judging.evaluate(*judging.chosen).judgement
    (arm,) = (one.arm for one in file.variations if one.name == variation)
    return judging.vary(arm)


def _told(judged: Judgement, found: Simulation) -> list[str]:
    """Return the result, and its measures under the names that requirements limit."""
    lines = [str(found), f"  {'controller':<20}{repr(judged.controller)[1:-1]}"]
    summary = found.summary
    values = {
        "settling_time": summary.settling_time_s,
        "overshoot": summary.overshoot,
        "residual_vibration": summary.residual_m,
        "torque_peak": summary.peak_torque,
        "voltage_peak": summary.peak_voltage,
        "slew_energy": summary.energy_j,
        "saturation_time": summary.saturation_s,
    }
    for name, value in values.items():
        if value is not None:
            lines.append(f"  {name:<20}{_text(name, value)}")
    if found.anti_windup:
        lines.append(f"  {'anti-windup':<20}{found.anti_windup}")
    if found.seed is not None:
        lines.append(f"  {'seed':<20}{found.seed}")
    lines.append(f"  {'step':<20}{found.step:.3g} s, {len(found.t)} times to {found.t[-1]:g} s")
    return lines


def _text(name: str, value: float) -> str:
    if math.isinf(value):
        return f"none: {QUANTITIES[name].infinite}"
    return number_text(value, QUANTITIES[name].unit)
