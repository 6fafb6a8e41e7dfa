"""The command ``replay``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from slewctl.breakdown import computing
from slewctl.check.words import number_text
from slewctl.cli.identifying import read_named_log
from slewctl.cli.terminal import OUT, progress
from slewctl.compare import Judge
from slewctl.errors import SlewctlError
from slewctl.files import read_design
from slewctl.loop import MarginUse, Replay, margin_use, replay, simulate


def replay_log(
    file: Path,
    design: Path,
    out: Path | None,
    *,
    columns: Sequence[str],
    sample_time: float | None,
    counts: float | None,
) -> None:
    """Print a log of a design's slew beside its prediction, and write a report where wanted."""
    asked = read_design(design, slew=True)
    with progress(3) as step:
        step("reading")
        log = read_named_log(file, columns, sample_time, counts)
        step("simulating")
        with asked.source.computing():
            judging = Judge(asked.case)
            judged = judging.evaluate(*judging.chosen).judgement
            predicted = simulate(judged.loop, judged.slew)
        with computing(str(file)):
            found = replay(predicted, log)
        step("fitting")
        try:
            with computing():
                use: MarginUse | str = margin_use(judged.loop, log)
        except SlewctlError as error:
            use = f"not told by this log: {error.what}"
    for line in told(found, use):
        OUT.print(line)
    if out is not None:
        from slewctl.report import write_replay  # matplotlib is only needed here

        OUT.print(f"report: {write_replay(found, use, out, asked.case.name)}")


def told(found: Replay, use: MarginUse | str) -> list[str]:
    """Return what a replay says, a line each."""
    lines = [found.caption]
    for one in (found.output, found.command):
        apart = "nowhere" if one.apart_s is None else f"at {one.apart_s:.3g} s"
        measured, predicted = (number_text(value, one.unit) for value in one.largest)
        lines.append(
            f"{one.name}: fit {one.fit:.1f} %, parts {apart}, largest {measured} where {predicted} "
            "was predicted"
        )
    return [*lines, f"margins: {use}", *(f"log: {remark}" for remark in found.log.remarks)]
