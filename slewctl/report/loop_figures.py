"""The figures of a loop: Bode, Nichols, Nyquist and sensitivity, with the margins drawn."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.compare import CaseResult, LoopCurves
from slewctl.report.page import number
from slewctl.report.plot import HEIGHT, WIDTH, Panel, Plot, refined, stacked
from slewctl.report.scale import Axis, around

# Lower gains are of no use to see, in dB.
_LOWEST_DB = -100.0
# Of so many designs, as many as a figure shows, what is drawn is kept for the next figure.
_KEPT = 8
# Numbers of modes need this much room in units, or some are left out.
_ROOM = 19.0


def own_last(result: CaseResult) -> list[tuple[int, LoopCurves]]:
    """Return the drawn designs with their places, the case's own last: above the others."""
    return sorted(enumerate(result.curves), key=lambda each: _own(result, each[0]))


def look(result: CaseResult, place: int) -> str:
    """Return the classes of a design's curves."""
    return f"o{place} own" if _own(result, place) else f"o{place}"


def _own(result: CaseResult, place: int) -> bool:
    return result.curves[place].origin == result.chosen.origin


def bode_figure(result: CaseResult) -> Plot:
    """Return gain and phase of the return ratio, with the margins and the modes."""
    frequency = _frequency(result)
    gains = np.concatenate([c.gain_db for c in result.curves])
    phases = np.concatenate([c.phase_deg for c in result.curves])
    low, high = around(np.maximum(gains, _LOWEST_DB))
    gain, phase = stacked(
        frequency,
        [
            (Axis("|L| (dB)", low, high), 200, "gain"),
            (Axis("arg L (deg)", *around(phases), step=90), 160, "phase"),
        ],
        "frequency",
    )
    gain.across(0, "k")
    phase.across(-180, "k")
    for k, curve in own_last(result):
        gain.curve(curve.frequency_hz, curve.gain_db, look(result, k), of=curve)
        phase.curve(curve.frequency_hz, curve.phase_deg, look(result, k), of=curve)
    _draw_margins(gain, phase, result)
    _name_modes(gain, result)
    return Plot([gain, phase], f"Bode plot of the return ratio of {result.case.name}")


def _draw_margins(gain: Panel, phase: Panel, result: CaseResult) -> None:
    """Draw the chosen design's gain and phase margin where they are reached."""
    own = next((c for c in result.curves if c.origin == result.chosen.origin), None)
    if own is None or not own.stable:
        return
    margins = result.chosen.judgement.margins
    u = np.log(own.frequency_hz)
    smaller = margins.smaller_gain_db
    if smaller.frequency_hz and np.isfinite(smaller.value):
        at = float(np.interp(np.log(smaller.frequency_hz), u, own.gain_db))
        gain.upright(smaller.frequency_hz, at, 0.0, "a")
        gain.word(smaller.frequency_hz, max(at, 0), f"{number(smaller.value, 3)} dB", "a", dy=-5)
    turn = margins.phase_deg
    if turn.frequency_hz and np.isfinite(turn.value):
        at = float(np.interp(np.log(turn.frequency_hz), u, own.phase_deg))
        # The margin is to the nearest odd multiple of half a turn.
        critical = 360 * np.round((at + 180) / 360) - 180
        phase.upright(turn.frequency_hz, at, critical, "a")
        phase.word(turn.frequency_hz, max(at, critical), f"{number(turn.value, 3)}°", "a", dy=-5)


def _name_modes(panel: Panel, result: CaseResult) -> None:
    """Write the modes' numbers over their frequencies, as many as find room."""
    last = -np.inf
    for mode, hertz in enumerate(result.truth.frequencies_hz, start=1):
        place = float(panel.x.at(hertz)) * panel.width
        if 0 < place < panel.width - 4 and place - last >= _ROOM:
            panel.word(hertz, panel.y.high, str(mode), "n", dy=11)
            last = place


def nichols_figure(result: CaseResult) -> Plot:
    """Return the return ratio as a Nichols plot, with the disk that it keeps out of."""
    axes = Axis("arg L (deg)", -360, 0, step=45), Axis("|L| (dB)", -20, 40, step=10)
    panel = Panel(*axes, 8, HEIGHT, role="nichols")
    disk = _disk(result)
    if disk is not None:
        panel.curve(np.degrees(np.angle(-disk)) - 180, 20 * np.log10(np.abs(disk)), "disk")
    for k, curve in own_last(result):
        _, values = _fine(curve)
        for phase, gain in _turns(values, curve.phase_deg[0]):
            near = np.where((gain > -30) & (gain < 60), gain, np.nan)
            panel.curve(phase, near, look(result, k), simple=True, of=curve)
    panel.crosses(np.array([-180.0]), np.zeros(1), "critical")
    return Plot([panel], f"Nichols plot of the return ratio of {result.case.name}")


