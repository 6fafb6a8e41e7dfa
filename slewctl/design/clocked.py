"""A clock for the methods that design a continuous law: it is discretised, and that is judged."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import wraps
from typing import Any

import numpy as np

from slewctl.design.discretise import (
    check_rule,
    discretised,
    discretised_entry,
    discretised_with_path,
)
from slewctl.design.reference import Reference, rigid_readings, rigid_reference
from slewctl.design.result import Controller, finished
from slewctl.errors import InputError, check_nonnegative, check_positive
from slewctl.numerics.hinf_norm import peak_gain
from slewctl.numerics.interconnect import closed_matrix
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.observability import poles_and_growth
from slewctl.plant import GeneralisedPlant, check_plant, sampled_plant, split_delay

_PARAMETERS = """sample_time : float, optional
    In s.  Given, the law is a continuous one made a difference equation, which runs with this
    clock; that one is returned, and its `continuous` is the law it was made of.
delay : float, optional
    Time in s from a sample to the output that is computed from it, up to ten samples.
discretise : {"tustin", "zoh", "matched"}, optional
    How; by default the trapezoidal rule, "tustin".
prewarp_hz : float, optional
    Where ``tustin`` keeps gain and phase exactly.
"""


def read_clock(sample_time: float | None, delay: float) -> dict[str, float]:
    """Return a clock as options of a method, none for a continuous controller.

    Raises
    ------
    InputError
        For impossible times, or a delay without a clock.
    """
    if sample_time is None:
        if check_nonnegative(delay, "delay") > 0:
            raise InputError(
                "a continuous controller has no computational delay",
                where="delay",
                remedy="give sample_time too",
            )
        return {}
    T = check_positive(sample_time, "sample_time")
    split_delay(T, delay)
    return {"sample_time": T, "delay": float(delay)}


def check_clock(plant: GeneralisedPlant, sample_time: float | None, delay: float) -> float:
    """Return the sample time in s, zero for a continuous controller.

    Raises
    ------
    InputError
        As `read_clock`; for a clock beside that of a sampled plant, or a plant that cannot be
        sampled.
    """
    clock = read_clock(sample_time, delay)
    if not clock:
        return 0.0
    if plant.sample_time:
        raise InputError(
            f"the plant is sampled already, every {plant.sample_time:g} s",
            where="sample_time",
            remedy="leave it out, or give the continuous plant",
        )
    return sampled_plant(plant, **clock).sample_time


def with_clock(method: Callable[..., Controller]) -> Callable[..., Controller]:
    """Let a method that designs a continuous law take a clock, a delay and a rule.

    Parameters
    ----------
    method : callable
        Takes a plant and, by keyword alone, options.

    Returns
    -------
    callable
        Takes ``sample_time``, ``delay``, ``discretise`` and ``prewarp_hz`` beside them.
    """

    @wraps(method)
    def clocked(
        plant: GeneralisedPlant,
        *,
        sample_time: float | None = None,
        delay: float = 0.0,
        discretise: str | None = None,
        prewarp_hz: float | None = None,
        **options: Any,
    ) -> Controller:
        check_plant(plant, method.__name__)
        T = check_clock(plant, sample_time, delay)
        if not T:
            for name, value in (("discretise", discretise), ("prewarp_hz", prewarp_hz)):
                if value is not None:
                    raise InputError(
                        "nothing is discretised", where=name, remedy="give sample_time too"
                    )
            return method(plant, **options)
        rule = _Rule(T, float(delay), discretise or "tustin", prewarp_hz)
        check_rule(T, rule.rule, prewarp_hz)
        return rule.run(plant, method(plant, **options))

    own = inspect.signature(method)
    added = [
        parameter
        for parameter in inspect.signature(clocked, follow_wrapped=False).parameters.values()
        if parameter.kind is parameter.KEYWORD_ONLY
    ]
    clocked.__signature__ = own.replace(  # type: ignore[attr-defined]
        parameters=[*own.parameters.values(), *added]
    )
    clocked.__doc__ = _documented(method.__doc__ or "")
    return clocked


def _documented(text: str) -> str:
    """Return a docstring with the parameters of the clock behind its own."""
    own, heading, rest = text.partition("\n\n    Returns\n")
    added = "".join(f"\n    {line}" for line in _PARAMETERS.rstrip().split("\n"))
    return own + added + heading + rest


@dataclass(frozen=True)
class _Rule:
    """How a continuous law becomes what runs."""

    T: float
    delay: float
    rule: str
    prewarp_hz: float | None

    def run(self, plant: GeneralisedPlant, law: Controller) -> Controller:
        """Return what runs of a law, with what it achieves on the plant recomputed."""
        system, reference = self._discretised(plant, law)
        made = finished(
            plant,
            system,
            law.method,
            law.gains,
            checks=[replace(c, name=f"continuous law: {c.name}") for c in law.certificate.checks],
            assumptions=(*law.assumptions, *self._words(law, system, plant)),
            seconds=law.seconds,
            delay=self.delay,
            reference=reference,
            entry=discretised_entry(law.linear, law.entry, *self._how),
        )
        return replace(made, continuous=law)

    def _discretised(
        self, plant: GeneralisedPlant, law: Controller
    ) -> tuple[LinearSystem, Reference | None]:
        """Return the law and the reference's path through it, both by the same rule."""
        if law.reference is None or _is_rigid(plant, law):
            return discretised(law.linear, *self._how), None
        if self.rule == "matched":
            raise InputError(
                f"matched is for one input, and {law.method} has a path of the reference too",
                where="discretise",
                remedy='use "tustin" or "zoh"',
            )
        return discretised_with_path(law.linear, law.reference, *self._how)

    @property
    def _how(self) -> tuple[float, str, float | None]:
        return self.T, self.rule, self.prewarp_hz

    def _words(
        self, law: Controller, system: LinearSystem, plant: GeneralisedPlant
    ) -> tuple[str, ...]:
        warped = f", prewarped at {self.prewarp_hz:g} Hz" if self.prewarp_hz else ""
        path = sampled_plant(plant, self.T, self.delay).path
        before, after = _modulus(plant.path, law.linear), _modulus(path, system)
        words = (
            f"a continuous law, run every {self.T:g} s by {self.rule}{warped}, {self.delay:g} s "
            "late; what is said of it above is said of the continuous law",
            f"least distance of the loop on the design model from −1 (modulus margin): "
            f"{_told(before)} of the continuous law, {_told(after)} of what runs",
        )
        if not law.guarantees:
            return words
        names = ", ".join(guarantee.name for guarantee in law.guarantees)
        return (*words, f"promised of the continuous law alone: {names}")


def _is_rigid(plant: GeneralisedPlant, law: Controller) -> bool:
    """Whether the reference enters by what the sensors would read, which sampling keeps."""
    if plant.model is None or law.reference is None:
        return False
    rigid = rigid_reference(law.linear, rigid_readings(plant.model, plant.sensors))
    return np.array_equal(rigid.B, law.reference.B) and np.array_equal(rigid.D, law.reference.D)


def _modulus(path: LinearSystem, law: LinearSystem) -> float:
    """Return 1/‖S‖∞ of the loop of a strictly proper path and a law; zero if it is unstable."""
    A = closed_matrix(path.A, path.B, path.C, law.matrices)
    if not poles_and_growth(A, path.sample_time)[1] < 0:
        return 0.0
    entering = np.vstack([path.B, np.zeros((law.nstates, 1))])
    seen = np.hstack([law.D @ path.C, law.C])
    return 1 / peak_gain(LinearSystem(A, entering, seen, 1.0, path.sample_time)).value


def _told(modulus: float) -> str:
    return f"{modulus:.3g}" if modulus else "none (unstable)"
