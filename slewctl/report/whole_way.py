"""The report of one design from data sheet to code: arm, fit, design, verdict, slew, code."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from slewctl.animation.animation import Animation
from slewctl.arm import Arm
from slewctl.arm.parts import arm_table
from slewctl.compare import CaseResult
from slewctl.loop import Simulation
from slewctl.measured.rig_fit_result import RigFit
from slewctl.report.comparison import section
from slewctl.report.export import csv_text, json_text, write_files
from slewctl.report.measured_panel import response_figure
from slewctl.report.page import render, versions

# Figures of the loop that stand in it, of those that a comparison draws.
_FIGURES = ("bode", "nyquist", "sensitivity", "poles")
# Properties that differ by less are one.
_SAME = 1e-3
# A gain that is off by less, as a logarithm, is no matter for a margin: a tenth of a decibel.
_GAIN = 0.0115


@dataclass(frozen=True, eq=False)
class WholeWay:
    """What is shown of a design.

    Attributes
    ----------
    result : CaseResult
        The design alone.
    verdicts : sequence of mapping
        As for `slewctl.report.comparison.section`.
    slew : Simulation or None
        As it happens.
    sheet : Arm or None
        The arm of the data sheet.
    fit : RigFit or None
        Of that arm to a log.
    code : mapping of str to str
        Files by name; none of a continuous design.
    code_notes : sequence of str
        What is said of the code, or why there is none.
    """

    result: CaseResult
    verdicts: Sequence[Mapping[str, Any]]
    slew: Simulation | None = None
    sheet: Arm | None = None
    fit: RigFit | None = None
    code: Mapping[str, str] | None = None
    code_notes: Sequence[str] = ()


def write_whole_way(way: WholeWay, folder: Path) -> Path:
    """Write the report and return the path of its page.

    Parameters
    ----------
    way : WholeWay
    folder : Path
        Gets ``index.html``, ``results.json``, the code, ``signals.csv`` of the slew and
        ``fitted.toml`` where there are such.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the folder cannot be written; nothing is left half-written.
    """
    shown, arms = section(0, way.result, way.verdicts), list(arm_rows(way))
    name = way.result.case.name
    page = render(
        "whole_way.html",
        s={**shown, "figures": [each for each in shown["figures"] if each[0] in _FIGURES]},
        way=way,
        arms=arms,
        frequencies=_frequencies(way),
        fitted=_fitted(way.fit, arms) if way.fit else None,
        animation=Animation([way.slew.movement], [name]).html() if way.slew else "",
        source=next((text for file, text in (way.code or {}).items() if file.endswith(".c")), ""),
    )
    results = {
        "versions": versions(),
        "case": way.result.case,
        "arm": arms,
        "estimates": way.fit.estimates if way.fit else [],
        "explained": way.fit.explained if way.fit else None,
        "verdicts": list(way.verdicts),
        "slew": way.slew.summary if way.slew else None,
        "code": list(way.code_notes),
    }
    files = {"index.html": page, **(way.code or {}), "results.json": json_text(results)}
    if way.slew:
        files["signals.csv"] = csv_text(way.slew.rows())
    if way.fit:
        files["fitted.toml"] = way.fit.to_toml()
    write_files(folder, files)
    return folder / "index.html"


def arm_rows(way: WholeWay) -> Iterator[dict[str, Any]]:
    """Yield each property of the arm: of the data sheet, as fitted, and in the design.

    Without a data sheet those of the design alone.
    """
    tables = {"sheet": way.sheet, "fitted": way.fit.arm if way.fit else None,
              "design": way.result.case.arm}  # fmt: skip
    arms = {key: arm for key, arm in tables.items() if arm is not None}
    ratios = max(np.size(arm.damping_ratio) for arm in arms.values())
    told = {key: dict(_leaves(_table(arm, ratios))) for key, arm in arms.items()}
    for name in dict.fromkeys(name for values in told.values() for name in values):
        row = {key: values.get(name) for key, values in told.items()}
        numbers = [v for v in row.values() if isinstance(v, float)]
        changed = len(numbers) > 1 and not all(_one(v, numbers[0]) for v in numbers)
        changed = changed or len(numbers) not in (0, len(row))
        yield {"property": name, **row, "changed": changed}


def _table(arm: Arm, ratios: int) -> dict[str, Any]:
    """Return an arm as the table of a design file, with a damping ratio for each of some modes."""
    table = dict(arm_table(arm))
    if "damping_ratio" in table:
        table["damping_ratio"] = arm.damping_ratios(ratios).tolist()
    return table


def _leaves(table: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, float]]:
    """Yield the numbers of nested tables by their keys."""
    for key, value in table.items():
        name = f"{above}{key}"
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{name}.")
        elif isinstance(value, list | tuple):
            yield from _leaves({f"{k + 1}": each for k, each in enumerate(value)}, f"{name}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield name, float(value)


def other_gain(fit: RigFit) -> float | None:
    """Return a fitted gain that is not one, which belongs to no arm; None where it is."""
    names = [each.name for each in fit.estimates]
    if "gain" not in names:
        return None
    low, high = fit.interval("gain")
    far = not low <= 1 <= high and abs(math.log(fit.gain)) > _GAIN
    return fit.gain if far else None


def _one(one: float, other: float) -> bool:
    return math.isclose(one, other, rel_tol=_SAME)


def _frequencies(way: WholeWay) -> list[float]:
    return [float(hz) for hz in way.result.truth.frequencies_hz[:4]]


def _fitted(fit: RigFit, arms: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return what the page shows of the fit."""
    far = [
        row["property"]
        for row in arms
        if row.get("fitted") is not None
        and row["design"] is not None
        and not _one(row["fitted"], row["design"])
    ]
    return {
        "gain": other_gain(fit),
        "picture": response_figure(fit.response, fit.computed(), "fitted", "response"),
        "intervals": [fit.interval(each.name) for each in fit.estimates],
        "far": far,
    }
