"""The figures of a comparison report."""

from __future__ import annotations

import numpy as np

from slewctl.compare import CaseResult, Evaluation, LoopCurves
from slewctl.report.drawing import ALARM, INK, figure, legend, style, svg


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


def poles_figure(result: CaseResult, name: str) -> str:
    """Return decay rate against frequency of the closed-loop poles on the truth."""
    fig, axes = figure(size=(7.2, 3.4))
    ax = axes[0]
    # The linear part of the axis around zero holds what decays slower than a tenth of
    # what is usual here.
    usual = np.median(np.abs(result.chosen.poles.real))
    linear = float(10.0 ** np.floor(np.log10(usual) - 1))
    for i, evaluation in enumerate(_same_order(result)):
        poles = evaluation.poles[evaluation.poles.imag >= 0]
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
        looks = style(curve.basis, i)
        gain.plot(curve.frequency_hz, curve.gain_db, label=_label(curve), lw=1.1, **looks)
        phase.plot(curve.frequency_hz, curve.phase_deg, lw=1.1, **looks)
    gain.axhline(0, color=INK, lw=0.9)
    gain.set_xscale("log")
    gain.set_ylim(bottom=max(-100, gain.get_ylim()[0]))
    gain.set_ylabel("|L| (dB)")
    legend(gain)
    phase.axhline(-180, color=INK, lw=0.9)
    phase.set_ylabel("arg L (deg)")
    phase.set_xlabel("frequency (Hz)")
    return svg(fig, name, f"Bode plot of the return ratio of {result.case.name}")


def nichols_figure(result: CaseResult, name: str) -> str:
    """Return the return ratio on the truth as a Nichols plot."""
    fig, axes = figure(size=(7.2, 3.8))
    ax = axes[0]
    for i, curve in enumerate(result.curves):
        turns = np.floor(curve.phase_deg / 360)
        wrapped = curve.phase_deg - 360 * turns - 360
        gain = curve.gain_db.copy()
        gain[1:][np.diff(turns) != 0] = np.nan
        ax.plot(wrapped, gain, lw=1.1, label=_label(curve), **style(curve.basis, i))
    ax.plot([-180], [0], "+", color=ALARM, markersize=14, markeredgewidth=2)
    ax.set_xlim(-360, 0)
    ax.set_xticks(range(-360, 1, 45))
    ax.set_ylim(-45, 40)
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
        looks = style(curves.basis, i)
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
    return f"{design.basis}, n = {design.n}{state}"
