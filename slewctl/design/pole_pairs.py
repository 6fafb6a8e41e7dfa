"""Poles two by two: the quadratic s² + a s + c of a mode, and the modes of a plant."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.errors import InputError

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

    def same(self, other: PolePair) -> bool:
        """Whether both poles are those of `other` to rounding."""
        size = max(self.frequency, other.frequency, abs(self.damping), abs(other.damping))
        return (
            abs(self.damping - other.damping) <= _SAME * size
            and abs(self.stiffness - other.stiffness) <= _SAME * size**2
        )


@dataclass(frozen=True, eq=False)
class OpenLoop:
    """A state matrix and its poles, mode by mode.

    Attributes
    ----------
    A : ndarray, shape (n, n)
        In energy states, see `slewctl.design.scaling`.
    pairs : tuple of PolePair
        By increasing frequency: the rigid body first, then mode 1, 2, ….
    states : tuple of (int, int), or None
        The two states of each mode; None where friction couples the modes.
    """

    A: Array
    pairs: tuple[PolePair, ...]
    states: tuple[tuple[int, int], ...] | None

    @property
    def dual(self) -> OpenLoop:
        """The transposed system, whose state feedback is the observer gain, transposed."""
        return OpenLoop(self.A.T, self.pairs, self.states)


def open_loop(A: Array) -> OpenLoop:
    """Return the modes of a state matrix given in energy states.

    Parameters
    ----------
    A : ndarray, shape (n, n)

    Raises
    ------
    InputError
        If the poles do not go into pairs.
    """
    n = len(A)
    if n % 2 == 0:
        half = n // 2
        for states in (
            tuple((k, half + k) for k in range(half)),
            tuple((2 * k, 2 * k + 1) for k in range(half)),
        ):
            pairs = [_block_pair(A[np.ix_(s, s)]) for s in states]
            if _uncoupled(A, states, pairs):
                order = sorted(range(half), key=lambda k: pairs[k].frequency)
                return OpenLoop(A, tuple(pairs[k] for k in order), tuple(states[k] for k in order))
    return OpenLoop(A, paired(np.linalg.eigvals(A).astype(complex)), None)


def _block_pair(block: Array) -> PolePair:
    """Return the characteristic polynomial of a block of two states."""
    trace = block[0, 0] + block[1, 1]
    return PolePair(-float(trace), float(block[0, 0] * block[1, 1] - block[0, 1] * block[1, 0]))


def _uncoupled(A: Array, states: Sequence[tuple[int, int]], pairs: Sequence[PolePair]) -> bool:
    frequency, between = np.zeros(len(A)), np.abs(A)
    for pair, (i, j) in zip(pairs, states, strict=True):
        frequency[[i, j]] = pair.frequency
        between[np.ix_((i, j), (i, j))] = 0.0
    apart = np.abs(frequency[:, None] - frequency)
    return bool(np.all(between <= _UNCOUPLED * apart))


def paired(values: ComplexArray) -> tuple[PolePair, ...]:
    """Return poles as pairs by increasing frequency; real ones go with their neighbours.

    Parameters
    ----------
    values : ndarray of complex
        Closed under conjugation, as the eigenvalues of a real matrix are.

    Raises
    ------
    InputError
        If their number is odd.
    """
    real = sorted((complex(v) for v in values if v.imag == 0), key=abs)
    if len(real) % 2:
        raise InputError(
            f"the {len(values)} poles of the plant are not those of modes",
            where="plant",
            remedy="give a plant with two states for each mode",
        )
    pairs = [PolePair.of(v, np.conj(v)) for v in values if v.imag > 0]
    pairs += [PolePair.of(*real[k : k + 2]) for k in range(0, len(real), 2)]
    return tuple(sorted(pairs, key=lambda pair: pair.frequency))


def mode_name(number: int, pair: PolePair) -> str:
    """Return how a message calls a mode; its pair in rad/s."""
    if number == 0:
        return "the rigid-body rotation"
    return f"mode {number} ({pair.frequency / (2 * math.pi):.4g} Hz)"
