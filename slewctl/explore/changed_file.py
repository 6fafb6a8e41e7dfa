"""A design file with some of its keys changed: everything else in it stays as it was written."""

from __future__ import annotations

from collections.abc import Callable, Mapping, MutableMapping
from math import sqrt
from typing import Any

import numpy as np
import tomlkit
from tomlkit.items import Table

from slewctl.arm import Arm, ModalData, vary
from slewctl.arm.parts import arm_table
from slewctl.explore.knobs import DAMPING, DELAY, SAMPLE_TIME, STIFFNESS, Value
from slewctl.export import toml_text
from slewctl.files import DesignFile

Tables = MutableMapping[str, Any]


def changed_text(design: DesignFile, settings: Mapping[str, Value]) -> str:
    """Return the text of a design file with some keys changed.

    Parameters
    ----------
    design : DesignFile
    settings : mapping of str to float, int or str
        By the keys of `Knob`, those alone that are to be changed.  A sample time of zero takes
        the clock, with its delay, out of the file.

    Returns
    -------
    str
        Comments and order are the file's own; only a change of the stiffness of a catalogue arm
        writes its ``[arm]`` anew, in full.

    Examples
    --------
    >>> from slewctl.explore import changed_text
    >>> from slewctl.files import example_design, read_design
    >>> design = read_design(example_design())
    >>> print(changed_text(design, {"model.n": 2, "arm.hub.inertia": 0.3}).splitlines()[0])
    arm = { catalogue = "paper-beam", hub.inertia = 0.3, damping_ratio = 0.01 }
    """
    document = tomlkit.parse(design.source.text)
    changes = dict(settings)
    stiffer = float(changes.pop(STIFFNESS, 1.0))
    if stiffer != 1.0:
        _stiffen(document, design, stiffer)
    damped = float(changes.pop(DAMPING, 1.0))
    if damped != 1.0:
        _multiply_ratios(document["arm"], design.case.arm, damped)
    if not changes.get(SAMPLE_TIME, 1.0):
        for key in (SAMPLE_TIME, DELAY):
            document["controller"].pop(key.partition(".")[2], None)
            changes.pop(key, None)
    for key, value in changes.items():
        _set(document, key.split("."), value)
    return tomlkit.dumps(document)


def _set(document: Tables, path: list[str], value: Value) -> None:
    """Set a key, in a table that is made where it is missing."""
    table = document
    for name in path[:-1]:
        if name not in table:
            inline = not isinstance(table, Table | tomlkit.TOMLDocument)
            table[name] = tomlkit.inline_table() if inline else tomlkit.table()
        table = table[name]
    if table.get(path[-1]) != value:
        table[path[-1]] = value


def _stiffen(document: Tables, design: DesignFile, factor: float) -> None:
    arm, faster = document["arm"], sqrt(factor)
    for data in _modal_data(arm):
        data["frequencies_hz"] = [_short(faster * hertz) for hertz in data["frequencies_hz"]]
    if isinstance(design.case.arm.beam, ModalData):
        return
    if "catalogue" in arm:
        stiffer = arm_table(vary(design.case.arm, stiffness_factor=factor))
        document["arm"] = tomlkit.parse(toml_text({"arm": stiffer}))["arm"]
    elif "section" in arm["beam"]:
        _multiply(arm["beam"]["section"], "youngs_modulus", factor)
    elif isinstance(arm["beam"]["bending_stiffness"], MutableMapping):
        _multiply(arm["beam"]["bending_stiffness"], "values", factor)
    else:
        _multiply(arm["beam"], "bending_stiffness", factor)


def _modal_data(arm: Tables) -> list[Tables]:
    found = [arm["modal_data"]] if "modal_data" in arm else []
    return [*found, *arm.get("wings", {}).values()]


def _multiply_ratios(arm: Tables, known: Arm, factor: float) -> None:
    tables = [t for t in (arm, *arm.get("wings", {}).values()) if "damping_ratio" in t]
    for table in tables:
        _multiply(table, "damping_ratio", factor)
    if not tables:  # those of the catalogue
        ratios = np.atleast_1d(known.damping_ratio).tolist()
        arm["damping_ratio"] = [_short(factor * ratio) for ratio in ratios]


def _multiply(table: Tables, key: str, factor: float) -> None:
    table[key] = _each(table[key], lambda value: _short(factor * value))


def _each(value: Any, change: Callable[[float], float]) -> Any:
    return [change(item) for item in value] if isinstance(value, list) else change(value)


def _short(value: float) -> float:
    """Return a value without the digits that multiplying leaves behind."""
    return float(f"{value:.12g}")
