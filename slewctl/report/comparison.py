"""The comparison report: a page, the same as Markdown, and its numbers for other tools."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from slewctl import report
from slewctl._types import FilePath
from slewctl.compare import (
    QUANTITIES,
    CaseResult,
    Comparison,
    Evaluation,
    Quantity,
    quantities_of,
    read,
    sampling_loss,
)
from slewctl.compare.quantities import WEIGHTED, Kind
from slewctl.errors import check_path
from slewctl.report.comparison_figures import figures, looks
from slewctl.report.comparison_tables import TABLES, file_name, known, readings
from slewctl.report.export import (
    csv_text,
    json_text,
    packed_csv,
    parquet,
    to_plain,
    write_files,
)
from slewctl.report.page import render, versions


def write_comparison(
    comparison: Comparison,
    folder: FilePath,
    *,
    as_parquet: bool = False,
    sections: Sequence[Mapping[str, Any]] | None = None,
    split: bool = False,
) -> Path:
    """Write the report of a comparison and return the path of its page.

    Parameters
    ----------
    comparison : Comparison
    folder : str or PathLike
        Gets ``index.html``, the same as ``index.md``, ``results.json``, the CSV tables
        ``designs`` and ``truths``, and gzipped the long ones: ``ladders``, ``poles``,
        ``loops``, ``slews`` and ``shapes``.
    as_parquet : bool
        Whether to write every table as Parquet too, which needs pyarrow.
    sections : sequence of mapping, optional
        What `section` returned of each case, where it was drawn in another process.
    split : bool
        Whether every design gets a page of its own, and ``index.html`` leads to them.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the folder cannot be written, or pyarrow is missing; nothing is left half-written.

    Examples
    --------
    >>> import slewctl as sc
    >>> from slewctl.compare import Case, compare
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> noise = {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
    >>> objective = sc.Objective({"tip": 0.03, "torque": 1.0}, noise)
    >>> case = Case("arm", arm, objective, truth_modes=6, bases=("clamped-free",), orders=(1,))
    >>> from pathlib import Path
    >>> from slewctl.report import write_comparison
    >>> write_comparison(compare([case]), Path("report"))  # doctest: +SKIP
    """
    folder = check_path(folder, "folder")
    if sections is None:
        sections = [section(k, case) for k, case in enumerate(comparison.cases)]
    results = {"versions": versions(), "cases": [_record(c) for c in comparison.cases]}
    files: dict[str, str | bytes] = {
        **_pages(sections, split),
        "index.md": render("comparison.md", cases=sections, **_asked(sections)),
        "results.json": json_text(results),
    }
    for name, (rows, long) in TABLES.items():
        table = list(rows(comparison))
        files[f"{name}.csv.gz" if long else f"{name}.csv"] = (
            packed_csv(table) if long else csv_text(table)
        )
        if as_parquet:
            files[f"{name}.parquet"] = parquet(table)
    write_files(folder, files)
    return folder / "index.html"


def _pages(sections: Sequence[Mapping[str, Any]], split: bool) -> dict[str, str]:
    """Return one page of all designs, or a page of each and one that leads to them."""
    files = [file_name(s["case"].name, k) + ".html" for k, s in enumerate(sections)]
    addresses = files if split else ["#" + s["anchor"] for s in sections]
    cases = [{**s, "address": at} for s, at in zip(sections, addresses, strict=True)]
    shared = {"cases": cases, **_asked(sections)}
    told = [] if split else cases
    pages = {"index.html": render("comparison.html", told=told, alone=None, **shared)}
    if split:
        for name, case in zip(files, cases, strict=True):
            pages[name] = render("comparison.html", told=[case], alone=case, **shared)
    return pages


def _asked(sections: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the requirements of all designs: which there are, how many, and how many fail."""
    verdicts = [v for s in sections for arm in s["verdicts"].values() for v in arm.values()]
    names = {v["quantity"] for v in verdicts}
    return {
        "required": [q for q in QUANTITIES.values() if q.name in names],
        "asked": len(verdicts),
        "failures": sum(not v["passed"] for v in verdicts),
    }


def _record(result: CaseResult) -> dict[str, Any]:
    """Return a case as JSON knows it, without what the long tables hold."""
    return {
        "case": result.case,
        "truth": result.truth,
        "chosen": result.chosen.origin.cells,
        "followed": [
            {
                "quantity": followed.quantity.name,
                "converged": followed.converged,
                "seen": [{"modes": s.modes, "value": known(s.reading)} for s in followed.seen],
            }
            for followed in result.followed
        ],
        "evaluations": [_evaluation(e, slewed=result.slewed) for e in result.evaluations],
        "refused": result.refused,
        **_measured(result),
    }


def _measured(result: CaseResult) -> dict[str, Any]:
    """Return what the controller meets on the measured response, if there is one."""
    met = result.measured
    if met is None:
        return {}
    crossings = {"measured": met.crossings, "modelled": met.modelled_crossings}
    found = {"stable": met.margins.stable, "margins": _margin_rows(result), "roots": met.roots}
    return {"measured": {**found, "crossings": crossings}}


def _margin_rows(result: CaseResult) -> list[dict[str, Any]]:
    """Return the margins on the measured response beside those on the truth; none without one."""
    met, chosen = result.measured, result.chosen
    own = chosen.judgement.margins if chosen.stable else None
    return report.margin_rows(met.margins, own) if met else []


def _evaluation(e: Evaluation, *, slewed: bool) -> dict[str, Any]:
    return {
        **e.origin.cells,
        "frequencies_hz": e.frequencies / (2 * math.pi),
        "frequency_errors": e.frequency_errors,
        "verified": e.verified,
        "certificate": str(e.controller.certificate),
        "expected_cost": e.controller.h2_cost,
        "stable": e.stable,
        "unstable_hz": e.judgement.unstable_hz,
        **_before_sampling(e),
        "quantities": {
            name: {"value": known(reading)}
            | {key: said for key, said in reading._asdict().items() if said and key != "value"}
            for name, reading in readings(e, slewed=slewed).items()
        },
    }


def _proof(chosen: Evaluation) -> str:
    """Return what proves the margins of a stable loop, and what is proved of those in doubt."""
    if not chosen.stable:
        return ""
    margins = chosen.judgement.margins
    if not margins.intervals:
        return "are confirmed by the poles of closed loops alone, not on intervals of the axis"
    exact = "to one part in a million" if margins.confirmed else "but " + "; ".join(margins.doubts)
    # A delay of any part of a sample turns no curve of z, of which intervals could be asked.
    late = "; closed-loop poles confirm that of the delay" if chosen.controller.sample_time else ""
    return f"are proved on {margins.intervals} intervals of the frequency axis, {exact}{late}"


def _before_sampling(e: Evaluation) -> dict[str, Any]:
    """Return the margins of the continuous law that a sampled one was made of."""
    loss = sampling_loss(e.judgement)
    if loss is None:
        return {}
    return {"continuous": {name: known(reading) for name, reading in loss.continuous.items()}}


def section(
    place: int, result: CaseResult, verdicts: Iterable[Mapping[str, Any]] = ()
) -> dict[str, Any]:
    """Return what the page shows of one case, its figures included.

    Parameters
    ----------
    place : int
        The case's own number.
    result : CaseResult
    verdicts : iterable of mapping
        Of each requirement: ``arm``, ``requirement``, ``quantity``, ``passed``, the numbers
        ``number`` and ``bound``, and as text ``value``, ``limit``, ``place`` and ``note``.

    Returns
    -------
    dict
    """
    anchor = f"case-{place}"
    by_arm: dict[str, dict[str, Mapping[str, Any]]] = {}
    for verdict in verdicts:
        by_arm.setdefault(verdict["arm"], {})[verdict["quantity"]] = verdict
    return {
        "result": result,
        "anchor": anchor,
        "verdicts": by_arm,
        "failed": [v for arm in by_arm.values() for v in arm.values() if not v["passed"]],
        "case": result.case,
        "truth": result.truth,
        "chosen": result.chosen,
        "clock": _clock(result.chosen),
        "unbounded": _unbounded(result.chosen),
        "proof": _proof(result.chosen),
        "sampling": sampling_loss(result.chosen.judgement),
        "ratios": np.atleast_1d(result.case.arm.damping_ratio).tolist(),
        "rows": [(e, readings(e, slewed=result.slewed)) for e in result.evaluations],
        "measured": _margin_rows(result),
        "groups": _groups(result),
        "bases": [(basis, _row(result, basis)) for basis in _bases(result)],
        "orders": sorted({e.n for e in result.evaluations}),
        "unstable": [e for e in result.evaluations if not e.stable],
        "saturating": [
            e
            for e in result.evaluations
            if result.slewed and e.judgement.moved and e.judgement.saturation
        ],
        "inputs": _inputs(result),
        **drawn(result),
        "beside": report.measured_figures(place, result.measured) if result.measured else [],
    }


def drawn(result: CaseResult) -> dict[str, Any]:
    """Return a case's figures, and what the page's script and the legend need of them."""
    designs = looks(result)
    return {
        "figures": [(kind, plot.svg(), caption) for kind, plot, caption in figures(result)],
        "designs": designs,
        "names": json.dumps([look["label"] for look in designs], ensure_ascii=False),
        "modes": json.dumps([float(f"{hz:.6g}") for hz in result.truth.frequencies_hz]),
        "looks": ";".join(
            f"--c{k}:{look['colour']};--d{k}:{look['dashes'] or 'none'}"
            for k, look in enumerate(designs)
        ),
    }


# The tables of all designs: a heading, and the kinds of quantities that stand in each.
_TABLES_OF_KINDS: dict[str, tuple[Kind, ...]] = {
    "Margins": ("margin",),
    "Sensitivity and poles": ("sensitivity", "pole"),
    "Cost, and levels under noise": ("cost", "noise"),
    "The slew": ("slew",),
}


def _groups(result: CaseResult) -> list[tuple[str, list[Quantity]]]:
    """Return the tables' headings with their quantities; volts only where there is a motor.

    Without limits and noise there is no cost, and no level under noise.
    """
    motor = result.case.arm.motor is not None
    quantities = quantities_of(result.case.slew)
    weighted = result.case.objective.weighted
    return [
        (title, [q for q in quantities if q.kind in kinds and (motor or q.unit != "V")])
        for title, kinds in _TABLES_OF_KINDS.items()
        if (weighted or not set(kinds) & set(WEIGHTED)) and (result.slewed or "slew" not in kinds)
    ]


def _clock(chosen: Evaluation) -> str:
    """Return the controller's clock in words; empty for a continuous one."""
    controller = chosen.controller
    if not controller.sample_time:
        return ""
    delay = f" and a delay of {1000 * controller.delay:g} ms" if controller.delay else ""
    return f"with a clock of {1000 * controller.sample_time:g} ms{delay}"


def _unbounded(chosen: Evaluation) -> str:
    """Return why the cost of a stable loop is infinite; empty where it is not."""
    cost = read(chosen.judgement, "h2_cost")
    return cost.note if math.isinf(cost.value) else ""


def _bases(result: CaseResult) -> list[str]:
    return list(dict.fromkeys(e.basis for e in result.evaluations))


def _row(result: CaseResult, basis: str) -> dict[int, Evaluation]:
    return {e.n: e for e in result.evaluations if e.basis == basis}


def _inputs(result: CaseResult) -> str:
    case = to_plain(result.case)
    hidden = ("name", "title") if result.slewed else ("name", "title", "slew")
    return json_text({key: item for key, item in case.items() if key not in hidden})
