"""What a given law reads and commands, and with which sign."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from slewctl.design.own.forms import Law
from slewctl.design.reference import REFERENCE, Reference
from slewctl.errors import Faults, InputError, check_choice, shown
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant.signals import ACTUATORS, check_signals

_SIGNS = {"negative": -1.0, "positive": 1.0}


def signals_of(law: Law | None, options: Mapping[str, Any]) -> tuple[str, ...]:
    """Return what a law reads, each once; of a law that cannot be read the names are looked at."""
    named = options.get("inputs", law.names if law and law.names else None)
    width = law.system.ninputs if law else None
    if named is None and width not in (1, None):
        raise InputError(
            f"the law reads {width} signals", where="inputs", remedy="name them in their order"
        )
    if not isinstance(named, str | Sequence | None):
        raise InputError(
            f"{shown(named)} is not a list of names",
            where="inputs",
            remedy="give one, as in ['theta']",
        )
    names = (named,) if isinstance(named, str) else tuple(named or ("theta",))
    faults = Faults()
    for name in names:
        if name != REFERENCE:
            faults.attempt(check_signals, [name], "inputs")
    faults.tell()
    if law is None:
        return names
    if law.names and sorted(names) != sorted(law.names):
        raise InputError(
            f"the system's own are called {', '.join(law.names)}",
            where="inputs",
            remedy="leave this out, or rename the system's",
        )
    names = law.names or names
    if len(names) != width or len(set(names)) != width:
        raise InputError(
            f"{len(names)} names for {width} signals",
            where="inputs",
            remedy="name each signal that the law reads once",
        )
    if set(names) == {REFERENCE}:
        raise InputError(
            "nothing is measured", where="inputs", remedy="name a sensor, such as theta"
        )
    return names


def output_of(law: Law | None, options: Mapping[str, Any], default: str | None) -> str:
    """Return what a law commands, which it may say itself; without a default something must."""
    own = law.output if law and law.output else options.get("output", default)
    if own is None:
        raise InputError(
            "missing: the arm has a motor, and the law may command the torque or the voltage",
            where="output",
            remedy='give "torque" if it computes N·m, "voltage" if it computes V',
        )
    if options.get("output", own) != own:
        raise InputError(
            f"the system's own is called {own}",
            where="output",
            remedy="leave this out, or rename the system's",
        )
    return check_choice(own, ACTUATORS, "output")


def sign_of(form: str | None, options: Mapping[str, Any]) -> float:
    """Return −1 where the law is connected with a minus; a PID acts on the error r − y."""
    told = options.get("feedback", "negative" if form in ("pid", None) else None)
    if told is None:
        raise InputError(
            "missing: the sign of this law can be meant both ways",
            where="feedback",
            remedy='give "negative" if it is connected with a minus, as in control.feedback, or '
            '"positive" if its minus is inside',
        )
    return _SIGNS[check_choice(told, _SIGNS, "feedback")]


def signed(system: LinearSystem, names: Sequence[str], sign: float, output: str) -> LinearSystem:
    """Return the law with its minus inside; the path of the reference keeps its sign."""
    if sign < 0:
        factors = np.array([1.0 if name == REFERENCE else -1.0 for name in names])
        B, D = system.B * factors, system.D * factors
    else:
        B, D = system.B, system.D
    return LinearSystem(
        system.A, B, system.C, D, system.dt,
        inputs=names, outputs=[output], states=system.state_labels, name="given",
    )  # fmt: skip


def reference_apart(
    system: LinearSystem, names: Sequence[str]
) -> tuple[LinearSystem, Reference | None]:
    """Return the feedback and, of a law with two degrees of freedom, the reference's path."""
    if REFERENCE not in names:
        return system, None
    at = list(names).index(REFERENCE)
    kept = [k for k in range(len(names)) if k != at]
    feedback = LinearSystem(
        system.A, system.B[:, kept], system.C, system.D[:, kept], system.dt,
        inputs=[names[k] for k in kept], outputs=system.output_labels,
        states=system.state_labels, name=system.name,
    )  # fmt: skip
    return feedback, Reference(system.B[:, [at]], system.D[:, [at]])
