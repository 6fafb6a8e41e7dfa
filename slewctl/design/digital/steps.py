"""A controller on its way to the computer that runs it: discretised, reduced, rounded."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.design.achieved import achieved
from slewctl.design.digital.arithmetic import Arithmetic
from slewctl.design.digital.fixed_point import LoopSignals, rounded
from slewctl.design.digital.reduction import reduced_by_loop
from slewctl.design.digital.sections import Sections, in_sections
from slewctl.design.discretise import discretised, discretised_entry, discretised_with_path
from slewctl.design.reference import Reference
from slewctl.errors import DesignError, InputError, check_nonnegative, check_positive
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant import GeneralisedPlant, check_plant, split_delay

Made = TypeVar("Made", bound="DigitalSteps")
# How well a path of the reference is one of the readings, relative, to be taken for it.
_RIGID = 1e-9


class DigitalSteps:
    """What a `Controller` can become; each step is one more controller, judged like any other."""

    if TYPE_CHECKING:
        # Of the controller.
        reference: Reference | None
        delay: float
        method: str
        certificate: Any
        assumptions: tuple[str, ...]
        state_scale: Array
        entry: Array | None
        poles: ComplexArray
        arithmetic: Arithmetic | None

        @property
        def linear(self) -> LinearSystem: ...

    def discretised(
        self: Made,
        sample_time: float,
        delay: float = 0.0,
        method: str = "tustin",
        prewarp_hz: float | None = None,
    ) -> Made:
        """Return the difference equation that a computer runs instead of a continuous law.

        Its `continuous` is the law, so that whoever judges it says what sampling costs.

        Parameters
        ----------
        sample_time : float
            In s.
        delay : float
            From a sample to the command that is computed from it, in s.
        method : {"tustin", "zoh", "matched"}
        prewarp_hz : float, optional
            Where ``tustin`` keeps gain and phase exactly.

        Raises
        ------
        InputError
            As the design methods with a ``sample_time``; for a law that is sampled already.
        """
        T = check_positive(sample_time, "sample_time")
        split_delay(T, check_nonnegative(delay, "delay"))
        law, rule = self.linear, (T, method, prewarp_hz)
        readings = _readings(law, self.reference)
        if self.reference is None or readings is not None:
            system = discretised(law, *rule)
            reference = None if readings is None else Reference(-system.B @ readings,
                                                                -system.D @ readings)  # fmt: skip
        else:
            system, reference = discretised_with_path(law, self.reference, *rule)
        words = f"a continuous law, run every {T:g} s by {method}, {delay:g} s late"
        made = _replaced(self, system.named(states=law.state_labels), reference, words)
        entry = discretised_entry(law, self.entry, *rule)
        return replace(  # type: ignore[type-var]
            made, delay=float(delay), continuous=self, entry=entry
        )

    def reduced(self: Made, order: int, plant: GeneralisedPlant) -> Made:
        """Return a controller of fewer states that does in its loop what this one does.

        Balanced truncation by what the plant's noise excites and its limits weigh in the closed
        loop; integrators are kept.

        Parameters
        ----------
        order : int
            States to keep, integrators among them.
        plant : GeneralisedPlant
            What the controller was designed on, or another that it stabilises.

        Raises
        ------
        InputError
            For an order that is none, or a plant that the controller does not stabilise.
        DesignError
            For an order at which the loop is lost, with the least one at which it is not.

        Examples
        --------
        >>> import slewctl as sc
        >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
        >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
        >>> plant = problem.plant("clamped-free", n=3)
        >>> K = sc.lqg(plant)
        >>> small = K.reduced(4, plant)
        >>> small, small.h2_cost / K.h2_cost < 1.1
        (<lqg controller, 4 states, from theta>, True)
        """
        check_plant(plant, "plant")
        found = reduced_by_loop(plant, self.linear, order, self.delay, self.reference)
        words = f"reduced from {self.linear.nstates} states to {order} by what its loop needs"
        made = _replaced(self, *found, words)
        poles, _, cost = achieved(plant, made.linear, self.delay)
        return replace(made, poles=poles, h2_cost=cost.value, continuous=None)  # type: ignore[type-var]

    def in_sections(self: Made) -> Made:
        """Return the same controller in modal sections: a real pole or a pair of them each.

        Of all coordinates these are moved least where coefficients are rounded.
        """
        found = in_sections(self.linear)
        reference = _turned(self.reference, found)
        return _replaced(self, found.system, reference, "in modal sections", found)

    def in_float32(self: Made) -> Made:
        """Return the controller in modal sections with coefficients of single precision.

        Raises
        ------
        InputError
            For a continuous controller, or a coefficient beyond single precision.
        """
        check_sampled(self, "in_float32")
        found = in_sections(self.linear)
        system, eye = found.system, np.eye(self.linear.nstates)
        # What is added to a state in a sample is held: near z = 1 it keeps more digits.
        A, B, C, D = (_single(m) for m in (system.A - eye, system.B, system.C, system.D))
        made = LinearSystem(
            eye + A, B, C, D, system.dt, inputs=system.input_labels,
            outputs=system.output_labels, states=system.state_labels, name=system.name,
        )  # fmt: skip
        reference = self.reference
        if reference is not None:
            reference = Reference(_single(found.of_state(reference.B)), _single(reference.D))
        made_of = _replaced(self, made, reference, "in modal sections, in single precision", found)
        return replace(made_of, arithmetic=Arithmetic("float"))  # type: ignore[type-var]

    def in_fixed_point(self: Made, word: int, fraction: int | None, signals: LoopSignals) -> Made:
        """Return the controller in modal sections, in words of whole numbers.

        Parameters
        ----------
        word : int
            Bits of a word, the sign included; 4 to 32.
        fraction : int or None
            How many of them are behind the point, in the readings and in the command; None for
            as many as the sizes of each leave.  States are scaled one by one.
        signals : LoopSignals
            What the signals come to: `slewctl.Problem.loop_signals`.

        Raises
        ------
        InputError
            For a continuous controller; for a word in which a signal or a coefficient
            overflows, with the length that works.
        DesignError
            For a word so short that nothing of the controller is left.

        Examples
        --------
        >>> import slewctl as sc
        >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
        >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
        >>> K = sc.lqg(problem.plant("clamped-free", n=1), sample_time=0.02)
        >>> signals = problem.loop_signals(K)
        >>> problem.judge(K.in_fixed_point(16, None, signals)).stable
        True
        >>> K.in_fixed_point(16, 14, signals)
        Traceback (most recent call last):
        ...
        slewctl.errors.InputError: fraction: 14 of 16 bits behind the point overflow: ...
        """
        check_sampled(self, "in_fixed_point")
        found = in_sections(self.linear)
        turned = found.of_state(np.eye(self.linear.nstates))
        system, arithmetic = rounded(found.system, word, fraction, signals, turned)
        if not (np.any(system.D) or (np.any(system.B) and np.any(system.C))):
            raise DesignError(
                f"nothing is left of the controller in words of {word} bits",
                where="word",
                remedy="give a longer one",
            )
        reference = _turned(self.reference, found)
        words = f"in modal sections, in words of {word} bits"
        made = _replaced(self, system, reference, words, found)
        return replace(made, arithmetic=arithmetic)  # type: ignore[type-var]


def _replaced(
    made_of: Made,
    system: LinearSystem,
    reference: Reference | None,
    words: str,
    found: Sections | None = None,
) -> Made:
    """Return a controller with another system, and with what is said of the one before."""
    checks = tuple(replace(check, name=f"before: {check.name.removeprefix('before: ')}")
                   for check in made_of.certificate.checks)  # fmt: skip
    # Of states that are not those of before nobody knows where a limited command enters.
    entry = None if made_of.entry is None or found is None else found.of_state(made_of.entry)
    return replace(  # type: ignore[type-var]
        made_of,
        system=system,
        reference=reference,
        certificate=replace(made_of.certificate, checks=checks),
        assumptions=(*made_of.assumptions, words),
        h2_cost=np.nan,
        poles=np.zeros(0, dtype=complex),
        guarantees=(),
        state_scale=np.ones(system.nstates),
        entry=entry,
    )


def _turned(reference: Reference | None, found: Sections) -> Reference | None:
    return None if reference is None else Reference(found.of_state(reference.B), reference.D)


def check_sampled(controller: DigitalSteps, where: str) -> None:
    """Refuse a continuous controller where what a computer runs is meant."""
    if not controller.linear.sample_time:
        raise InputError(
            "the controller is continuous, and a computer runs samples",
            where=where,
            remedy="take controller.discretised(sample_time)",
        )


def _single(matrix: Array) -> Array:
    with np.errstate(over="ignore"):
        rounded_off = matrix.astype(np.float32).astype(float)
    if not np.isfinite(rounded_off).all():
        raise InputError(
            f"a coefficient of {np.abs(matrix).max():.3g} is beyond single precision",
            where="in_float32",
            remedy="give the arm in SI units",
        )
    return np.asarray(rounded_off)


def _readings(system: LinearSystem, reference: Reference | None) -> Array | None:
    """Return the readings of which the reference's path is the minus; None if of none."""
    if reference is None:
        return None
    entering = np.vstack([system.B, system.D])
    wanted = -np.vstack([reference.B, reference.D])
    found = np.linalg.lstsq(entering, wanted, rcond=None)[0]
    missed = np.linalg.norm(entering @ found - wanted)
    return np.asarray(found) if missed <= _RIGID * np.linalg.norm(wanted) else None
