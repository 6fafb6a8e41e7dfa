"""The file that ``[measured]`` names, read when a design has one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

from slewctl.arm import Arm
from slewctl.check import check_limits
from slewctl.check.measured import MEASURED, READ
from slewctl.errors import Faults, InputError, SlewctlError, check_choice
from slewctl.files.measured_table import MeasuredPlant
from slewctl.measured.read_response import read_response
from slewctl.measured.response import Response
from slewctl.measured.rig_model import integrations
from slewctl.plant import Objective
from slewctl.textfile import read_bytes

# More is no response that anybody measured.
_MOST_BYTES = 50_000_000


def read_measured(
    table: Mapping[str, Any],
    path: Path,
    arm: Arm,
    objective: Objective,
    requirements: Mapping[str, float | bool],
    variations: Iterable[str],
) -> MeasuredPlant | None:
    """Return the measured response of a design file; None where its file is missing.

    Parameters
    ----------
    table : mapping
        ``[measured]``.
    path : Path
        Of the design file.
    arm : Arm
        It has as many poles at zero as what was measured, unless told otherwise.
    objective : Objective
        It names what the controller reads and commands.
    requirements : mapping of str to float
        Of the design.
    variations : iterable of str

    Raises
    ------
    InputError
        For a file that cannot be read, a controller that reads more than was measured, and
        each requirement that no response tells.
    """
    faults = Faults()
    own = table.get("requirements")
    for name, limit in (own or {}).items():
        faults.attempt(_check_own, name, limit)
    if MEASURED in variations:
        faults.add([InputError(f"a variation is called {MEASURED!r} too", where="file",
                               remedy="give it another name")])  # fmt: skip
    try:
        plant = faults.attempt(_plant, table, path, arm, objective) if "file" in table else None
        faults.tell()
    except InputError as error:
        raise error.within("measured", ".") from error
    if plant is None:
        return None
    asked = requirements if own is None else own
    return MeasuredPlant(
        *plant[:3],
        {name: limit for name, limit in asked.items() if name in READ},
        tuple(name for name in asked if name not in READ),
        plant[3],
    )


def _check_own(name: str, limit: float | bool) -> None:
    check_limits({name: limit})
    check_choice(name, READ, f"requirements.{name}")


def _plant(
    table: Mapping[str, Any], path: Path, arm: Arm, objective: Objective
) -> tuple[Response, int, int, str]:
    sensors = objective.sensors
    if len(sensors) != 1:
        raise InputError(
            f"the controller reads {', '.join(sensors)}, a response is of one signal",
            where="file",
            remedy="leave [measured] out, or give a controller of one signal",
        )
    wanted = {"actuator": objective.actuator, "sensor": sensors[0]}
    for key, own in wanted.items():
        if table.get(key) not in (None, own):
            raise InputError(f"the controller's {key} is {own}", where=key, remedy=f"measure {own}")
    file = path.parent / table["file"]
    given = ("columns", "averages", "factor", "sample_time")
    keys: dict[str, Any] = {name: table[name] for name in given if table.get(name) is not None}
    try:
        response = read_response(file, **keys, actuator=objective.actuator, sensor=sensors[0])
        digest = sha256(read_bytes(file, most=_MOST_BYTES)).hexdigest()
    except (OSError, SlewctlError) as error:
        told_as = error if isinstance(error, SlewctlError) else InputError(str(error))
        raise told_as.within("file") from error
    at_zero = table.get("poles_at_zero")
    if at_zero is None:
        at_zero = integrations(arm, response.actuator, response.sensor)
    return response, table.get("unstable_poles", 0), at_zero, digest
