"""The comparison report: a page, the same as Markdown, and its numbers for other tools."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from slewctl.compare import (
    QUANTITIES,
    CaseResult,
    Comparison,
    Evaluation,
    Quantity,
    Reading,
    read,
    sampling_loss,
)
from slewctl.compare.quantities import WEIGHTED, Kind
from slewctl.loop.on_measured import OnMeasured
from slewctl.report.comparison_figures import (
    BODE,
    LADDER,
    MEASURED_LOOP,
    NICHOLS,
    POLES,
    RESPONSE,
    SHAPES,
    SLEW,
    bode_figure,
    ladder_figure,
    nichols_figure,
    poles_figure,
    shapes_figure,
    slew_figure,
)
from slewctl.report.export import (
    csv_text,
    json_text,
    packed_csv,
    parquet,
    to_plain,
    write_files,
)
from slewctl.report.measured_panel import loop_figure, margin_rows, response_figure
from slewctl.report.page import render, versions


def write_comparison(
    comparison: Comparison,
    folder: Path,
    *,
    as_parquet: bool = False,
    sections: Sequence[Mapping[str, Any]] | None = None,
) -> Path:
    """Write the report of a comparison and return the path of its page.

    Parameters
    ----------
    comparison : Comparison
    folder : Path
        Gets ``index.html``, the same as ``index.md``, ``results.json``, the CSV tables
        ``designs`` and ``truths``, and gzipped the long ones: ``ladders``, ``poles``,
        ``loops``, ``slews`` and ``shapes``.
    as_parquet : bool
        Whether to write every table as Parquet too, which needs pyarrow.
    sections : sequence of mapping, optional
        What `section` returned of each case, where it was drawn in another process.

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
    if sections is None:
        sections = [section(k, case) for k, case in enumerate(comparison.cases)]
    results = {"versions": versions(), "cases": [_record(c) for c in comparison.cases]}
    files: dict[str, str | bytes] = {
        "index.html": render("comparison.html", cases=sections),
        "index.md": render("comparison.md", cases=sections),
        "results.json": json_text(results),
    }
    for name, (rows, long) in _TABLES.items():
        table = list(rows(comparison))
        files[f"{name}.csv.gz" if long else f"{name}.csv"] = (
            packed_csv(table) if long else csv_text(table)
        )
        if as_parquet:
            files[f"{name}.parquet"] = parquet(table)
    write_files(folder, files)
    return folder / "index.html"


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
                "seen": [{"modes": s.modes, "value": _known(s.reading)} for s in followed.seen],
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
    return margin_rows(met.margins, own) if met else []


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
            name: {"value": _known(reading)}
            | {key: said for key, said in reading._asdict().items() if said and key != "value"}
            for name, reading in _readings(e, slewed=slewed).items()
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
    return f"are proved on {margins.intervals} intervals of the frequency axis, {exact}"


def _before_sampling(e: Evaluation) -> dict[str, Any]:
    """Return the margins of the continuous law that a sampled one was made of."""
    loss = sampling_loss(e.judgement)
    if loss is None:
        return {}
    return {"continuous": {name: _known(reading) for name, reading in loss.continuous.items()}}


def _readings(e: Evaluation, *, slewed: bool) -> dict[str, Reading]:
    """Return every quantity; those of a slew only where one was asked for."""
    asked = (name for name, q in QUANTITIES.items() if slewed or q.kind != "slew")
    return {name: read(e.judgement, name) for name in asked}


def _known(reading: Reading) -> float | None:
    return None if math.isnan(reading.value) else reading.value


def section(place: int, result: CaseResult) -> dict[str, Any]:
    """Return what the page shows of one case, its figures included; `place` is its own number."""
    anchor = f"case-{place}"
    return {
        "result": result,
        "anchor": anchor,
        "case": result.case,
        "truth": result.truth,
        "chosen": result.chosen,
        "clock": _clock(result.chosen),
        "unbounded": _unbounded(result.chosen),
        "proof": _proof(result.chosen),
        "sampling": sampling_loss(result.chosen.judgement),
        "ratios": np.atleast_1d(result.case.arm.damping_ratio).tolist(),
        "rows": [(e, _readings(e, slewed=result.slewed)) for e in result.evaluations],
        "measured": _margin_rows(result),
        "groups": _groups(result),
        "bases": [(basis, _row(result, basis)) for basis in _bases(result)],
        "orders": sorted({e.n for e in result.evaluations}),
        "unstable": [e for e in result.evaluations if not e.stable],
        "saturating": [
            e for e in result.evaluations if e.stable and result.slewed and e.judgement.saturation
        ],
        "inputs": _inputs(result),
        "figures": [
            *([(shapes_figure(result, f"s{place}"), SHAPES)] if result.shapes else []),
            (ladder_figure(result, f"l{place}"), LADDER),
            (poles_figure(result, f"p{place}"), POLES),
            (bode_figure(result, f"b{place}"), BODE),
            (nichols_figure(result, f"n{place}"), NICHOLS),
            *([(slew_figure(result, f"t{place}"), SLEW)] if result.slewed else []),
        ],
        "measured_figures": _measured_figures(place, result.measured),
    }


