"""The figures of a comparison report: every design's curves on axes that the page can enlarge."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from slewctl._types import Array
from slewctl.compare import Case, CaseResult, Evaluation, Ladder, LoopCurves, Rung
from slewctl.compare.case import Origin
from slewctl.report.loop_figures import (
    bode_figure,
    look,
    nichols_figure,
    nyquist_figure,
    own_last,
    sensitivity_figure,
)
from slewctl.report.palette import colour, dashes
from slewctl.report.plot import HEIGHT, Panel, Plot, stacked
from slewctl.report.scale import Axis, around, prefixed

# Less than a hundredth of a percent lost is drawn as that.
_LEAST_LOSS = 1e-4

Draw = Callable[[CaseResult], Plot]


def looks(result: CaseResult) -> list[dict[str, Any]]:
    """Return the designs that are drawn, in order, with colour and dashes."""
    return [
        {
            "label": _label(curve),
            "chosen": curve.origin == result.chosen.origin,
            "colour": colour(curve.origin.basis, k),
            "dashes": dashes(curve.origin.basis),
        }
        for k, curve in enumerate(result.curves)
    ]


def figures(result: CaseResult) -> Iterator[tuple[str, Plot, str]]:
    """Yield each figure's kind, the figure and its caption; none of what there is nothing of."""
    there = {"shapes": bool(result.shapes), "slew": result.slewed, "ladder": bool(result.ladders)}
    for kind, (draw, told) in _FIGURES.items():
        if there.get(kind, True):
            yield kind, draw(result), told


def caption(kind: str) -> str:
    """Return a figure's caption, which is there before the figure is."""
    return _FIGURES[kind][1]


def _poles(result: CaseResult) -> Plot:
    """Return decay rate against frequency of the closed-loop poles on the truth."""
    designs = [_of(result, curve) for curve in result.curves]
    found = []
    for design in designs:
        poles = design.judgement.poles
        poles = poles[poles.imag >= 0]
        found.append((np.abs(poles) / (2 * np.pi), -poles.real))
    hertz, decay = (np.concatenate(part) for part in zip(*found, strict=True))
    # The linear part of the axis around zero holds what decays slower than a tenth of
    # what is usual here.
    usual = np.median(np.abs(result.chosen.judgement.poles.real))
    bend = float(10.0 ** np.floor(np.log10(usual) - 1)) if usual else 1.0
    x = Axis("frequency |s|/2π (Hz)", *_log_ends(hertz), kind="log")
    low = min(1.5 * float(decay.min()), -bend)
    y = Axis("decay rate −Re s (1/s)", low, 2 * float(decay.max()) or bend, "symlog", bend)
    panel = Panel(x, y, 8, HEIGHT, role="poles")
    edges = np.array([x.low, x.high, x.high, x.low])
    panel.curve(edges, np.array([0, 0, low, low]), "unstable")
    panel.across(0, "k")
    for k, (f, rate) in enumerate(found):
        known = f > 0
        panel.dots(f[known], rate[known], f"o{k}")
        panel.crosses(f[known & (rate <= 0)], rate[known & (rate <= 0)], "critical")
    return Plot([panel], f"Closed-loop poles of {result.case.name} on the truth")


def ladder_figure(result: CaseResult) -> Plot:
    """Return `drawn_ladders` of the designs of a result."""
    return drawn_ladders(result.case, result.ladders, [curve.origin for curve in result.curves])


