"""Build wheel and sdist, and use the wheel alone, outside the checkout."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import venv
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def run(*command: str | Path, where: Path = ROOT) -> None:
    """Run a command that must succeed, without this checkout on the path."""
    bare = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    subprocess.run([str(part) for part in command], check=True, cwd=where, env=bare)


def main() -> None:
    """Say nothing but what the programs say; fail where one fails."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        run(
            sys.executable, "-m", "build", "--outdir", place / "dist", ROOT
        )  # the wheel from the sdist
        built = sorted((place / "dist").iterdir())
        run(sys.executable, "-m", "twine", "check", "--strict", *built)
        (wheel,) = (file for file in built if file.suffix == ".whl")
        contents = set(zipfile.ZipFile(wheel).namelist())
        package = ROOT / "slewctl"
        files = (
            *package.rglob("*.py"),
            package / "py.typed",
            *(package / "report/templates").iterdir(),
            *(package / "files/templates").iterdir(),
            *package.glob("animation/player.*"),
            package / "embedded/fmi2.c",
        )
        if missing := {file.relative_to(ROOT).as_posix() for file in files} - contents:
            sys.exit(f"the wheel lacks {sorted(missing)}")
        venv.create(place / "venv", with_pip=True)
        scripts = place / "venv" / ("Scripts" if os.name == "nt" else "bin")
        run(scripts / "python", "-m", "pip", "install", "--quiet", "--no-compile", wheel)
        run(scripts / "slewctl", "--help", where=place)
        run(scripts / "slewctl", "init", "first.toml", where=place)
        run(scripts / "slewctl", "check", "first.toml", where=place)


if __name__ == "__main__":
    main()