def _measured_figures(place: int, met: OnMeasured | None) -> list[tuple[str, str]]:
    if met is None:
        return []
    return [
        (response_figure(met.response, met.computed, "truth", f"r{place}"), RESPONSE),
        (loop_figure(met, "truth", f"m{place}"), MEASURED_LOOP),
    ]


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
    weighted = result.case.objective.weighted
    return [
        (title, [q for q in QUANTITIES.values() if q.kind in kinds and (motor or q.unit != "V")])
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
    loss = read(chosen.judgement, "h2_loss")
    return loss.note if math.isinf(loss.value) else ""


def _bases(result: CaseResult) -> list[str]:
    return list(dict.fromkeys(e.basis for e in result.evaluations))


def _row(result: CaseResult, basis: str) -> dict[int, Evaluation]:
    return {e.n: e for e in result.evaluations if e.basis == basis}


def _inputs(result: CaseResult) -> str:
    case = to_plain(result.case)
    hidden = ("name", "title") if result.slewed else ("name", "title", "slew")
    return json_text({key: item for key, item in case.items() if key not in hidden})


def _each(comparison: Comparison) -> Iterator[tuple[CaseResult, Evaluation]]:
    for case in comparison.cases:
        for evaluation in case.evaluations:
            yield case, evaluation


# Kinds of quantities that are reached at a frequency.
_PLACED: tuple[Kind, ...] = ("margin", "sensitivity", "pole")


def _design_rows(comparison: Comparison) -> Iterable[dict[str, Any]]:
    for case, e in _each(comparison):
        found: dict[str, Any] = {
            "case": case.case.name,
            **e.origin.cells,
            "chosen": e is case.chosen,
            "verified": e.verified,
            "unstable_hz": None if e.stable else e.judgement.unstable_hz[0],
            "worst_frequency_error": e.worst_frequency_error,
            "expected_cost": e.controller.h2_cost,
            "optimal_cost": case.truth.optimal_cost,
            "margins_confirmed": e.judgement.margins.confirmed if e.stable else None,
        }
        for name, reading in _readings(e, slewed=case.slewed).items():
            found[name] = e.stable if name == "stable" else _known(reading)
            if QUANTITIES[name].kind in _PLACED:
                found[f"{name}_at_hz"] = reading.frequency_hz if e.stable else None
        yield found


def _truth_rows(comparison: Comparison) -> Iterable[dict[str, Any]]:
    for case in comparison.cases:
        for mode, frequency in enumerate(case.truth.frequencies_hz, start=1):
            yield {"case": case.case.name, "mode": mode, "frequency_hz": frequency}


def _pole_rows(comparison: Comparison) -> Iterable[dict[str, Any]]:
    for case, e in _each(comparison):
        for pole in e.judgement.poles:
            yield {
                "case": case.case.name, **e.origin.cells,
                "real": pole.real, "imag": pole.imag,
            }  # fmt: skip


def _loop_rows(comparison: Comparison) -> Iterable[dict[str, Any]]:
    for case in comparison.cases:
        for curve in case.curves:
            columns = (curve.frequency_hz, curve.gain_db, curve.phase_deg)
            for f, gain, phase in zip(*(to_plain(c) for c in columns), strict=True):
                yield {
                    "case": case.case.name, **curve.origin.cells,
                    "frequency_hz": f, "gain_db": gain, "phase_deg": phase,
                }  # fmt: skip


def _ladder_rows(comparison: Comparison) -> Iterable[dict[str, Any]]:
    for case in comparison.cases:
        for ladder in case.ladders:
            for row in ladder.rows():
                yield {"case": case.case.name, **ladder.origin.cells, **row}


def _slew_rows(comparison: Comparison) -> Iterable[dict[str, Any]]:
    names = ("t", "theta", "tip", "tip_deflection", "torque", "tip_reference")
    for case in comparison.cases:
        for curves in case.curves if case.slewed else ():
            columns = [to_plain(getattr(curves.slew, name)) for name in names if curves.slew]
            row = {"case": case.case.name, **curves.origin.cells}
            for values in zip(*columns, strict=True):
                yield row | dict(zip(names, values, strict=True))


def _shape_rows(comparison: Comparison) -> Iterable[dict[str, Any]]:
    for case in comparison.cases:
        for source in case.shapes:
            for mode, shape in enumerate(source.shapes, start=1):
                for x, value in zip(to_plain(source.x), to_plain(shape), strict=True):
                    yield {
                        "case": case.case.name, "source": source.source, "mode": mode,
                        "x": x, "displacement": value,
                    }  # fmt: skip


# The rows of each table, and whether it is long and therefore packed.
_TABLES: dict[str, tuple[Callable[[Comparison], Iterable[dict[str, Any]]], bool]] = {
    "truths": (_truth_rows, False),
    "designs": (_design_rows, False),
    "ladders": (_ladder_rows, True),
    "poles": (_pole_rows, True),
    "loops": (_loop_rows, True),
    "slews": (_slew_rows, True),
    "shapes": (_shape_rows, True),
}
