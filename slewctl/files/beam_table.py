"""``[arm.beam]``: profiles along the beam, or a section and its material."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

from slewctl.arm import Beam, ProfileSpec, Stations
from slewctl.errors import InputError, check_each, check_number, shown
from slewctl.files.chosen_tables import RectangleTable, TubeTable
from slewctl.files.faults import Faults, missing
from slewctl.files.refusals import validate
from slewctl.files.schema import BeamTable

_PROFILES = ("mass_per_length", "bending_stiffness")


def beam_of_table(table: BeamTable) -> Beam:
    """Return the beam of a table.

    Raises
    ------
    InputError
        For everything that is wrong with it.
    """
    if table.section is not None:
        return _of_section(table, table.section)
    faults = Faults()
    found = {key: _attempted(faults, key, getattr(table, key)) for key in _PROFILES}
    faults.tell()
    return Beam(table.length, **cast(dict[str, ProfileSpec], found))


def _of_section(table: BeamTable, content: Mapping[str, Any]) -> Beam:
    """Return a uniform beam; the keys of its section say whether that is a tube."""
    faults = Faults()
    for key in _PROFILES:
        if getattr(table, key) is not None:
            faults.add(
                [
                    InputError(
                        "the section gives it already",
                        where=f"arm.beam.{key}",
                        remedy="leave it out, or the section",
                    )
                ]
            )
    faults.tell()
    place = ("arm", "beam", "section")
    try:
        if {"outer_diameter", "inner_diameter"} & content.keys():
            return Beam.tube(table.length, **validate(content, TubeTable, place).model_dump())
        keys = validate(content, RectangleTable, place).model_dump()
        return Beam.rectangular(table.length, **keys)
    except InputError as error:
        if error.where.startswith("beam."):
            raise error.at(error.where.replace("beam.", "arm.beam.section.", 1)) from error
        raise


def _attempted(faults: Faults, key: str, value: object) -> ProfileSpec | None:
    where = f"arm.beam.{key}"
    if value is None:
        faults.add([missing(where)])
        return None
    return faults.attempt(_profile, value, where)


def _profile(value: object, where: str) -> ProfileSpec:
    if isinstance(value, dict):
        if set(value) != {"x", "values"} or not all(isinstance(v, list) for v in value.values()):
            raise InputError(
                f"a table of stations with keys {shown(sorted(value))}",
                where=where,
                remedy="give { x = [...], values = [...] }, x in metres",
            )
        try:
            return Stations(value["x"], value["values"])
        except InputError as error:
            key = where + error.where.removeprefix("stations")
            raise error.at(key) from error
    if isinstance(value, list):
        return check_each(value, where, check_number)
    return check_number(value, where)
