"""The command ``identify``."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from slewctl.arm import Arm
from slewctl.cli.options import options_named
from slewctl.cli.terminal import OUT, progress
from slewctl.design import Controller, given
from slewctl.errors import InputError, shown
from slewctl.files import computing_arm, find_arm
from slewctl.loop import Margins, UnstableLoopError
from slewctl.loop.margin_functions import margins
from slewctl.loop.on_measured import OnMeasured, on_measured
from slewctl.measured.fit import fit
from slewctl.measured.log import Log
from slewctl.measured.read_log import read_log
from slewctl.measured.read_response import read_response
from slewctl.measured.response import Response
from slewctl.measured.rig_fit_result import RigFit
from slewctl.measured.rig_model import Modes, equations, integrations
from slewctl.measured.rig_parameters import Rig
from slewctl.measured.units import COUNTS, named
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant.signals import ACTUATORS
from slewctl.plant.statespace import Actuator

_MAPPED, _PAIR = re.compile(r"columns=\{([^}]*)\}"), re.compile(r"'(\w+)': '?([^',]*)'?")
# Where something is wrong that is not with the arm.
_NOT_THE_ARM = ("fit.", "log", "response")
_OPTIONS = {
    "fit.free": "--free",
    "columns": "--column",
    "sample_time": "--sample-time",
    "counts_per_turn": "--counts",
}


def identify(
    file: Path,
    arm: str,
    free: str,
    out: Path,
    *,
    columns: Sequence[str],
    between: tuple[str | None, str | None] | None,
    sample_time: float | None,
    counts: float | None,
    controller: Path | None,
) -> None:
    """Fit an arm to a log, or to a response between two signals, and write the report."""
    from slewctl.report import write_identification  # matplotlib is only needed here

    start = find_arm(arm)
    names = free_names(free)
    with options_named(_OPTIONS), _columns_as_options(), progress(3) as step:
        step("reading")
        measured: Log | Response
        if between is not None:
            signals = _signals(*between, start, counts)
            measured = read_response(
                file, _named(columns), sample_time=sample_time or 0.0, **signals
            )
        else:
            measured = read_named_log(file, columns, sample_time, counts)
        law = _law(controller) if controller else None
        step("fitting")
        found = fitted_arm(start, arm, measured, names)
        met = _met(found, law) if law else None
        step("drawing")
        page = write_identification(found, out, met)
    for result in (measured, found, *([met[0].margins] if met else [])):
        for line in str(result).splitlines():
            OUT.print(line)
    OUT.print(f"fitted arm: {out / 'fitted.toml'}")
    OUT.print(f"report: {page}")


def free_names(free: str) -> list[str]:
    """Return the properties that ``--free`` names."""
    return [name.strip() for name in free.split(",") if name.strip()]


def read_named_log(
    file: Path, columns: Sequence[str], sample_time: float | None, counts: float | None
) -> Log:
    """Return a log whose columns the command line names; what is wrong names its option."""
    with options_named(_OPTIONS), _columns_as_options():
        return read_log(file, _named(columns), sample_time=sample_time, counts_per_turn=counts)


def _signals(
    actuator: str | None, sensor: str | None, arm: Arm, counts: float | None
) -> dict[str, Any]:
    """Return between which signals a response is, and its factor to their own units."""
    if actuator is None and arm.motor is not None:
        raise InputError(
            "the arm has a motor, and nothing says whether the response is from its torque or "
            "from its voltage",
            where="--actuator",
            remedy="give --actuator torque or --actuator voltage",
        )
    told = {}
    for name, where, kind in (
        (actuator or "torque", "--actuator", "torque or voltage"),
        (sensor or "theta", "--sensor", "a sensor, such as theta_deg or tip"),
    ):
        found = named(name, counts)
        if found is None or (found.signal in ACTUATORS) != (where == "--actuator"):
            raise InputError(f"{shown(name)} is none", where=where, remedy=f"give {kind}")
        told[where] = found
    if counts is not None and told["--sensor"].unit != COUNTS:
        raise InputError(
            "the response is in no counts", where="--counts", remedy="give --sensor theta_counts"
        )
    source, target = told["--actuator"], told["--sensor"]
    factor = target.factor / source.factor
    return {"actuator": source.signal, "sensor": target.signal, "factor": factor}


def _named(columns: Sequence[str]) -> dict[str, str]:
    return dict(_pair(column) for column in columns)


@contextmanager
def _columns_as_options() -> Iterator[None]:
    """Let a remedy that maps a column name the option that does."""
    try:
        yield
    except InputError as error:
        remedy = _MAPPED.sub(
            lambda told: " ".join(f"--column {name}={of}" for name, of in _PAIR.findall(told[1])),
            error.remedy,
        )
        if remedy == error.remedy:
            raise
        remedy = remedy.replace("sample_time", "--sample-time")
        raise InputError(error.what, where=error.where, remedy=remedy) from error


def fitted_arm(start: Arm, arm: str, measured: Log | Response, names: Sequence[str]) -> RigFit:
    """Return the fit; what is wrong with the arm names its file, what is asked for does not."""
    with computing_arm(arm):
        try:
            return fit(start, measured, names)
        except InputError as error:
            if not error.where.startswith(_NOT_THE_ARM):
                raise
            wrong = error
    raise wrong


def _pair(told: str) -> tuple[str, str]:
    name, equals, column = told.partition("=")
    if not equals or not name or not column:
        raise InputError(
            f"{told!r} maps nothing", where="columns", remedy="write it as theta_deg=enc"
        )
    return name, column


def _law(file: Path) -> Controller:
    """Return a controller of a file; what is wrong names its option."""
    try:
        return given(file=file)
    except InputError as error:
        raise error.at(f"--controller {file}") from error


def _met(found: RigFit, law: Controller) -> tuple[OnMeasured, Margins | str]:
    """Return what a controller meets on the measured response, and margins on the fitted arm."""
    response = found.response
    actuator: Actuator = "voltage" if response.actuator == "voltage" else "torque"
    plant = equations(found.arm, actuator, response.sensor, Modes(found.modes))
    at_zero = integrations(found.arm, actuator, response.sensor)
    rig = Rig(found.arm, found.gain, found.delay)
    met = on_measured(response, law, rig, poles_at_zero=at_zero)
    plant = LinearSystem(
        plant.A, found.gain * plant.B, plant.C, found.gain * plant.D,
        inputs=[actuator], outputs=[response.sensor],
    )  # fmt: skip
    try:
        return met, margins(plant, law, delay=found.delay)
    except UnstableLoopError as error:
        return met, error.what
