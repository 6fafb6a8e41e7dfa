"""Design files: TOML to frozen values, with file, line, key and remedy in every refusal.

A design file describes; it runs no code.  All that is wrong with it is told at once.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from slewctl import files
from slewctl._types import FilePath
from slewctl.arm import Arm, Hub, Joint, ModalData, catalogue, vary
from slewctl.check import REQUIREMENTS, check_limits
from slewctl.compare import QUANTITIES, Case
from slewctl.compare.case import check_basis
from slewctl.design.methods import GIVEN
from slewctl.embedded.options import CodeOptions
from slewctl.errors import InputError, check_path, check_paths, shown
from slewctl.files.arm_table import DESCRIBED, arm_of_table
from slewctl.files.encoders import with_encoder_noise
from slewctl.files.export_table import read_export
from slewctl.files.faults import Faults
from slewctl.files.find import find_designs, name_designs, refuse_study
from slewctl.files.given_law import (
    beside,
    digest_beside,
    missing_of,
    read_given,
    refuse_unweighted,
)
from slewctl.files.measured_table import MeasuredPlant
from slewctl.files.refusals import validate_each
from slewctl.files.schema import DESIGN_SCHEMA, MOST_SIGNALS, ArmTable, ControllerTable, DesignTable
from slewctl.files.slew_table import slew_of_table
from slewctl.files.source import Source, read_source, source_of_text
from slewctl.files.uncertainty import Uncertainty, read_uncertainty, refuse_unweighed
from slewctl.files.variations import Variation, read_variations
from slewctl.plant import Objective
from slewctl.plant.signals import ACTUATORS, check_signals

# Limits, or noise, that are right, beside which the others are looked at.
_NO_SLEW = InputError("missing", where="slew", remedy="add it, with angle_deg and duration_s")
_NO_TURN = InputError(
    "missing: words of fixed point hold what the slew comes to, and no more",
    where="slew",
    remedy="add it, with angle_deg of the largest turn and its duration_s",
)
_HALF = {"theta": 1.0, "torque": 1.0}
_OF_CONTROL = ("limits", "noise")
# The keys of [controller] that are no options of a method.
_OBJECTIVE = frozenset(ControllerTable.model_fields)


@dataclass(frozen=True)
class DesignFile:
    """A design file read and checked.

    Attributes
    ----------
    path : Path
    case : Case
        With the slew of `Case` where the file describes none.
    requirements : mapping of str to float
    variations : tuple of Variation
        The arms on which the same controller is judged as well.
    source : Source
        The file's text, and the lines of its keys.
    beside : str
        A digest of the files that hold a given controller or a measured response; empty where
        there are none.
    uncertainty : Uncertainty or None
        The box in which the worst arm is sought.
    measured : MeasuredPlant or None
        A response on which the controller is judged as well.
    export : CodeOptions
        How the controller runs, as code.
    """

    path: Path
    case: Case
    requirements: Mapping[str, float | bool]
    variations: tuple[Variation, ...]
    source: Source
    beside: str = ""
    uncertainty: Uncertainty | None = None
    measured: MeasuredPlant | None = None
    export: CodeOptions = field(default_factory=CodeOptions)

    @property
    def text(self) -> str:
        """All that the design is made of: the file's text, and a digest of what is beside it."""
        return f"{self.source.text}\0{self.beside}" if self.beside else self.source.text


def read_design(path: FilePath, name: str = "", *, slew: bool = False) -> DesignFile:
    """Return the design that a TOML file describes.

    Parameters
    ----------
    path : str or PathLike
    name : str, optional
        The design's short name; the file's stem by default.
    slew : bool
        Whether a slew is needed even if no requirement is on one.

    Returns
    -------
    DesignFile

    Raises
    ------
    InputError
        If the file cannot be read, is not TOML, or has an unknown key or an impossible
        value; the message names file, line, key and remedy of each.

    Examples
    --------
    >>> from slewctl.files import example_design, read_design
    >>> path = example_design()
    >>> read_design(path).case.basis
    'clamped-free'
    """
    path = check_path(path, "path")
    return _read(read_source(path), name or path.stem, slew)


def design_of_text(text: str, path: FilePath, name: str = "") -> DesignFile:
    """Return the design that the text of a file describes, as if it stood at a path.

    Parameters
    ----------
    text : str
    path : str or PathLike
        What refusals name, and beside which other files are looked for; itself it is not read.
    name : str, optional
        As for `read_design`.

    Returns
    -------
    DesignFile

    Raises
    ------
    InputError
        As `read_design`.

    Examples
    --------
    >>> from slewctl.files import design_of_text, example_design
    >>> path = example_design()
    >>> text = path.read_text().replace("n = 1", "n = 2")
    >>> design_of_text(text, path).case.n
    2
    """
    path = check_path(path, "path")
    return _read(source_of_text(text, path), name or path.stem)


