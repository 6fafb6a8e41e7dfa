"""What becomes of a design when some of its keys are changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path

from slewctl._threads import single_threaded
from slewctl.check import NOMINAL, Finding, judge_at_once
from slewctl.check.words import told_finding
from slewctl.compare import CaseResult, glance
from slewctl.compare.single_design import glance_at_ladder, named
from slewctl.explore.changed_file import changed_text
from slewctl.explore.knobs import Value
from slewctl.files import DesignFile, design_of_text, read_design
from slewctl.gate import verdicts
from slewctl.report.comparison_figures import drawn_ladders
from slewctl.report.explorer import explorer_body, explorer_page

# What the design of the file itself is called beside the changed one.
_BEFORE = "as in the file: "
_FRAME = "width:100%;height:52rem;border:0"


@dataclass(frozen=True, eq=False)
class Explored:
    """A design as it is set, judged.

    Attributes
    ----------
    design : DesignFile
        Of the changed text.
    result : CaseResult
        Its loop and slew on the truth, and beside it those of the file as it was.
    findings : tuple of Finding
    confirmed : bool
        Whether the findings are those of the gate, on finer truths and on every arm of the
        file; those of a first look are of the file's own arm and one truth alone.
    """

    design: DesignFile
    result: CaseResult
    findings: tuple[Finding, ...]
    confirmed: bool

    @property
    def text(self) -> str:
        """The design file as it is set."""
        return self.design.source.text

    @property
    def holds(self) -> bool:
        """Whether every requirement holds, as far as it was looked at."""
        return all(finding.verdict.passed for finding in self.findings)

    def body(self, doubt: str = "") -> str:
        """Return verdicts and figures as a part of a page.

        Parameters
        ----------
        doubt : str
            Why they are not confirmed.

        Returns
        -------
        str
            With the place of a ladder that is not climbed held for `seen_ladder`.
        """
        told = [told_finding(finding) for finding in self.findings]
        with self.design.source.computing():
            return explorer_body(self.result, told, confirmed=self.confirmed, doubt=doubt)

    def __repr__(self) -> str:
        failed = sum(not finding.verdict.passed for finding in self.findings)
        state = f"{failed} of {len(self.findings)} requirements fail" if failed else "all hold"
        return f"<{self.result.case.name} explored: {self.result.chosen.origin}, {state}>"

    def _repr_html_(self) -> str:
        page = escape(explorer_page(self.body()))
        return (
            f'<iframe title="{escape(repr(self)[1:-1])}" style="{_FRAME}" srcdoc="{page}"></iframe>'
        )


@single_threaded
def explored(
    design: DesignFile | Path | str,
    settings: Mapping[str, Value] | None = None,
    *,
    beside: CaseResult | None = None,
    confirm: bool = True,
    ladder: bool = True,
) -> Explored:
    """Return what becomes of a design when some of its keys are changed.

    Parameters
    ----------
    design : DesignFile, Path or str
        The design, or its file.
    settings : mapping of str to float, int or str, optional
        By the keys of `knobs_of`.
    beside : CaseResult, optional
        Another design that is shown with it, such as that of the file itself: `before`.
    confirm : bool
        Whether the verdicts are the gate's own, and what the ladder tells is proved.
    ladder : bool
        Whether the ladder is climbed.

    Returns
    -------
    Explored

    Raises
    ------
    SlewctlError
        For what a design file of these keys would be refused for, or no controller.

    Examples
    --------
    >>> from slewctl.explore import explored
    >>> from slewctl.files import example_design
    >>> explored(example_design(), {"model.n": 2})
    <arm explored: clamped-free, n = 2, all hold>
    """
    file = design if isinstance(design, DesignFile) else read_design(Path(design))
    changed = set_as(file, settings or {})
    with changed.source.computing():
        result = glance(changed.case, beside, whole=confirm, ladder=ladder)
        judgement = result.chosen.judgement
        if confirm:
            findings = verdicts(changed, judgement)
        else:
            met = judge_at_once(judgement, changed.requirements)
            findings = tuple(Finding(verdict, NOMINAL) for verdict in met)
    return Explored(changed, result, findings, confirm)


@single_threaded
def seen_ladder(design: DesignFile, beside: CaseResult | None = None) -> str:
    """Return the ladder of a first look as it is drawn, which takes as long as all the rest of it.

    Parameters
    ----------
    design : DesignFile
    beside : CaseResult, optional
        As for `explored`.

    Returns
    -------
    str
        SVG, for `slewctl.report.explorer.with_ladder`.

    Raises
    ------
    SlewctlError
        As `explored` does.
    """
    with design.source.computing():
        own = glance_at_ladder(design.case)
        ladders = (*(beside.ladders if beside else ()), own)
        origins = [ladder.origin for ladder in ladders]
        return drawn_ladders(design.case, ladders, origins).svg()


def set_as(design: DesignFile, settings: Mapping[str, Value]) -> DesignFile:
    """Return a design with some of its keys changed; itself where there are none.

    Raises
    ------
    SlewctlError
        For what a design file of these keys would be refused for.
    """
    if not settings:
        return design
    return design_of_text(changed_text(design, settings), design.path, design.case.name)


def before(design: DesignFile) -> CaseResult | None:
    """Return the design of a file as it is, to be shown beside a changed one; None of a given law.

    Parameters
    ----------
    design : DesignFile

    Returns
    -------
    CaseResult or None

    Raises
    ------
    SlewctlError
        If there is no controller.
    """
    if design.case.is_given:
        return None
    with design.source.computing():
        found = glance(design.case)
    return named(found, f"{_BEFORE}{design.case.basis}")
