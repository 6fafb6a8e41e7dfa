"""Names of the modes that limit a margin: those with the largest share in L there.

L is the sum of what each mode of the plant contributes, and of the rest: the rigid body, lags
and feedthrough.  At a frequency the largest of these is what L is made of, wherever the mode
itself lies: a sampled loop shows one above half the sampling frequency at a lower one, and
modes that contribute nothing are near every frequency if only the arm has enough of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array, BoolArray, ComplexArray
from slewctl.loop.parts import Pair
from slewctl.numerics.frequency_response import FrequencyResponse, sample_time
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.modal_form import modal_form
from slewctl.numerics.modes import Eigensystem, at_origin
from slewctl.numerics.pairing import paired

# A pole that is damped less than this rings, and is called a mode.
_RINGS = 0.3


def mode_name(number: int, hertz: float, step: float = 0.0) -> str:
    """Return the name of a mode, and with a sample time in s where the samples show it."""
    seen = abs(hertz - round(hertz * step) / step) if step else hertz
    alias = f", seen at {seen:.4g} Hz" if abs(seen - hertz) > 1e-9 * hertz else ""
    return f"mode {number} ({hertz:.4g} Hz{alias})"


@dataclass(frozen=True, eq=False)
class Modes:
    """The modes of a plant, by which the frequencies of its loop are named.

    Attributes
    ----------
    names : tuple of str
    rest : str
        What everything else is called: the rigid body, or nothing.
    parts : callable
        From ω in rad/s, shape (m,), to what each mode contributes to L there, shape
        (m, modes, outputs, inputs).
    """

    names: tuple[str, ...]
    rest: str
    parts: Callable[[Array], ComplexArray]

    def largest(self, hertz: Array, values: ComplexArray) -> list[str]:
        """Return the names of what has the largest share in L at some frequencies.

        Parameters
        ----------
        hertz : ndarray, shape (m,)
        values : ndarray, shape (m,) or (m, outputs, inputs)
            L there.
        """
        with np.errstate(all="ignore"):  # a pole on the axis: its part is infinite
            parts = self.parts(2 * np.pi * hertz)
            rest = np.reshape(values, (len(hertz), *parts.shape[2:])) - parts.sum(axis=1)
            shares = np.linalg.norm(np.concatenate([rest[:, None], parts], axis=1), axis=(2, 3))
        names = (self.rest, *self.names)
        return [names[k] for k in np.nan_to_num(shares, nan=0.0).argmax(axis=1).tolist()]


def modes_of_loop(loop: LinearSystem) -> Modes:
    """Return the modes of a return ratio: its lightly damped poles."""
    ringing, step = _ringing(loop), sample_time(loop)
    names = tuple(mode_name(k + 1, hertz) for k, hertz in enumerate(ringing.hertz))

    return Modes(names, "rigid body" if ringing.rigid else "", _LoopParts(ringing, step))


def modes_of_pair(
    pair: Pair, delay: float = 0.0, hertz: Sequence[float] | Array | None = None
) -> Modes:
    """Return the modes of a plant in the loop that is broken at its input.

    Parameters
    ----------
    pair : Pair
        Of one clock, or a continuous plant and a sampled controller.
    delay : float
        In s, of a sampled controller.
    hertz : sequence of float, optional
        Natural frequencies of the plant's modes in Hz, increasing, where it is an arm with a
        rigid body; otherwise its lightly damped poles are counted.
    """
    ringing = _ringing(pair.plant)
    own, step = pair.clocks
    if hertz is None:
        known = list(enumerate(ringing.hertz, 1))
    else:
        apart = np.abs(np.log(np.array(ringing.hertz)[:, None] / np.asarray(hertz)))
        kept, numbers = paired(apart)
        ringing = ringing.only(kept.tolist())
        known = [(k + 1, float(hertz[k])) for k in numbers.tolist()]
    names = tuple(mode_name(number, f, step) for number, f in known)
    held = (step, delay) if step and not own else None
    parts = _PairParts(
        ringing, own or step, held, FrequencyResponse(pair.negative), pair.controller.noutputs
    )
    rigid = hertz is not None or ringing.rigid
    return Modes(names, "rigid body" if rigid else "", parts)


def _held(omega: Array, step: float, delay: float) -> Callable[[ComplexArray], ComplexArray]:
    """Return what 1/(s − p) becomes behind a hold and a delay, as sampled at e^(jωT)."""
    z = np.exp(1j * omega[:, None] * step)
    whole, late = divmod(delay, step)

    def sampled(pole: ComplexArray) -> ComplexArray:
        fresh, all_of_it = np.expm1(pole * (step - late)), np.expm1(pole * step)
        held = (fresh + (all_of_it - fresh) / z) / pole
        return np.asarray(held * z**-whole / (z - np.exp(pole * step)))

    return sampled


@dataclass(frozen=True, eq=False)
class _Ringing:
    """Lightly damped poles, one of each pair, in s or z, their natural frequencies and residues."""

    poles: ComplexArray
    residues: ComplexArray
    hertz: tuple[float, ...]
    rigid: bool

    def only(self, kept: list[int]) -> _Ringing:
        hertz = tuple(self.hertz[k] for k in kept)
        return _Ringing(self.poles[kept], self.residues[kept], hertz, self.rigid)

    def sum_of_pairs(self, factor: Callable[[ComplexArray], ComplexArray]) -> ComplexArray:
        """Return residue times factor of each pole and its conjugate.

        Factors are of shape (m, modes), what is returned of (m, modes, outputs, inputs).
        """
        one, other = (factor(p)[..., None, None] for p in (self.poles, self.poles.conj()))
        # A negative z has no partner: it rings at half the sampling frequency.
        paired = (self.poles.imag != 0)[:, None, None]
        return np.asarray(self.residues * one + paired * self.residues.conj() * other)


@dataclass(frozen=True, eq=False)
class _LoopParts:
    """What each mode of a loop on one clock contributes to it."""

    ringing: _Ringing
    step: float

    def __call__(self, omega: Array) -> ComplexArray:
        point = (np.exp(1j * omega * self.step) if self.step else 1j * omega)[:, None]
        return self.ringing.sum_of_pairs(lambda pole: 1 / (point - pole))


@dataclass(frozen=True, eq=False)
class _PairParts:
    """What each mode of a plant contributes to its loop; `held` is its clock and dead time."""

    ringing: _Ringing
    step: float
    held: tuple[float, float] | None
    controller: FrequencyResponse
    controller_outputs: int

    def __call__(self, omega: Array) -> ComplexArray:
        shape = (len(omega), 1, self.controller_outputs, -1)
        K = self.controller(omega).reshape(shape)
        if self.held is None:
            return np.asarray(K @ _LoopParts(self.ringing, self.step)(omega))
        return np.asarray(K @ self.ringing.sum_of_pairs(_held(omega, *self.held)))


def _ringing(system: LinearSystem) -> _Ringing:
    step = sample_time(system)
    poles, residues, alone = _single_poles(system)
    s = poles
    if step:
        delays = np.abs(s) < 1e-12  # z = 0
        s = np.asarray(np.log(np.where(delays, 1e-12, s)) / step, dtype=complex)
    size = np.abs(s)
    origin = at_origin(s, float(size[np.isfinite(size)].max(initial=0.0)))
    rings = np.flatnonzero(~origin & alone & (s.imag > 0) & (np.abs(s.real) < _RINGS * size))
    rings = rings[np.argsort(size[rings])]
    hertz = tuple(float(f) for f in size[rings] / (2 * np.pi))
    return _Ringing(poles[rings], residues[rings], hertz, bool(origin.any()))


def _single_poles(system: LinearSystem) -> tuple[ComplexArray, ComplexArray, BoolArray]:
    """Return poles in s or z, their residues, shape (n, p, m), and which have some of their own."""
    if system.ninputs != 1:
        found = Eigensystem.of(np.asarray(system.A, dtype=float))
        everything = np.arange(len(found.poles))
        residues = found.residues(system.B, system.C, everything)
        return found.poles, residues, np.ones(len(found.poles), dtype=bool)
    form = modal_form(system)  # the margins have it already
    poles = form.poles + 1 if form.sample_time else form.poles
    return poles, (form.shape * form.entry).T[:, :, None], form.alone
