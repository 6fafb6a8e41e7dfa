"""The command ``explore``."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from slewctl.cli.terminal import OUT
from slewctl.errors import InputError


def explore(design: Path, port: int, *, show: bool) -> None:
    """Serve the explorer of a design until it is interrupted."""
    for package in ("panel", "tomlkit"):
        if find_spec(package) is None:
            raise InputError(
                f"{package} is not installed",
                where="explore",
                remedy="pip install 'slewctl[explore]'",
            )
    from slewctl.explore.app import serve  # loads panel

    def ready(address: str) -> None:
        OUT.print(f"{design.name}: {address}  (Ctrl-C ends it)")

    serve(design, port=port, show=show, ready=ready)
