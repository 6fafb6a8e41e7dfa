"""The one result type of all design methods, and the certificate it carries."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import control
import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.linalg import h2_cost
from slewctl.plant import GeneralisedPlant

# Two Gramians that disagree by more do not confirm an H2 cost.
COST_TOLERANCE = 1e-6


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


@dataclass(frozen=True)
class Guarantee:
    """What a design promises, beside what its closed loop achieves by an independent computation.

    Attributes
    ----------
    name : str
        For example ``decay rate``.
    bound : float
        What the method promised.
    achieved : float
        Recomputed from the closed loop of the design model.
    sense : {"at least", "at most"}
    unit : str
    """

    name: str
    bound: float
    achieved: float
    sense: Literal["at least", "at most"]
    unit: str = ""

    @property
    def check(self) -> Check:
        """How far the promise is missed, relative; zero where it is kept."""
        short = (
            self.bound - self.achieved if self.sense == "at least" else self.achieved - self.bound
        )
        return Check(f"{self.name} {self.sense} {self.bound:.4g}",
                     max(short, 0.0) / (abs(self.bound) or 1.0), 1e-6)  # fmt: skip


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
        Squared H2 norm achieved on the design model, recomputed from a Lyapunov equation;
        infinite where sensor noise passes straight to the actuator.
    certificate : Certificate
    poles : ndarray of complex
        Closed-loop poles on the design model, recomputed.
    assumptions : tuple of str
        What was assumed, in words.
    guarantees : tuple of Guarantee
        What the method promises beside stability.
    seconds : mapping of str to float
        What took how long, for example ``build`` and ``solve``.
    """

    system: control.StateSpace
    method: str
    gains: Mapping[str, Array]
    h2_cost: float
    certificate: Certificate
    poles: ComplexArray = field(default_factory=lambda: np.zeros(0, dtype=complex))
    assumptions: tuple[str, ...] = ()
    guarantees: tuple[Guarantee, ...] = ()
    seconds: Mapping[str, float] = field(default_factory=dict)

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


def finished(
    plant: GeneralisedPlant,
    system: control.StateSpace,
    method: str,
    gains: Mapping[str, Array],
    *,
    checks: Sequence[Check] = (),
    assumptions: Sequence[str] = (),
    guarantees: Sequence[Guarantee] = (),
    seconds: Mapping[str, float] | None = None,
) -> Controller:
    """Return a controller with what it achieves on its design model recomputed.

    Every method ends here, so that no result goes out that was not closed around its plant.

    Parameters
    ----------
    plant : GeneralisedPlant
    system : control.StateSpace
        From the sensors to the actuator, connected with a plus sign.
    method : str
    gains : mapping of str to ndarray
    checks : sequence of Check
        The method's own, beside those on the poles, the cost and the guarantees.
    assumptions : sequence of str
    guarantees : sequence of Guarantee
    seconds : mapping of str to float
    """
    closed = plant.close(system)
    A, B, C = (np.asarray(getattr(closed, name)) for name in "ABC")
    poles = np.linalg.eigvals(A)
    slowest = float(poles.real.max())
    stability = Check("closed-loop poles right of the axis", max(slowest, 0.0), 0.0)
    cost, confirmed = math.inf, []
    if slowest < 0 and not np.any(np.asarray(closed.D)):
        found = h2_cost(A, B, C)
        cost = found.value
        confirmed = [Check("cost, two Gramians", found.discrepancy, COST_TOLERANCE)]
    kept = [guarantee.check for guarantee in guarantees]
    return Controller(
        system,
        method,
        gains,
        cost,
        Certificate((stability, *checks, *confirmed, *kept)),
        poles.astype(complex),
        tuple(assumptions),
        tuple(guarantees),
        dict(seconds or {}),
    )
