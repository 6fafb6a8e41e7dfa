"""Poles two by two: the quadratic s² + a s + c of a mode, and the modes of a plant.

A plant with a lag has an odd number of poles: one real one is left alone.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.numerics.modes import real_pairs

# Modes coupled by less than this, relative to the distance of their frequencies, are not:
# their eigenvectors are turned by no more, and the poles only by its square.
_UNCOUPLED = 1e-12
# Two poles that differ by less, relative, are the same.
_SAME = 1e-9


@dataclass(frozen=True)
class PolePair:
    """The roots of s² + damping·s + stiffness.

    Parameters
    ----------
    damping : float
        2ζω for a mode of frequency ω and damping ratio ζ, in rad/s.
    stiffness : float
        ω² in rad²/s².
    """

    damping: float
    stiffness: float

    @classmethod
    def of(cls, first: complex, second: complex) -> PolePair:
        """Return the pair of two poles, both real or conjugate to each other."""
        return cls(float(-(first + second).real), float((first * second).real))

    @classmethod
    def mode(cls, frequency: float, ratio: float) -> PolePair:
        """Return the pair of a frequency in rad/s and a damping ratio."""
        return cls(2 * ratio * frequency, frequency**2)

    @property
    def poles(self) -> tuple[complex, complex]:
        """Both roots, without cancellation."""
        half = self.damping / 2
        root = cmath.sqrt(half**2 - self.stiffness)
        if root.imag:
            return -half + root, -half - root
        large = -half - math.copysign(root.real, half)
        return (self.stiffness / large if large else 0.0) + 0j, complex(large)

    @property
    def frequency(self) -> float:
        """Undamped frequency ω = √|stiffness| in rad/s."""
        return math.sqrt(abs(self.stiffness))

    @property
    def ratio(self) -> float:
        """Damping ratio ζ; infinite for a pole at the origin beside another."""
        omega = self.frequency
        return self.damping / (2 * omega) if omega else math.copysign(math.inf, self.damping)

    def times(self, factor: float) -> PolePair:
        """Return the pair with both poles multiplied by a factor."""
        return PolePair(self.damping * factor, self.stiffness * factor**2)

    def same(self, other: Roots) -> bool:
        """Whether both poles are those of `other` to rounding."""
        if not isinstance(other, PolePair):
            return False
        size = max(self.frequency, other.frequency, abs(self.damping), abs(other.damping))
        return (
            abs(self.damping - other.damping) <= _SAME * size
            and abs(self.stiffness - other.stiffness) <= _SAME * size**2
        )


@dataclass(frozen=True)
class LonePole:
    """A real pole without a partner, as of a lag; what it shares with a pair is named alike.

    Parameters
    ----------
    pole : float
        In rad/s.
    """

    pole: float

    @property
    def poles(self) -> tuple[complex, ...]:
        """The pole itself."""
        return (complex(self.pole),)

    @property
    def damping(self) -> float:
        """Twice the decay rate, as of a pair of such poles."""
        return -2 * self.pole

    @property
    def frequency(self) -> float:
        """The pole's magnitude in rad/s."""
        return abs(self.pole)

    @property
    def ratio(self) -> float:
        """Damping ratio: 1 for a stable pole, −1 for an unstable one."""
        return math.copysign(1.0, -self.pole)

    def times(self, factor: float) -> LonePole:
        """Return the pole multiplied by a factor."""
        return LonePole(self.pole * factor)

    def same(self, other: Roots) -> bool:
        """Whether `other` is this pole to rounding."""
        size = max(self.frequency, other.frequency)
        return isinstance(other, LonePole) and abs(self.pole - other.pole) <= _SAME * size


Roots = PolePair | LonePole


@dataclass(frozen=True, eq=False)
class OpenLoop:
    """A state matrix and its poles, mode by mode.

    Attributes
    ----------
    A : ndarray, shape (n, n)
        In energy states, see `slewctl.design.energy_coordinates`.
    pairs : tuple of PolePair or LonePole
        By increasing frequency: the rigid body first, then mode 1, 2, …, at the end a pole
        without a partner.
    states : tuple of tuple of int, or None
        The states of each; None where friction couples the modes.
    """

    A: Array
    pairs: tuple[Roots, ...]
    states: tuple[tuple[int, ...], ...] | None

    @property
    def dual(self) -> OpenLoop:
        """The transposed system, whose state feedback is the observer gain, transposed."""
        return OpenLoop(self.A.T, self.pairs, self.states)


def open_loop(A: Array) -> OpenLoop:
    """Return the modes of a state matrix given in energy states.

    Parameters
    ----------
    A : ndarray, shape (n, n)
    """
    n = len(A)
    for lone in range(n) if n % 2 else (n,):
        others, half = [k for k in range(n) if k != lone], n // 2
        for layout in (
            [(others[k], others[half + k]) for k in range(half)],
            [(others[2 * k], others[2 * k + 1]) for k in range(half)],
        ):
            states: list[tuple[int, ...]] = [*layout, *([(lone,)] if n % 2 else [])]
            pairs = [_block_roots(A[np.ix_(s, s)]) for s in states]
            if _uncoupled(A, states, pairs):
                order = sorted(range(half), key=lambda k: pairs[k].frequency) + [half] * (n % 2)
                return OpenLoop(A, tuple(pairs[k] for k in order), tuple(states[k] for k in order))
    return OpenLoop(A, paired(np.linalg.eigvals(A).astype(complex)), None)


def _block_roots(block: Array) -> Roots:
    """Return the characteristic polynomial of a block of one or two states."""
    if len(block) == 1:
        return LonePole(float(block[0, 0]))
    trace = block[0, 0] + block[1, 1]
    return PolePair(-float(trace), float(block[0, 0] * block[1, 1] - block[0, 1] * block[1, 0]))


def _uncoupled(A: Array, states: Sequence[tuple[int, ...]], pairs: Sequence[Roots]) -> bool:
    frequency, between = np.zeros(len(A)), np.abs(A)
    for pair, own in zip(pairs, states, strict=True):
        frequency[list(own)] = pair.frequency
        between[np.ix_(own, own)] = 0.0
    apart = np.abs(frequency[:, None] - frequency)
    return bool(np.all(between <= _UNCOUPLED * apart))


def paired(values: ComplexArray) -> tuple[Roots, ...]:
    """Return poles as pairs by increasing frequency; real ones go with their neighbours.

    Of an odd number the fastest real one is left over, at the end.

    Parameters
    ----------
    values : ndarray of complex
        Closed under conjugation, as the eigenvalues of a real matrix are.
    """
    every = range(len(values))
    real, left = real_pairs(values, every, overdamped=False)
    pairs = [PolePair.of(v, np.conj(v)) for v in values if v.imag > 0]
    pairs += [PolePair.of(complex(values[i]), complex(values[k])) for i, k in real]
    lone = [LonePole(float(values[k].real)) for k in left]
    return (*sorted(pairs, key=lambda pair: pair.frequency), *lone)


def flexible_modes(pairs: Sequence[Roots]) -> int:
    """Return how many modes there are beside the rigid body's pair and a lone pole."""
    return sum(isinstance(pair, PolePair) for pair in pairs) - 1


def mode_name(number: int, pair: Roots) -> str:
    """Return how a message calls a mode; its pair in rad/s."""
    if isinstance(pair, LonePole):
        return f"the real pole ({pair.frequency / (2 * math.pi):.4g} Hz)"
    if number == 0:
        return "the rigid-body rotation"
    return f"mode {number} ({pair.frequency / (2 * math.pi):.4g} Hz)"
