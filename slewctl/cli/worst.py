"""The command ``worst``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.table import Table

from slewctl.cli.options import options_named
from slewctl.cli.terminal import OUT, PATIENCE, number_table, progress, show
from slewctl.compare import QUANTITIES, VariedArm, WorstCase, worst_case
from slewctl.compare.arm_box import box_bounds
from slewctl.compare.quantities import UNWEIGHTED, WEIGHTED
from slewctl.compare.worst_arm import good
from slewctl.errors import InputError, check_choice, shown
from slewctl.export import toml_text
from slewctl.files import DesignFile, read_design
from slewctl.files.uncertainty import Uncertainty

# Arms of the table, the worst first.
_SHOWN = 8
_OPTIONS = {"box": "--box", "quantity": "--quantity", "samples": "--samples",
            "searches": "--searches", "evaluations": "--evaluations", "seed": "--seed"}  # fmt: skip


@dataclass(frozen=True)
class Asked:
    """What the command line says; None where it says nothing and the file does, or the default."""

    box: Sequence[str]
    quantity: str | None
    samples: int | None
    searches: int | None
    evaluations: int | None
    seed: int | None


def print_worst(design: Path, asked: Asked, as_json: bool) -> int:
    """Print the worst arm in a box of a design; return 1 where its loop is unstable."""
    file = read_design(design)
    with options_named(_OPTIONS):
        search = _search(file, asked)
    with progress(search.most_arms, every=PATIENCE) as step, file.source.computing():
        found = worst_case(file.case, search.box, **search.asked, progress=step)
    if as_json:
        from slewctl.report.export import json_text  # loads what draws the reports

        OUT.text(json_text(_record(found)).rstrip())
    else:
        _print(found)
    return 0 if found.stable else 1


def _search(file: DesignFile, asked: Asked) -> Uncertainty:
    """Return what is sought: the command line's words before the file's."""
    own = file.uncertainty
    named = [_interval(text) for text in asked.box]
    box = dict(named) or (own.box if own else {})
    if len(box) < len(named):
        names = [name for name, _ in named]
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError(f"{twice} is given twice", where="box", remedy="give one range of each")
    if not box:
        raise InputError(
            "no box: the file has no [uncertainty], and none is named",
            where="box",
            remedy="give one, as in --box payload_mass=0:0.2 --box stiffness_factor=0.9:1.1",
        )
    box_bounds(box, file.case.arm)
    said: dict[str, Any] = own.asked if own else Uncertainty({}, "disk_margin", 32, 2).asked
    said |= {key: value for key in said if (value := getattr(asked, key)) is not None}
    for name, count in (("seed", "samples"), ("evaluations", "searches")):
        if getattr(asked, count) == 0 and getattr(asked, name) is None:
            said[name] = None  # the file's means nothing then
    check_choice(said["quantity"], QUANTITIES, "quantity")
    if QUANTITIES[said["quantity"]].kind in WEIGHTED and not file.case.objective.weighted:
        raise InputError(UNWEIGHTED, where="quantity", remedy="ask for a margin")
    if QUANTITIES[said["quantity"]].kind == "slew" and "slew" not in file.source.content:
        raise InputError(
            "the file has no [slew] of which it could be read",
            where="quantity",
            remedy="add one with angle_deg and duration_s, or ask for a margin",
        )
    for name, count in (("seed", "samples"), ("evaluations", "searches")):
        if said[name] is not None and not said[count]:
            raise InputError("means nothing where none are made", where=name, remedy="leave it out")
    return Uncertainty(box, **said)


def _interval(text: str) -> tuple[str, tuple[float, float]]:
    """Return the property and the range of NAME=LOW:HIGH."""
    name, _, interval = text.partition("=")
    low, _, high = interval.partition(":")
    try:
        return name.strip(), (float(low), float(high))
    except ValueError:
        raise InputError(
            f"{shown(text)} is not NAME=LOW:HIGH",
            where="box",
            remedy="give it as in payload_mass=0:0.2",
        ) from None


def _print(found: WorstCase) -> None:
    OUT.print(str(found))
    nominal = found.nominal
    OUT.print(f"the arm as it is: {_value(found, nominal)}")
    if found.unstable:
        OUT.print(f"not stable on {found.unstable} of the {found.tried} arms")
    if found.worst.reading.doubt:
        OUT.print(f"NOT confirmed: {found.worst.reading.doubt}")
    show(_table(found))
    if math.isnan(found.value):
        return  # one arm is not worse than another
    text = toml_text({"variations": {"worst": dict(found.properties)}})
    OUT.print("to hold it in the gate whatever the search finds, add to the design file:")
    OUT.text(text[text.index("[variations.worst]") :].rstrip())


def _value(found: WorstCase, trial: VariedArm) -> str:
    if math.isnan(trial.value):
        return f"{found.quantity} has no value: {trial.reading.note}"
    if trial.stable:
        return f"{found.quantity} {trial.value:.4g} {QUANTITIES[found.quantity].unit}".rstrip()
    if trial.growth_per_s is None:
        return "not proved to be stable"
    return f"unstable, growing at {trial.growth_per_s:.3g} 1/s"


def _table(found: WorstCase) -> Table:
    """Return the worst arms, the worst first."""
    table = number_table(*found.properties, found.quantity, "at (Hz)", "how")
    ranked = sorted(found.trials, key=lambda trial: (trial.stable, good(trial, found.quantity)))
    for trial in ranked[:_SHOWN]:
        hertz = "" if trial.frequency_hz is None else f"{trial.frequency_hz:.4g}"
        grows = "not proved" if trial.growth_per_s is None else f"{trial.growth_per_s:.3g} 1/s"
        known = "-" if math.isnan(trial.value) else f"{trial.value:.4g}"
        value = known if trial.stable else f"unstable ({grows})"
        numbers = [f"{number:.5g}" for number in trial.properties.values()]
        table.add_row(*numbers, value, hertz, trial.how)
    return table


def _measured(trial: VariedArm) -> dict[str, Any]:
    value = trial.value if trial.stable and not math.isnan(trial.value) else None
    return {"stable": trial.stable, "value": value, "growth_per_s": trial.growth_per_s}


def _record(found: WorstCase) -> dict[str, Any]:
    worst = {"properties": dict(found.properties), **_measured(found.worst),
             "frequency_hz": found.frequency_hz, "at_corner": found.at_corner,
             "confirmed": found.confirmed}  # fmt: skip
    nominal = _measured(found.nominal)
    return {"quantity": found.quantity, "worst": worst, "nominal": nominal,
            "modes": found.modes, "trials": found.rows()}  # fmt: skip
