"""`slewctl check`: the gate on the command line."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from slewctl import check as outcome
from slewctl import embedded
from slewctl.check import DesignResult, exit_status
from slewctl.check.result import BAD_INPUT
from slewctl.cli.terminal import ERR, OUT, next_step, progress, show
from slewctl.cli.verdicts import summary, verdict_table
from slewctl.errors import InputError, SlewctlError, check_nonnegative
from slewctl.files import designs_below, find_designs
from slewctl.files.find import is_no_design
from slewctl.gate import check_designs
from slewctl.versions import installed

if TYPE_CHECKING:
    from slewctl.check import Baseline


@dataclass(frozen=True)
class Outputs:
    """Where to write what, and the baseline, which is read too."""

    junit: Path | None
    json: Path | None
    baseline: Path | None

    def check(self, designs: Sequence[Path]) -> None:
        """Refuse to write one file twice, or over a design."""
        taken = {path.resolve(): "a design" for path in designs}
        for option, path in (
            ("--junit", self.junit), ("--json", self.json), ("--baseline", self.baseline)
        ):  # fmt: skip
            if path is None:
                continue
            other = taken.setdefault(path.resolve(), option)
            if other != option:
                raise InputError(
                    f"{option} names the same file as {other}",
                    where=str(path),
                    remedy="name another file",
                )

    def accepted(self, *, may_be_missing: bool) -> Baseline | None:
        """Return the baseline, None if none was named."""
        if self.baseline is None:
            return None
        try:
            found = outcome.read_baseline(self.baseline, may_be_missing=may_be_missing)
            return replace(found, is_design=_is_there)
        except SlewctlError as error:
            raise error.within("--baseline", " ") from error


def check(
    paths: Sequence[Path],
    outputs: Outputs,
    *,
    tolerance: float,
    every: bool,
    quiet: bool,
    github: bool,
    update_baseline: bool,
    changed_only: bool,
    compiled: bool = False,
) -> int:
    """Judge designs, print and write the verdicts; return the exit status."""
    if compiled:
        embedded.find_compiler()  # said once, and not of every design
    if check_nonnegative(tolerance, "--tolerance") >= 1:
        raise InputError(
            f"{tolerance:g} would let every margin go",
            where="--tolerance",
            remedy="give a fraction, as 0.05 for five per cent",
        )
    designs = find_designs(paths)
    outputs.check(designs)
    before = outputs.accepted(may_be_missing=update_baseline)
    with progress(len(designs)) as step:
        results = check_designs(
            paths,
            step,
            None if update_baseline else before,
            changed_only=changed_only,
            working=step.within,
            compiled=compiled,
            marked=outputs.baseline is not None,
        )
    if before is not None and not update_baseline:
        gone = outcome.missing(before, results)
        results = (*(outcome.compare_with(before, result, tolerance) for result in results), *gone)
    # Files first: whoever reads the table may stop reading.
    written, notes = _write(outputs, results, before if update_baseline else None)
    _print(results, every=every, quiet=quiet, github=github)
    if not quiet:
        _tell_what_was_not_seen(paths, designs)
        for note in notes:
            OUT.print(f"baseline: {note}", soft_wrap=True)
    return exit_status(results) if written else BAD_INPUT


def _is_there(path: Path) -> bool:
    """Whether there is a design, or what cannot be read, in place of one that was accepted."""
    return path.exists() and not is_no_design(path)


def _tell_what_was_not_seen(paths: Sequence[Path], designs: Sequence[Path]) -> None:
    for folder in filter(Path.is_dir, paths):
        if below := designs_below(folder, designs):
            inside = ", ".join(sorted({str(path.parent) for path in below}))
            what = "design is" if len(below) == 1 else "designs are"
            OUT.print(f"{len(below)} more {what} in {inside}: name it too", soft_wrap=True)


def _print(results: Sequence[DesignResult], *, every: bool, quiet: bool, github: bool) -> None:
    table = verdict_table(results, every=every, failures=quiet)
    if table is not None:
        show(table)
    if not quiet:
        for result in results:
            for note in result.notes:
                OUT.print(f"{result.name}: {note}", soft_wrap=True)
    if not quiet or exit_status(results):
        OUT.print(summary(results, every=every))
    failed = next((result for result in results if result.status == "failed"), None)
    if failed is not None:
        next_step(f"slewctl explain {failed.file}", "what limits it, and what to change first")
    for result in results:
        if result.error:
            ERR.tell(result.error)
    if github:
        root = Path(os.environ.get("GITHUB_WORKSPACE") or ".")
        for line in outcome.to_annotations(results, root):
            OUT.print(line, soft_wrap=True)


def _write(
    outputs: Outputs, results: Sequence[DesignResult], before: Baseline | None
) -> tuple[bool, list[str]]:
    """Write the files asked for; return whether all could be, and what the baseline took."""
    if not (outputs.junit or outputs.json or before is not None):
        return True, []
    # Loads what draws the reports, which a run without files need not wait for.
    from slewctl.report.export import json_text

    written = True
    if outputs.junit:
        written &= _written("--junit", outputs.junit, outcome.to_junit(results))
    if outputs.json:
        record = outcome.to_record(results, installed())
        written &= _written("--json", outputs.json, json_text(record))
    if before is None:
        return written, []
    after, notes = outcome.accept(before, results)
    if not _written("--baseline", after.path, json_text(outcome.baseline_record(after))):
        return False, []
    return written, [*notes, f"{len(after.designs)} accepted, written to {after.path}"]


def _written(option: str, path: Path, text: str) -> bool:
    """Write one file whole; say on the error stream why it could not be."""
    from slewctl.report.export import write_files

    # A link is followed, not replaced by a file.
    target = path.resolve()
    try:
        if target.exists() and not target.is_file():
            raise InputError(
                "cannot be written: not an ordinary file", remedy="name an ordinary file"
            )
        # A file name that is no UTF-8 is written with its bytes escaped.
        whole = text.encode("utf-8", "backslashreplace").decode("utf-8")
        write_files(target.parent, {target.name: whole})
    except SlewctlError as error:
        ERR.print(f"slewctl: {option} {path}: {error}", soft_wrap=True)
        return False
    return True
