"""The command ``export``."""

from __future__ import annotations

from pathlib import Path

from slewctl.cli.terminal import OUT
from slewctl.compare import Judge, unit_notes
from slewctl.embedded import controller_data, fmu_bytes, program_files, provenance
from slewctl.embedded.program import identifier
from slewctl.export.formats import data_bytes
from slewctl.files import read_design
from slewctl.gate.compiled_design import design_program
from slewctl.gate.fingerprint import digest
from slewctl.loop import UnstableLoopError
from slewctl.report.export import write_files
from slewctl.versions import installed


def export_design(design: Path, form: str, out: Path) -> int:
    """Write the controller of a design file as code or data; return 1 where its checks failed."""
    file = read_design(design)
    case = file.case
    with file.source.computing():
        judgement = Judge(case).evaluate(*case.origin).judgement
        if not judgement.stable:
            raise UnstableLoopError(
                f"the loop is {judgement.loop.fault}: not to be run",
                where="controller",
                remedy=f"see what to change by slewctl explain {design}",
            )
        notes = provenance(judgement, case.name, digest(file.text), installed())
        if form in ("c", "fmu"):
            program = design_program(judgement, file.export, case.name, notes)
            files: dict[str, str | bytes] = (
                dict(program_files(program))
                if form == "c"
                else {f"{program.name}.fmu": fmu_bytes(program)}
            )
            said = program.notes[len(notes) :]
        else:
            name = f"{identifier(case.name)}.{form}"
            files = {name: data_bytes(form, controller_data(judgement, notes))}
            said = ()
    write_files(out, files)
    OUT.print(f"{judgement.controller!r} is written to {out}: {', '.join(files)}", soft_wrap=True)
    for line in (*notes[1:], *said):
        OUT.print(f"  {line}", soft_wrap=True)
    for note in unit_notes(case.arm):
        OUT.print(f"note: {note}", soft_wrap=True)
    if judgement.controller.certificate.verified:
        return 0
    OUT.print(f"{judgement.controller.certificate}")
    return 1
