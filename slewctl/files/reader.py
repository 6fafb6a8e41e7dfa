"""Design files: TOML to frozen values, with file, line, key and remedy in every refusal.

A design file describes; it runs no code.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from slewctl.arm import (
    Arm,
    Beam,
    Hub,
    KelvinVoigt,
    Motor,
    Payload,
    ProfileSpec,
    Rayleigh,
    Stations,
    catalogue,
)
from slewctl.check import check_limits
from slewctl.compare import Case
from slewctl.errors import InputError, SlewctlError, check_choice, check_number
from slewctl.files.refusals import validate
from slewctl.files.schema import (
    ArmTable,
    ControllerTable,
    DesignTable,
    KelvinVoigtTable,
    RayleighTable,
    Table,
)
from slewctl.files.source import Source, read_source
from slewctl.files.variations import Variation, read_variations
from slewctl.loop import Slew
from slewctl.plant import Objective
from slewctl.plant.signals import check_signals

# Kind of damping law: the table that describes it, and the law.
_LAWS: dict[str, tuple[type[Table], type[Rayleigh | KelvinVoigt]]] = {
    "rayleigh": (RayleighTable, Rayleigh),
    "kelvin-voigt": (KelvinVoigtTable, KelvinVoigt),
}


@dataclass(frozen=True)
class DesignFile:
    """A design file read and checked.

    Attributes
    ----------
    path : Path
    case : Case
    requirements : mapping of str to float
    variations : tuple of Variation
        The arms on which the same controller is judged as well.
    source : Source
        The file's text, and the lines of its keys.
    """

    path: Path
    case: Case
    requirements: Mapping[str, float | bool]
    variations: tuple[Variation, ...]
    source: Source


def find_designs(paths: Iterable[Path]) -> tuple[Path, ...]:
    """Return the ``.toml`` files named, and those in the folders named, sorted.

    Raises
    ------
    InputError
        If a path does not exist or a folder holds no design.
    """
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            inside = sorted(path.glob("*.toml"))
            if not inside:
                raise InputError(
                    "no .toml file in this folder", where=str(path), remedy="name a design file"
                )
            found += inside
        elif path.is_file():
            found.append(path)
        else:
            raise InputError("no such file or folder", where=str(path), remedy="check the path")
    return tuple({path.resolve(): path for path in found}.values())


def name_designs(paths: Iterable[Path]) -> dict[Path, str]:
    """Return a short name for each file: its stem, or as many folders as tell it from others."""
    names: dict[Path, str] = {}
    whole = {path: path.resolve().parts for path in paths}
    stems = Counter(path.stem for path in whole)
    for path, parts in whole.items():
        rivals = [p for p in whole.values() if p != parts]
        depth = 2
        while any(p[-depth:] == parts[-depth:] for p in rivals):
            depth += 1
        names[path] = path.stem if stems[path.stem] == 1 else "/".join(parts[-depth:])
    return names


def read_design(path: Path, name: str = "") -> DesignFile:
    """Return the design that a TOML file describes.

    Parameters
    ----------
    path : Path
    name : str, optional
        The design's short name; the file's stem by default.

    Raises
    ------
    InputError
        If the file cannot be read, is not TOML, or has an unknown key or an impossible
        value; the message names file, line, key and remedy.
    """
    source = read_source(path)
    try:
        table = validate(source.content, DesignTable)
        check_limits(table.requirements)
        arm = arm_of_table(table.arm)
        case = _case(table, arm, path, name or path.stem)
        variations = read_variations(table.variations, arm, table.requirements)
    except SlewctlError as error:
        raise source.refuse(error) from error
    return DesignFile(path, case, table.requirements, variations, source)


def _case(table: DesignTable, arm: Arm, path: Path, name: str) -> Case:
    return Case(
        name=name,
        source=str(path),
        arm=arm,
        objective=_objective(table.controller, arm),
        basis=table.model.basis,
        n=table.model.n,
        method=table.controller.method,
        options=table.controller.model_extra or {},
        slew=Slew(**table.slew.model_dump()),
        title=table.title,
        truth_modes=table.truth.modes,
        bases=tuple(table.compare.bases),
        orders=tuple(table.compare.orders),
    )


def read_designs(paths: Iterable[Path]) -> tuple[DesignFile, ...]:
    """Return the designs in files and folders, each with a name of its own.

    Raises
    ------
    InputError
        As `find_designs` and `read_design`.
    """
    names = name_designs(find_designs(paths))
    return tuple(read_design(path, name) for path, name in names.items())


def read_arm(path: Path) -> Arm:
    """Return the arm that the ``[arm]`` table of a TOML file describes.

    Raises
    ------
    InputError
        As `read_design`, for that table.
    """
    source = read_source(path)
    if "arm" not in source.content:
        raise InputError("no [arm] table", where=str(path), remedy="add one")
    try:
        return arm_of_table(validate(source.content["arm"], ArmTable, ("arm",)))
    except SlewctlError as error:
        raise source.refuse(error) from error


def _objective(table: ControllerTable, arm: Arm) -> Objective:
    try:
        objective = Objective(table.limits, table.noise)
        for where, names in (("limits", objective.performance), ("noise", objective.sensors)):
            check_signals(names, where, arm.beam)
    except InputError as error:
        raise error.within("controller", ".") from error
    if objective.actuator == "voltage" and arm.motor is None:
        raise InputError(
            "the arm has no motor",
            where="controller.limits.voltage",
            remedy="add [arm.motor], or limit the torque instead",
        )
    return objective


def find_arm(name: str) -> Arm:
    """Return the arm of a catalogue name, or of the TOML file of that name.

    Raises
    ------
    InputError
        As `read_arm`, or for a name that is neither.
    """
    path = Path(name)
    is_path = name not in catalogue.names() and (path.suffix == ".toml" or path.exists())
    return read_arm(path) if is_path else catalogue.get(name)


def arm_of_table(table: ArmTable) -> Arm:
    """Return the arm of a table: a catalogue entry changed where given, or a new one."""
    if (table.catalogue is None) == (table.beam is None):
        raise InputError(
            "give either catalogue or beam",
            where="arm",
            remedy=f"catalogue arms: {', '.join(catalogue.names())}",
        )
    if table.beam is not None:
        beam = Beam(
            table.beam.length,
            _profile(table.beam.mass_per_length, "arm.beam.mass_per_length"),
            _profile(table.beam.bending_stiffness, "arm.beam.bending_stiffness"),
        )
        arm = Arm(beam)
    else:
        name = check_choice(str(table.catalogue), catalogue.names(), "arm.catalogue")
        arm = catalogue.get(name)
    ratio = table.damping_ratio
    return replace(
        arm,
        hub=Hub(**table.hub.model_dump()) if table.hub else arm.hub,
        payload=Payload(**table.payload.model_dump()) if table.payload else arm.payload,
        damping_ratio=arm.damping_ratio if ratio is None else ratio,
        damping=arm.damping if table.damping is None else _damping(table.damping),
        motor=Motor(**table.motor.model_dump()) if table.motor else arm.motor,
        name=table.name or arm.name,
    )


def _damping(content: Mapping[str, Any]) -> Rayleigh | KelvinVoigt:
    """Return the damping law of ``[arm.damping]``, whose kind says which keys it takes."""
    if "kind" not in content:
        raise InputError(
            "missing", where="arm.damping.kind", remedy=f"add it, one of {', '.join(_LAWS)}"
        )
    kind = check_choice(content["kind"], _LAWS, "arm.damping.kind")
    table, law = _LAWS[kind]
    keys = validate(content, table, ("arm", "damping")).model_dump(exclude={"kind"})
    return law(**keys)


def _profile(value: object, where: str) -> ProfileSpec:
    if isinstance(value, dict):
        if set(value) != {"x", "values"} or not all(isinstance(v, list) for v in value.values()):
            raise InputError(
                f"a table of stations with keys {sorted(value)}",
                where=where,
                remedy="give { x = [...], values = [...] }, x in metres",
            )
        return Stations(value["x"], value["values"])
    if isinstance(value, list):
        return tuple(check_number(coefficient, where) for coefficient in value)
    return check_number(value, where)