def _read(source: Source, name: str, needs_slew: bool = False) -> DesignFile:
    refuse_study(source)
    with source.computing():
        return _design(source, name, needs_slew)


def read_designs(paths: FilePath | Iterable[FilePath]) -> tuple[DesignFile, ...]:
    """Return the designs in files and folders, each with a name of its own.

    Parameters
    ----------
    paths : path, or iterable of them
        Files and folders.

    Returns
    -------
    tuple of DesignFile

    Raises
    ------
    InputError
        As `find_designs` and `read_design`.

    Examples
    --------
    >>> from slewctl.files import example_design, read_designs
    >>> path = example_design()
    >>> [design.case.name for design in read_designs([path])]
    ['arm']
    """
    paths = check_paths(paths, "paths")
    names = name_designs(find_designs(paths))
    return tuple(read_design(path, name) for path, name in names.items())


def _design(source: Source, name: str, needs_slew: bool) -> DesignFile:
    _check_schema(source.content)
    faults = Faults()
    tables = validate_each(with_encoder_noise(source.content, faults), DesignTable, faults)
    method = tables.get("controller", {}).get("method")
    missing_of(method, source.content, faults)
    requirements = tables.get("requirements", {})
    for required, limit in requirements.items():
        faults.attempt(check_limits, {required: limit})
    arm = _arm(source.content, tables, faults)
    keys = _parts_of_case(source, tables, arm, faults)
    tried = tables.get("variations", {})
    common = {} if faults else requirements
    varied = arm or _stand_in(source.content)
    variations = faults.attempt(read_variations, tried, varied, common) or ()
    asked = [requirements, *(variation.requirements for variation in variations)]
    uncertainty = None
    if tables.get("uncertainty"):
        uncertainty = faults.attempt(read_uncertainty, tables["uncertainty"], varied, tried)
    measured = None
    # Where the controller is wrong, the rest of a table is looked at all the same.
    met = keys["objective"] or Objective(_HALF, _HALF)
    if tables.get("measured"):
        measured = faults.attempt(
            files.read_measured, tables["measured"], source.path, varied, met, common, tried
        )
    export = CodeOptions()
    if tables.get("export"):
        export = faults.attempt(read_export, tables["export"], met) or export
    sought = () if uncertainty is None else (QUANTITIES[uncertainty.quantity].requirement,)
    needs_slew = needs_slew or any(_asks_for_a_slew(limits) for limits in (*asked, sought))
    if needs_slew and "slew" not in source.content:
        faults.add([_NO_SLEW])
    elif export.arithmetic == "fixed" and "slew" not in source.content:
        faults.add([_NO_TURN])
    faults.tell()
    if not keys["objective"].weighted:
        refuse_unweighted(name for limits in asked for name in limits)
    if uncertainty is not None:
        refuse_unweighed(uncertainty, keys["objective"])
    case = Case(name=name, title=tables["title"], source=str(source.path), **keys)
    beside = digest_beside(source.path, case.options) if method == GIVEN else ""
    beside += measured.digest if measured else ""
    return DesignFile(
        source.path, case, requirements, variations, source, beside, uncertainty, measured, export
    )


def _arm(content: Mapping[str, Any], tables: Mapping[str, Any], faults: Faults) -> Arm | None:
    """Return the arm, or None after adding what is wrong with it."""
    if "arm" not in tables:
        return None
    keys = tables["arm"]
    if {"catalogue", *DESCRIBED} & (content["arm"].keys() - keys.keys()):
        keys = {**keys, **dict.fromkeys(DESCRIBED), "catalogue": catalogue.names()[0]}
    return faults.attempt(arm_of_table, ArmTable.model_construct(**keys))


def _asks_for_a_slew(requirements: Iterable[str]) -> bool:
    return any(REQUIREMENTS[name].kind == "slew" for name in requirements if name in REQUIREMENTS)


def _check_schema(content: Mapping[str, Any]) -> None:
    """Refuse a file written for another slewctl, whose keys may mean something else."""
    written_for = content.get("schema", DESIGN_SCHEMA)
    if written_for != DESIGN_SCHEMA:
        raise InputError(
            f"{shown(written_for)} is not read by this slewctl",
            where="schema",
            remedy=f"it reads {DESIGN_SCHEMA!r}",
        )


