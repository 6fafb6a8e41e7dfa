"""The idea in five pictures: drawn, and their numbers found, while the guide is built."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

import control as ct
import numpy as np
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import slewctl as sc
from slewctl.compare import QUANTITIES, Case, spillover_ladder
from slewctl.loop.curves import curve
from slewctl.report.drawing import INK, figure, legend, plain_labels, style, svg
from slewctl.report.palette import ALARM

BASES = ("clamped-free", "slewing", "arm-matched")
COLOURS = [style(basis)["color"] for basis in BASES]
GREEN = COLOURS[2]
HUB = 0.02  # kg·m², a tenth of the beam's own inertia
LIMITS = {"tip": 0.1, "torque": 1.0}
NOISE = {"torque": 0.1, "theta": 0.01}
REQUIRED = {"gain_margin_db": 6.0, "phase_margin_deg": 30.0, "disk_margin": 0.5}
VARIED: dict[str, dict[str, float]] = {
    "as described": {},
    "10 % stiffer": {"stiffness_factor": 1.1},
    "with a payload of 10 g": {"payload_mass": 0.01},
}
LEAST = 1e-13  # of an error that is drawn
WIDEST = 3.0  # of a bar, in what is required
SIZE = (3.6, 2.9)


@dataclass(frozen=True)
class Picture:
    """Panels beside each other, each with what it shows in words, and the numbers to tell."""

    panels: Sequence[tuple[Any, str]]
    numbers: Mapping[str, Any]


@cache
def arm(hub: float = HUB) -> sc.Arm:
    """The paper's beam on a hub."""
    return sc.Arm(sc.arms.paper_beam().beam, hub=sc.Hub(inertia=hub), damping_ratio=0.005)


@cache
def problem() -> sc.Problem:
    """What is asked of it."""
    return sc.Problem(arm(), limits=LIMITS, noise=NOISE)


@cache
def law(n: int) -> sc.Controller:
    """The design on n functions."""
    return sc.lqg(problem().plant("arm-matched", n))


def loop(n: int, *, on_model: bool = False) -> sc.Loop:
    """That design on the truth, or on the model that it was made on."""
    model = sc.assemble(arm(), "arm-matched", n) if on_model else problem().truth
    return sc.close(model, problem().objective, law(n))


def panel(title: str = "") -> tuple[Any, Any]:
    """Return an empty figure and its axes."""
    fig, (ax,) = figure(size=SIZE)
    ax.set_title(title)
    return fig, ax


def functions() -> Picture:
    """The first three functions of two bases."""
    x, panels, bent = np.linspace(0, 1, 101), [], {}
    for basis, name in ((sc.ClampedFree(3), "cantilever modes"), (sc.Slewing(3), "new functions")):
        fig, ax = panel(name)
        tip = basis.evaluate(x)[-1]
        for k, colour in enumerate(COLOURS):
            ax.plot(x, basis.evaluate(x)[:, k] / tip[k], color=colour, label=f"{k + 1}")
        ax.set_xlabel("x/L")
        ax.set_ylabel("deflection")
        legend(ax)
        bent[basis.name] = abs(float(basis.evaluate(np.zeros(1), 2)[0, 0] / tip[0]))
        panels.append((fig, f"The first three {name} along the beam, each of them 1 at the tip."))
    return Picture(panels, {"cantilever": bent["clamped-free"], "new": bent["slewing"]})


def errors() -> Picture:
    """How far frequencies are off, without and with a hub."""
    counts, panels, numbers = range(2, 9), [], {}
    for hub, where in ((0.0, "no hub"), (HUB, f"hub of {HUB:g} kg·m²")):
        exact = sc.truth(arm(hub)).frequencies_hz[:2]
        fig, ax = panel(where)
        for basis in BASES:
            found = [sc.assemble(arm(hub), basis, n).frequencies_hz[:2] for n in counts]
            off = [max(LEAST, float(np.max(np.abs(f / exact - 1)))) for f in found]
            ax.semilogy(counts, off, "o-", ms=3, color=style(basis)["color"], label=basis)
            numbers[f"{basis.replace('-', '_')}_{'hub' if hub else 'none'}"] = 100 * off[0]
        ax.set_ylim(LEAST / 3, 3)
        ax.set_yticks([1e-12, 1e-9, 1e-6, 1e-3, 1])
        ax.set_xlabel("functions n")
        ax.set_ylabel("worst error of two frequencies")
        legend(ax)
        panels.append((fig, f"Error of the first two frequencies over n on three bases, {where}."))
    return Picture(panels, numbers | {"hub": HUB})


