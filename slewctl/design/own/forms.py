"""The forms in which people have a control law, each made a state space."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from slewctl._types import Array
from slewctl.design.zeros_poles import cascade, polynomials, read_coefficients, read_roots
from slewctl.errors import (
    Faults,
    InputError,
    check_given,
    check_number,
    check_positive,
    shown,
    suggest,
)
from slewctl.numerics.given_system import read_matrix, read_system
from slewctl.numerics.interconnect import parallel
from slewctl.numerics.linear_system import LinearSystem, nameless

# Of an entry of a law's matrices: its square and products with others are still numbers.
_LARGEST = 1e100
# The keys of each form.
FORMS: dict[str, tuple[str, ...]] = {
    "a system": ("system",),
    "pid": ("pid",),
    "num and den": ("num", "den"),
    "zeros, poles and gain": ("zeros", "poles", "gain"),
    "A, B, C and D": ("A", "B", "C", "D"),
}
_PID = ("kp", "ki", "kd", "filter_hz")


@dataclass(frozen=True, eq=False)
class Law:
    """A control law as it was told.

    Attributes
    ----------
    system : LinearSystem
        On its own clock.
    kept : bool
        Whether its states are the user's, who finds them again.
    names : tuple of str
        Of what it reads; empty where they have none.
    output : str
        What it commands; empty where it has no name.
    """

    system: LinearSystem
    kept: bool = False
    names: tuple[str, ...] = ()
    output: str = ""


def find_form(options: Mapping[str, Any]) -> str:
    """Return which of `FORMS` the options of `slewctl.given` tell; refuse none, and two."""
    found = [name for name, keys in FORMS.items() if any(key in options for key in keys)]
    known = f"{'; '.join(list(FORMS)[1:])}; or file"
    if not found:
        raise InputError("missing", where="pid", remedy=f"give a control law: {known}")
    if len(found) > 1:
        raise InputError(
            f"{' and '.join(found)} are given",
            where=next(key for key in options if key in FORMS[found[1]]),
            remedy=f"give one of {known}",
        )
    return found[0]


def read_law(form: str, options: Mapping[str, Any]) -> Law:
    """Return the law that the options of `slewctl.given` tell in one of `FORMS`.

    Raises
    ------
    InputError
        For each part that cannot be.
    """
    # What is to be discretised is continuous; the clock is that of the computer.
    clock = 0.0
    if "discretise" not in options and "sample_time" in options:
        clock = check_positive(options["sample_time"], "sample_time")
    with np.errstate(over="ignore", invalid="ignore"):  # told below
        law = _READERS[form](options, clock)
    own = law.system.sample_time
    if "discretise" not in options and "sample_time" in options and own != clock:
        raise _wrong_clock(own, clock, form)
    if law.system.noutputs != 1:
        raise InputError(
            f"the law commands {law.system.noutputs} signals",
            where=FORMS[form][-1],
            remedy="give it one",
        )
    largest = max(np.abs(matrix).max(initial=0.0) for matrix in law.system.matrices)
    if not largest <= _LARGEST:
        raise InputError(
            f"the law has an entry of {largest:g}, the most that can be computed with is "
            f"{_LARGEST:g}",
            where=FORMS[form][0],
            remedy="mend its numbers, or their units",
        )
    return law


def _wrong_clock(own: float, clock: float, form: str) -> InputError:
    if own:
        return InputError(
            f"the system has sample time {own:g} s, sample_time says {clock:g} s",
            where="sample_time",
            remedy="leave it out, or give the right one",
        )
    return InputError(
        f"{form} is continuous and a clock is given",
        where="discretise",
        remedy='say how it becomes what runs: "tustin", "zoh" or "matched"',
    )


def _of_system(options: Mapping[str, Any], clock: float) -> Law:
    system = read_system(options["system"], "system")
    inputs, outputs = system.input_labels, system.output_labels
    plain = LinearSystem(*system.matrices, system.dt or 0.0, states=system.state_labels)
    if system.dt is None and clock:
        plain.dt = clock
    return Law(
        plain,
        kept=True,
        names=() if nameless(inputs) else tuple(inputs),
        output="" if nameless(outputs) else outputs[0],
    )


def _of_pid(options: Mapping[str, Any], clock: float) -> Law:
    keys = options["pid"]
    if not isinstance(keys, Mapping):
        raise InputError(
            f"{shown(keys)} is no table of gains",
            where="pid",
            remedy="give one, as in { kp = 20.0, kd = 9.0, filter_hz = 30.0 }",
        )
    faults = Faults()
    faults.add(
        InputError("unknown key", where=f"pid.{key}", remedy=suggest(str(key), _PID))
        for key in keys
        if key not in _PID
    )
    gains = [faults.attempt(check_number, keys.get(key, 0.0), f"pid.{key}") for key in _PID[:3]]
    corner = faults.attempt(_corner, keys)
    faults.tell()
    kp, ki, kd = (gain or 0.0 for gain in gains)
    if not any((kp, ki, kd)):
        raise InputError("all gains are zero", where="pid", remedy="give kp, ki or kd")
    parts = [_static(kp)]
    if ki:
        parts.append(LinearSystem(0.0, 1.0, ki, 0.0))
    if kd and corner is not None:
        omega = 2 * math.pi * corner
        parts.append(LinearSystem(-omega, omega, -kd * omega, kd * omega))
    system = parts[0]
    for part in parts[1:]:
        system = parallel(system, part)
    return Law(system)


def _corner(keys: Mapping[str, Any]) -> float | None:
    """Return the corner of the derivative's lag in Hz; None where there is no derivative."""
    if "filter_hz" in keys:
        return check_positive(keys["filter_hz"], "pid.filter_hz")
    if keys.get("kd"):
        raise InputError(
            "the derivative needs filter_hz: without it the law is improper and nothing can run it",
            where="pid.filter_hz",
            remedy="give the corner in Hz of a lag on the derivative, well above the crossover",
        )
    return None


