"""Figures 2–7 of the paper redrawn, and the figures of the three findings."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from slewctl.paper import (
    ConditioningFinding,
    Figures,
    HubFinding,
    HubPoint,
    IntegratorFinding,
    ShapeFigure,
)
from slewctl.report.drawing import INK, figure, legend, plain_labels, style, svg
from slewctl.report.palette import ALARM

_FUNCTION_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00")
_FUNCTION_STYLES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1)))


def functions_figure(functions: ShapeFigure) -> str:
    """Return Figure 2 or 3: the first five admissible functions of a basis."""
    fig, axes = figure(size=(7.2, 3.0))
    ax = axes[0]
    for i, shape in enumerate(functions.shapes.T):
        colour, line = _FUNCTION_COLOURS[i], _FUNCTION_STYLES[i]
        ax.plot(functions.x, shape, color=colour, linestyle=line, label=f"i = {i + 1}")
    ax.set_xlabel("x (m)")
    ax.set_ylabel("φ (1)")
    legend(ax, ncols=5, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return svg(fig, f"figure-{functions.number}", f"Functions of the {functions.basis} basis")


def modes_figure(figures: Figures) -> str:
    """Return Figures 4 and 5: two mode shapes by both bases over the converged one."""
    fig, axes = figure(1, 2, (7.2, 2.8))
    for ax, mode in zip(axes, figures.modes, strict=True):
        ax.plot(mode.x, mode.truth, lw=5, alpha=0.45, **style("truth"), label="truth")
        ax.plot(mode.x, mode.clamped_free, **style("clamped-free"), label="clamped-free")
        ax.plot(mode.x, mode.slewing, **style("slewing"), label="slewing")
        ax.set_title(f"Figure {mode.number}: flexible mode {mode.mode}")
        ax.set_xlabel("x (m)")
    axes[0].set_ylabel("displacement (1/√kg)")
    legend(axes[0])
    return svg(fig, "figures-4-5", "Fourth and fifth mode shapes by both bases and the truth")


def tip_figure(figures: Figures) -> str:
    """Return Figures 6 and 7: the tip, and how far it is from the converged model."""
    fig, axes = figure(2, 2, (7.2, 4.4), sharex=True)
    for column, run in enumerate(figures.tip):
        above, below = axes[column], axes[column + 2]
        looks = style(run.basis)
        above.plot(run.truth.t, run.truth.tip, lw=5, alpha=0.45, **style("truth"), label="truth")
        above.plot(run.exact.t, run.exact.tip, **looks, label="exact hold")
        above.plot(run.taylor.t, run.taylor.tip, color=ALARM, lw=1.0, ls=":", label="RK4 step")
        above.set_ylim(-2, 1.1 * float(np.abs(run.truth.tip).max()))
        above.set_title(f"Figure {run.number}: {run.basis}, n = 5")
        for what, line, colour in ((run.exact, "-", looks["color"]), (run.taylor, ":", ALARM)):
            steps = len(what.t)
            gap = 1e3 * (what.tip - run.truth.tip[:steps])
            below.plot(what.t, gap, color=colour, ls=line, lw=1.0)
        below.set_ylim(-60, 60)
        below.set_xlabel("time (s)")
    axes[0].set_ylabel("tip (m)")
    axes[2].set_ylabel("tip − truth (mm)")
    legend(axes[0])
    return svg(fig, "figures-6-7", "Tip under the bang-bang torque, by basis and integrator")


def integrator_figure(finding: IntegratorFinding) -> str:
    """Return the spectral radius of one step by integrator, for both models."""
    fig, axes = figure(size=(7.2, 3.4))
    ax = axes[0]
    places = np.arange(len(finding.rows), dtype=float)
    for shift, basis in ((-0.2, "clamped_free"), (0.2, "slewing")):
        radii = [getattr(row, basis).spectral_radius for row in finding.rows]
        name = getattr(finding, basis).basis
        colour = style(name)["color"]
        ax.barh(places + shift, radii, height=0.36, left=0, color=colour, label=name)
    ax.axvline(1, color=INK, lw=0.9)
    ax.set_xscale("log")
    ax.set_xlim(0.9, 30)
    ax.set_yticks(places, [row.integrator for row in finding.rows], fontsize=8)
    ax.invert_yaxis()
    ax.set_xlabel(f"spectral radius of a step of {finding.step_s:g} s")
    legend(ax)
    return svg(fig, "integrators", "Spectral radius by integrator and basis")


def hub_figure(finding: HubFinding) -> str:
    """Return frequency error and H2 loss of both bases against the hub's inertia."""
    fig, (error, loss) = figure(2, 1, (7.2, 5.0), sharex=True)
    points = [p for p in finding.points if p.ratio > 0]
    ratios = np.array([p.ratio for p in points])
    # The arm without a hub has no place on a logarithmic axis; it stands at its left end.
    nothing = ratios[0] / 3
    for basis in ("clamped_free", "slewing"):
        name = basis.replace("_", "-")
        looks = style(name)
        without = finding.points[0]
        errors = np.array([getattr(p, f"{basis}_error") for p in points])
        error.plot(ratios, errors, "o", ms=4, label=name, **looks)
        error.plot([nothing], [getattr(without, f"{basis}_error")], "s", ms=6, color=looks["color"])
        _losses(loss, nothing, [without, *points], basis)
    error.set_xscale("log")
    error.set_yscale("log")
    error.set_ylabel("worst frequency error")
    legend(error)
    loss.set_yscale("log")
    plain_labels(error.xaxis, error.yaxis, loss.yaxis)
    loss.set_ylabel("H2 loss of an LQG design")
    loss.set_xlabel("hub inertia / beam inertia (squares at the left: no hub)")
    return svg(fig, "hub", "Frequency error and H2 loss against the hub's inertia")


