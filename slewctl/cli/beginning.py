"""The commands ``init`` and ``explain``."""

from __future__ import annotations

from pathlib import Path

from slewctl.cli.options import options_named
from slewctl.cli.terminal import OUT, next_step, progress
from slewctl.errors import InputError
from slewctl.files import read_design, starter_files
from slewctl.gate import explain


def write_starter(file: Path, origin: str) -> None:
    """Write a first design file, over nothing that is there."""
    if file.suffix != ".toml":
        raise InputError(
            "a design file ends in .toml", where=str(file), remedy=f"name it {file.stem}.toml"
        )
    with options_named({"from": "--from"}):
        texts = starter_files(origin, file.name)
    for name in texts:
        if (file.parent / name).exists():
            raise InputError(
                "is there already", where=str(file.parent / name), remedy="name another file"
            )
    from slewctl.report.export import write_files

    write_files(file.parent, texts)
    OUT.print(f"{' and '.join(str(file.parent / name) for name in texts)} written")
    next_step(f"slewctl check {file}", "does it hold what it asks for?")


def print_explanation(design: Path) -> None:
    """Print what limits a design and what to change first."""
    with progress(None) as step:
        found = explain(read_design(design), step)
    OUT.text(str(found))
