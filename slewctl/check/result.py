"""What the gate found on a design: the findings that every output is written from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from slewctl.check.requirements import Verdict
from slewctl.compare import Reading

# The arm as the design file describes it, beside its named variations.
NOMINAL = "nominal"

# Exit statuses, as of pytest: all well, something failed, bad input.
ALL_HOLD, SOME_FAIL, BAD_INPUT = 0, 1, 2


@dataclass(frozen=True)
class Finding:
    """A verdict with its place.

    Attributes
    ----------
    verdict : Verdict
    arm : str
        `NOMINAL`, or the name of a variation.
    line : int or None
        Line of the design file that asks for it.
    against : {"requirement", "baseline"}
        Whether the limit is the file's own or comes from the last accepted run.
    """

    verdict: Verdict
    arm: str = NOMINAL
    line: int | None = None
    against: Literal["requirement", "baseline"] = "requirement"


@dataclass(frozen=True)
class DesignResult:
    """Everything found on one design file.

    Attributes
    ----------
    name : str
        Short name, unlike that of any other design of the run.
    file : Path
        As the user named it.
    findings : tuple of Finding
        Arm by arm, stability first.
    recorded : mapping of str to mapping
        By arm: the required quantities and all margins by name, from `measure`.
    notes : tuple of str
        What a person should know beside the verdicts.
    fingerprint : str
        Of the file's text and the programs that judged it; empty where nobody asked for it.
    digest : str
        Of the file's text alone, by which a renamed file is known again.
    error : str
        Why the design could not be judged, with file, line, key and remedy.
    error_line : int or None
    faults : tuple of (str, int or None)
        The single faults that `error` tells of, each with its line.
    unchanged : bool
        Not judged again since nothing changed after the last accepted run.
    missing : bool
        In the baseline, and its file is gone.
    seconds : float
        Time taken.
    """

    name: str
    file: Path
    findings: tuple[Finding, ...] = ()
    recorded: Mapping[str, Mapping[str, Reading]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    fingerprint: str = ""
    digest: str = ""
    error: str = ""
    error_line: int | None = None
    faults: tuple[tuple[str, int | None], ...] = ()
    unchanged: bool = False
    missing: bool = False
    seconds: float = 0.0

    @property
    def failures(self) -> tuple[Finding, ...]:
        """The findings that do not pass."""
        return tuple(found for found in self.findings if not found.verdict.passed)

    @property
    def status(self) -> Literal["broken", "missing", "unchanged", "failed", "passed"]:
        """Broken designs could not be judged; unchanged ones passed before."""
        if self.error:
            return "broken"
        if self.missing:
            return "missing"
        if self.unchanged:
            return "unchanged"
        # Nothing was judged without a finding, and nothing may pass unjudged.
        return "failed" if self.failures or not self.findings else "passed"


def exit_status(results: Iterable[DesignResult]) -> int:
    """Return 2 if a design could not be judged, else 1 if one failed or is missing, else 0.

    Parameters
    ----------
    results : iterable of DesignResult

    Returns
    -------
    int

    Examples
    --------
    >>> from pathlib import Path
    >>> from slewctl.check import DesignResult, exit_status
    >>> broken = DesignResult("arm", Path("designs/arm.toml"), error="no such basis")
    >>> exit_status([broken])
    2
    """
    found = {result.status for result in results}
    if "broken" in found:
        return BAD_INPUT
    return SOME_FAIL if found & {"failed", "missing"} else ALL_HOLD