def spilled() -> Picture:
    """A design on one function, on its model and on the arm."""
    t, panels = np.linspace(0, 8, 2401), []
    for on_model, title, colour, shown in (
        (True, "on its own model, n = 1", GREEN, "on the design's own model: it comes to rest."),
        (False, "on the truth", ALARM, "on the truth: an oscillation grows and grows."),
    ):
        system = loop(1, on_model=on_model).system
        tip, torque = system.output_labels.index("z_tip"), system.input_labels.index("w_torque")
        response = ct.impulse_response(system, T=t).outputs[tip, torque]
        fig, ax = panel(title)
        ax.plot(t, 1e3 * LIMITS["tip"] * response, lw=1, color=colour)
        ax.set_xlabel("time (s)")
        ax.set_ylabel("tip (mm)")
        panels.append((fig, f"The tip after a blow on the hub, computed {shown}"))
    own, real = loop(1, on_model=True), loop(1)
    first, second = problem().truth.frequencies_hz[:2]
    return Picture(
        panels,
        {
            "phase": own.margins.phase_deg.value,
            "grows": real.unstable_hz[0],
            "first": first,
            "second": second,
            "blow": NOISE["torque"],
        },
    )


def margin() -> Picture:
    """The margins of a design on three functions, drawn."""
    closed = loop(3)
    m, seen, turn = closed.margins, curve(closed), np.linspace(0, 2 * np.pi, 181)
    disk = m.disk.value
    centre, radius = -(4 + disk**2) / (4 - disk**2), 4 * disk / (4 - disk**2)
    at = closed.response(2 * np.pi * np.array([m.disk.frequency_hz, m.phase_deg.frequency_hz]))
    near = seen.values[np.abs(seen.values) < 50]
    nyquist, (ax,) = figure(size=(3.6, 3.1))
    ax.plot(near.real, near.imag, lw=1.1, color=GREEN)
    ax.plot(np.cos(turn), np.sin(turn), lw=0.7, ls=":", color=INK)
    edge = (centre + radius * np.cos(turn), radius * np.sin(turn))
    ax.fill(*edge, color=ALARM, alpha=0.18, lw=0)
    ax.plot(*edge, lw=1, color=ALARM)
    ax.plot([-1], [0], "+", ms=11, mew=1.6, color=INK)
    ax.plot(at.real[:1], at.imag[:1], "o", ms=5, color=ALARM)
    ax.plot(at.real[1:], at.imag[1:], "s", ms=5, color=INK)
    ax.set(xlim=(-2.6, 1.6), ylim=(-1.8, 1.8), xlabel="Re L", ylabel="Im L")
    ax.set_aspect("equal")
    bode, (ax,) = figure(size=(3.6, 3.1))
    ax.semilogx(seen.frequency_hz, seen.gain_db, lw=1.1, color=GREEN)
    ax.axhline(0, lw=0.7, ls=":", color=INK)
    ax.axvline(m.disk.frequency_hz, lw=1, color=ALARM)
    ax.plot([m.phase_deg.frequency_hz], [0], "s", ms=5, color=INK)
    ax.set(xlim=(0.1, 100), ylim=(-80, 60), xlabel="frequency (Hz)", ylabel="|L| (dB)")
    plain_labels(ax.xaxis)
    return Picture(
        [
            (nyquist, "Nyquist curve about the point −1, and a disk there that it only touches."),
            (bode, "Gain of the return ratio over frequency, with a peak at each of the modes."),
        ],
        {
            "disk": disk,
            "low": m.disk_gains[0],
            "high": m.disk_gains[1],
            "turn": m.disk_phase_deg,
            "phase": m.phase_deg.value,
            "intervals": m.intervals,
        },
    )


