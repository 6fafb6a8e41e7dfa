"""A sampled controller in words of whole numbers, in modal sections, each state scaled."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.design.digital.arithmetic import Arithmetic
from slewctl.errors import InputError, check_count
from slewctl.numerics.linear_system import LinearSystem

# In bits: the shortest word that holds a sign and a number to be scaled; the longest whose sums
# have a type in C.
LEAST_WORD, MOST_WORD = 4, 32
# Sums of three products, each over 2 to this power at least, cannot overflow two words.
LEAST_SHIFT = 2
# A normal disturbance is beyond so many standard deviations once in two million samples.
_DEVIATIONS = 5.0
# Kept free above the largest value of a state that was seen.
_FREE = 2.0
# And above the largest command that was seen, where nothing else limits it.
_UNLIMITED = 4.0


@dataclass(frozen=True, eq=False)
class LoopSignals:
    """What a controller's signals are in the loop that it closes, by which words are scaled.

    Attributes
    ----------
    readings : ndarray, shape (steps, sensors)
    states : ndarray, shape (steps, n)
        Of the controller.
    command : ndarray, shape (steps,)
    angle : float
        Largest reference angle, in rad.
    reading_covariance, state_covariance : ndarray, shapes (sensors, sensors), (n, n)
        Of the noise that comes on top.
    command_variance : float
    limit : float
        Where the command is cut off; its words hold that and no more.
    """

    readings: Array
    states: Array
    command: Array
    angle: float
    reading_covariance: Array
    state_covariance: Array
    command_variance: float
    limit: float = math.inf

    @property
    def largest(self) -> Array:
        """Largest reading of each sensor, of the command and of the reference, with noise."""
        spread = _DEVIATIONS * np.sqrt(np.diag(self.reading_covariance))
        readings = np.abs(self.readings).max(axis=0) + spread
        command = self.limit
        if not math.isfinite(command):
            command = np.abs(self.command).max() + _DEVIATIONS * math.sqrt(self.command_variance)
            command *= _UNLIMITED  # where words end nobody has said that the drive does
        return np.array([*readings, command, abs(self.angle)])

    def largest_states(self, turned: Array) -> Array:
        """Return the largest values of states turned @ x, with noise."""
        spread = np.sqrt(np.maximum(np.sum(turned @ self.state_covariance * turned, axis=1), 0.0))
        seen = np.abs(self.states @ turned.T).max(axis=0, initial=0.0)
        return np.asarray(seen + _DEVIATIONS * spread)


def whole_bits(size: float) -> int:
    """Return how many bits before the point hold a size; negative of a small one."""
    return math.frexp(size)[1] if size else -1_000


def fractions(
    word: int, fraction: int | None, names: Sequence[str], sizes: Array
) -> tuple[int, ...]:
    """Return the fraction bits of signals; refuse those that leave too few before the point."""
    room = [word - 1 - whole_bits(float(size)) for size in sizes]
    if fraction is None:
        # What is always zero needs no digits: the step of the others will do.
        told = [bits for bits in room if bits < word + 900]
        return tuple(min(bits, max(told, default=word - 1)) for bits in room)
    if not isinstance(fraction, int) or isinstance(fraction, bool):
        raise InputError(
            f"{fraction!r} is no number of bits", where="fraction", remedy="give a whole number"
        )
    k = int(np.argmin(room))
    if fraction > room[k]:
        raise InputError(
            f"{fraction} of {word} bits behind the point overflow: {names[k]} comes to "
            f"{sizes[k]:.3g}",
            where="fraction",
            remedy=f"give at most {room[k]}{_longer(word + fraction - room[k])}",
        )
    return (fraction,) * len(room)


def _longer(word: int) -> str:
    return f", or a word of {word} bits" if word <= MOST_WORD else ""


def check_word(word: int) -> int:
    """Return a word's length in bits; refuse one that nothing runs."""
    if not LEAST_WORD <= check_count(word, "word") <= MOST_WORD:
        raise InputError(
            f"words of {word} bits", where="word", remedy=f"give {LEAST_WORD} to {MOST_WORD}"
        )
    return word


def rounded(
    system: LinearSystem, word: int, fraction: int | None, signals: LoopSignals, turned: Array
) -> tuple[LinearSystem, Arithmetic]:
    """Return sections with the coefficients that words of so many bits hold.

    Parameters
    ----------
    system : LinearSystem
        In sections.
    word : int
        Bits of a word.
    fraction : int or None
        Fraction bits of readings and command; None for as many as their sizes leave.
    signals : LoopSignals
        With the states before they were put in sections.
    turned : ndarray, shape (n, n)
        From those states to these.

    Raises
    ------
    InputError
        For words in which a signal or a coefficient overflows, with the length that works.
    """
    check_word(word)
    names = [*system.input_labels, system.output_labels[0], "theta_ref"]
    bits = fractions(word, fraction, names, signals.largest)
    sizes = _FREE * signals.largest_states(turned)
    readings, command = bits[: system.ninputs], bits[system.ninputs]
    states = tuple(
        # Of a state that nothing moves a step is at most one of the command.
        word - 1 - whole_bits(float(size)) if size else command + max(whole_bits(float(seen)), 0)
        for size, seen in zip(sizes, np.abs(system.C[0]), strict=True)
    )
    columns, rows = np.array([*states, *readings]), np.array([*states, command])
    n = system.nstates
    # What is added to a state in a sample: near z = 1 its coefficients keep more digits.
    real = np.block([[system.A - np.eye(n), system.B], [system.C, system.D]])
    words = np.ldexp(real, rows[:, None] - columns)
    shifts = [_shift(row, word) for row in words]
    short = LEAST_SHIFT - min(shifts, default=LEAST_SHIFT)
    if short > 0:
        raise InputError(
            f"a coefficient overflows words of {word} bits",
            where="word",
            remedy=f"give at least {word + short}",
        )
    whole = np.array([np.rint(np.ldexp(row, k)) for row, k in zip(words, shifts, strict=True)])
    kept = np.ldexp(whole, columns - rows[:, None] - np.array(shifts)[:, None])
    made = LinearSystem(
        np.eye(n) + kept[:n, :n], kept[:n, n:], kept[n:, :n], kept[n:, n:], system.dt,
        inputs=system.input_labels, outputs=system.output_labels, states=system.state_labels,
        name=system.name,
    )  # fmt: skip
    return made, Arithmetic("fixed", word, readings, states, command, bits[-1], tuple(shifts))


def _shift(row: Array, word: int) -> int:
    """Return the largest shift at which a row's sum of products cannot overflow two words."""
    limit = 2 ** (word - 1) - 1
    shift = word - 1 - whole_bits(float(np.abs(row).sum()))
    while np.abs(np.rint(np.ldexp(row, shift))).sum() > limit:
        shift -= 1
    return min(shift, 2 * word - 2)