def _stand_in(content: Mapping[str, Any]) -> Arm:
    """Return an arm that has everything, to look at the rest of a file if its own is wrong."""
    if isinstance(content.get("arm"), Mapping) and {"modal_data", "wings"} & content["arm"].keys():
        data = ModalData(100.0, [1.0], [1.0])
        return Arm(data, Hub(1.0), damping_ratio=0.01)
    arm = catalogue.get(catalogue.names()[0])
    arm = replace(arm, joint=Joint(1.0, 1.0, rotor_inertia=1.0), damping_ratio=0.01)
    return vary(arm, payload_mass=1.0, hub_inertia=1.0)


def _parts_of_case(
    source: Source, tables: Mapping[str, Any], arm: Arm | None, faults: Faults
) -> dict[str, Any]:
    """Return what a case is made of; each part is tried alone, so that none hides another."""
    content = source.content
    keys: dict[str, Any] = {"arm": arm or _stand_in(content), "objective": Objective(_HALF, _HALF)}
    groups: list[dict[str, Any]] = []
    controller = tables.get("controller", {})
    is_given = controller.get("method") == GIVEN
    weighted = not is_given or any(key in content["controller"] for key in _OF_CONTROL)
    stated = None
    if controller and weighted:
        limits, noise = (_named(content["controller"], controller, key) for key in _OF_CONTROL)
        stated = faults.attempt(_objective, limits, noise, arm)
        keys["objective"] = stated or keys["objective"]
    if "method" in controller:
        method = controller["method"]
        options = {key: controller[key] for key in controller if key not in _OBJECTIVE}
        options = beside(source.path, options) if is_given else options
        groups += [{"method": method, "options": {key: options[key]}} for key in options]
        groups.append({"method": method, "options": options})
    model, compare = tables.get("model", {}), tables.get("compare", {})
    groups += [{"basis": model["basis"]}] if "basis" in model else []
    groups += [{"bases": tuple(compare["bases"])}] if "bases" in compare else []
    if is_given and "modes" in tables["truth"]:
        groups.append({"truth_modes": tables["truth"]["modes"], "orders": ()})
    elif "n" in model and "orders" in compare and "modes" in tables["truth"]:
        orders, modes = tuple(compare["orders"]), tables["truth"]["modes"]
        groups.append({"n": model["n"], "orders": orders, "truth_modes": modes})
    alone = {"name": "", **keys}
    for group in groups:
        faults.attempt(Case, **alone, **group)
        keys |= group
    if arm is not None and not faults and {"basis", "n"} <= keys.keys():
        faults.attempt(check_basis, arm, keys["basis"], keys["n"])
    if is_given:
        keys["objective"] = faults.attempt(read_given, options, stated, arm, weighted=weighted)
    if "slew" in tables:
        keys["slew"] = faults.attempt(slew_of_table, tables["slew"])
    return keys


def _named(content: Mapping[str, Any], right: Mapping[str, Any], key: str) -> Mapping[str, float]:
    """Return limits or noise; where a value is wrong, their names are looked at all the same."""
    if right.get(key) is not None:
        return right[key]
    given = content.get(key)
    if not isinstance(given, dict) or not 0 < len(given) <= MOST_SIGNALS:
        return _HALF
    return dict.fromkeys(given, 1.0)


def _alone(
    table: str, key: str, limits: Mapping[str, float], noise: Mapping[str, float]
) -> Objective:
    """Return an objective in which only one key can be wrong, at whose place it is refused."""
    try:
        return Objective(limits, noise)
    except InputError as error:
        raise (error.at(f"{table}.{key}") if error.where == table else error) from error


def _objective(
    limits: Mapping[str, float], noise: Mapping[str, float], arm: Arm | None
) -> Objective:
    """Return what the controller is asked to do; each name is tried alone first."""
    faults = Faults()
    for key, value in limits.items():
        if key not in ACTUATORS:
            faults.attempt(_alone, "limits", key, {**_HALF, key: value}, _HALF)
    for key, value in noise.items():
        faults.attempt(_alone, "noise", key, _HALF, {**_HALF, key: value})
    if not faults:
        faults.attempt(Objective, limits, _HALF)
        faults.attempt(Objective, _HALF, noise)
    try:
        faults.tell()
        objective = Objective(limits, noise)
        for where, names in (("limits", objective.performance), ("noise", objective.sensors)):
            check_signals(names, where, arm.beam if arm else None)
    except InputError as error:
        raise error.within("controller", ".") from error
    if objective.actuator == "voltage" and arm is not None and arm.motor is None:
        raise InputError(
            "the arm has no motor",
            where="controller.limits.voltage",
            remedy="add [arm.motor], or limit the torque instead",
        )
    return objective
