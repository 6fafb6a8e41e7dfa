"""The command ``design``."""

from __future__ import annotations

from pathlib import Path

from slewctl.cli.terminal import OUT, next_step
from slewctl.compare import Judge, unit_notes
from slewctl.files import read_design


def write_design(design: Path, out: Path) -> int:
    """Write the controller of a design file; return 1 where its own checks failed."""
    file = read_design(design)
    with file.source.computing():
        _, controller = Judge(file.case).own
    controller.save(out)
    OUT.print(f"{controller!r} is written to {out}")
    for line in controller.assumptions:
        OUT.print(f"  {line}")
    for note in unit_notes(file.case.arm):
        OUT.print(f"note: {note}", soft_wrap=True)
    if controller.certificate.verified:
        next_step(f"slewctl export {design} --out code", "what runs on a board, as C")
        return 0
    OUT.print(f"{controller.certificate}")
    return 1
