"""The command ``shape``."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

from rich.table import Table

from slewctl.cli.options import options_named
from slewctl.cli.terminal import OUT, progress, show
from slewctl.compare import Judge
from slewctl.files import read_design
from slewctl.loop import Conditions, Shaping, compare_commands
from slewctl.loop.motion.slew_inputs import SLEW_SHAPERS

# Residuals that are rounding.
_ROUNDING = 1e-9


def shape_design(design: Path, modes: int | None, error: float, out: Path | None) -> None:
    """Print shapers and profiles for a design's slew, and write a report where one is wanted."""
    file = read_design(design, slew=True)
    slew = file.case.slew
    with file.source.computing(), options_named({"error": "--error"}):
        # What is compared is linear, and all shapers are: the file's own is one of them.
        plain = replace(slew, shaper=None, modes=None, conditions=Conditions())
        judging = Judge(replace(file.case, slew=plain))
        loop = judging.judge(judging.own[1]).loop
        # A shaper and a slew each, and the slew without one.
        with progress(2 * len(SLEW_SHAPERS) + 1) as step:
            found = compare_commands(
                loop, plain, modes=modes or slew.modes, error=error, progress=step
            )
    OUT.print(found.caption)
    show(_table(found.rows()))
    for name, why in found.left_out.items():
        OUT.print(f"{name} left out: {why}")
    show(_table(profile_rows(found)))
    if out is not None:
        from slewctl.report import write_shaping  # matplotlib is only needed here

        OUT.print(f"report: {write_shaping(found, out, file.case.name)}")


def profile_rows(found: Shaping) -> list[dict[str, object]]:
    """Return one row a profile: what the rigid arm needs, and the shortest slew."""
    rows: list[dict[str, object]] = []
    for need in found.profiles:
        row: dict[str, object] = {"profile": need.name, "torque (N·m)": need.torque}
        if need.voltage is not None:
            row["voltage (V)"] = need.voltage
        rows.append({**row, "shortest (s)": need.least_s or None})
    return rows


def _table(rows: list[dict[str, object]]) -> Table:
    table = Table(box=None, pad_edge=False)
    for place, key in enumerate(rows[0]):
        table.add_column(key, justify="right" if place else "left", no_wrap=True)
    for row in rows:
        table.add_row(*(_cell(value) for value in row.values()))
    return table


def _cell(value: object) -> str:
    if value is None:
        return "–"
    if isinstance(value, float):
        if math.isinf(value):
            return "never"
        return f"{value:.4g}" if abs(value) > _ROUNDING else "0"
    return str(value)
