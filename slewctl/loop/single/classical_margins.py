"""Margins of a stable single loop, continuous or sampled, none of them from a grid.

With light damping a resonance is narrower than any frequency grid.  The frequencies where
|L| = 1 or L is real are therefore eigenvalues (`crossings`), the smallest distance to −1 is
enclosed by level sets (`disk`), every margin comes with the change of the loop that reaches
it (`perturbation`), and the poles of changed loops are asked whether they agree (`confirm`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from slewctl._show import Tabular
from slewctl._types import Array
from slewctl.errors import InputError, check_number
from slewctl.loop.parts import System, state_space
from slewctl.loop.single import perturbation
from slewctl.loop.single.confirm import Limit, gain_doubts, phase_doubts
from slewctl.loop.single.crossings import (
    Crossings,
    Samples,
    crossings,
    log_gain,
    sampled,
    sine,
    truly_real,
)
from slewctl.loop.single.disk import disk_gains, disk_phase_deg, nearest
from slewctl.loop.single.mode_names import Modes, modes_of_loop
from slewctl.loop.single.perturbation import Perturbation
from slewctl.loop.single.return_ratio import BrokenLoop
from slewctl.numerics.linear_system import LinearSystem

# |L| is one at all frequencies when it differs by no more than this and its rounding.
_ALL_PASS = 1e-10
# L is known where it is this much larger than its rounding error.
_KNOWN = 0.1
_NO_GAIN = "L is nowhere real and negative where the gain would have to {}"
_SMALL = "|L| is below one at all frequencies"
_LARGE = "|L| is above one at all frequencies"
_NO_SAMPLE = "|L| is not below one at half the sampling frequency: not one whole sample is stood"


@dataclass(frozen=True)
class Crossing:
    """A margin and the frequency at which it is reached.

    Attributes
    ----------
    value : float
        Infinite where the loop has no such crossing.
    frequency_hz : float or None
        None where there is no crossing, or it lies at infinite frequency.
    mode : str
        What has the largest share in L there: "mode 3 (12.4 Hz)", "rigid body", or empty where
        it is no mode.
    perturbation : Perturbation or None
        The smallest change of the loop that makes it unstable, and the pole it leads to.
    on_axis : float or None
        How far from the stability limit the pole of the changed loop was recomputed,
        relative to its size.
    note : str
        Why the margin is infinite or zero, in words.
    """

    value: float
    frequency_hz: float | None
    mode: str = ""
    perturbation: Perturbation | None = field(default=None, repr=False, compare=False)
    on_axis: float | None = None
    note: str = ""


@dataclass(frozen=True)
class Margins(Tabular):
    """Margins of a stable loop under negative feedback.

    Attributes
    ----------
    gain_db : Crossing
        How much the loop gain may rise.
    gain_reduction_db : Crossing
        How much it may fall, as a positive number; infinite when down to zero.
    phase_deg : Crossing
        Smallest phase change, of either sign, that reaches the stability limit.
    delay_s : Crossing
        Smallest added delay that reaches it, as a turn of L by e^(−jωτ).  A sampled loop is
        delayed by whole samples alone, z^(−k) between controller and hold: it is stable with
        every k whose kT is less.  Zero where one sample is already too many because |L| ≥ 1
        at half the sampling frequency.  For the delay of the continuous signal, which may be
        any part of a sample, ask `hybrid_delay_margin`.
    gain_crossings_hz : tuple of float
        All frequencies where |L| = 1.
    modulus : Crossing
        min |1 + L|: distance of the Nyquist curve from −1.
    disk : Crossing
        α of the disk margin with the skew σ = `skew` (Seiler, Packard and Gahinet, IEEE
        Control Systems Magazine 40(5), 2020): the loop stands any gain and phase, together,
        of the disk that `disk_gains` and `disk_phase_deg` describe.
    confirmed : bool
        Whether the poles of closed loops with changed gain and phase agree throughout.
    skew : float
    doubts : tuple of str
        What they do not agree with, in words.
    """

    gain_db: Crossing
    gain_reduction_db: Crossing
    phase_deg: Crossing
    delay_s: Crossing
    gain_crossings_hz: tuple[float, ...]
    modulus: Crossing
    disk: Crossing
    confirmed: bool
    skew: float = 0.0
    doubts: tuple[str, ...] = ()

    def rows(self) -> list[dict[str, object]]:
        """Return one row for each margin: name, value, frequency, mode and note."""
        names = ("gain_db", "gain_reduction_db", "phase_deg", "delay_s", "modulus", "disk")
        return [
            {
                "margin": name,
                "value": crossing.value,
                "frequency_hz": crossing.frequency_hz,
                "mode": crossing.mode,
                "note": crossing.note,
            }
            for name in names
            for crossing in [getattr(self, name)]
        ]

    @property
    def caption(self) -> str:
        """Whether closed-loop poles doubt the margins."""
        return "" if self.confirmed else "NOT confirmed"

    @property
    def smaller_gain_db(self) -> Crossing:
        """The smaller of the gain's rise and fall; NaN counts as the smallest."""
        return min(
            (self.gain_db, self.gain_reduction_db),
            key=lambda m: -math.inf if math.isnan(m.value) else m.value,
        )

    @property
    def disk_gains(self) -> tuple[float, float]:
        """Gain factors between which the disk lies: for σ = 0, (2 ∓ α)/(2 ± α)."""
        return disk_gains(self.disk.value, self.skew)

    @property
    def disk_phase_deg(self) -> float:
        """Turn in degrees that lies within the disk: for σ = 0, 2 arctan(α/2)."""
        return disk_phase_deg(self.disk.value, self.skew)


