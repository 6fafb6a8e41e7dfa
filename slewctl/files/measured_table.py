"""``[measured]``: a frequency response on which a design's controller is judged as well."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from slewctl.arm import Arm
from slewctl.check import check_limits
from slewctl.check.measured import MEASURED, READ
from slewctl.errors import Faults, InputError, SlewctlError, check_choice
from slewctl.files.table import NonNegative, Positive, Table, told
from slewctl.measured.read_response import read_response
from slewctl.measured.response import Response
from slewctl.measured.rig_model import integrations
from slewctl.plant import Objective
from slewctl.textfile import read_bytes

# More is no response that anybody measured.
_MOST_BYTES = 50_000_000


class MeasuredTable(Table):
    """``[measured]``."""

    file: Annotated[
        str, told("text", "the response, by its path from the design file", "response.csv")
    ]
    columns: Annotated[
        dict[str, str] | None,
        told("table", "the file's own names of columns", {"gain_db": "Mag (dB)"}),
    ] = None
    actuator: Annotated[
        str | None, told("text", "what was driven; by default what is commanded", "torque")
    ] = None
    sensor: Annotated[
        str | None, told("text", "what was measured; by default what the controller reads", "theta")
    ] = None
    sample_time: Annotated[
        NonNegative,
        told("s", "the clock that held the input and sampled the output; 0 without one", 0.005),
    ] = 0.0
    factor: Annotated[
        Positive, told("1", "makes the file's values SI: 0.0174533 for degrees", 0.0174533)
    ] = 1.0
    averages: Annotated[
        Positive | None, told("1", "independent averages that the coherence is of", 13.3)
    ] = None
    unstable_poles: Annotated[
        Annotated[int, Field(ge=0)], told("1", "unstable poles of what was measured", 0)
    ] = 0
    poles_at_zero: Annotated[
        Annotated[int, Field(ge=0)] | None,
        told("1", "its poles at zero; by default those of the arm", 1),
    ] = None
    requirements: Annotated[
        dict[str, Any] | None,
        told(
            "table",
            "limits on it, of stability and margins; by default those of [requirements]",
            {"modulus_margin": 0.5},
        ),
    ] = None


@dataclass(frozen=True)
class MeasuredPlant:
    """A measured response with what is assumed of it and required on it.

    Attributes
    ----------
    response : Response
    unstable_poles, poles_at_zero : int
    requirements : mapping of str to float
        That a response can tell.
    left_out : tuple of str
        Requirements of the design that it cannot.
    digest : str
        Of the file.
    """

    response: Response
    unstable_poles: int
    poles_at_zero: int
    requirements: Mapping[str, float | bool]
    left_out: tuple[str, ...]
    digest: str


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