def drawn_ladders(case: Case, ladders: Sequence[Ladder], origins: Sequence[Origin]) -> Plot:
    """Return disk margin and loss of each basis over the number of modes let in.

    Parameters
    ----------
    case : Case
    ladders : sequence of Ladder
        One at least.
    origins : sequence of Origin
        Of all designs whose curves are drawn, in their order.

    Returns
    -------
    Plot
    """
    weighted = case.objective.weighted
    modes = [rung.modes for ladder in ladders for rung in ladder.rungs]
    x = Axis("modes of the truth N", min(modes) - 0.5, max(modes) + 0.5, step=1)
    margins = [[_value(r, "disk_margin") for r in ladder.rungs] for ladder in ladders]
    known = [m for row in margins for m in row if np.isfinite(m)]
    ys = [(Axis("disk margin α", 0, 1.1 * max(known, default=0) or 1.0), 180.0, "disk margin")]
    losses = [[_loss(r) for r in ladder.rungs] for ladder in ladders] if weighted else []
    if weighted:
        most = max((v for row in losses for v in row if np.isfinite(v)), default=0)
        top = 2 * max(100 * most, 0.1)
        ys.append((Axis("lost (%)", 50 * _LEAST_LOSS, top, "log"), 180.0, "lost"))
    panels = stacked(x, ys, "modes")
    places = {origin: k for k, origin in enumerate(origins)}
    for row, ladder in enumerate(ladders):
        k = places[ladder.origin]
        place = np.array([rung.modes for rung in ladder.rungs], dtype=float)
        shown = ((margins, 1, 0.0), (losses, 100, 100 * _LEAST_LOSS))
        for panel, (rows, scale, floor) in zip(panels, shown, strict=False):
            data = scale * np.array(rows[row])
            values = np.maximum(data, floor)
            panel.curve(place, values, f"o{k}", data=data)
            panel.dots(place, values, f"o{k}", data=data)
        lost = place[[not rung.stable for rung in ladder.rungs]]
        panels[0].crosses(lost, np.zeros(len(lost)), f"o{k}")
    what = "Disk margin and loss" if weighted else "Disk margin"
    return Plot(panels, f"{what} of {case.name} over the modes let in")


def _loss(rung: Rung) -> float:
    """Return a loss that can be drawn; infinite ones are gaps."""
    loss = _value(rung, "h2_loss")
    return loss if np.isfinite(loss) else np.nan


def _value(rung: Rung, name: str) -> float:
    value = rung.value(name)
    return np.nan if value is None else value


def _slew(result: CaseResult) -> Plot:
    """Return tip, its error and what the drive gives, for the stable loops."""
    slews = [(k, c.slew) for k, c in own_last(result) if c.slew is not None]
    by_voltage = result.case.arm.motor is not None
    drive, unit = ("motor voltage", "V") if by_voltage else ("torque", "N·m")
    if not slews:
        times, ends = Axis("time (s)", 0, 1), Axis("tip (m)", 0, 1)
        (panel,) = stacked(times, [(ends, HEIGHT, "")], "time")
        known = "nothing is known of a slew"  # of a loop that is proved to be stable, by little
        why = known if any(c.stable for c in result.curves) else "every loop is unstable: no slew"
        panel.word(0.5, 0.5, why, "n")
        return Plot([panel], f"{result.case.name}: {why}")
    first = slews[0][1]
    tips = [first.tip_reference, *(s.tip for _, s in slews)]
    errors = [s.tip - s.tip_reference for _, s in slews]
    given = [s.actuator if by_voltage else s.torque for _, s in slews]
    factors, axes = [], []
    for what, of, usual, curves in (
        ("tip", "m", 0, tips), ("tip error", "m", -1, errors), (drive, unit, 0, given),
    ):  # fmt: skip
        values = np.concatenate(curves)
        factor, told = prefixed(values, of, usual)
        factors.append(factor)
        axes.append(Axis(f"{what} ({told})", *around(factor * values)))
    limit = factors[2] * (_drive_limit(result) or np.inf)
    low, high = axes[2].low, axes[2].high
    # A limit is drawn where it tells something: not far outside.
    near = limit < 3 * max(-low, high)
    if near:
        axes[2] = Axis(axes[2].label, *around(np.array([low, high, limit, -limit])))
    pace, second = prefixed(first.t, "s")
    panels = stacked(
        Axis(f"time ({second})", pace * float(first.t[0]), pace * float(first.t[-1])),
        [(axis, 116, role) for axis, role in zip(axes, ("tip", "error", "drive"), strict=True)],
        "time",
    )
    panels[0].curve(pace * first.t, factors[0] * first.tip_reference, "wanted")
    panels[1].across(0, "k")
    for value in (limit, -limit) if near else ():
        panels[2].across(value, "limit")
    for panel, factor, curves in zip(panels, factors, (tips[1:], errors, given), strict=True):
        for (k, slew), values in zip(slews, curves, strict=True):
            panel.curve(pace * slew.t, factor * values, look(result, k))
    return Plot(panels, f"Slew of {result.case.name} on the truth")


def _drive_limit(result: CaseResult) -> float | None:
    """Return the limit of what is drawn of the drive: the motor's voltage, or the torque."""
    arm = result.case.arm
    if arm.motor is not None:
        return arm.motor.voltage_limit
    return arm.drive.torque_limit


