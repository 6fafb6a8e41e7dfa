"""The matrices of a linear system with named signals, and python-control's form of it.

python-control takes two seconds to load.  Everything inside computes on `LinearSystem`; a
`control.StateSpace` is made where a user asks for one and read where a user gives one.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, TypeVar

import numpy as np

from slewctl._types import Array, ComplexArray

if TYPE_CHECKING:
    import control

T = TypeVar("T")
# What python-control calls signals that were given no name.
_NAMELESS = re.compile(r"[uy]\[\d+\]")


class LinearSystem:
    """ẋ = A x + B u, y = C x + D u, or x⁺ = … with a sample time.

    Parameters
    ----------
    A, B, C, D : array_like, shapes (n, n), (n, m), (p, n), (p, m)
        Numbers stand for matrices of one entry.
    dt : float, optional
        Sample time in s; zero for continuous time; None where any clock will do.
    inputs, outputs, states : sequence of str, optional
        By default u[0] …, y[0] … and x[0] …, as python-control has them.
    name : str, optional
    """

    __slots__ = (
        "A",
        "B",
        "C",
        "D",
        "__weakref__",
        "dt",
        "input_labels",
        "name",
        "output_labels",
        "state_labels",
    )

    def __init__(
        self,
        A: Array | float,
        B: Array | float,
        C: Array | float,
        D: Array | float,
        dt: float | None = 0.0,
        *,
        inputs: Sequence[str] | None = None,
        outputs: Sequence[str] | None = None,
        states: Sequence[str] | None = None,
        name: str | None = None,
    ) -> None:
        self.A, self.B, self.C, self.D = (_matrix(entries) for entries in (A, B, C, D))
        self.dt = dt
        self.input_labels = _labels(inputs, "u", self.D.shape[1])
        self.output_labels = _labels(outputs, "y", self.D.shape[0])
        self.state_labels = _labels(states, "x", len(self.A))
        self.name = name or ""

    @property
    def ninputs(self) -> int:
        """Number of inputs m."""
        return self.D.shape[1]

    @property
    def noutputs(self) -> int:
        """Number of outputs p."""
        return self.D.shape[0]

    @property
    def nstates(self) -> int:
        """Number of states n."""
        return len(self.A)

    @property
    def sample_time(self) -> float:
        """Sample time in s, zero for continuous time."""
        return float(self.dt or 0.0)

    @property
    def matrices(self) -> tuple[Array, Array, Array, Array]:
        """A, B, C and D."""
        return self.A, self.B, self.C, self.D

    @property
    def finite(self) -> bool:
        """Whether every entry is a finite number."""
        return all(bool(np.isfinite(matrix).all()) for matrix in self.matrices)

    def poles(self) -> ComplexArray:
        """Return the eigenvalues of A."""
        return np.linalg.eigvals(self.A).astype(complex)

    def named(
        self,
        inputs: Sequence[str] | None = None,
        outputs: Sequence[str] | None = None,
        states: Sequence[str] | None = None,
        name: str | None = None,
    ) -> LinearSystem:
        """Return the same system with other names."""
        return LinearSystem(
            *self.matrices,
            self.dt,
            inputs=inputs or self.input_labels,
            outputs=outputs or self.output_labels,
            states=states or self.state_labels,
            name=name or self.name,
        )

    def to_control(self) -> control.StateSpace:
        """Return the same system for python-control."""
        import control  # only who wants one of its systems waits for it

        return control.StateSpace(
            *self.matrices,
            self.dt,
            inputs=list(self.input_labels),
            outputs=list(self.output_labels),
            states=list(self.state_labels),
            name=self.name or None,
        )


def _matrix(entries: Array | float) -> Array:
    return np.atleast_2d(np.asarray(entries, dtype=float))


def _labels(names: Sequence[str] | None, letter: str, count: int) -> tuple[str, ...]:
    if names is None:
        return tuple(f"{letter}[{i}]" for i in range(count))
    if len(names) != count:
        raise ValueError(f"{len(names)} names for {count} signals")
    return tuple(names)


def nameless(names: Sequence[str]) -> bool:
    """Return whether signals have no names but those that python-control gives."""
    return all(_NAMELESS.fullmatch(name) for name in names)


def of_kind(system: object, kind: Literal["StateSpace", "TransferFunction"]) -> bool:
    """Return whether a user gave a system of this class of python-control."""
    control = sys.modules.get("control")
    return control is not None and isinstance(system, getattr(control, kind))


def linear(system: Any) -> LinearSystem | None:
    """Return a state space of either form as a `LinearSystem`; None if it is none.

    Without a known sample time (see `clock_unknown`) it is none either.
    """
    if isinstance(system, LinearSystem):
        return system
    if not of_kind(system, "StateSpace") or clock_unknown(system):
        return None
    return LinearSystem(
        system.A, system.B, system.C, system.D, system.dt,
        inputs=system.input_labels, outputs=system.output_labels, states=system.state_labels,
        name=system.name,
    )  # fmt: skip


def clock_unknown(system: object) -> bool:
    """Return whether a system is sampled without saying how often."""
    return getattr(system, "dt", None) is True


def alike(given: object, system: LinearSystem) -> Any:
    """Return a system in the form of the one that it was made of."""
    return system if isinstance(given, LinearSystem) else system.to_control()


class WithSystem:
    """A dataclass with a field ``system``; `holding_light` makes it."""

    @property
    def linear(self) -> LinearSystem:
        """The system as all inside computes on it, without python-control."""
        return vars(self)["_linear"]


class _Given:
    """A system as a user gives and wants it, a `control.StateSpace`, made when asked for.

    The owner keeps the light form.  What can be no state space is kept as it came, for the
    owner to refuse.
    """

    def __get__(self, owner: Any, kind: type) -> Any:
        if owner is None:
            return self
        kept = vars(owner)
        if "_given" not in kept:  # made of the light form
            kept["_given"] = kept["_linear"].to_control()
        return kept["_given"]

    def __set__(self, owner: Any, system: Any) -> None:
        kept = vars(owner)
        kept["_linear"] = linear(system)
        if not isinstance(system, LinearSystem):
            kept["_given"] = system


def holding_light(owner: type[T]) -> type[T]:
    """Let a frozen dataclass keep the light form of its field ``system``: a decorator."""
    owner.system = _Given()  # type: ignore[attr-defined]
    return owner
