"""Model beside measurement: figures and tables that several pages show."""

from __future__ import annotations

from typing import Any

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.loop import Margins
from slewctl.loop.measured_margin_results import MeasuredMargins
from slewctl.loop.on_measured import OnMeasured
from slewctl.measured.response import Response
from slewctl.report.drawing import INK, figure, legend, plain_labels, style, svg
from slewctl.report.palette import ALARM

# What stands below each figure.
RESPONSE = (
    "The measured response with its 95 % band, that of the arm's model with its dead time and the "
    "clock of the measurement, and the coherence."
)
MEASURED_LOOP = (
    "The controller's return ratio on the measured response, with the disks in which it lies, and "
    "on the model."
)
# A larger step of the phase in degrees, from point to point, is one of its turns.
_TURN = 180.0
_LOOKS = style("clamped-free")
_MARGINS = (
    ("gain_db", "gain may rise (dB)"),
    ("gain_reduction_db", "gain may fall (dB)"),
    ("phase_deg", "phase (deg)"),
    ("delay_s", "delay (s)"),
    ("modulus", "distance from −1"),
)


def response_figure(response: Response, computed: ComplexArray, label: str, name: str) -> str:
    """Return a measured response with its band, the model's over it, and the coherence."""
    hz, size = response.frequencies_hz, np.abs(response.values)
    low, high = response.band()
    fig, axes = figure(3, 1, (7.2, 6.0), sharex=True)
    axes[0].fill_between(hz, low, high, color=_LOOKS["color"], alpha=0.25, lw=0)
    axes[0].plot(hz, size, lw=0.9, color=_LOOKS["color"], label="measured")
    axes[0].plot(hz, np.abs(computed), "--", lw=1.2, color=ALARM, label=label)
    axes[0].set_yscale("log")
    shown = size[size > 0]
    axes[0].set_ylim(shown.min() / 3, shown.max() * 3)  # whatever the band does
    axes[0].set_ylabel(f"magnitude ({response.unit})")
    legend(axes[0])
    axes[1].plot(hz, np.angle(response.values, deg=True), ".", ms=2, color=_LOOKS["color"])
    axes[1].plot(hz, _without_turns(computed), lw=1.2, color=ALARM)
    axes[1].set_ylabel("phase (deg)")
    axes[2].plot(hz, np.asarray(response.coherence), lw=0.9, color=_LOOKS["color"])
    axes[2].set_ylim(0, 1.02)
    axes[2].set_ylabel("coherence")
    _along_frequency(axes[2])
    way = f"from {response.actuator} to {response.sensor}"
    return svg(fig, name, f"Measured and {label} response {way}, with coherence")


def loop_figure(met: OnMeasured, label: str, name: str) -> str:
    """Return the return ratio on the measurement, with its disks, and on the model."""
    fig, (gain, phase) = figure(2, 1, (7.2, 4.6), sharex=True)
    size = np.abs(met.loop)
    low = np.maximum(size - met.radius, size / 30)
    gain.fill_between(met.hz, low, size + met.radius, color=_LOOKS["color"], alpha=0.25, lw=0)
    gain.plot(met.hz, size, lw=0.9, color=_LOOKS["color"], label="measured")
    gain.plot(met.hz, np.abs(met.modelled_loop), "--", lw=1.1, color=ALARM, label=label)
    gain.axhline(1, color=INK, lw=0.9)
    gain.set_yscale("log")
    gain.set_ylabel("|L|")
    legend(gain)
    phase.plot(met.hz, _without_turns(met.loop), lw=0.9, color=_LOOKS["color"])
    phase.plot(met.hz, _without_turns(met.modelled_loop), "--", lw=1.1, color=ALARM)
    phase.set_ylabel("arg L (deg)")
    _along_frequency(phase)
    return svg(fig, name, f"Return ratio on the measured response and on the {label} one")


def measured_figures(place: int, met: OnMeasured) -> list[tuple[str, str]]:
    """Return the figures of a case on its measured response, each with its caption."""
    return [
        (response_figure(met.response, met.computed, "truth", f"r{place}"), RESPONSE),
        (loop_figure(met, "truth", f"m{place}"), MEASURED_LOOP),
    ]


def margin_rows(measured: MeasuredMargins, other: Margins | None) -> list[dict[str, Any]]:
    """Return each margin on the measurement, with its interval, beside the model's."""
    rows = []
    for name, title in _MARGINS:
        margin = getattr(measured, name)
        rows.append(
            {
                "margin": title,
                "measured": margin.value,
                "low": margin.low,
                "high": margin.high,
                "frequency_hz": margin.frequency_hz,
                "modelled": None if other is None else getattr(other, name).value,
            }
        )
    return rows


def _without_turns(values: ComplexArray) -> Array:
    """Return phases in degrees, with gaps where they turn by 360°, which is no line."""
    phase = np.angle(values, deg=True)
    phase[1:][np.abs(np.diff(phase)) > _TURN] = np.nan
    return np.asarray(phase)


def _along_frequency(ax: Any) -> None:
    ax.set_xscale("log")
    ax.set_xlabel("frequency (Hz)")
    plain_labels(ax.xaxis)
