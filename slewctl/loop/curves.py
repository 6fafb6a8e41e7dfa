"""Curves of a loop, smooth at every resonance, and how they are drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from slewctl._show import axes_or_new
from slewctl._types import Array, ComplexArray
from slewctl.errors import InputError, check_choice
from slewctl.loop.single.margin_results import Margins
from slewctl.model import Model

# A lightly damped zero is this much narrower than the distance of the first points.
_HALVINGS = 12


class Seen(Protocol):
    """What is drawn of a loop; `Loop` is one."""

    @property
    def model(self) -> Model: ...
    @property
    def stable(self) -> bool: ...
    @property
    def poles(self) -> ComplexArray: ...
    @property
    def open_poles(self) -> ComplexArray: ...
    @property
    def nyquist_rad_s(self) -> float: ...
    @property
    def margins(self) -> Margins: ...
    def response(self, omega: Array) -> ComplexArray: ...
    def describe(self) -> str: ...


@dataclass(frozen=True, eq=False)
class Curve:
    """L at frequencies between which a straight line may be drawn.

    Attributes
    ----------
    omega : ndarray
        rad/s, increasing.
    values : ndarray of complex
    """

    omega: Array
    values: ComplexArray

    @property
    def frequency_hz(self) -> Array:
        """Frequencies in Hz."""
        return self.omega / (2 * np.pi)

    @property
    def gain_db(self) -> Array:
        """|L| in dB."""
        return np.asarray(20 * np.log10(np.abs(self.values)))

    @property
    def phase_deg(self) -> Array:
        """The phase in degrees, continuous, from between −315° and 45° on.

        A loop begins near a multiple of 90°: the ends are halfway between two of them, so that
        loops that are equal but for rounding begin on the same turn.
        """
        phase = np.degrees(np.unwrap(np.angle(self.values)))
        return np.asarray(phase - 360 * np.ceil((phase[0] - 45) / 360))


def nichols_line(phase_deg: Array, gain_db: Array) -> tuple[Array, Array]:
    """Return phases between −360° and 0° and gains, without a line from one edge to the other."""
    turns = np.floor(phase_deg / 360)
    gain = gain_db.copy()
    gain[1:][np.diff(turns) != 0] = np.nan
    return phase_deg - 360 * turns - 360, gain


def curve(loop: Seen, points: int = 400, step: float = 0.15) -> Curve:
    """Return the return ratio of a loop from a tenth of its slowest pole to its last mode.

    Parameters
    ----------
    loop : Loop
    points : int
        Frequencies before resonances and bends are added.
    step : float
        What log L may change by, in nepers and radians together, along a straight line.
    """
    omega = _frequencies(loop, points)
    values = loop.response(omega)
    for _ in range(_HALVINGS):
        with np.errstate(divide="ignore", invalid="ignore"):
            change = np.abs(np.log(values[1:] / values[:-1]))
        coarse = change > step
        if not coarse.any():
            break
        middle = np.sqrt(omega[1:] * omega[:-1])[coarse]
        places = np.flatnonzero(coarse) + 1
        omega = np.insert(omega, places, middle)
        values = np.insert(values, places, loop.response(middle))
    # On a pole or a zero of the axis itself there is nothing to draw, nor between two
    # frequencies that are one but for rounding.
    drawn = np.isfinite(values) & (values != 0)
    drawn[1:] &= np.diff(np.log(omega)) > 0
    return Curve(omega[drawn], values[drawn])


def _frequencies(loop: Seen, points: int) -> Array:
    """Return frequencies in rad/s, dense at every pole of the loop, with those of its margins."""
    poles = loop.open_poles
    poles = poles[poles.imag > 0]
    slow = np.abs(loop.poles)[np.abs(loop.poles) > 0].min()
    margins = _margin_frequencies(loop)
    fast = min(1.3 * max([loop.model.omega[-1], *margins]), loop.nyquist_rad_s)
    grid = np.geomspace(min([slow, *margins]) / 10, fast, points)
    widths = np.abs(poles.real)[:, None] * np.array([0, 0.5, 1, 2, 4, 8, 16])
    around = np.concatenate([poles.imag[:, None] + widths, poles.imag[:, None] - widths])
    around = np.concatenate([around.ravel(), margins])
    around = around[(around > grid[0]) & (around < fast)]
    return np.unique(np.concatenate([grid, around]))


def _margin_frequencies(loop: Seen) -> list[float]:
    """Return where a stable loop's margins are reached, which no curve of it may leave out."""
    if not loop.stable:
        return []
    reached = (crossing.frequency_hz for crossing in loop.margins.each.values())
    return [2 * np.pi * hertz for hertz in reached if hertz and np.isfinite(hertz)]


