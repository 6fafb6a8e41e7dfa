"""The one result type of all design methods, and the certificate it carries."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import control

from slewctl._types import Array


@dataclass(frozen=True)
class Check:
    """One independent check of a result: a measured error and the largest allowed one."""

    name: str
    error: float
    tolerance: float

    @property
    def passed(self) -> bool:
        """Whether the error is within the tolerance; NaN never is."""
        return self.error <= self.tolerance


@dataclass(frozen=True)
class Certificate:
    """The checks that a result went through."""

    checks: tuple[Check, ...]

    @property
    def verified(self) -> bool:
        """Whether every check passed."""
        return all(check.passed for check in self.checks)

    def __str__(self) -> str:
        lines = (
            f"{check.name}: {check.error:.1e} {'<=' if check.passed else '> (FAILED)'} "
            f"{check.tolerance:.0e}"
            for check in self.checks
        )
        return ("verified" if self.verified else "NOT verified") + " (" + "; ".join(lines) + ")"


@dataclass(frozen=True, eq=False, repr=False)
class Controller:
    """A designed controller: torque = K(s) y.

    Sign convention: the torque is the output of `system` driven by the measurements
    themselves.  The minus of the state feedback u = −K x̂ is inside, so connect it with a
    plus sign; the return ratio under negative feedback is L = −K(s)G(s).

    Attributes
    ----------
    system : control.StateSpace
        From the sensors, by name, to ``torque``.
    method : str
    gains : mapping of str to ndarray
        For example ``state_feedback`` (u = −Kx) and ``observer``.
    h2_cost : float
        Squared H2 norm achieved on the design model, recomputed from a Lyapunov equation.
    certificate : Certificate
    """

    system: control.StateSpace
    method: str
    gains: Mapping[str, Array]
    h2_cost: float
    certificate: Certificate

    def __repr__(self) -> str:
        states = f"{self.system.nstates} states"
        return f"<{self.method} controller, {states}, from {', '.join(self.sensors)}>"

    @property
    def sensors(self) -> tuple[str, ...]:
        """The measurements that the controller takes."""
        return tuple(self.system.input_labels)


def given(system: control.StateSpace) -> Controller:
    """Return a controller that was designed elsewhere, so that a loop can judge it.

    Parameters
    ----------
    system : control.StateSpace
        From the sensors to the actuator, by name, connected with a plus sign.
    """
    return Controller(system, "given", {}, math.nan, Certificate(()))
