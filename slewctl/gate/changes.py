"""Small changes of a design, each of which a person would try first."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from slewctl.arm import ModalData
from slewctl.compare import Case
from slewctl.plant import ACTUATORS, Objective

# A step that is seen, and is no other design.
_SLOWER, _FASTER = 0.7, 1.4
# For a design that fails, whatever small change is made.
_FAR_SLOWER = 0.3
_SPEEDS = ("bandwidth_hz", "crossover_hz")
_GAINS = ("kp", "ki", "kd")
_BEST_BASIS = "arm-matched"


@dataclass(frozen=True)
class Change:
    """A design with one thing changed.

    Attributes
    ----------
    words : str
        The key and its new value, as a design file has it.
    case : Case
    """

    words: str
    case: Case


def small_changes(case: Case) -> tuple[Change, ...]:
    """Return what to try on a design: its model, its speed and its clock.

    Parameters
    ----------
    case : Case

    Returns
    -------
    tuple of Change

    Examples
    --------
    >>> from slewctl.files import example_design, read_design
    >>> from slewctl.gate import small_changes
    >>> for change in small_changes(read_design(example_design()).case):
    ...     print(change.words)
    model.n = 2
    model.basis = "arm-matched"
    controller.limits.torque = 0.7
    controller.limits.torque = 1.4
    """
    return (*_models(case), *_speeds(case), *_clocks(case))


def slower(case: Case) -> Change | None:
    """Return the same design made far slower; None where nothing of it sets the speed."""
    return next(_speeds(case, (_FAR_SLOWER,)), None)


def _models(case: Case) -> Iterator[Change]:
    if case.is_given:
        return
    beam = case.arm.beam
    most = min(case.truth_modes, beam.modes) if isinstance(beam, ModalData) else case.truth_modes
    if case.n < most:
        yield Change(f"model.n = {case.n + 1}", replace(case, n=case.n + 1))
    if not isinstance(beam, ModalData) and case.basis != _BEST_BASIS:
        yield Change(f'model.basis = "{_BEST_BASIS}"', replace(case, basis=_BEST_BASIS))


def _speeds(case: Case, factors: tuple[float, ...] = (_SLOWER, _FASTER)) -> Iterator[Change]:
    options, objective = case.options, case.objective
    speed = next((key for key in _SPEEDS if key in options), None)
    for factor in factors:
        if isinstance(options.get("pid"), Mapping):
            pid = {key: value * factor if key in _GAINS else value
                   for key, value in options["pid"].items()}  # fmt: skip
            yield _with_options(case, f"{factor:g} times the gains of controller.pid", pid=pid)
        elif speed is not None:
            value = _short(options[speed] * factor)
            yield _with_options(case, f"controller.{speed} = {value:g}", **{speed: value})
        elif not case.is_given:
            actuator = next(name for name in ACTUATORS if name in objective.limits)
            value = _short(objective.limits[actuator] * factor)
            limits = {**objective.limits, actuator: value}
            changed = Objective(limits, objective.noise)
            yield Change(
                f"controller.limits.{actuator} = {value:g}", replace(case, objective=changed)
            )


def _clocks(case: Case) -> Iterator[Change]:
    options = case.options
    if "sample_time" in options and not _is_law_of_a_clock(case):
        half = _short(options["sample_time"] / 2)
        yield _with_options(case, f"controller.sample_time = {half:g}", sample_time=half)
    if options.get("delay"):
        half = _short(options["delay"] / 2)
        yield _with_options(case, f"controller.delay = {half:g}", delay=half)


def _is_law_of_a_clock(case: Case) -> bool:
    """Whether the numbers of a given law hold for its own clock alone."""
    return case.is_given and "discretise" not in case.options


def _with_options(case: Case, words: str, **changed: Any) -> Change:
    return Change(words, replace(case, options={**case.options, **changed}))


def _short(value: float) -> float:
    """Return a value as a person would write it."""
    return float(f"{value:.3g}")
