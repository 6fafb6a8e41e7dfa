"""The part of the explorer's page that changes: verdicts, and the curves of the design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from slewctl.compare import CaseResult
from slewctl.report.comparison import drawn
from slewctl.report.page import render


def explorer_page(body: str = "") -> str:
    """Return the page, whose main part is put there later or is given.

    Parameters
    ----------
    body : str
        From `explorer_body` or `explorer_refusal`.

    Returns
    -------
    str
    """
    return render("explorer.html", body=body)


def explorer_body(
    result: CaseResult,
    verdicts: Sequence[Mapping[str, Any]],
    *,
    confirmed: bool,
    doubt: str = "",
) -> str:
    """Return verdicts and figures as HTML.

    Parameters
    ----------
    result : CaseResult
        Of one design, and perhaps another beside it.
    verdicts : sequence of mapping
        As for `slewctl.report.comparison.section`.
    confirmed : bool
        Whether the verdicts are the gate's.
    doubt : str
        Why they cannot be.

    Returns
    -------
    str
    """
    return render(
        "explored.html",
        result=result,
        chosen=result.chosen,
        verdicts=verdicts,
        failed=[verdict for verdict in verdicts if not verdict["passed"]],
        arms=len({verdict["arm"] for verdict in verdicts}),
        confirmed=confirmed,
        doubt=doubt,
        **drawn(result),
    )


def explorer_refusal(message: str) -> str:
    """Return why there is no design with these settings, as HTML."""
    return render("explorer_refusal.html", message=message)
