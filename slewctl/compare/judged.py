"""A judgement as a person reads it: followed over finer truths, printed, drawn."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from slewctl._show import Axes, Tabular
from slewctl.compare.clock_loss import sampling_loss
from slewctl.compare.convergence import Followed, follow
from slewctl.compare.judgement import Judgement
from slewctl.compare.quantities import QUANTITIES, Reading, quantities_of
from slewctl.compare.reading import read
from slewctl.design import Controller

if TYPE_CHECKING:
    import control

# What is printed of a judgement; all quantities are in its `rows`.
HEADLINES = (
    "gain_margin_db",
    "phase_margin_deg",
    "delay_margin_s",
    "disk_margin",
    "h2_loss",
    "settling_time",
    "torque_peak",
)


@dataclass(frozen=True, eq=False)
class Judged(Tabular, Judgement):
    """What a controller achieves on the truth, and what is left of it on finer truths."""

    def followed(self, name: str) -> Followed:
        """Return a quantity on truths of more and more modes, until it stands still.

        Parameters
        ----------
        name : str
            Key of `slewctl.compare.QUANTITIES`.
        """
        return follow(self, name)

    @property
    def return_ratio(self) -> control.StateSpace:
        """L, the loop broken at the actuator, for python-control's own plots."""
        return self.loop.return_ratio

    def rows(self) -> list[dict[str, object]]:
        """Return every quantity on the truth: name, value, unit, frequency, mode and note."""
        return [_row(q.name, read(self, q.name)) for q in quantities_of(self.slew)]

    @property
    def caption(self) -> str:
        """Controller and truth."""
        arm = self.loop.model.arm.name
        return f"{repr(self.controller)[1:-1]}, on the truth of {arm}"

    def __str__(self) -> str:
        stability = self.followed("stable")
        if not self.stable:
            lost = f"{self.loop.loud_fault} on {self.modes} modes: no margin, cost or slew"
            loss = sampling_loss(self)
            return "\n".join([self.caption, lost, *([str(loss)] if loss else [])])
        modes = ", ".join(str(seen.modes) for seen in stability.seen)
        entries = [("stable", f"on {modes} modes" if stability.reading.value else str(stability))]
        entries += [(name, _text(self.followed(name))) for name in HEADLINES]
        loss = sampling_loss(self)
        entries += [("sampling", str(loss))] if loss else []
        entries.append(("design", _design(self.controller)))
        return "\n".join([self.caption, *(f"{name:<18}{text}" for name, text in entries)])

    def __repr__(self) -> str:
        return f"<{self.caption}: {self.loop.describe()}>"

    def plot(self, kind: str = "bode", ax: Axes | None = None) -> Axes:
        """Draw the loop on the truth; see `slewctl.loop.Loop.plot`."""
        return self.loop.plot(kind, ax)


def _row(name: str, reading: Reading) -> dict[str, object]:
    value: object = None if math.isnan(reading.value) else reading.value
    return {
        "quantity": name,
        "value": bool(value) if name == "stable" else value,
        "unit": QUANTITIES[name].unit,
        "frequency (Hz)": reading.frequency_hz,
        "mode": reading.mode,
        "note": reading.doubt or reading.note,
    }


def _design(controller: Controller) -> str:
    """Return whether the checks of a design passed."""
    checks = controller.certificate.checks
    if not checks:
        return "given, without a certificate"
    if controller.certificate.verified:
        return f"verified by {len(checks)} independent checks"
    return str(controller.certificate)


def _text(found: Followed) -> str:
    """Return a quantity with its unit, where it is reached, and how it settled."""
    quantity, reading = found.quantity, found.reading
    if math.isnan(reading.value):
        return f"none: {reading.note}"
    unit = f" {quantity.unit}" if quantity.unit else ""
    hertz = reading.frequency_hz
    at = "" if hertz is None else f" at {hertz:.4g} Hz"
    mode = f" ({reading.mode})" if reading.mode else ""
    note = f", {reading.note}" if math.isinf(reading.value) else ""
    doubt = f"; NOT confirmed: {reading.doubt}" if reading.doubt else ""
    doubt += "" if found.converged else f"; not converged: {found}"
    return f"{reading.value:.4g}{unit}{at}{mode}{note}{doubt}"
