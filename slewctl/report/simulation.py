"""The report of a slew as it happened: figures, measures, and all signals as a file."""

from __future__ import annotations

from pathlib import Path

from slewctl._types import FilePath
from slewctl.animation.animation import Animation
from slewctl.errors import check_path
from slewctl.loop import Simulation
from slewctl.report.drawing import figure, legend, style, svg
from slewctl.report.export import csv_text, json_text, write_files
from slewctl.report.page import render, versions
from slewctl.report.palette import ALARM


def write_simulation(
    found: Simulation, folder: FilePath, title: str, animation: Animation | None = None
) -> Path:
    """Write the report of a simulated slew and return the path of its page.

    Parameters
    ----------
    found : Simulation
    folder : str or PathLike
        Gets ``index.html``, ``signals.csv`` and ``results.json``.
    title : str
    animation : Animation, optional
        By default the slew's own; beside another it is made by `Simulation.animate`.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the folder cannot be written; nothing is left half-written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from slewctl.report import write_simulation
    >>> write_simulation(found, Path("report"), "arm")  # doctest: +SKIP
    """
    folder = check_path(folder, "folder")
    shaper = found.slew.shaper
    page = render(
        "simulation.html",
        title=title,
        found=found,
        summary=found.summary,
        met=_met(found),
        shaper=None if shaper is None or isinstance(shaper, str) else shaper,
        picture=_picture(found),
        animation=(animation or found.animate(names=[title])).html(),
    )
    results = {
        "versions": versions(),
        "slew": found.slew,
        "step": found.step,
        "seed": found.seed,
        "anti_windup": found.anti_windup,
        "summary": found.summary,
    }
    write_files(
        folder,
        {
            "index.html": page,
            "signals.csv": csv_text(found.rows()),
            "results.json": json_text(results),
        },
    )
    return folder / "index.html"


def _met(found: Simulation) -> list[str]:
    """Return the conditions in words."""
    met = found.conditions
    arm_moves = "nonlinear equations" if met.nonlinear else "linear truth"
    words = [f"The arm moves by the {arm_moves}."]
    if met.saturate:
        words.append("The command is held within the drive's limits.")
    if met.rate_limit is not None:
        words.append(f"It changes by at most {met.rate_limit:g} a second.")
    if found.anti_windup:
        words.append(f"Anti-windup: {found.anti_windup}.")
    if met.breakaway:
        words.append(
            f"Dry friction of {met.coulomb_friction:g} N·m, {met.breakaway:g} N·m to break loose."
        )
    if met.backlash_deg:
        words.append(f"The joint has {met.backlash_deg:g} degrees of play.")
    if met.encoder_counts:
        words.append(f"The angle is read in {met.encoder_counts} steps a turn.")
    if met.jitter:
        words.append(f"Samples are up to {met.jitter:g} s late.")
    if met.missed:
        words.append(f"A sample is missed with a probability of {met.missed:g}.")
    if met.noise:
        words.append("The problem's noise acts.")
    for load in met.loads:
        until = "" if load.until_s is None else f" to {load.until_s:g} s"
        pushes = [f"{load.torque:g} N·m on the hub"] if load.torque else []
        pushes += [f"{load.tip_force:g} N on the tip"] if load.tip_force else []
        words.append(f"From {load.time_s:g} s{until}: {' and '.join(pushes)}.")
    return words


def _picture(found: Simulation) -> str:
    volts = "voltage" in found.signals
    fig, axes = figure(3 + volts, 1, (7.2, 6.4 + 1.8 * volts), sharex=True)
    looks = {"color": style("clamped-free")["color"], "lw": 1.0}
    t, signals = found.t, found.signals
    axes[0].plot(t, signals["tip_ref"], lw=3, alpha=0.35, color=looks["color"], label="wanted")
    axes[0].plot(t, signals["tip"], label="tip", **looks)
    axes[0].set_ylabel("tip (m)")
    legend(axes[0])
    axes[1].plot(t, 1e3 * (signals["tip"] - signals["tip_ref"]), **looks)
    axes[1].set_ylabel("tip error (mm)")
    axes[2].step(t, signals["torque"], where="post", label="actuator", **looks)
    if signals["friction_torque"].any():
        axes[2].step(t, signals["friction_torque"], where="post", lw=0.7, color=ALARM,
                     label="dry friction")  # fmt: skip
    axes[2].set_ylabel("torque (N·m)")
    legend(axes[2])
    if volts:
        axes[3].step(t, signals["voltage"], where="post", **looks)
        axes[3].set_ylabel("voltage (V)")
    axes[-1].set_xlabel("time (s)")
    return svg(fig, "slew", "Tip, its error, torque and voltage of the slew over time")
