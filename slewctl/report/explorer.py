"""The part of the explorer's page that changes: verdicts, and the curves of the design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from slewctl.compare import CaseResult
from slewctl.report.comparison import drawn
from slewctl.report.comparison_figures import caption
from slewctl.report.page import render

# Stands where the ladder will, as high as that (414 units), so that nothing on the page jumps.
_LATER = (
    '<svg class="later" viewBox="0 0 480 414" role="img" aria-label="The ladder follows">'
    '<text x="240" y="200" text-anchor="middle" fill="currentColor">the ladder follows …</text>'
    "</svg>"
)


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
        With the place of a ladder that is not climbed held for `with_ladder`.
    """
    climbed = any(ladder.origin == result.chosen.origin for ladder in result.ladders)
    shown = drawn(result if climbed else replace(result, ladders=()))
    if not climbed:
        place = [kind for kind, *_ in shown["figures"]].index("poles")
        shown["figures"].insert(place, ("ladder", _LATER, caption("ladder")))
    return render(
        "explored.html",
        result=result,
        chosen=result.chosen,
        verdicts=verdicts,
        failed=[verdict for verdict in verdicts if not verdict["passed"]],
        arms=len({verdict["arm"] for verdict in verdicts}),
        confirmed=confirmed,
        doubt=doubt,
        **shown,
    )


def with_ladder(body: str, ladder: str) -> str:
    """Return a body whose ladder's place was held, with its ladder.

    Parameters
    ----------
    body : str
        From `explorer_body` without its ladder.
    ladder : str
        From `ladder_figure` or `drawn_ladders`, as SVG.

    Returns
    -------
    str
    """
    return body.replace(_LATER, ladder)


def explorer_refusal(message: str) -> str:
    """Return why there is no design with these settings, as HTML."""
    return render("explorer_refusal.html", message=message)
