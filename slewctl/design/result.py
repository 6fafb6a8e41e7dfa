"""The one result type of all design methods, and the certificate it carries."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from slewctl._show import table_html
from slewctl._types import Array, ComplexArray, FilePath
from slewctl.design.achieved import achieved
from slewctl.design.breakdown import check_finite
from slewctl.design.coordinates import balanced
from slewctl.design.digital.arithmetic import Arithmetic
from slewctl.design.digital.steps import DigitalSteps
from slewctl.design.reference import Reference, rigid_readings, rigid_reference, with_reference
from slewctl.design.stored import to_data
from slewctl.errors import InputError
from slewctl.export import write_data
from slewctl.numerics.h2_norm import H2Cost
from slewctl.numerics.linear_system import (
    LinearSystem,
    WithSystem,
    holding_light,
)
from slewctl.plant import GeneralisedPlant

if TYPE_CHECKING:
    import control

# Two Gramians that disagree by more do not confirm an H2 cost.
COST_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Check:
    """One independent check of a result: a measured error and the largest allowed one.

    Attributes
    ----------
    name : str
    error, tolerance : float
    remedy : str
        What to relax where it fails.
    """

    name: str
    error: float
    tolerance: float
    remedy: str = ""

    @property
    def passed(self) -> bool:
        """Whether the error is within the tolerance; NaN never is."""
        return self.error <= self.tolerance

    def __str__(self) -> str:
        if self.passed:
            return f"{self.name}: {self.error:.1e} <= {self.tolerance:.0e}"
        advice = f", {self.remedy}" if self.remedy else ""
        return f"{self.name} FAILED: {self.error:.1e}, at most {self.tolerance:.0e} allowed{advice}"


@dataclass(frozen=True)
class Certificate:
    """The checks that a result went through.

    Attributes
    ----------
    checks : tuple of Check
    """

    checks: tuple[Check, ...]

    @property
    def verified(self) -> bool:
        """Whether every check passed."""
        return all(check.passed for check in self.checks)

    def __str__(self) -> str:
        """Return every check that a verified result passed, else those alone that failed."""
        failed = [check for check in self.checks if not check.passed]
        told = "; ".join(str(check) for check in failed or self.checks)
        others = f"; {len(self.checks) - len(failed)} others passed" if failed else ""
        return f"{'NOT verified' if failed else 'verified'} ({told}{others})"


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


@holding_light
@dataclass(frozen=True, eq=False, repr=False)
class Controller(DigitalSteps, WithSystem):
    """A designed controller: torque = K y, continuous, or sampled with a zero-order hold.

    Sign convention: the torque is the output of `system` driven by the measurements
    themselves.  The minus of the state feedback u = −K x̂ is inside, so connect it with a
    plus sign; the return ratio under negative feedback is L = −K(s)G(s).

    Clock: a sampled controller (`sample_time` > 0) reads y_k at t_k = kT; the torque that it
    computes from it, its output of the same step, acts from t_k + `delay` to
    t_{k+1} + `delay`.

    Attributes
    ----------
    system : control.StateSpace
        From the sensors, by name, to the actuator, ``torque`` or ``voltage``.
    method : str
    gains : mapping of str to ndarray
        For example ``state_feedback`` (u = −Kx) and ``observer``.
    h2_cost : float
        Squared H2 norm achieved on the design model, recomputed from a Lyapunov equation;
        infinite where sensor noise passes straight to the actuator.
    certificate : Certificate
    poles : ndarray of complex
        Closed-loop poles on the design model in rad/s, recomputed; of a sampled controller
        their equivalents s = ln(z)/T.
    assumptions : tuple of str
        What was assumed, in words.
    guarantees : tuple of Guarantee
        What the method promises beside stability.
    seconds : mapping of str to float
        What took how long, for example ``build`` and ``solve``.
    delay : float
        Time in s from a sample to the torque computed from it; zero if continuous.
    reference : Reference or None
        How the reference angle enters; see `tracking`.
    state_scale : ndarray, shape (states,)
        Powers of two: a state of `system` times its scale is what its label names.  Every
        designed controller leaves in balanced coordinates.
    continuous : Controller or None
        The continuous law that a sampled one was made of by discretisation.
    arithmetic : Arithmetic or None
        The numbers that it is rounded to; None for those of double precision.
    entry : ndarray or None, shape (states, 1)
        Of an observer, how the actuator's signal enters its states beyond its own command: by
        entry·(applied − commanded).
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
    delay: float = 0.0
    reference: Reference | None = None
    state_scale: Array = field(default_factory=lambda: np.ones(0))
    continuous: Controller | None = None
    arithmetic: Arithmetic | None = None
    entry: Array | None = None

    def __repr__(self) -> str:
        states = f"{self.linear.nstates} states"
        clock = f", every {self.sample_time:g} s" if self.sample_time else ""
        return f"<{self.method} controller, {states}{clock}, from {', '.join(self.sensors)}>"

    def _repr_html_(self) -> str:
        checks = [
            {
                "check": check.name,
                "error": check.error,
                "allowed": check.tolerance,
                "passed": check.passed,
            }
            for check in self.certificate.checks
        ]
        return table_html(checks, "; ".join([repr(self)[1:-1], *self.assumptions]))

    @property
    def sample_time(self) -> float:
        """T in s; zero for a continuous controller."""
        return self.linear.sample_time

    @property
    def sensors(self) -> tuple[str, ...]:
        """The measurements that the controller takes."""
        return tuple(self.linear.input_labels)

    @property
    def tracking(self) -> control.StateSpace:
        """The controller with the reference angle ``theta_ref`` (rad) as a further input.

        A step in it turns the arm by as much, without steady error.

        Raises
        ------
        InputError
            If how the reference enters is not known: the controller was designed elsewhere,
            or on a plant without a model.
        """
        if self.reference is None:
            raise InputError(
                "how the reference angle enters this controller is not known",
                where="tracking",
                remedy="close it around a model and ask the loop for its tracking",
            )
        return with_reference(self.linear, self.reference).to_control()

    def save(self, path: FilePath) -> None:
        """Write the controller as data; ``slewctl.given(file=…)`` reads it to the last bit.

        Parameters
        ----------
        path : path
            Ending in ``.json``, ``.mat`` or ``.npz``.

        Raises
        ------
        InputError
            For another ending, or a file that cannot be written.
        """
        write_data(Path(path), self.data)

    @property
    def data(self) -> dict[str, Any]:
        """What `save` writes, by name."""
        return to_data(
            self.linear, self.method, self.delay, self.reference, self.state_scale, self.entry,
            self.arithmetic,
        )  # fmt: skip