def _shapes(result: CaseResult) -> Plot:
    """Return the mode shapes of the chosen order on each basis, over the truth's."""
    modes = len(result.shapes[0].shapes)
    columns = 1 if modes == 1 else 2
    rows = -(-modes // columns)
    room = 480.0 / columns
    height = max((392.0 - 44 * rows) / rows, 60.0)
    places = {curve.origin.basis: k for k, curve in enumerate(result.curves)}
    panels = []
    for k in range(modes):
        values = np.concatenate([s.shapes[k] for s in result.shapes if len(s.shapes) > k])
        along, metre = prefixed(result.shapes[0].x, "m")
        size, unit = _power_of_ten(values, "/√kg")
        x = along * result.shapes[0].x
        panel = Panel(
            Axis(f"x ({metre})", float(x[0]), float(x[-1])),
            Axis(f"mode {k + 1} ({unit})", *around(size * values)),
            20 + (k // columns) * (height + 48), height, "place", "shape",
            left=52 + (k % columns) * room, width=room - 62,
        )  # fmt: skip
        for source in result.shapes:
            if len(source.shapes) > k:
                look = "wanted" if source.source == "truth" else f"o{places[source.source]}"
                panel.curve(along * source.x, size * source.shapes[k], look)
        title = f"mode {k + 1}: {result.truth.frequencies_hz[k]:.4g} Hz"
        panel.word(float(x[0] + x[-1]) / 2, panel.y.high, title, "n", dy=-5)
        panels.append(panel)
    return Plot(panels, f"Mode shapes of {result.case.name} by basis over the truth")


def _power_of_ten(values: Array, unit: str) -> tuple[float, str]:
    """Return a factor and a unit of which a power of ten is a part, where marks want it."""
    factor, prefix = prefixed(values, "")
    power = str(-round(np.log10(factor))).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return factor, f"10{power}{unit}" if prefix else f"1{unit}"


def _log_ends(values: Array) -> tuple[float, float]:
    positive = values[values > 0]
    return float(positive.min()) / 1.5, 1.5 * float(positive.max())


def _of(result: CaseResult, curve: LoopCurves) -> Evaluation:
    return next(e for e in result.evaluations if e.origin == curve.origin)


def _label(design: Evaluation | LoopCurves) -> str:
    state = "" if design.stable else " (unstable)"
    return f"{design.origin}{state}"


_FIGURES: dict[str, tuple[Draw, str]] = {
    "bode": (
        bode_figure,
        "Return ratio L = −K(s)G(s) on the truth, dense at every resonance. Each peak above 0 dB "
        "must arrive with a safe phase. Red: this design's gain and phase margin; the numbers "
        "above are the arm's modes.",
    ),
    "nichols": (
        nichols_figure,
        "The same as a Nichols plot. The cross is the critical point; the ring is the disk "
        "margin of this design, which its curve may touch and not enter. Loops are resonances.",
    ),
    "nyquist": (
        nyquist_figure,
        "The same near −1, for positive frequencies, with the same disk.",
    ),
    "sensitivity": (
        sensitivity_figure,
        "Sensitivity S = 1/(1 + L) above, T = L/(1 + L) below. The dot is this design's largest "
        "gain of S, one over the modulus margin. Of an unstable loop they are the bare quotients.",
    ),
    "slew": (
        _slew,
        "The slew on the truth: tip over what is wanted (grey), its error, and what the drive "
        "gives, as if it had no limits (dotted, where near) unless the file asks for conditions. "
        "Unstable loops are left out.",
    ),
    "ladder": (
        ladder_figure,
        "The spillover ladder: each controller meets the first N modes of the truth. A cross is "
        "an unstable loop; where the lines are level, more modes change nothing. What loses less "
        "than 0.01 % is drawn there.",
    ),
    "poles": (
        _poles,
        "Closed-loop poles on the truth, each design's in a ring of its own. Those on shaded "
        "ground grow. The row on the right is the arm's own damping of modes that the controller "
        "does not know.",
    ),
    "shapes": (
        _shapes,
        "Arc displacement of the design model's modes over those of the truth (grey). Where a line "
        "leaves the grey band the design sees a mode that the arm does not have.",
    ),
}
