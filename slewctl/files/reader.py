"""Design files: TOML to frozen values, with file, key and remedy in every refusal.

A design file describes; it runs no code.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import ValidationError

from slewctl.arm import Arm, Beam, Hub, Payload, ProfileSpec, Stations, catalogue
from slewctl.check import check_limits
from slewctl.compare import Case
from slewctl.errors import InputError, SlewctlError, check_number, suggest
from slewctl.files.schema import ArmTable, ControllerTable, DesignTable, Table
from slewctl.loop import Slew
from slewctl.plant import Objective

T = TypeVar("T", bound=Table)


@dataclass(frozen=True)
class DesignFile:
    """A design file read and checked.

    Attributes
    ----------
    path : Path
    case : Case
    requirements : mapping of str to float
    """

    path: Path
    case: Case
    requirements: Mapping[str, float | bool]


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
    return tuple(dict.fromkeys(found))


def read_design(path: Path) -> DesignFile:
    """Return the design that a TOML file describes.

    Raises
    ------
    InputError
        If the file cannot be read, is not TOML, or has an unknown key or an impossible
        value; the message names file, key and remedy.
    """
    table = _validate(path, _parse(path), DesignTable)
    try:
        limits = check_limits(table.requirements)
        case = Case(
            name=path.stem,
            source=str(path),
            arm=_arm(table.arm),
            objective=_objective(table.controller),
            basis=table.model.basis,
            n=table.model.n,
            method=table.controller.method,
            slew=Slew(**table.slew.model_dump()),
            title=table.title,
            truth_modes=table.truth.modes,
            bases=tuple(table.compare.bases),
            orders=tuple(table.compare.orders),
        )
    except SlewctlError as error:
        raise error.within(str(path)) from error
    return DesignFile(path, case, {name: table.requirements[name] for name in limits})


def read_arm(path: Path) -> Arm:
    """Return the arm that the ``[arm]`` table of a TOML file describes.

    Raises
    ------
    InputError
        As `read_design`, for that table.
    """
    content = _parse(path)
    if "arm" not in content:
        raise InputError("no [arm] table", where=str(path), remedy="add one")
    table = _validate(path, content["arm"], ArmTable, ("arm",))
    try:
        return _arm(table)
    except SlewctlError as error:
        raise error.within(str(path)) from error


def _parse(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise InputError(
            f"cannot be read: {reason}", where=str(path), remedy="check the path"
        ) from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"not valid TOML: {error}", where=str(path)) from error


def _validate(path: Path, content: object, kind: type[T], prefix: tuple[str, ...] = ()) -> T:
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        # The first wrong key is the one to mend first.
        raise _refusal(path, kind, prefix, error.errors(include_url=False)[0]) from None


def _refusal(
    path: Path, kind: type[Table], prefix: tuple[str, ...], error: Mapping[str, Any]
) -> InputError:
    """Return pydantic's finding in this project's words."""
    place = tuple(str(part) for part in error["loc"])
    key = ".".join((*prefix, *place))
    if error["type"] == "extra_forbidden":
        remedy = suggest(place[-1], _known_keys(kind, place[:-1]))
        return InputError("unknown key", where=f"{path}: {key}", remedy=remedy)
    if error["type"] == "missing":
        return InputError("missing", where=f"{path}: {key}", remedy="add it")
    wanted = str(error["msg"]).removeprefix("Input should be ")
    return InputError(
        f"{error['input']!r} is not allowed", where=f"{path}: {key}", remedy=f"give {wanted}"
    )


def _known_keys(kind: type[Table], place: tuple[str, ...]) -> tuple[str, ...]:
    """Return the keys that the table at `place` knows."""
    for part in place:
        annotation = kind.model_fields[part].annotation
        options = (annotation, *get_args(annotation))
        kind = next(t for t in options if isinstance(t, type) and issubclass(t, Table))
    return tuple(kind.model_fields)


def _objective(table: ControllerTable) -> Objective:
    try:
        return Objective(table.limits, table.noise)
    except InputError as error:
        raise error.within("controller", ".") from error


def _arm(table: ArmTable) -> Arm:
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
        arm = catalogue.get(str(table.catalogue))
    return replace(
        arm,
        hub=Hub(**table.hub.model_dump()) if table.hub else arm.hub,
        payload=Payload(**table.payload.model_dump()) if table.payload else arm.payload,
        damping_ratio=arm.damping_ratio if table.damping_ratio is None else table.damping_ratio,
        name=table.name or arm.name,
    )


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
