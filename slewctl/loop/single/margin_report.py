"""Margins in words and with names, whichever way they were found."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.loop.single.margin_results import AxisCrossing, Crossing
from slewctl.loop.single.mode_names import Modes
from slewctl.loop.single.perturbation import Changed, Kind

_NO_GAIN = "L is nowhere real and negative where the gain would have to {}"
_SMALL = "|L| is below one at all frequencies"
_LARGE = "|L| is above one at all frequencies"
# Of infinite margins less is proved where |L| is too small to be seen, or one at L = 1 alone, as
# at the beginning of the axis.
_LARGE_DB, _HALF_TURN = 60.0, 179.9
_HIDDEN = "whether |L| passes one cannot be told from rounding"
_NO_SAMPLE = "|L| is not below one at half the sampling frequency: not one whole sample is stood"


@dataclass(frozen=True, eq=False)
class Report:
    """Makes a `Crossing` of each margin of a loop, with what is proved of it, and names them.

    Attributes
    ----------
    at : callable
        From ω in rad/s, shape (m,), to L.
    D : float
        L at infinite frequency, of a sampled loop its feedthrough.
    last : float
        L at infinite frequency, or at half the sampling frequency.
    step : float
        Sample time in s, zero if continuous.
    static : bool
        Whether L has no dynamics.
    modes : Modes
    changes : Changed or None
        From which perturbations are made; None where the changed loop has no state space.
    """

    at: Callable[[Array], ComplexArray]
    D: float
    last: float
    step: float
    static: bool
    modes: Modes
    changes: Changed | None

    def named(self, crossings: Mapping[str, Crossing]) -> dict[str, Crossing]:
        """Return crossings with the names of the modes they are at."""
        found = dict(crossings)
        at = {k: c.frequency_hz for k, c in found.items() if c.frequency_hz is not None}
        hertz = np.array(list(at.values()))
        if len(hertz):
            names = self.modes.largest(hertz, self.at(2 * np.pi * hertz))
            found |= {k: replace(found[k], mode=name) for k, name in zip(at, names, strict=True)}
        return found

    def _crossing(
        self,
        value: float,
        omega: float,
        at_least: float | None,
        kind: Kind | None = None,
        factor: complex = 1.0,
    ) -> Crossing:
        hertz = float(omega / (2 * np.pi)) if np.isfinite(omega) else None
        end = "every frequency" if self.static else "infinite frequency"
        note = "" if hertz is not None else f"reached at {end}"
        change = self.changes.by(kind, factor, omega) if self.changes and kind else None
        return Crossing(value, hertz, "", note, at_least, change)

    def nearest(
        self,
        kind: Kind,
        value: float,
        omega: float,
        skew: float,
        at_least: float | None = None,
    ) -> Crossing:
        """Return a modulus or disk margin."""
        return self._crossing(value, omega, at_least, kind, skew)

    def gain(
        self, limits: Sequence[tuple[float, float]], way: str, at_least: float | None = None
    ) -> Crossing:
        """Return the nearest factor above or below one, in decibels.

        Parameters
        ----------
        limits : sequence of (float, float)
            Factors at which a pole lies on the limit, and ω in rad/s.
        way : {"rise", "fall"}
        at_least : float, optional
            In dB.
        """
        rise = way == "rise"
        side = sorted(limit for limit in limits if (limit[0] >= 1) == rise)
        if not side:
            return Crossing(
                np.inf, None, note=_NO_GAIN.format(way), at_least=at_least, enough=_LARGE_DB
            )
        factor, omega = side[0] if rise else side[-1]
        # Where L(∞) is the critical value no pole reaches the axis: one becomes infinite.
        posed = np.isfinite(omega) and abs(1 + factor * self.D) > 1e-12
        value = abs(float(20 * np.log10(factor)))
        return self._crossing(value, omega, at_least, "gain" if posed else None, factor)

    def phase(
        self, turns: Array, omega: Array, above: bool, at_least: float | None = None
    ) -> Crossing:
        """Return the smallest turn, from turns in rad at the gain crossings ω."""
        if not len(turns):
            return _uncrossed(above, at_least, at_least)
        k = int(np.argmin(np.abs(turns)))
        size = float(np.degrees(abs(turns[k])))
        return self._turned("phase", size, float(omega[k]), float(turns[k]), at_least)

    def delay(
        self,
        turns: Array,
        omega: Array,
        above: bool,
        turn: float | None = None,
        at_least: float | None = None,
    ) -> Crossing:
        """Return the smallest delay, from turns in rad at the gain crossings ω; see `phase`.

        Parameters
        ----------
        turn : float, optional
            What is proved of the phase margin, in degrees.
        """
        late = self._at_the_end()
        if late is not None:
            return late
        if not len(turns):
            return _uncrossed(above, turn, at_least)
        seconds = np.mod(-turns, 2 * np.pi) / omega
        k = int(np.argmin(seconds))
        return self._turned("delay", float(seconds[k]), float(omega[k]), float(turns[k]), at_least)

    def _turned(
        self, kind: Kind, size: float, omega: float, turn: float, at_least: float | None
    ) -> Crossing:
        return self._crossing(size, omega, at_least, kind, complex(np.exp(1j * turn)))

    @staticmethod
    def all_crossings(
        limits: Sequence[tuple[float, float]], turns: Array, omega: Array
    ) -> tuple[AxisCrossing, ...]:
        """Return every gain limit and gain crossing, by increasing frequency."""
        found = [
            AxisCrossing(w / (2 * np.pi), gain_db=float(20 * np.log10(factor)))
            for factor, w in limits
        ]
        found += [
            AxisCrossing(w / (2 * np.pi), phase_deg=float(np.degrees(turn)))
            for turn, w in zip(turns.tolist(), omega.tolist(), strict=True)
        ]
        return tuple(sorted(found, key=lambda crossing: crossing.frequency_hz))

    def _at_the_end(self) -> Crossing | None:
        """Return the delay that acts through |L| ≥ 1 at the highest frequency, if there is one.

        With |D| ≥ 1 any delay at all leaves infinitely many unstable poles.  A sampled loop
        does not stand one sample: z^(−1) turns L(−1) into −L(−1), the half turn that takes
        1 + L to the other side of zero, a pole at z = −1 included.
        """
        if abs(self.last) < 1:
            return None
        if not self.step:
            return Crossing(0.0, None, note="|L| is not below one at infinite frequency")
        hertz = 0.5 / self.step
        return Crossing(0.0, hertz, note=_NO_SAMPLE)

    def all_pass(self) -> tuple[Crossing, Crossing]:
        """Return phase and delay margin of L = 1, the only stable loop with |L| = 1 throughout.

        Any other has N(s) = ±P(−s), and poles symmetric about the axis.
        """
        turned = Crossing(180.0, None, note="|L| is one at all frequencies")
        return turned, self._at_the_end() or Crossing(0.0, None)


def _uncrossed(above: bool, turn: float | None, at_least: float | None) -> Crossing:
    """Return a margin of a loop with no gain crossing, or with none that is seen.

    Parameters
    ----------
    above : bool
        Whether |L| is above one.
    turn : float or None
        Of L at a crossing that may be there, in degrees: it is no smaller.
    at_least : float or None
        What is proved of the margin.
    """
    if turn is None or turn >= _HALF_TURN:
        note = _LARGE if above else _SMALL
        return Crossing(np.inf, None, note=note, at_least=at_least, enough=-np.inf)
    return Crossing(np.inf, None, note=_HIDDEN, at_least=at_least)
