"""Margins of a controller on a measured response, with what the measurement leaves open."""

from __future__ import annotations

from dataclasses import dataclass

from slewctl._show import Tabular

MARGINS = ("gain_db", "gain_reduction_db", "phase_deg", "delay_s", "modulus")


@dataclass(frozen=True)
class MeasuredMargin:
    """A margin and the interval in which it lies.

    Attributes
    ----------
    value : float
        At the points and, between them, where the curve through them leads; infinite where
        there is no crossing in the measured band.
    low, high : float
        With the disks around the points and the uncertainty between them; `high` is infinite
        where no crossing is certain.
    frequency_hz : float or None
    """

    value: float
    low: float
    high: float
    frequency_hz: float | None

    def __str__(self) -> str:
        at = "" if self.frequency_hz is None else f" at {self.frequency_hz:.4g} Hz"
        return f"{self.value:.4g} ({self.low:.4g} to {self.high:.4g}){at}"


@dataclass(frozen=True)
class MeasuredMargins(Tabular):
    """Margins of a loop whose plant was measured, not modelled; nothing of them is proved.

    Attributes
    ----------
    stable : bool or None
        By the count of encirclements of −1; None where the measurement does not decide it.
    encirclements : int or None
        Clockwise, of 1 + L around zero.
    unstable_poles : int
        Of the open loop, as assumed.
    gain_db, gain_reduction_db : MeasuredMargin
        How much the gain may rise, and fall.
    phase_deg : MeasuredMargin
    delay_s : MeasuredMargin
    modulus : MeasuredMargin
        Distance of L from −1.
    crossings_hz : tuple of float
        Where |L| = 1.
    assumptions : tuple of str
        What the count and the intervals stand on.
    doubts : tuple of str
        What the measurement does not decide.
    """

    stable: bool | None
    encirclements: int | None
    unstable_poles: int
    gain_db: MeasuredMargin
    gain_reduction_db: MeasuredMargin
    phase_deg: MeasuredMargin
    delay_s: MeasuredMargin
    modulus: MeasuredMargin
    crossings_hz: tuple[float, ...]
    assumptions: tuple[str, ...]
    doubts: tuple[str, ...]

    @property
    def caption(self) -> str:
        """Whether the loop is stable, and that it is a measurement that says so."""
        word = {True: "stable", False: "NOT stable", None: "stability not decided"}
        return f"measured: {word[self.stable]}"

    def rows(self) -> list[dict[str, object]]:
        """Return one row for each margin: its name, value, interval and frequency."""
        return [
            {
                "margin": name,
                "value": margin.value,
                "low": margin.low,
                "high": margin.high,
                "frequency_hz": margin.frequency_hz,
            }
            for name in MARGINS
            for margin in [getattr(self, name)]
        ]

    def __str__(self) -> str:
        lines = [self.caption]
        lines += [f"  {row['margin']} = {getattr(self, str(row['margin']))}" for row in self.rows()]
        lines += [f"  in doubt: {doubt}" for doubt in self.doubts]
        lines += [f"  assumed: {assumption}" for assumption in self.assumptions]
        return "\n".join(lines)