def draw(loop: Seen, kind: str, ax: Any) -> Any:
    """Draw a loop; see `Loop.plot`."""
    return _KINDS[check_choice(kind, tuple(_KINDS), "kind")](loop, ax)


def _bode(loop: Seen, ax: Any) -> Any:
    ax = axes_or_new(ax, 2)
    try:
        gain, phase = ax
    except (TypeError, ValueError) as error:
        raise InputError(
            "a Bode plot is drawn on two axes", where="ax", remedy="give a pair, as of subplots(2)"
        ) from error
    found = curve(loop)
    gain.semilogx(found.frequency_hz, found.gain_db, lw=1.1)
    gain.axhline(0, color="0.4", lw=0.8)
    gain.set_ylabel("|L| (dB)")
    phase.semilogx(found.frequency_hz, found.phase_deg, lw=1.1)
    phase.axhline(-180, color="0.4", lw=0.8)
    phase.set_ylabel("arg L (deg)")
    phase.set_xlabel("frequency (Hz)")
    if loop.stable:
        margins = loop.margins
        for axes, crossing in ((gain, margins.smaller_gain_db), (phase, margins.phase_deg)):
            if crossing.frequency_hz:
                axes.axvline(crossing.frequency_hz, color="C3", lw=0.8, ls="--")
        gain.set_title(loop.describe(), fontsize="small")
    return ax


def _nyquist(loop: Seen, ax: Any) -> Any:
    ax, found = axes_or_new(ax), curve(loop)
    # Seen from far: what matters is near −1, and a rigid body goes to infinity.
    near = np.abs(found.values) < 1e3
    for values in (found.values[near], found.values[near].conj()):
        ax.plot(values.real, values.imag, lw=1.1, color="C0")
    ax.plot([-1], [0], "+", color="C3", markersize=12)
    if loop.stable and np.isfinite(size := loop.margins.modulus.value):
        turn = np.linspace(0, 2 * np.pi, 200)
        ax.plot(-1 + size * np.cos(turn), size * np.sin(turn), lw=0.8, color="C3")
    ax.set_xlim(-3, 2)
    ax.set_ylim(-2.5, 2.5)
    ax.set_aspect("equal")
    ax.set_xlabel("Re L")
    ax.set_ylabel("Im L")
    return ax


def _nichols(loop: Seen, ax: Any) -> Any:
    ax, found = axes_or_new(ax), curve(loop)
    ax.plot(*nichols_line(found.phase_deg, found.gain_db), lw=1.1)
    ax.plot([-180], [0], "+", color="C3", markersize=12)
    ax.set_xlim(-360, 0)
    ax.set_xticks(range(-360, 1, 45))
    ax.set_ylim(-40, 40)
    ax.set_xlabel("arg L (deg)")
    ax.set_ylabel("|L| (dB)")
    return ax


def _poles(loop: Seen, ax: Any) -> Any:
    ax = axes_or_new(ax)
    for poles, marker, label in (
        (loop.open_poles, "o", "open loop"),
        (loop.poles, "x", "closed loop"),
    ):
        ax.plot(poles.real, poles.imag / (2 * np.pi), marker, mfc="none", label=label)
    ax.axvline(0, color="0.4", lw=0.8)
    ax.set_xlabel("growth (1/s)")
    ax.set_ylabel("frequency (Hz)")
    ax.legend()
    return ax


_KINDS: dict[str, Callable[[Seen, Any], Any]] = {
    "bode": _bode,
    "nyquist": _nyquist,
    "nichols": _nichols,
    "poles": _poles,
}
