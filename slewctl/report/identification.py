"""The report of a fit: model beside measurement, and the fitted arm as a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from slewctl._types import FilePath
from slewctl.errors import InputError, check_path
from slewctl.loop import Margins
from slewctl.loop.on_measured import OnMeasured
from slewctl.measured.rig_fit_result import RigFit
from slewctl.report.export import csv_text, json_text, write_files
from slewctl.report.measured_panel import loop_figure, margin_rows, response_figure
from slewctl.report.page import render, versions


def write_identification(
    found: RigFit,
    folder: FilePath,
    controller: tuple[OnMeasured, Margins | str] | None = None,
) -> Path:
    """Write the report of a fit and return the path of its page.

    Parameters
    ----------
    found : RigFit
    folder : str or PathLike
        Gets ``index.html``, ``fitted.toml`` (the arm, and its uncertainty as variations),
        ``response.csv`` and ``results.json``.
    controller : tuple of OnMeasured and Margins or str, optional
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
    folder = check_path(folder, "folder")
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
    met, on_model = controller or (None, "")
    beside = (
        margin_rows(met.margins, None if isinstance(on_model, str) else on_model) if met else []
    )
    page = render(
        "identification.html",
        fit=found,
        intervals=[found.interval(estimate.name) for estimate in found.estimates],
        picture=response_figure(response, computed, "fitted", "response"),
        margins=beside,
        met=met,
        loop_picture=loop_figure(met, "fitted", "loop") if met else "",
        on_model=on_model if isinstance(on_model, str) else "",
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
        "crossings": {"measured": met.crossings, "modelled": met.modelled_crossings} if met else {},
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
