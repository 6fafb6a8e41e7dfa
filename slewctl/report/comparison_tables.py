"""The rows of a comparison's tables, for other tools."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from slewctl.compare import (
    QUANTITIES,
    CaseResult,
    Comparison,
    Evaluation,
    Reading,
    quantities_of,
    read,
)
from slewctl.compare.quantities import Kind
from slewctl.report.export import to_plain


def file_name(name: str, place: int) -> str:
    """Return a design's name as one of a file, as safe in a folder as in an address."""
    plain = re.sub(r"[^A-Za-z0-9._-]+", "-", name)
    # A name that had to change, or is the overview's, could be another's.
    unlike = plain != name or plain in ("index", "designs", "")
    return f"{plain}-{place + 1}" if unlike else plain


def readings(e: Evaluation, *, slewed: bool) -> dict[str, Reading]:
    """Return every quantity of a design by name; those of a slew only where one was asked for."""
    asked = (q for q in quantities_of(e.judgement.slew) if slewed or q.kind != "slew")
    return {q.name: read(e.judgement, q.name) for q in asked}


def known(reading: Reading) -> float | None:
    """Return a value, None where there is none."""
    return None if math.isnan(reading.value) else reading.value


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
        told = readings(e, slewed=case.slewed)
        for name in QUANTITIES:  # all of them: the table is one of many designs
            reading = told.get(name, Reading(math.nan))
            found[name] = e.stable if name == "stable" else known(reading)
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
TABLES: dict[str, tuple[Callable[[Comparison], Iterable[dict[str, Any]]], bool]] = {
    "truths": (_truth_rows, False),
    "designs": (_design_rows, False),
    "ladders": (_ladder_rows, True),
    "poles": (_pole_rows, True),
    "loops": (_loop_rows, True),
    "slews": (_slew_rows, True),
    "shapes": (_shape_rows, True),
}