def classical_margins(loop: System, *, skew: float = 0.0, modes: Modes | None = None) -> Margins:
    """Return the margins of a loop that is stable when closed.

    Gain and phase margins are exact to rounding, typically 1e-9 relative, and modulus and
    disk margins within `PEAK_TOLERANCE`.  What only touches a limit, within about 1e-10, is
    undecidable in double precision and may count as a crossing or not.

    Parameters
    ----------
    loop : control.StateSpace or control.TransferFunction
        Return ratio L, one input and output, continuous or sampled, closed as 1 + L = 0.
        The caller decides stability first: an unstable loop has no margin.
    skew : float
        σ of the disk: 0 is balanced, positive where the gain may rise more than fall.
    modes : Modes, optional
        By which the frequencies are named; otherwise the lightly damped poles of L.

    Returns
    -------
    Margins

    Raises
    ------
    InputError
        If the loop has several inputs or outputs, an unknown sample time, an entry that is
        not finite, or feedthrough −1, for which 1 + L has no inverse.
    """
    light = state_space(loop, "margins")
    check_single(light)
    check_number(skew, "skew")
    broken = BrokenLoop(light)
    if abs(1 + broken.D) <= 4 * np.finfo(float).eps:
        raise InputError(
            "the feedthrough of L is -1, so that 1 + L has no inverse",
            where="margins",
            remedy="the loop is not well posed: change its direct feedthrough",
        )
    samples = sampled(broken)
    gain = crossings(broken, samples, log_gain)
    limits = _gain_limits(broken, truly_real(broken, crossings(broken, samples, sine)))
    report = _Report(broken, modes or modes_of_loop(light))
    modulus, disk = nearest(broken, samples, 1.0), nearest(broken, samples, skew)
    turns = -np.angle(-broken.response(gain.omega))
    doubts = gain_doubts(broken, limits)
    if _all_pass(samples):
        phase, delay = report.all_pass()
    else:
        doubts += phase_doubts(broken, turns, gain.omega, gain.rising)
        phase, delay = report.phase(samples, turns, gain), report.delay(turns, gain)
    return Margins(
        report.gain(limits, "rise"),
        report.gain(limits, "fall"),
        phase,
        delay,
        tuple(float(w) / (2 * np.pi) for w in gain.omega),
        report.crossing(
            1 / modulus.value, modulus.omega, perturbation.added(broken, modulus.omega)
        ),
        report.crossing(
            1 / disk.value if disk.value else np.inf,
            disk.omega,
            perturbation.filtered(broken, skew, disk.omega),
        ),
        not doubts,
        float(skew),
        tuple(doubts),
    )


def check_single(loop: LinearSystem) -> None:
    """Refuse what is not one loop of finite numbers with a known sample time."""
    if loop.ninputs != 1 or loop.noutputs != 1:
        raise InputError(
            "the loop has several inputs or outputs",
            where="margins",
            remedy="give one loop as a control.StateSpace, broken at one point",
        )


def _all_pass(samples: Samples) -> bool:
    size = np.abs(samples.values)
    clear = np.isfinite(samples.rounding)
    return bool(np.all(np.abs(size - 1)[clear] <= _ALL_PASS + 10 * samples.rounding[clear]))


