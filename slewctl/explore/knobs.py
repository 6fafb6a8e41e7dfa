"""What of a design can be turned: its keys, and the values to choose from."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from slewctl.arm import Arm, ModalData
from slewctl.basis import bases_of
from slewctl.compare import Case
from slewctl.design import options
from slewctl.files import DesignFile
from slewctl.model import Truth, beam_inertia

Value = float | int | str

STIFFNESS = "arm.stiffness_factor"
"""Times EI all along the beam, or times the squared frequencies of modal data."""
DAMPING = "arm.damping_factor"
"""Times each of several modal damping ratios."""
SAMPLE_TIME, DELAY = "controller.sample_time", "controller.delay"

# What sets the speed of a design, by the methods' own names.
_SPEEDS = ("bandwidth_hz", "crossover_hz")
_GAINS = ("kp", "ki", "kd")
_UNITS = {"torque": "N·m", "voltage": "V"}
# A step is 12 %: a person sees a change, and a decade to either side is 41 places of a slider.
_DECADE = 20
# Of what may be none: parts of a scale that the arm itself gives.
_PARTS = (0.0, 0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0)
# Of the period of the first flexible mode: clocks and dead times that are felt.
_CLOCKS = (0.0, 2e-3, 3e-3, 5e-3, 7e-3, 0.01, 0.015, 0.02, 0.03, 0.04, 0.05, 0.07, 0.1, 0.15)
# Nobody designs on more, and matrix inequalities would take minutes.
_MOST_FUNCTIONS = 8
# Of a metal beam with its joints, where a file gives none.
_USUAL_RATIO = 0.01
# A quarter of the stiffness, and four times: half and twice the frequencies.
_STIFFER = 12


@dataclass(frozen=True)
class Knob:
    """A key of a design file with the values that it may be given.

    Attributes
    ----------
    key : str
        As the file has it, such as ``arm.hub.inertia``; or one of `STIFFNESS` and `DAMPING`,
        which multiply what the file gives.
    label : str
    unit : str
    values : tuple
        In order, the file's own among them.
    value : float, int or str
        The file's own.
    """

    key: str
    label: str
    unit: str
    values: tuple[Value, ...]
    value: Value

    def text(self, value: Value) -> str:
        """Return a value as a person reads it."""
        if isinstance(value, str):
            return value
        if not value and self.key == SAMPLE_TIME:
            return "continuous"
        factor = 1e3 if self.unit == "ms" else 1.0
        return f"{factor * value:.4g} {self.unit}".rstrip()


def knobs_of(design: DesignFile, truth: Truth) -> tuple[Knob, ...]:
    """Return what of a design can be turned.

    Parameters
    ----------
    design : DesignFile
    truth : Truth
        Of its arm, which gives the scale of what the file leaves at nothing.

    Returns
    -------
    tuple of Knob
        Of the arm, of the model, of the controller.

    Examples
    --------
    >>> from slewctl.compare import Judge
    >>> from slewctl.explore import knobs_of
    >>> from slewctl.files import example_design, read_design
    >>> design = read_design(example_design())
    >>> for knob in knobs_of(design, Judge(design.case).truth):
    ...     print(knob.label, knob.text(knob.value))
    hub inertia 0.2 kg·m²
    payload 0 kg
    stiffness 1 times
    damping ratio 0.01
    dead time of the drive 0 ms
    basis clamped-free
    functions n 1
    largest torque 1 N·m
    sample time continuous
    computing delay 0 ms
    """
    period = 2 * np.pi / float(truth.omega[0])
    case = design.case
    return (*_of_arm(case.arm, period), *_of_model(case), *_of_controller(case, period))


def _of_arm(arm: Arm, period: float) -> Iterator[Knob]:
    if not isinstance(arm.beam, ModalData):
        inertia, length = beam_inertia(arm), arm.beam.length
        yield _amount("arm.hub.inertia", "hub inertia", "kg·m²", arm.hub.inertia, inertia)
        yield _amount("arm.payload.mass", "payload", "kg", arm.payload.mass, inertia / length**2)
    yield Knob(STIFFNESS, "stiffness", "times", _around(1.0, _STIFFER), 1.0)
    ratio = arm.damping_ratio
    if isinstance(ratio, float | int):
        own = float(ratio)
        yield _amount("arm.damping_ratio", "damping ratio", "", own, _USUAL_RATIO, below=1.0)
    elif any(ratio):
        most = 1 / max(ratio)
        factors = tuple(v for v in _around(1.0) if v < most)
        yield Knob(DAMPING, "damping", "times", factors, 1.0)
    own = arm.actuator.delay if arm.actuator else 0.0
    clocks = _with(own, (part * period for part in _CLOCKS))
    yield Knob("arm.actuator.delay", "dead time of the drive", "ms", clocks, own)


def _of_model(case: Case) -> Iterator[Knob]:
    if case.is_given:
        return
    beam = case.arm.beam
    most = min(_MOST_FUNCTIONS, case.truth_modes)
    if isinstance(beam, ModalData):
        most = min(most, beam.modes)
    yield Knob("model.basis", "basis", "", bases_of(case.arm), case.basis)
    counts = sorted({*range(1, most + 1), case.n})
    yield Knob("model.n", "functions n", "", tuple(counts), case.n)


def _of_controller(case: Case, period: float) -> Iterator[Knob]:
    given, actuator = case.options, case.objective.actuator
    known = options(case.method)
    pid = given.get("pid")
    if isinstance(pid, dict):
        for name in _GAINS:
            if pid.get(name):
                yield _times(f"controller.pid.{name}", name, "", pid[name])
    for name in _SPEEDS:
        if given.get(name):
            yield _times(f"controller.{name}", name.removesuffix("_hz"), "Hz", given[name])
    if not case.is_given and not any(given.get(name) for name in _SPEEDS):
        unit = _UNITS[actuator]
        limit = case.objective.limits[actuator]
        yield _times(f"controller.limits.{actuator}", f"largest {actuator}", unit, limit)
    if not case.is_given and "sample_time" in known:
        for key, label, most in (
            (SAMPLE_TIME, "sample time", 1.0),
            (DELAY, "computing delay", 0.5),
        ):
            own = float(given.get(key.partition(".")[2]) or 0.0)
            clocks = _with(own, (most * part * period for part in _CLOCKS))
            yield Knob(key, label, "ms", clocks, own)


def _times(key: str, label: str, unit: str, own: float) -> Knob:
    return Knob(key, label, unit, _around(float(own)), float(own))


def _amount(
    key: str, label: str, unit: str, own: float, scale: float, below: float = math.inf
) -> Knob:
    """Return the knob of what may be none, about its own value or on a scale given for none."""
    values = (0.0, *_around(own)) if own else (part * scale for part in _PARTS)
    return Knob(key, label, unit, _with(own, (v for v in values if v < below)), own)


def _around(own: float, steps: int = _DECADE) -> tuple[float, ...]:
    """Return values to either side of one, in equal ratios; of nothing there are none."""
    return _with(own, (own * 10 ** (k / _DECADE) for k in range(-steps, steps + 1)))


def _with(own: float, values: Iterable[float]) -> tuple[float, ...]:
    """Return values as a person would write them, in order, one's own as it is among them."""
    short = {float(f"{value:.3g}") for value in values}
    near = {value for value in short if abs(value - own) <= 1e-2 * abs(own)}
    return tuple(sorted((short - near) | {own}))
