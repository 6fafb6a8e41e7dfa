"""The table of `slewctl check`: one row for an arm that passes, one for each failure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.table import Table
from rich.text import Text

from slewctl.check import NOMINAL, DesignResult, Finding
from slewctl.check.words import GONE, limit_text, place_text, value_text

_WORDS = {
    "passed": Text("ok", "green"),
    "failed": Text("FAIL", "bold red"),
    "broken": Text("BROKEN", "bold red"),
    "missing": Text("MISSING", "bold red"),
    "unchanged": Text("unchanged", "dim"),
}
_HEADINGS = ("design", "verdict", "requirement", "value", "limit", "note")
# Only these are broken into lines where the terminal is narrow.
_FOLDED = ("design", "note")
Row = tuple[str | Text, ...]


def verdict_table(results: Sequence[DesignResult], *, every: bool, failures: bool) -> Table | None:
    """Return the table of results, or None if it would be empty.

    Parameters
    ----------
    results : sequence of DesignResult
    every : bool
        Show each requirement instead of the tightest alone.
    failures : bool
        Show only what failed.
    """
    rows = [row for result in results for row in _rows(result, every, failures)]
    if not rows:
        return None
    # Columns that say nothing are left out.
    shown = [k for k, _ in enumerate(_HEADINGS) if any(str(row[k]) for row in rows)]
    table = Table(box=None, pad_edge=False)
    for k in shown:
        folded = _HEADINGS[k] in _FOLDED
        table.add_column(_HEADINGS[k], overflow="fold", no_wrap=not folded)
    for row in rows:
        table.add_row(*(row[k] for k in shown))
    return table


def _rows(result: DesignResult, every: bool, failures: bool) -> Iterator[Row]:
    """Yield the rows of a design: its arms one after the other."""
    for arm in dict.fromkeys(found.arm for found in result.findings):
        here = [found for found in result.findings if found.arm == arm]
        failed = [found for found in here if not found.verdict.passed]
        name = result.name if arm == NOMINAL else f"{result.name} [{arm}]"
        if every and not failures:
            yield from (_row(name, found) for found in here)
        elif failed:
            yield from _failures(name, failed)
        elif not failures:
            yield _tightest(name, here)
    if result.error:
        yield (result.name, _WORDS["broken"], "", "", "", "see the error below")
    elif result.missing:
        yield (result.name, _WORDS["missing"], "", "", "", GONE)
    elif result.unchanged and not failures:
        yield (result.name, _WORDS["unchanged"], "", "", "", "since it was accepted")


def _failures(name: str, failed: Sequence[Finding]) -> Iterator[Row]:
    """Yield a row for each reason to fail: an unstable loop is one reason, not five."""
    reasons: dict[object, list[Finding]] = {}
    for found in failed:
        verdict = found.verdict
        # What has a value fails by it; what has none fails for what the note says.
        shared = verdict.value is None or verdict.quantity.kind == "stability"
        reasons.setdefault(verdict.note if shared else id(found), []).append(found)
    for first, *others in reasons.values():
        row = _row(name, first)
        more = f" and {_many(len(others), 'requirement')} more" if others else ""
        yield (*row[:2], f"{row[2]}{more}", *row[3:])


def _tightest(name: str, here: Sequence[Finding]) -> Row:
    """Return the row of an arm that passes: the requirement with the least room left."""
    asked = [found for found in here if found.against == "requirement"]
    found = min(asked, key=lambda found: (found.verdict.requirement == "stable", _slack(found)))
    return (*_row(name, found)[:-1], found.verdict.note)


def _slack(found: Finding) -> float:
    return found.verdict.slack


def _row(name: str, found: Finding) -> Row:
    verdict = found.verdict
    at = place_text(verdict)
    return (
        name,
        _WORDS["passed" if verdict.passed else "failed"],
        f"{verdict.requirement}{' (baseline)' if found.against == 'baseline' else ''}",
        value_text(verdict),
        limit_text(verdict),
        "; ".join(text for text in (f"at {at}" if at else "", verdict.note) if text),
    )


def summary(results: Sequence[DesignResult], *, every: bool) -> str:
    """Return the last line: what holds, what failed, what could not be judged.

    Parameters
    ----------
    results : sequence of DesignResult
    every : bool
        Whether the table shows every requirement, or the tightest alone.
    """
    if not results:
        return (
            "only studies or arms, no design: nothing was judged (a design has a [controller]; "
            "slewctl study runs a study)"
        )
    shown = "" if every else "; the tightest of each is shown"
    findings = [found for result in results for found in result.findings]
    asked = [found for found in findings if found.against == "requirement"]
    failed = sum(not found.verdict.passed for found in asked)
    worse = sum(not found.verdict.passed for found in findings) - failed
    broken = sum(result.status == "broken" for result in results)
    gone = sum(result.missing for result in results)
    skipped = sum(result.unchanged for result in results)
    judged = len(results) - broken - gone - skipped
    parts = []
    if failed:
        parts.append(f"{failed} of {_many(len(asked), 'requirement')} failed")
    if worse:
        parts.append(f"{_many(worse, 'quantity', 'quantities')} worse than in the baseline")
    if gone:
        parts.append(f"{_many(gone, 'design')} of the baseline not found")
    if broken:
        parts.append(f"{_many(broken, 'design')} could not be judged")
    if not parts:
        parts.append(
            f"all requirements hold ({len(asked)} in {_many(judged, 'design')}{shown})"
            if judged
            else "nothing to judge"
        )
    if skipped:
        parts.append(f"{_many(skipped, 'design')} unchanged")
    return ", ".join(parts)


def _many(count: int, one: str, several: str = "") -> str:
    return f"{count} {one if count == 1 else several or f'{one}s'}"
