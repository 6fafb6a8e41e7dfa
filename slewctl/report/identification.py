"""The report of a fit: model beside measurement, and the fitted arm as a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from slewctl.errors import InputError
from slewctl.loop import Margins
from slewctl.loop.measured_margin_results import MeasuredMargins
from slewctl.measured.rig_fit_result import RigFit
from slewctl.report.drawing import figure, legend, plain_labels, style, svg
from slewctl.report.export import csv_text, json_text, write_files
from slewctl.report.page import render, versions
from slewctl.report.palette import ALARM

# A larger step of the phase in degrees, from point to point, is one of its turns.
_TURN = 180.0


def write_identification(
    found: RigFit,
    folder: Path,
    margins: tuple[MeasuredMargins, Margins | str] | None = None,
) -> Path:
    """Write the report of a fit and return the path of its page.

    Parameters
    ----------
    found : RigFit
    folder : Path
        Gets ``index.html``, ``fitted.toml`` (the arm, and its uncertainty as variations),
        ``response.csv`` and ``results.json``.
    margins : tuple of MeasuredMargins and Margins or str, optional
        What a controller meets on the measured response and on the fitted arm; a text where
        the latter loop has no margins.

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
    >>> from slewctl.report import write_identification
    >>> write_identification(found, Path("report"))  # doctest: +SKIP
    """
    response = found.response
    computed = found.computed()
    rows = [
        {
            "frequency_hz": hz,
            "real": measured.real,
            "imag": measured.imag,
            "deviation": deviation,
            "coherence": coherence,
            "fitted_real": fitted.real,
            "fitted_imag": fitted.imag,
        }
        for hz, measured, deviation, coherence, fitted in zip(
            response.frequencies_hz.tolist(),
            response.values.tolist(),
            response.known_deviation.tolist(),
            np.asarray(response.coherence).tolist(),
            computed.tolist(),
            strict=True,
        )
    ]
    beside = _beside(margins)
    page = render(
        "identification.html",
        fit=found,
        intervals=[found.interval(estimate.name) for estimate in found.estimates],
        picture=_response_figure(found, computed),
        margins=beside,
        on_rig=margins[0] if margins else None,
        on_model=margins[1] if margins and isinstance(margins[1], str) else "",
    )
    results = {
        "versions": versions(),
        "estimates": found.estimates,
        "intervals_95": {e.name: found.interval(e.name) for e in found.estimates},
        "covariance": found.covariance,
        "undetermined": found.undetermined,
        "gain": found.gain,
        "delay": found.delay,
        "roots": found.roots,
        "remarks": [*response.remarks, *(found.log.remarks if found.log else ()), *found.remarks],
        "margins": beside,
    }
    write_files(
        folder,
        {
            "index.html": page,
            "fitted.toml": _arm_file(found),
            "response.csv": csv_text(rows),
            "results.json": json_text(results),
        },
    )
    return folder / "index.html"


def _arm_file(found: RigFit) -> str:
    """Return the fitted arm with its variations, and what belongs to no arm as comments."""
    told = [f"# {line}" for line in str(found).splitlines()]
    try:
        text = found.to_toml(variations=found.variations())
    except InputError as error:
        told.append(f"# no variations: {error.what}")
        text = found.to_toml()
    return "\n".join([*told, "", text])


def _response_figure(found: RigFit, computed: object) -> str:
    response = found.response
    hz, fitted = response.frequencies_hz, np.asarray(computed)
    low, high = response.band()
    fig, axes = figure(3, 1, (7.2, 6.0), sharex=True)
    looks = style("clamped-free")
    axes[0].fill_between(hz, low, high, color=looks["color"], alpha=0.25, lw=0)
    axes[0].plot(hz, np.abs(response.values), lw=0.9, color=looks["color"], label="measured")
    axes[0].plot(hz, np.abs(fitted), "--", lw=1.2, color=ALARM, label="fitted")
    axes[0].set_yscale("log")
    size = np.abs(response.values)
    axes[0].set_ylim(size.min() / 3, size.max() * 3)  # whatever the band does
    axes[0].set_ylabel(f"magnitude ({response.unit})")
    legend(axes[0])
    axes[1].plot(hz, np.angle(response.values, deg=True), ".", ms=2, color=looks["color"])
    phase = np.angle(fitted, deg=True)
    phase[1:][np.abs(np.diff(phase)) > _TURN] = np.nan  # a turn of 360° is no line
    axes[1].plot(hz, phase, lw=1.2, color=ALARM)
    axes[1].set_ylabel("phase (deg)")
    axes[2].plot(hz, np.asarray(response.coherence), lw=0.9, color=looks["color"])
    axes[2].set_ylim(0, 1.02)
    axes[2].set_ylabel("coherence")
    axes[2].set_xscale("log")
    axes[2].set_xlabel("frequency (Hz)")
    plain_labels(axes[2].xaxis)
    name = f"from {response.actuator} to {response.sensor}"
    return svg(fig, "response", f"Measured and fitted response {name}, with coherence")


def _beside(
    margins: tuple[MeasuredMargins, Margins | str] | None,
) -> list[dict[str, float | str | None]]:
    """Return each margin on the rig, with its interval, beside the one on the fitted arm."""
    if margins is None:
        return []
    measured, fitted = margins
    found: list[dict[str, float | str | None]] = []
    for name, title in (
        ("gain_db", "gain may rise (dB)"),
        ("gain_reduction_db", "gain may fall (dB)"),
        ("phase_deg", "phase (deg)"),
        ("delay_s", "delay (s)"),
        ("modulus", "distance from −1"),
    ):
        margin = getattr(measured, name)
        own = None if isinstance(fitted, str) else getattr(fitted, name).value
        found.append(
            {
                "margin": title,
                "measured": margin.value,
                "low": margin.low,
                "high": margin.high,
                "frequency_hz": margin.frequency_hz,
                "fitted": own,
            }
        )
    return found
