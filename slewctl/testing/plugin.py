"""The pytest plugin's door: it collects design files when asked, and costs nothing before.

    pytest --slewctl designs                     # on the command line, or in pyproject.toml:

    [tool.pytest.ini_options]
    slewctl_designs = ["designs"]

A TOML file is a design if it has an ``[arm]`` and a ``[controller]``, one of the two perhaps
mistyped, or an ``[arm]`` with other tables of a design; studies, arms alone and others are left
alone.  Every run of pytest imports this module, so it loads nothing of slewctl before there is a
design to judge.
"""

from __future__ import annotations

import re
import tomllib
from difflib import get_close_matches
from pathlib import Path

import pytest

# The tables of a design file.
TABLES = (
    "arm", "controller", "model", "slew", "truth", "compare", "requirements", "variations",
    "uncertainty", "measured", "export",
)  # fmt: skip
# So many of them beside the arm and its variations are a design without a controller.
_ENOUGH = 2
# What looks like a table in what is not valid TOML: a design must fail and not go unseen.
_HEAD = re.compile(r"^\s*(?:\[\s*([\w-]+)|([\w-]+)\s*=\s*\{)", re.M)
# How near a mistyped name is, in parts of the letters of both that agree; the arm has few.
_NEAR = {"arm": 0.6, "controller": 0.8}
# What slewctl itself refuses to parse: larger files, and keys of very many parts.
_MOST_BYTES = 1_000_000
_ENDLESS_KEY = re.compile(r"(?:[.]\s*+[^\s.=]++\s*+){50}")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the flag and the ini option."""
    group = parser.getgroup("slewctl", "design files of slewctl")
    group.addoption(
        "--slewctl",
        action="store_true",
        help="collect the design files (*.toml) among the paths given as tests",
    )
    parser.addini(
        "slewctl_designs", "folders and files of designs to collect as tests", type="paths"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Add the folders of designs to the paths that pytest looks at when none is named."""
    config.addinivalue_line("markers", "slewctl: a requirement of a design file")
    if not config.option.file_or_dir:
        for folder in config.getini("slewctl_designs"):
            # A run that judges nothing would be green.
            if not folder.exists():
                raise pytest.UsageError(f"slewctl_designs: {folder}: no such file or folder")
            if folder.is_dir() and not any(map(_is_design, folder.rglob("*.toml"))):
                raise pytest.UsageError(f"slewctl_designs: {folder}: no design in it")
    if _from_testpaths(config):
        seen = [Path(argument).resolve() for argument in config.args]
        config.args += [
            str(folder)
            for folder in config.getini("slewctl_designs")
            if not any(_below(folder, path) for path in seen)
        ]


def _from_testpaths(config: pytest.Config) -> bool:
    """Return whether pytest looks where its configuration says, and nowhere else."""
    source = getattr(config, "args_source", None)
    if source is not None:
        return source is pytest.Config.ArgsSource.TESTPATHS
    # Before pytest 7.2 nobody says so.
    named = config.option.file_or_dir
    return not named and config.args == config.getini("testpaths")


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Return the collector of a design file, if designs are asked for and the file is one."""
    if file_path.suffix != ".toml" or not _asked(file_path, parent.config):
        return None
    if not _is_design(file_path):
        return None
    # The first design that is collected pays for slewctl and all it needs.
    from slewctl.testing.collect import DesignFile

    return DesignFile.from_parent(parent, path=file_path)


def _asked(path: Path, config: pytest.Config) -> bool:
    if config.getoption("--slewctl"):
        return True
    return any(_below(path, folder) for folder in config.getini("slewctl_designs"))


def _below(path: Path, folder: Path) -> bool:
    return path.resolve().is_relative_to(folder.resolve())


def _is_design(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            data = file.read(_MOST_BYTES + 1)
    except OSError:  # what it is cannot be told: it says so where it is judged
        return True
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        # No valid TOML either.  Tables are ASCII in every encoding, but for UTF-16's zeros.
        return _designs(_heads(data.replace(b"\0", b"").decode("latin-1")))
    if len(text) > _MOST_BYTES or _ENDLESS_KEY.search(text):
        return _designs(_heads(text))
    try:
        content = tomllib.loads(text)
    except (ValueError, RecursionError):
        return _designs(_heads(text))
    study = isinstance(content.get("grid"), list) and "controller" not in content
    return not study and _designs({k for k, value in content.items() if isinstance(value, dict)})


def _heads(text: str) -> set[str]:
    return {table or inline for table, inline in _HEAD.findall(text)}


def _designs(tables: set[str]) -> bool:
    """Return whether these tables are those of a design, though a name be mistyped."""
    arm, controller = (
        name in tables or bool(get_close_matches(name, tables, 1, near))
        for name, near in _NEAR.items()
    )
    if arm and controller:
        return "arm" in tables or "controller" in tables
    others = tables.intersection(TABLES) - {"arm", "variations"}
    return "arm" in tables and len(others) >= _ENOUGH