def _losses(ax: Axes, nothing: float, points: list[HubPoint], basis: str) -> None:
    looks = style(basis.replace("_", "-"))
    ratios = np.array([p.ratio or nothing for p in points])
    values = [getattr(p, basis).usual.loss for p in points]
    losses = np.array([np.nan if v is None or v <= 0 else v for v in values])
    ax.plot(ratios[1:], losses[1:], "o", ms=4, **looks)
    ax.plot(ratios[:1], losses[:1], "s", ms=6, color=looks["color"])
    unstable = np.array([v is None for v in values])
    top = np.full(unstable.sum(), 3e3 if basis == "slewing" else 1e3)
    ax.plot(ratios[unstable], top, "x", ms=8, mew=2, color=looks["color"])


def conditioning_figure(finding: ConditioningFinding) -> str:
    """Return the gap to the Riccati optimum by n, raw and scaled, by form and hub inertia."""
    ratios = list(dict.fromkeys(point.hub_ratio for point in finding.points))
    forms = ("covariance", "riccati")
    fig, axes = figure(len(forms), len(ratios), (7.2, 5.2), sharex=True)
    for k, ax in enumerate(axes):
        form, ratio = forms[k // len(ratios)], ratios[k % len(ratios)]
        for shift, basis in ((-0.08, "clamped-free"), (0.08, "slewing")):
            _attempts(ax, finding, ratio, basis, form, shift)
        ax.set_yscale("log")
        ax.set_ylim(3e-13, 30)
        plain_labels(ax.yaxis)
        ax.axhline(1e-6, color=INK, lw=0.8)
        name = "Riccati" if form == "riccati" else form
        ax.set_title(f"{name} form, {f'$J_h$ = {ratio:g} $J_{{beam}}$' if ratio else 'no hub'}")
    for ax in axes[-len(ratios) :]:
        ax.set_xlabel("n")
    for ax in axes[:: len(ratios)]:
        ax.set_ylabel("J / J_Riccati − 1")
    legend(axes[-1], loc="center")
    return svg(fig, "conditioning", "Gap to the Riccati optimum in raw and scaled coordinates")


def _attempts(
    ax: Axes, finding: ConditioningFinding, ratio: float, basis: str, form: str, shift: float
) -> None:
    points = finding.of(ratio, basis)
    colour = style(basis)["color"]
    n = np.array([point.n for point in points]) + shift
    for coordinates, marker, face in (("raw", "o", colour), ("scaled", "s", "none")):
        found = [getattr(point, f"{form}_{coordinates}").gap for point in points]
        gaps = np.array([np.nan if gap is None else gap for gap in found])
        label = f"{basis}, {coordinates}"
        ax.plot(n, gaps, marker, ms=5, color=colour, mfc=face, label=label)
        nothing = np.isnan(gaps)
        ax.plot(n[nothing], np.full(nothing.sum(), 3.0), "x", ms=7, mew=2, color=colour)
