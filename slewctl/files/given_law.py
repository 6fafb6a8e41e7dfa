"""``[controller]`` with ``method = "given"``: a law in the file or beside it, and its signals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

from slewctl import design
from slewctl.arm import Arm
from slewctl.check import REQUIREMENTS
from slewctl.compare.quantities import UNWEIGHTED, WEIGHTED
from slewctl.design import Controller, fitted
from slewctl.design.methods import GIVEN
from slewctl.design.reference import REFERENCE
from slewctl.errors import InputError
from slewctl.files.faults import Faults, missing
from slewctl.plant import VOLTAGE, Objective, signals_alone
from slewctl.plant.signals import TORQUE, check_signals
from slewctl.textfile import read_bytes

# Tables and keys that say what a controller is designed on and for.
_OF_A_DESIGN = (("model", None), ("controller", "limits"), ("controller", "noise"))


def beside(path: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of a design file with the path of its law, which is from the file."""
    file = options.get("file")
    return {**options, "file": str(path.parent / file)} if isinstance(file, str) else {**options}


def digest_beside(path: Path, options: Mapping[str, Any]) -> str:
    """Return a digest of the file that holds the law; empty where there is none."""
    file = beside(path, options).get("file")
    if file is None:
        return ""
    try:
        return sha256(read_bytes(Path(file), most=50_000_000)).hexdigest()
    except (OSError, InputError):  # told where the law is read
        return ""


def missing_of(method: object, content: Mapping[str, Any], faults: Faults) -> None:
    """Add what a design needs and a file has not; a given law needs none of it."""
    controller = content.get("controller")
    for table, key in _OF_A_DESIGN:
        inside = controller if key else content
        wanted = key or table
        if not isinstance(inside, dict) or wanted in inside:
            continue
        # Limits and noise weigh together, or not at all.
        half = key and {"limits", "noise"} & inside.keys()
        if method != GIVEN or half:
            faults.add([missing(f"{table}.{key}" if key else table)])


def read_given(
    options: Mapping[str, Any], objective: Objective | None, arm: Arm | None, *, weighted: bool
) -> Objective:
    """Return what a given law is judged by: the file's objective, or its signals alone.

    Parameters
    ----------
    options : mapping of str to object
    objective, arm : Objective or None, Arm or None
        None where there is none, or it is wrong.
    weighted : bool
        Whether the file has an objective, right or wrong.

    Raises
    ------
    InputError
        For all that `slewctl.given` refuses, and each signal that the arm or the objective has
        not.
    """
    faults = Faults()
    try:
        if not isinstance(options.get("file", ""), str):
            raise InputError("it is no path", where="file", remedy='give one, as in "gains.json"')
        sure = weighted or arm is None or arm.motor is None
        default = objective.actuator if objective else TORQUE if sure else None
        law = faults.attempt(design.read_options, options, default)
        # What the file of a law that cannot be read holds is not known; what is beside it is.
        for name in _names(law.sensors if law else options.get("inputs")):
            faults.attempt(check_signals, [name], "inputs", arm.beam if arm else None)
        commanded = law.linear.output_labels[0] if law else options.get("output")
        if arm is not None:
            faults.attempt(_check_output, commanded, arm)
        return _judged_by(faults.settled(law), objective)
    except InputError as error:
        raise error.within("controller", ".") from error


def _names(given: object) -> Iterable[str]:
    if isinstance(given, str):
        return [given]
    names = given if isinstance(given, Iterable) else ()
    return [name for name in names if isinstance(name, str) and name != REFERENCE]


def _check_output(commanded: object, arm: Arm) -> None:
    if commanded == VOLTAGE and arm.motor is None:
        raise InputError(
            "the arm has no motor", where="output", remedy="add [arm.motor], or command the torque"
        )


def _judged_by(controller: Controller, objective: Objective | None) -> Objective:
    if objective is None:
        return signals_alone(controller.sensors, controller.linear.output_labels[0])
    fitted(controller, objective.sensors, objective.actuator)
    return objective


def refuse_unweighted(requirements: Iterable[str]) -> None:
    """Refuse requirements on what limits and noise weigh, in a file without them."""
    for name in requirements:
        if REQUIREMENTS[name].kind in WEIGHTED:
            raise InputError(
                UNWEIGHTED,
                where=f"requirements.{name}",
                remedy="add controller.limits and controller.noise",
            )