def _gain_limits(loop: BrokenLoop, real: Crossings) -> list[Limit]:
    """Return all gain factors at which a pole lies on the limit, increasing."""
    if not len(loop.A):
        return [Limit(-1 / loop.D, np.inf)] if loop.D < 0 else []
    omega = np.concatenate([[0.0], real.omega, [loop.response.nyquist] if loop.step else []])
    values, doubtful = loop.response(omega), loop.response.uncertainty(omega)
    found = []
    for w, value, rounding in zip(omega.tolist(), values.tolist(), doubtful, strict=True):
        # A double integrator in rounded coordinates has a finite, meaningless L(0).
        if w and not rounding < _KNOWN * abs(value):
            value, rounding = loop.solved(w)
        if rounding < _KNOWN * abs(value) < np.inf and value.real < 0:
            found.append(Limit(-1 / value.real, w))
    if not loop.step and loop.D < 0:
        found.append(Limit(-1 / loop.D, np.inf))
    return sorted(found, key=lambda limit: limit.value)


@dataclass(frozen=True, eq=False)
class _Report:
    """Makes a `Crossing` of each margin of a loop: named, with its perturbation applied."""

    loop: BrokenLoop
    modes: Modes

    def _name(self, hertz: float | None) -> str:
        if hertz is None:
            return ""
        return self.modes.largest(hertz, self.loop.response(np.array([2 * np.pi * hertz])))

    def crossing(self, value: float, omega: float, change: Perturbation | None) -> Crossing:
        hertz = float(omega / (2 * np.pi)) if np.isfinite(omega) else None
        name = self._name(hertz)
        end = "infinite frequency" if len(self.loop.A) else "every frequency"
        note = "" if hertz is not None else f"reached at {end}"
        return Crossing(value, hertz, name, change, change.distance if change else None, note)

    def gain(self, limits: list[Limit], way: str) -> Crossing:
        """Return the nearest factor above or below one, in decibels."""
        sides = {
            "rise": [limit for limit in limits if limit.value >= 1],
            "fall": [limit for limit in reversed(limits) if limit.value < 1],
        }[way]
        if not sides:
            return Crossing(np.inf, None, note=_NO_GAIN.format(way))
        factor, omega = sides[0].value, sides[0].omega
        # Where L(∞) is the critical value no pole reaches the axis: one becomes infinite.
        posed = np.isfinite(omega) and abs(1 + factor * self.loop.D) > 1e-12
        change = perturbation.gain(self.loop, factor, omega) if posed else None
        return self.crossing(abs(float(20 * np.log10(factor))), omega, change)

    def phase(self, samples: Samples, turns: Array, gain: Crossings) -> Crossing:
        if not len(turns):
            above = bool(np.median(log_gain(samples.values)) > 0)
            return Crossing(np.inf, None, note=_LARGE if above else _SMALL)
        k = int(np.argmin(np.abs(turns)))
        return self._turned("phase", abs(float(turns[k])), float(gain.omega[k]), float(turns[k]))

    def delay(self, turns: Array, gain: Crossings) -> Crossing:
        late = self._at_the_end()
        if late is not None:
            return late
        if not len(turns):
            return Crossing(np.inf, None, note=_SMALL)
        seconds = np.mod(-turns, 2 * np.pi) / gain.omega
        k = int(np.argmin(seconds))
        return self._turned("delay", float(seconds[k]), float(gain.omega[k]), float(turns[k]))

    def _turned(self, kind: perturbation.Kind, size: float, omega: float, turn: float) -> Crossing:
        change = perturbation.turned(self.loop, kind, complex(np.exp(1j * turn)), omega)
        return self.crossing(float(np.degrees(size)) if kind == "phase" else size, omega, change)

    def _at_the_end(self) -> Crossing | None:
        """Return the delay that acts through |L| ≥ 1 at the highest frequency, if there is one.

        With |D| ≥ 1 any delay at all leaves infinitely many unstable poles.  A sampled loop
        does not stand one sample: z^(−1) turns L(−1) into −L(−1), the half turn that takes
        1 + L to the other side of zero, a pole at z = −1 included.
        """
        if abs(self.loop.last) < 1:
            return None
        if not self.loop.step:
            return Crossing(0.0, None, note="|L| is not below one at infinite frequency")
        hertz = 0.5 / self.loop.step
        return Crossing(0.0, hertz, self._name(hertz), note=_NO_SAMPLE)

    def all_pass(self) -> tuple[Crossing, Crossing]:
        """Return phase and delay margin of L = 1, the only stable loop with |L| = 1 throughout.

        Any other has N(s) = ±P(−s), and poles symmetric about the axis.
        """
        turned = Crossing(180.0, None, note="|L| is one at all frequencies")
        return turned, self._at_the_end() or Crossing(0.0, None)