def _static(gain: float) -> LinearSystem:
    return LinearSystem(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), gain)


def _of_polynomials(options: Mapping[str, Any], clock: float) -> Law:
    faults = Faults()
    num, den = (faults.attempt(_coefficients, options, key) for key in ("num", "den"))
    return Law(polynomials(faults.settled(num), faults.settled(den), clock))


def _coefficients(options: Mapping[str, Any], key: str) -> Array:
    given = check_given(options.get(key), key, "coefficients, highest power first")
    return read_coefficients(given, key)


def _of_roots(options: Mapping[str, Any], clock: float) -> Law:
    faults = Faults()
    number = faults.attempt(_factor, options)
    found = [faults.attempt(read_roots, options.get(key, []), key) for key in ("zeros", "poles")]
    zeros, poles = (faults.settled(roots) for roots in found)
    if len(zeros) > len(poles):
        raise InputError(
            f"more zeros ({len(zeros)}) than poles ({len(poles)}): nothing can run it",
            where="zeros",
            remedy="add poles above the frequencies of interest",
        )
    return Law(cascade(zeros, poles, faults.settled(number), clock))


def _factor(options: Mapping[str, Any]) -> float:
    gain = options.get("gain")
    if isinstance(gain, np.ndarray) and gain.size == 1:  # a file's
        gain = gain.item()
    return check_number(check_given(gain, "gain", "the factor"), "gain")


def _of_matrices(options: Mapping[str, Any], clock: float) -> Law:
    parts = {key: options.get(key) for key in "ABCD"}
    if parts["D"] is not None and not any(_size(parts[key]) for key in "ABC"):
        D = read_matrix(parts["D"], "D")  # a law without states
        return Law(LinearSystem(np.zeros((0, 0)), np.zeros((0, D.shape[1])),
                                np.zeros((len(D), 0)), D, clock), kept=True)  # fmt: skip
    faults = Faults()
    found = {key: faults.attempt(_matrix, parts, key) for key in "ABC"}
    through = faults.attempt(read_matrix, parts["D"], "D") if parts["D"] is not None else None
    A, B, C = (faults.settled(matrix) for matrix in found.values())
    n = len(A)
    B = B.T if B.shape == (1, n) != (n, 1) and n > 1 else B  # a list of n numbers is a column
    D = np.zeros((len(C), B.shape[1])) if through is None else through
    wanted = {"A": (n, n), "B": (n, B.shape[1]), "C": (len(C), n), "D": (len(C), B.shape[1])}
    faults.add(
        InputError(
            f"its shape is {matrix.shape}, beside the others it wants {wanted[name]}",
            where=name,
            remedy="give x' = A x + B y, u = C x + D y",
        )
        for name, matrix in zip("ABCD", (A, B, C, D), strict=True)
        if matrix.shape != wanted[name]
    )
    faults.tell()
    return Law(LinearSystem(A, B, C, D, clock), kept=True)


def _matrix(parts: Mapping[str, Any], key: str) -> Array:
    return read_matrix(check_given(parts[key], key, "a matrix"), key)


def _size(value: Any) -> int:
    return 0 if value is None else int(np.size(value))


_READERS = {
    "a system": _of_system,
    "pid": _of_pid,
    "num and den": _of_polynomials,
    "zeros, poles and gain": _of_roots,
    "A, B, C and D": _of_matrices,
}
