"""The pytest plugin's door: it collects design files when asked, and costs nothing before.

    pytest --slewctl designs                     # on the command line, or in pyproject.toml:

    [tool.pytest.ini_options]
    slewctl_designs = ["designs"]

A TOML file is a design if it has both an ``[arm]`` and a ``[controller]`` table; others are
left alone.  Every run of pytest imports this module, so it loads nothing of slewctl before
there is a design to judge.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

# What a design looks like that is not valid TOML: it must fail and not go unseen.
_TABLES = (re.compile(r"^\s*\[\s*arm\b", re.M), re.compile(r"^\s*\[\s*controller\b", re.M))
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
            if not folder.exists():  # a run that judges nothing would be green
                raise pytest.UsageError(f"slewctl_designs: {folder}: no such file or folder")
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
        text = data.replace(b"\0", b"").decode("latin-1")
        return all(table.search(text) for table in _TABLES)
    tables = all(table.search(text) for table in _TABLES)
    if len(text) > _MOST_BYTES or _ENDLESS_KEY.search(text):
        return tables
    try:
        content = tomllib.loads(text)
    except (ValueError, RecursionError):
        return tables
    return isinstance(content.get("arm"), dict) and isinstance(content.get("controller"), dict)