def _turns(values: ComplexArray, first_phase: float) -> Iterator[tuple[Array, Array]]:
    """Yield pieces of a curve, each shifted by whole turns into −360° to 0°, with a point more."""
    phase = np.degrees(np.unwrap(np.angle(values)))
    phase += 360 * np.round((first_phase - phase[0]) / 360)
    gain = 20 * np.log10(np.abs(values))
    turns = np.floor(phase / 360)
    cuts = np.r_[0, np.flatnonzero(np.diff(turns)) + 1, len(turns)]
    for a, b in pairwise(cuts):
        piece = slice(max(a - 1, 0), b + 1)
        yield phase[piece] - 360 * turns[a] - 360, gain[piece]


def nyquist_figure(result: CaseResult) -> Plot:
    """Return the return ratio near −1 in the complex plane, with the disk."""
    across = WIDTH - 62
    wide = 5.0
    high = wide * HEIGHT / across / 2
    panel = Panel(Axis("Re L", -3, -3 + wide), Axis("Im L", -high, high), 8, HEIGHT, role="nyquist")
    disk = _disk(result)
    if disk is not None:
        panel.curve(disk.real, disk.imag, "disk")
    panel.across(0, "k")
    for k, curve in own_last(result):
        _, values = _fine(curve)
        near = np.where(np.abs(values) < 8, values, np.nan)
        panel.curve(near.real, near.imag, look(result, k), simple=True, of=curve)
    panel.crosses(np.array([-1.0]), np.zeros(1), "critical")
    return Plot([panel], f"Nyquist plot of the return ratio of {result.case.name}")


def _disk(result: CaseResult) -> ComplexArray | None:
    """Return the edge of the disk of the chosen design's disk margin; None for none."""
    if not result.chosen.stable:
        return None
    alpha = result.chosen.judgement.margins.disk.value
    if not 0 < alpha < 2:
        return None
    far, near = -(2 + alpha) / (2 - alpha), -(2 - alpha) / (2 + alpha)
    turn = np.exp(2j * np.pi * np.linspace(0, 1, 181))
    return np.asarray((far + near) / 2 + (near - far) / 2 * turn)


def sensitivity_figure(result: CaseResult) -> Plot:
    """Return the gains of S and T."""
    found = {k: _sensitivities(curve) for k, curve in own_last(result)}
    tops = [
        float(np.max(gain[np.isfinite(gain)])) for _, *gains in found.values() for gain in gains
    ]
    top = min(max([*tops, 6.0]) + 6, 40.0)
    s, t = stacked(
        _frequency(result),
        [
            (Axis("|S| (dB)", -40, top), 180, "sensitivity"),
            (Axis("|T| (dB)", -60, top), 180, "complementary"),
        ],
        "frequency",
    )
    for panel in (s, t):
        panel.across(0, "k")
    for k, (hertz, sensitivity, complementary) in found.items():
        for panel, gain in ((s, sensitivity), (t, complementary)):
            drawn, of = np.maximum(gain, -90), result.curves[k]
            panel.curve(hertz, drawn, look(result, k), simple=True, of=of, data=gain)
    if result.chosen.stable:
        peak = result.chosen.judgement.margins.modulus
        if peak.frequency_hz and peak.value > 0:
            decibels = -20 * float(np.log10(peak.value))
            s.dots(np.array([peak.frequency_hz]), np.array([decibels]), "peak")
            s.word(peak.frequency_hz, decibels, f"{number(decibels, 3)} dB", "a", dy=-6)
    return Plot([s, t], f"Sensitivity of the loops of {result.case.name}")


@lru_cache(maxsize=_KEPT)
def _sensitivities(curve: LoopCurves) -> tuple[Array, Array, Array]:
    """Return frequencies in Hz, and the gains of S and T in dB."""
    omega, values = _fine(curve)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = 1 / (1 + values)
        gain, complementary = (20 * np.log10(np.abs(g)) for g in (s, values * s))
    return omega / (2 * np.pi), gain, complementary


def _frequency(result: CaseResult) -> Axis:
    hertz = np.concatenate([curve.frequency_hz for curve in result.curves])
    return Axis("frequency (Hz)", float(hertz.min()), float(hertz.max()), "log")


@lru_cache(maxsize=_KEPT)
def _fine(curve: LoopCurves) -> tuple[Array, ComplexArray]:
    values: ComplexArray = np.exp(
        np.log(10) * curve.gain_db / 20 + 1j * np.radians(curve.phase_deg)
    )
    return refined(2 * np.pi * curve.frequency_hz, values)
