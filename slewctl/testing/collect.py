"""Design files as pytest sees them: one file, one test for each requirement.

`slewctl.testing.plugin` decides which files are designs and loads this module for the first one.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

import pytest

from slewctl.check import NOMINAL, DesignResult, Finding
from slewctl.check.measured import MEASURED
from slewctl.check.words import limit_text, place_text, value_text
from slewctl.errors import SlewctlError
from slewctl.files import DesignFile as Design
from slewctl.files import read_design
from slewctl.files.uncertainty import WORST
from slewctl.gate import examine


class RequirementFailedError(AssertionError):
    """A requirement of a design does not hold; its text is all that a person needs."""


class DesignFile(pytest.File):
    """A design file.  It is read when collected and judged when its first test runs."""

    def collect(self) -> Iterator[pytest.Item]:
        """Yield a test for each requirement on each arm, or one that says why there is none."""
        try:
            design = read_design(self.path)
        except SlewctlError as error:
            yield Broken.from_parent(self, name="can_be_judged", why=str(error))
            return
        self.judging = Judging(design)
        asked = {NOMINAL: design.requirements}
        asked.update({variation.name: variation.requirements for variation in design.variations})
        if design.uncertainty is not None:
            asked[WORST] = design.requirements
        if design.measured is not None:
            asked[MEASURED] = design.measured.requirements
        for arm, requirements in asked.items():
            for requirement in dict.fromkeys(["stable", *requirements]):
                name = requirement if arm == NOMINAL else f"{requirement}[{arm}]"
                yield Required.from_parent(self, name=name, arm=arm, requirement=requirement)


class Judging:
    """A design and its result, computed once."""

    def __init__(self, design: Design) -> None:
        self.design = design

    @cached_property
    def result(self) -> DesignResult:
        """The verdicts."""
        return examine(self.design)


class _DesignTest(pytest.Item):
    """A test that shows its failure in its own words."""

    def __init__(self, **keys: Any) -> None:
        super().__init__(**keys)
        self.add_marker("slewctl")

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """Return the failure's text without a traceback."""
        if isinstance(excinfo.value, RequirementFailedError):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """Return the file and what the summary calls the test."""
        return self.path, None, f"{self.path.name}: {self.name}"


class Broken(_DesignTest):
    """A design file that cannot be read: it fails."""

    def __init__(self, *, why: str, **keys: Any) -> None:
        super().__init__(**keys)
        self.why = why

    def runtest(self) -> None:
        """Fail with file, line, key and remedy."""
        raise RequirementFailedError(self.why)


class Required(_DesignTest):
    """One requirement on one arm of a design."""

    def __init__(self, *, arm: str, requirement: str, **keys: Any) -> None:
        super().__init__(**keys)
        self.arm, self.requirement = arm, requirement

    def runtest(self) -> None:
        """Judge the whole design, once for all its tests, and fail if this does not hold."""
        parent = self.parent
        if not isinstance(parent, DesignFile):
            raise TypeError(f"{parent!r} is no design file")
        result = parent.judging.result
        mine = [f for f in result.findings if self._asks(f)]
        if not mine:
            raise RequirementFailedError(result.error or f"{self.path}: nothing was judged")
        for finding in mine:
            if not finding.verdict.passed:
                raise RequirementFailedError(_failure(result, finding))

    def _asks(self, finding: Finding) -> bool:
        return (finding.arm, finding.verdict.requirement) == (self.arm, self.requirement)


def _failure(result: DesignResult, finding: Finding) -> str:
    verdict = finding.verdict
    place = f"{result.file}:{finding.line}" if finding.line else str(result.file)
    at = place_text(verdict)
    lines = [
        f"{place}: {verdict.requirement} does not hold",
        f"  value  {value_text(verdict)}{f' at {at}' if at else ''}",
        f"  limit  {limit_text(verdict)}",
    ]
    if finding.arm != NOMINAL:
        lines.append(f"  arm    variation {finding.arm}")
    if verdict.note:
        lines.append(f"  note   {verdict.note}")
    return "\n".join(lines)
