"""``[arm]``: a catalogue arm, changed where keys are given, or a full description."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from slewctl._types import FilePath
from slewctl.arm import (
    LAWS,
    Actuator,
    Arm,
    DampingLaw,
    Hub,
    Joint,
    LumpedMass,
    Motor,
    Payload,
    Sensor,
    catalogue,
    equal_appendages,
)
from slewctl.breakdown import computing
from slewctl.errors import InputError, check_choice, check_path
from slewctl.files.beam_table import beam_of_table
from slewctl.files.chosen_tables import DragTable, KelvinVoigtTable, RayleighTable
from slewctl.files.drive_tables import SensorTable
from slewctl.files.faults import Faults, missing, placed
from slewctl.files.modal_table import arm_of_wings, data_of_table
from slewctl.files.refusals import validate
from slewctl.files.schema import ArmTable, LumpedMassTable
from slewctl.files.source import read_source
from slewctl.files.table import Table
from slewctl.plant.signals import signal

# What describes an arm that is not of the catalogue.
DESCRIBED = ("beam", "modal_data", "wings")
_OWN_RATIOS = InputError(
    "each wing has its own",
    where="arm.damping_ratio",
    remedy="leave it out, and give each of arm.wings its damping_ratio",
)
Part = TypeVar("Part", Hub, Payload)
# Kind of damping law: the table that describes it, and the law.
_TABLES: tuple[type[Table], ...] = (RayleighTable, KelvinVoigtTable, DragTable)
_LAWS = {law.kind: (table, law) for table, law in zip(_TABLES, LAWS, strict=True)}


def find_arm(name: str) -> Arm:
    """Return the arm of a catalogue name, or of the TOML file of that name.

    Parameters
    ----------
    name : str
        Of the catalogue, or a path.

    Returns
    -------
    Arm

    Raises
    ------
    InputError
        As `read_arm`, or for a name that is neither.

    Examples
    --------
    >>> from slewctl.files import find_arm
    >>> find_arm("paper-beam").beam.length
    1.0
    """
    path = _path(name)
    return catalogue.get(name) if path is None else read_arm(path)


def computing_arm(name: str) -> AbstractContextManager[None]:
    """Return a context in which whatever a computation on this arm raises names its place.

    Parameters
    ----------
    name : str
        As given to `find_arm`.

    Returns
    -------
    context manager

    Examples
    --------
    >>> import slewctl as sc
    >>> from slewctl.files import computing_arm
    >>> with computing_arm("paper-beam"):
    ...     beam = sc.arms.paper_beam().beam
    """
    path = _path(name)
    return computing(name) if path is None else read_source(path).computing()


def _path(name: str) -> Path | None:
    """Return the file that a name of an arm means, None if it is one of the catalogue."""
    path = Path(name)
    known = name in catalogue.names()
    return path if not known and (path.suffix == ".toml" or path.exists()) else None


def read_arm(path: FilePath) -> Arm:
    """Return the arm that the ``[arm]`` table of a TOML file describes.

    Parameters
    ----------
    path : str or PathLike

    Returns
    -------
    Arm

    Raises
    ------
    InputError
        As `read_design`, for that table.

    Examples
    --------
    >>> from slewctl.files import example_design, read_arm
    >>> path = example_design()
    >>> read_arm(path).damping_ratio
    0.01
    """
    path = check_path(path, "path")
    source = read_source(path)
    if "arm" not in source.content:
        raise InputError("no [arm] table", where=f"{path}:1", remedy="add one")
    with source.computing():
        return arm_of_table(validate(source.content["arm"], ArmTable, ("arm",)))


def arm_of_table(table: ArmTable) -> Arm:
    """Return the arm of a table: a catalogue entry changed where given, or a new one.

    Raises
    ------
    InputError
        For everything that is wrong with it.
    """
    faults = Faults()
    arm = faults.attempt(_unchanged, table)
    ratio = table.damping_ratio
    parts: dict[str, Any] = {
        "hub": table.hub and faults.attempt(_changed, arm.hub if arm else Hub(), table.hub),
        "payload": table.payload
        and faults.attempt(_changed, arm.payload if arm else Payload(), table.payload),
        "masses": table.masses and _masses(table.masses, faults),
        "motor": table.motor and faults.attempt(Motor, **table.motor.model_dump()),
        "joint": table.joint and faults.attempt(Joint, **table.joint.model_dump()),
        "actuator": table.actuator and faults.attempt(Actuator, **table.actuator.model_dump()),
        "sensors": table.sensors and _sensors(table.sensors, arm, faults),
        "damping": None if table.damping is None else faults.attempt(_damping, table.damping),
        "damping_ratio": ratio,
        "damping_modes": table.damping_modes,
        "name": table.name or None,
    }
    unsaid = ratio is None and not np.any(arm.damping_ratio if arm else 0.0)
    if table.damping_modes is not None and unsaid:
        faults.add([missing("arm.damping_ratio")])
    if table.wings is not None and ratio is not None:
        faults.add([_OWN_RATIOS])
    given = {key: part for key, part in parts.items() if part is not None}
    # What is wrong with the whole is looked for even if one of its parts is.
    whole = faults.attempt(replace, arm or catalogue.get(catalogue.names()[0]), **given)
    if whole is not None and table.appendages is not None:
        whole = faults.attempt(equal_appendages, whole, table.appendages)
    return faults.settled(whole)


def _masses(tables: Sequence[LumpedMassTable], faults: Faults) -> list[LumpedMass] | None:
    """Return the masses along the beam, if nothing is wrong with any."""
    made = [faults.attempt(_mass, k, table) for k, table in enumerate(tables)]
    found = [mass for mass in made if mass is not None]
    return found if len(found) == len(made) else None


def _mass(k: int, table: LumpedMassTable) -> LumpedMass:
    return placed(f"masses.{k}", LumpedMass, **table.model_dump())


def _sensor(name: str, table: SensorTable) -> Sensor:
    return placed(f"sensors.{name}", Sensor, **table.model_dump())


def _sensors(
    tables: Mapping[str, SensorTable], arm: Arm | None, faults: Faults
) -> dict[str, Sensor]:
    """Return the sensors of ``[arm.sensors]``, beside those of a catalogue arm."""
    found = dict(arm.sensors) if arm else {}
    for name, table in tables.items():
        faults.attempt(_of_signal, name, arm)
        sensor = faults.attempt(_sensor, name, table)
        if sensor is not None:
            found[name] = sensor
    return found


def _of_signal(name: str, arm: Arm | None) -> None:
    """Refuse a sensor of no signal."""
    signal(name, "arm.sensors", arm.beam if arm else None)


def _changed(part: Part, table: Table) -> Part:
    """Return a part of the arm with those of its values that the table gives."""
    return replace(part, **table.model_dump(exclude_unset=True))


def _unchanged(table: ArmTable) -> Arm:
    """Return the arm of the catalogue, or that of a beam or of modal data alone."""
    if sum(getattr(table, kind) is not None for kind in ("catalogue", *DESCRIBED)) != 1:
        raise InputError(
            "give either catalogue or beam, or else modal_data or wings",
            where="arm",
            remedy=f"catalogue arms: {', '.join(catalogue.names())}",
        )
    if table.beam is not None:
        return Arm(beam_of_table(table.beam))
    hub = Hub() if table.hub is None else _changed(Hub(), table.hub)
    if table.modal_data is not None:
        return Arm(data_of_table(table.modal_data), hub)
    if table.wings is not None:
        return arm_of_wings(table.wings, hub)
    return catalogue.get(check_choice(str(table.catalogue), catalogue.names(), "arm.catalogue"))


def _damping(content: Mapping[str, Any]) -> DampingLaw:
    """Return the damping law of ``[arm.damping]``, whose kind says which keys it takes."""
    if "kind" not in content:
        raise InputError(
            "missing", where="arm.damping.kind", remedy=f"add it, one of {', '.join(_LAWS)}"
        )
    kind = check_choice(content["kind"], _LAWS, "arm.damping.kind")
    table, law = _LAWS[kind]
    keys = validate(content, table, ("arm", "damping")).model_dump(exclude={"kind"})
    if not any(keys.values()):
        raise InputError(
            "damps nothing",
            where="arm.damping",
            remedy=f"give {' or '.join(keys)}, or leave the table out",
        )
    return law(**keys)
