"""The figures of a comparison report."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator, MultipleLocator

from slewctl.compare import CaseResult, Evaluation, LoopCurves, Rung
from slewctl.report.drawing import ALARM, INK, figure, legend, plain_labels, style, svg

# Less than a hundredth of a percent lost is drawn as that.
_LEAST_LOSS = 1e-4

# What stands below each figure.
SHAPES = (
    "Arc displacement of the design model's modes (lines) over those of the truth (grey). "
    "Where a line leaves the grey band the design sees a mode that the arm does not have."
)
LADDER = (
    "The spillover ladder: each controller meets the first N modes of the truth, for every N from "
    "those that it was designed on (a given law: from one). A cross on the axis is an unstable "
    "loop; where the lines are level, more modes change nothing."
)
POLES = (
    "Closed-loop poles on the truth. Every pole must decay: the shaded ground and the stars "
    "mark poles that grow. The row of poles on the right is the arm's own damping of modes "
    "that the controller does not know."
)
BODE = (
    "Return ratio L = −K(s)G(s) on the truth, drawn densely at every resonance. Each peak "
    "above 0 dB must arrive with a safe phase."
)
NICHOLS = (
    "The same return ratio as a Nichols plot. The red cross is the critical point; the loops "
    "are the resonances, and how they pass the cross decides stability. What stays below −20 dB is "
    "left out. Where designs agree, the last one hides the others."
)
SLEW = (
    "The slew on the truth: tip position, its error against the rigid arm, and torque. "
    "Drawn as if the drive had no limits; unstable loops are left out."
)
RESPONSE = (
    "The measured response with its 95 % band, that of the arm's model with its dead time and the "
    "clock of the measurement, and the coherence."
)
MEASURED_LOOP = (
    "The controller's return ratio on the measured response, with the disks in which it lies, and "
    "on the model."
)


def shapes_figure(result: CaseResult, name: str) -> str:
    """Return the mode shapes of the chosen order on each basis, over the truth's."""
    modes = len(result.shapes[0].shapes)
    columns = min(modes, 3)
    rows = -(-modes // columns)
    fig, axes = figure(rows, columns, (7.2, 2.3 * rows + 0.4))
    for k, ax in enumerate(axes):
        if k >= modes:
            ax.set_visible(False)
            continue
        for i, source in enumerate(result.shapes):
            looks = style(source.source, i)
            width = 5.0 if source.source == "truth" else 1.6
            alpha = 0.45 if source.source == "truth" else 1.0
            ax.plot(source.x, source.shapes[k], label=source.source, lw=width, alpha=alpha, **looks)
        ax.set_title(f"mode {k + 1}: {result.truth.frequencies_hz[k]:.4g} Hz")
        ax.set_xlabel("x (m)")
    axes[0].set_ylabel("displacement (1/√kg)")
    legend(axes[0])
    return svg(fig, name, f"Mode shapes of {result.case.name} by basis over the truth")


def ladder_figure(result: CaseResult, name: str) -> str:
    """Return disk margin and loss of each basis over the number of modes let in."""
    weighted = result.case.objective.weighted
    fig, axes = figure(1, 1 + weighted, (7.2, 2.7))
    left = axes[0]
    highest = 0.0
    for i, ladder in enumerate(result.ladders):
        looks = style(ladder.origin.basis, i)
        modes = [rung.modes for rung in ladder.rungs]
        lost = [rung.modes for rung in ladder.rungs if not rung.stable]
        margins = [_value(rung, "disk_margin") for rung in ladder.rungs]
        left.plot(modes, margins, marker=".", lw=1.3, label=str(ladder.origin), **looks)
        left.plot(lost, np.zeros(len(lost)), "x", color=looks["color"], clip_on=False)
        highest = np.nanmax([*margins, highest])
    left.set_ylim(0, 1.1 * highest or 1.0)
    left.set_ylabel("disk margin α")
    if weighted:
        _losses(axes[1], result)
    for ax in axes:
        ax.set_xlabel("modes of the truth N")
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    legend(left)
    what = "Disk margin and loss" if weighted else "Disk margin"
    return svg(fig, name, f"{what} of {result.case.name} over the modes let in")


def _losses(ax: Axes, result: CaseResult) -> None:
    """Draw the loss of each ladder; infinite ones are gaps."""
    most = _LEAST_LOSS
    for i, ladder in enumerate(result.ladders):
        losses = [max(_value(rung, "h2_loss"), _LEAST_LOSS) for rung in ladder.rungs]
        losses = [loss if np.isfinite(loss) else np.nan for loss in losses]
        looks = style(ladder.origin.basis, i)
        ax.plot([rung.modes for rung in ladder.rungs], losses, marker=".", lw=1.3, **looks)
        most = np.nanmax([*losses, most])
    decades = 10.0 ** np.arange(-4, np.ceil(np.log10(most)) + 1)
    ax.set_yscale("log")
    ax.set_ylim(decades[0] / 2, 2 * max(decades[-1], 1e-3))
    ax.set_yticks(decades, [f"{100 * d:g} %" for d in decades])
    ax.set_ylabel("lost of the optimal cost")


def _value(rung: Rung, name: str) -> float:
    value = rung.value(name)
    return np.nan if value is None else value


def poles_figure(result: CaseResult, name: str) -> str:
    """Return decay rate against frequency of the closed-loop poles on the truth."""
    fig, axes = figure(size=(7.2, 3.4))
    ax = axes[0]
    # The linear part of the axis around zero holds what decays slower than a tenth of
    # what is usual here.
    usual = np.median(np.abs(result.chosen.judgement.poles.real))
    linear = float(10.0 ** np.floor(np.log10(usual) - 1))
    for i, evaluation in enumerate(_same_order(result)):
        poles = evaluation.judgement.poles
        poles = poles[poles.imag >= 0]
        hertz, decay = np.abs(poles) / (2 * np.pi), -poles.real
        looks = style(evaluation.basis, i)
        marker = "ox^s"[i % 4]
        ax.plot(
            hertz, decay, marker, color=looks["color"], label=_label(evaluation),
            markerfacecolor="none", markersize=7,
        )  # fmt: skip
        bad = decay <= 0
        ax.plot(hertz[bad], decay[bad], "*", color=ALARM, markersize=13)
    ax.set_xscale("log")
    ax.set_yscale("symlog", linthresh=linear)
    plain_labels(ax.xaxis, ax.yaxis)
    low, high = ax.get_ylim()
    low = min(low, -linear)
    ax.axhspan(low, 0, color=ALARM, alpha=0.12, lw=0)
    ax.set_ylim(low, 2 * high)
    ax.set_xlabel("frequency |s|/2π (Hz)")
    ax.set_ylabel("decay rate −Re s (1/s)")
    legend(ax)
    return svg(fig, name, f"Closed-loop poles of {result.case.name} on the truth")


def bode_figure(result: CaseResult, name: str) -> str:
    """Return gain and phase of the return ratio on the truth."""
    fig, (gain, phase) = figure(2, 1, (7.2, 4.6), sharex=True)
    for i, curve in enumerate(result.curves):
        looks = style(curve.origin.basis, i)
        gain.plot(curve.frequency_hz, curve.gain_db, label=_label(curve), lw=1.1, **looks)
        phase.plot(curve.frequency_hz, curve.phase_deg, lw=1.1, **looks)
    gain.axhline(0, color=INK, lw=0.9)
    gain.set_xscale("log")
    plain_labels(gain.xaxis)
    gain.set_ylim(bottom=max(-100, gain.get_ylim()[0]))
    gain.set_ylabel("|L| (dB)")
    legend(gain)
    phase.axhline(-180, color=INK, lw=0.9)
    # The critical angle is among the marks.
    phase.yaxis.set_major_locator(MultipleLocator(180 * -(-np.ptp(phase.get_ylim()) // 1080)))
    phase.set_ylabel("arg L (deg)")
    phase.set_xlabel("frequency (Hz)")
    return svg(fig, name, f"Bode plot of the return ratio of {result.case.name}")


def nichols_figure(result: CaseResult, name: str) -> str:
    """Return the return ratio on the truth as a Nichols plot."""
    fig, axes = figure(size=(7.2, 3.8))
    ax = axes[0]
    for i, curve in enumerate(result.curves):
        ax.plot(*curve.nichols, lw=1.1, label=_label(curve), **style(curve.origin.basis, i))
    ax.plot([-180], [0], "+", color=ALARM, markersize=14, markeredgewidth=2)
    ax.set_xlim(-360, 0)
    ax.set_xticks(range(-360, 1, 45))
    ax.set_ylim(-20, 40)
    ax.set_xlabel("arg L (deg)")
    ax.set_ylabel("|L| (dB)")
    legend(ax)
    return svg(fig, name, f"Nichols plot of the return ratio of {result.case.name}")


def slew_figure(result: CaseResult, name: str) -> str:
    """Return tip position, its error and the torque in the slew, for the stable loops."""
    fig, (tip, error, torque) = figure(3, 1, (7.2, 5.6), sharex=True)
    drawn = False
    for i, curves in enumerate(result.curves):
        slew = curves.slew
        if slew is None:
            continue
        if not drawn:
            tip.plot(slew.t, slew.tip_reference, lw=5, alpha=0.4, **style("truth"), label="wanted")
            drawn = True
        looks = style(curves.origin.basis, i)
        tip.plot(slew.t, slew.tip, label=_label(curves), **looks)
        error.plot(slew.t, 1e3 * (slew.tip - slew.tip_reference), **looks)
        torque.plot(slew.t, slew.torque, **looks)
    tip.set_ylabel("tip (m)")
    error.set_ylabel("tip error (mm)")
    torque.set_ylabel("torque (N·m)")
    torque.set_xlabel("time (s)")
    if drawn:
        legend(tip)
    return svg(fig, name, f"Slew of {result.case.name} on the truth")


def _same_order(result: CaseResult) -> list[Evaluation]:
    return [e for e in result.evaluations if e.n == result.case.n]


def _label(design: Evaluation | LoopCurves) -> str:
    state = "" if design.stable else " (unstable)"
    return f"{design.origin}{state}"