def finished(
    plant: GeneralisedPlant,
    system: LinearSystem,
    method: str,
    gains: Mapping[str, Array],
    *,
    checks: Sequence[Check] | Callable[[H2Cost], Sequence[Check]] = (),
    assumptions: Sequence[str] = (),
    guarantees: Sequence[Guarantee] = (),
    seconds: Mapping[str, float] | None = None,
    delay: float = 0.0,
    reference: Reference | None = None,
    entry: Array | None = None,
) -> Controller:
    """Return a controller with what it achieves on its design model recomputed.

    Every method ends here, so that no result goes out that was not closed around its plant,
    as it was given, or in coordinates that others lose digits in.

    Parameters
    ----------
    plant : GeneralisedPlant
    system : LinearSystem
        From the sensors to the actuator, connected with a plus sign.
    method : str
    gains : mapping of str to ndarray
    checks : sequence of Check, or callable
        The method's own, beside those on the poles, the cost and the guarantees; a function
        is given the cost as it was recomputed.
    assumptions : sequence of str
    guarantees : sequence of Guarantee
    seconds : mapping of str to float
    delay : float
        Of a sampled controller, in s.
    reference : Reference, optional
        How the reference angle enters; by default what the sensors would read on the rigid
        arm is subtracted, where the plant has a model.
    entry : ndarray, shape (states, 1), optional
        See `Controller`; by default B₂ where the states are estimates of the plant's.

    Returns
    -------
    Controller

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> from slewctl.design import finished
    >>> K = sc.lqg(plant)
    >>> finished(plant, K.linear, "mine", {}).h2_cost == K.h2_cost
    True
    """
    system, scale = balanced(system)
    entry = _estimate_entry(plant, system, scale) if entry is None else entry / scale[:, None]
    check_finite(*(np.asarray(getattr(system, name)) for name in "ABCD"))
    poles, growth, cost = achieved(plant, system, delay)
    edge = "outside the unit circle" if system.dt else "right of the axis"
    # A pole on the edge itself is not stable either.
    beyond = 0.0 if growth < 0 else max(growth, float(np.finfo(float).tiny))
    stability = Check(f"closed-loop poles {edge}", beyond, 0.0)
    confirmed = (
        [Check("cost, two Gramians", cost.discrepancy, COST_TOLERANCE)]
        if math.isfinite(cost.value)
        else []
    )
    own = checks(cost) if callable(checks) else checks
    kept = [guarantee.check for guarantee in guarantees]
    if reference is not None:
        reference = Reference(reference.B / scale[:, None], reference.D)
    elif plant.model is not None:
        reference = rigid_reference(system, rigid_readings(plant.model, plant.sensors))
    return Controller(
        system,
        method,
        gains,
        cost.value,
        Certificate((stability, *own, *confirmed, *kept)),
        poles,
        tuple(assumptions),
        tuple(guarantees),
        dict(seconds or {}),
        delay,
        reference,
        scale,
        entry=entry,
    )


def _estimate_entry(plant: GeneralisedPlant, system: LinearSystem, scale: Array) -> Array | None:
    """Return how the input enters a law whose states are estimates of the plant's, or None."""
    names = {f"{state}_estimate": k for k, state in enumerate(plant.linear.state_labels)}
    rows = [names.get(label) for label in system.state_labels]
    if system.sample_time != plant.sample_time or {*names.values()} - {*rows}:
        return None
    found = [[0.0] if row is None else plant.B2[row] for row in rows]
    return np.array(found) / scale[:, None]
