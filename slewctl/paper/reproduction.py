"""The whole reproduction: tables, figures, errata and findings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from slewctl.paper.conditioning import ConditioningFinding, conditioning
from slewctl.paper.errata import Erratum, errata
from slewctl.paper.figures import Figures, figures
from slewctl.paper.findings import Findings, findings
from slewctl.paper.tables import Tables, tables

# What `reproduce` does, in order; also how many times it calls its `progress`.
PARTS = ("tables 1-3 and eq. 49-50", "figures 2-7", "errata", "integrators and hub inertia",
         "raw coordinates and the solver")  # fmt: skip


@dataclass(frozen=True, eq=False)
class PaperReproduction:
    """The paper's numbers beside computed ones, its misprints, and what qualifies it.

    Attributes
    ----------
    tables : Tables
        Tables 1–3 and eq. 49–50.
    figures : Figures
        Data of Figures 2–7.
    errata : tuple of Erratum
    findings : Findings
        The integrator, and the hub's inertia.
    conditioning : ConditioningFinding
        Whether stiff matrices hurt a solver.
    """

    tables: Tables
    figures: Figures
    errata: tuple[Erratum, ...]
    findings: Findings
    conditioning: ConditioningFinding


def reproduce(progress: Callable[[str], None] | None = None) -> PaperReproduction:
    """Return the reproduction of the paper; some ten seconds of computing.

    Parameters
    ----------
    progress : callable, optional
        Called with each of `PARTS`, before that part.

    Returns
    -------
    PaperReproduction

    Examples
    --------
    >>> from slewctl.paper import reproduce
    >>> reproduce(print)  # doctest: +SKIP
    """

    def say(part: str) -> None:
        if progress is not None:
            progress(part)

    say(PARTS[0])
    numbers = tables()
    say(PARTS[1])
    curves = figures()
    say(PARTS[2])
    misprints = errata()
    say(PARTS[3])
    found = findings()
    say(PARTS[4])
    return PaperReproduction(numbers, curves, misprints, found, conditioning())
