"""Margins of a single loop, and the change of the loop that reaches each of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from slewctl._show import Tabular
from slewctl.loop.single.disk import disk_gains, disk_phase_deg
from slewctl.loop.single.perturbation import Change, Perturbation

# What is proved to less than this, relative, is in doubt.
_PROVED = 1e-6


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
    note : str
        Why the margin is infinite or zero, in words.
    at_least : float or None
        What is proved: the margin is nowhere smaller, for the numbers as they were given.
        None where it follows from the ends of the axis.
    change : Change or None
        From which `perturbation` is made when it is asked for.
    enough : float
        An infinite value of which less is proved is in doubt.
    """

    value: float
    frequency_hz: float | None
    mode: str = ""
    note: str = ""
    at_least: float | None = None
    change: Change | None = field(default=None, repr=False, compare=False)
    enough: float = field(default=math.inf, repr=False, compare=False)

    @property
    def wide(self) -> bool:
        """Whether noticeably less is proved than was computed."""
        if self.at_least is None:
            return False
        if math.isinf(self.value):
            return self.at_least < self.enough
        return self.at_least < self.value * (1 - _PROVED)

    @property
    def proved(self) -> float:
        """The value, or where it is wide what is proved of it."""
        return self.value if self.at_least is None or not self.wide else self.at_least

    @cached_property
    def perturbation(self) -> Perturbation | None:
        """The smallest change of the loop that makes it unstable, and the pole it leads to."""
        return self.change.applied if self.change else None

    @property
    def on_axis(self) -> float | None:
        """How far from the stability limit that pole was recomputed, relative to its size."""
        return self.perturbation.distance if self.perturbation else None


_UNKNOWN = Crossing(math.nan, None)


def doubts_of(crossings: Mapping[str, Crossing]) -> tuple[str, ...]:
    """Return what noticeably less is proved of than was computed, in words."""
    return tuple(
        f"{name} is proved to be at least {crossing.at_least:.6g} only"
        for name, crossing in crossings.items()
        if crossing.wide
    )


@dataclass(frozen=True)
class AxisCrossing:
    """A frequency at which a change of gain alone, or of phase alone, puts a pole on the limit.

    Attributes
    ----------
    frequency_hz : float
        Infinite where L(∞) is real and negative.
    gain_db : float or None
        Where L is real and negative, the change of gain: positive a rise, negative a fall.
    phase_deg : float or None
        Where |L| = 1, the turn of L: negative a lag, positive a lead.

    Examples
    --------
    >>> import control as ct
    >>> import slewctl as sc
    >>> first, second = sc.margins(ct.tf([1], [1, 2, 1, 0])).crossings
    >>> round(first.phase_deg, 1), round(second.gain_db, 3)
    (-21.4, 6.021)
    """

    frequency_hz: float
    gain_db: float | None = None
    phase_deg: float | None = None


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
        at half the sampling frequency.  The delay of the continuous signal may be any part of
        a sample: `hybrid_delay_margin`, which is what the loop of an arm is told here.
    gain_crossings_hz : tuple of float
        All frequencies where |L| = 1.
    modulus : Crossing
        min |1 + L|: distance of the Nyquist curve from −1.
    disk : Crossing
        α of the disk margin with the skew σ = `skew` (Seiler, Packard and Gahinet, IEEE
        Control Systems Magazine 40(5), 2020): the loop stands any gain and phase, together,
        of the disk that `disk_gains` and `disk_phase_deg` describe.
    confirmed : bool
        Whether all of it is proved to 1e-6.
    skew : float
    doubts : tuple of str
        What is not, in words.
    intervals : int
        How many intervals of the axis prove it: in each of them, however small, a crossing
        was excluded or found.
    crossings : tuple of AxisCrossing
        All of |L| = 1, and of L real and negative that a gain between 1e-8 and 1e8 reaches
        (with dead time there are infinitely many: those that could bound a gain margin), by
        increasing frequency, each with the sign of its change.
    complementary : Crossing
        min |1 + L|/|L|, the reciprocal of the largest gain of T = L/(1 + L): the margin against
        relative errors of the plant, which is the disk of the skew −1.
    bandwidth_hz : float
        Where |S| = 1/|1 + L| first rises through 1/√2: below it feedback acts (S. Skogestad and
        I. Postlethwaite, "Multivariable Feedback Control", 2nd ed., section 2.4.5).  Zero where
        |S| is larger from the first frequency on, infinite where it never rises so far.
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
    intervals: int = 0
    crossings: tuple[AxisCrossing, ...] = ()
    complementary: Crossing = _UNKNOWN
    bandwidth_hz: float = math.nan

    @property
    def unproved(self) -> tuple[str, ...]:
        """Doubts beside those of a margin that is known less narrowly, which its bound settles."""
        if self.confirmed:
            return ()
        wide = sum(crossing.wide for crossing in self.each.values())
        return self.doubts[: len(self.doubts) - wide] if wide else (self.doubts or ("in doubt",))

    @property
    def each(self) -> dict[str, Crossing]:
        """All six margins by name."""
        names = ("gain_db", "gain_reduction_db", "phase_deg", "delay_s", "modulus", "disk")
        return {name: getattr(self, name) for name in names}

    def rows(self) -> list[dict[str, object]]:
        """Return one row for each margin: name, value, frequency, mode and note."""
        return [
            {
                "margin": name,
                "value": crossing.value,
                "frequency_hz": crossing.frequency_hz,
                "mode": crossing.mode,
                "note": crossing.note,
            }
            for name, crossing in self.each.items()
        ]

    @property
    def caption(self) -> str:
        """Whether the margins are in doubt."""
        return "" if self.confirmed else "NOT confirmed"

    @property
    def smaller_gain_db(self) -> Crossing:
        """The smaller of the gain's rise and fall; NaN counts as the smallest."""
        return min(
            (self.gain_db, self.gain_reduction_db),
            key=lambda m: -math.inf if math.isnan(m.value) else m.proved,
        )

    @property
    def disk_gains(self) -> tuple[float, float]:
        """Gain factors between which the disk lies: for σ = 0, (2 ∓ α)/(2 ± α)."""
        return disk_gains(self.disk.value, self.skew)

    @property
    def disk_phase_deg(self) -> float:
        """Turn in degrees that lies within the disk: for σ = 0, 2 arctan(α/2)."""
        return disk_phase_deg(self.disk.value, self.skew)