def verdict() -> Picture:
    """What is left as modes are let in, and the room of every requirement."""
    ladder, numbers = _ladder()
    room, fails = _room()
    failing = list(dict.fromkeys(name for name, _ in fails))
    shown = "Each margin of the design on three functions over what is required, on three arms"
    return Picture(
        [
            (
                ladder,
                "Disk margin over the number of modes let in, of designs on 1 to 3 functions.",
            ),
            (room, f"{shown}; {len(fails)} are too small."),
        ],
        numbers
        | {
            "failed": len(fails),
            "asked": len(REQUIRED) * len(VARIED),
            "failing": " or ".join(failing) or "anywhere",
        },
    )


def _ladder() -> tuple[Any, dict[str, float]]:
    fig, ax = panel("spillover ladder")
    numbers: dict[str, float] = {}
    for n, colour in zip((1, 2, 3), (ALARM, COLOURS[0], GREEN), strict=True):
        case = Case("arm", arm(), problem().objective, truth_modes=12, basis="arm-matched", n=n)
        ladder = spillover_ladder(case)
        left = [(rung.modes, rung.value("disk_margin")) for rung in ladder.rungs]
        ax.plot(*zip(*[(m, v or 0.0) for m, v in left], strict=True), "o-", ms=3, lw=1,
                color=colour, label=f"n = {n}")  # fmt: skip
        lost = [modes for modes, value in left if value is None]
        if lost:
            ax.plot(lost, [0.0] * len(lost), "x", ms=6, color=colour, label="unstable")
        numbers |= {f"lost_{n}": lost[0] if lost else 0, f"left_{n}": left[-1][1] or 0.0}
    ax.axhline(REQUIRED["disk_margin"], lw=0.8, ls=":", color=INK)
    ax.set(ylim=(-0.05, 1), xlabel="modes of the truth let in", ylabel="disk margin")
    ax.set_xticks(range(2, 13, 2))
    legend(ax, ncols=2)
    return fig, numbers


def _room() -> tuple[Any, list[tuple[str, str]]]:
    fig, ax = panel("verdict")
    fails = []
    for place, (name, changed) in enumerate(VARIED.items()):
        other = sc.Problem(sc.vary(arm(), **changed), limits=LIMITS, noise=NOISE)
        judged = other.judge(law(3))
        values = [judged.followed(q).reading.value / REQUIRED[q] for q in REQUIRED]
        fails += [(name, q) for q, value in zip(REQUIRED, values, strict=True) if not value >= 1]
        ax.barh(np.arange(len(values)) + 0.26 * (1 - place), np.minimum(values, WIDEST),
                height=0.22, color=COLOURS[place], label=name)  # fmt: skip
    ax.axvline(1, lw=1.2, color=INK)
    labels = [
        f"{q.split('_')[0]}\n≥ {least:g} {QUANTITIES[q].unit}" for q, least in REQUIRED.items()
    ]
    ax.set_yticks(range(len(labels)), labels)
    ax.set(ylim=(-0.5, len(labels) + 0.7), xlim=(0, 2.2), xlabel="margin over what is required")
    legend(ax, loc="upper right")
    return fig, fails


PICTURES: dict[str, Callable[[], Picture]] = {
    "functions": functions,
    "errors": errors,
    "spilled": spilled,
    "margin": margin,
    "verdict": verdict,
}


class PictureDirective(SphinxDirective):
    """``picture`` with the name of one; its content is the caption, numbers in braces."""

    required_arguments: ClassVar[int] = 1
    has_content: ClassVar[bool] = True

    def run(self) -> list[nodes.Node]:
        """Return the figure with its caption."""
        name = self.arguments[0]
        self.env.note_dependency(__file__)
        picture = PICTURES[name]()
        drawn = "".join(
            svg(fig, f"{name}{place}", shown) for place, (fig, shown) in enumerate(picture.panels)
        )
        whole = nodes.figure(classes=["picture"])
        whole += nodes.raw("", f'<div class="panels">{drawn}</div>', format="html")
        caption = " ".join(self.content).format(**picture.numbers)
        text, messages = self.parse_inline(caption, lineno=self.lineno)
        whole += nodes.caption("", "", *text)
        return [whole, *messages]


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("picture", PictureDirective)
    return {"parallel_read_safe": True}
