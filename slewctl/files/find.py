"""Which files are designs, and what to call them."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path

from slewctl._types import FilePath
from slewctl.errors import InputError, SlewctlError, check_path, check_paths
from slewctl.files.source import Source, read_source

# What a file of an arm alone has, as a data sheet or what identify writes.
_OF_AN_ARM = {"arm", "variations", "title", "schema"}


def find_designs(paths: FilePath | Iterable[FilePath]) -> tuple[Path, ...]:
    """Return the ``.toml`` files named, and those in the folders named, sorted.

    Study files, which `slewctl.files.read_study` reads, and files of an arm alone, which
    `slewctl.files.read_arm` reads, are left out, and so is what lies in folders of these
    folders.  What cannot be read is kept: whoever reads it says why.

    Parameters
    ----------
    paths : path, or iterable of them
        Files and folders.

    Returns
    -------
    tuple of Path

    Raises
    ------
    InputError
        If a path does not exist or a folder holds no design.

    Examples
    --------
    >>> from slewctl.files import example_design, find_designs
    >>> path = example_design()
    >>> [found.name for found in find_designs([path.parent])]
    ['arm.toml']
    """
    paths = check_paths(paths, "paths")
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            found += _in_folder(path)
        elif not path.exists():
            raise InputError("no such file or folder", where=str(path), remedy="check the path")
        elif not is_no_design(path):
            found.append(path)
    return tuple({path.resolve(): path for path in found}.values())


def _in_folder(folder: Path) -> list[Path]:
    try:
        files = [path for path in sorted(folder.glob("*.toml")) if not path.is_dir()]
    except OSError as error:
        raise InputError(
            f"cannot be read: {error.strerror}", where=str(folder), remedy="check the path"
        ) from error
    designs = [path for path in files if not is_no_design(path)]
    if not designs:
        what = "only studies or arms, no design" if files else "no .toml file"
        below = dict.fromkeys(str(path.parent) for path in designs_below(folder, []))
        remedy = f"designs are in {', '.join(below)}: name it" if below else "name a design file"
        raise InputError(f"{what} in this folder", where=str(folder), remedy=remedy)
    return designs


def designs_below(folder: FilePath, known: FilePath | Iterable[FilePath]) -> tuple[Path, ...]:
    """Return the designs in folders of a folder that are none of those known.

    Parameters
    ----------
    folder : str or PathLike
    known : path, or iterable of them

    Returns
    -------
    tuple of Path
        Of what can be read as TOML with a controller, but for hidden folders.

    Examples
    --------
    >>> from slewctl.files import designs_below, example_design
    >>> designs_below(example_design().parent, [])
    ()
    """
    folder = check_path(folder, "folder")
    known = check_paths(known, "known")
    seen, found = {path.resolve() for path in known}, []
    for root, folders, files in os.walk(folder):
        # What is hidden is a program's own, as .git and .venv are: large, and no designs.
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        nested = [Path(root, name) for name in sorted(files) if name.endswith(".toml")]
        found += nested if Path(root) != folder else []
    return tuple(
        path for path in found if path.resolve() not in seen and "controller" in _content(path)
    )


def _content(path: Path) -> Mapping[str, object]:
    """Return what a TOML file holds; nothing of one that cannot be read."""
    try:
        return read_source(path).content
    except SlewctlError:
        return {}


def is_study(path: FilePath) -> bool:
    """Return whether a file is a study: it has grids and no controller.

    Parameters
    ----------
    path : str or PathLike

    Returns
    -------
    bool

    Examples
    --------
    >>> from slewctl.files import example_design, is_study
    >>> path = example_design()
    >>> is_study(path)
    False
    """
    path = check_path(path, "path")
    return holds_study(_content(path))


def is_no_design(path: Path) -> bool:
    """Return whether a file is a study, or an arm alone, with its variations perhaps."""
    content = _content(path)
    return holds_study(content) or ("arm" in content and set(content) <= _OF_AN_ARM)


def holds_study(content: Mapping[str, object]) -> bool:
    """Return whether what a TOML file holds is a study."""
    return isinstance(content.get("grid"), list) and "controller" not in content


def refuse_study(source: Source) -> None:
    """Refuse a study where a design is read."""
    if holds_study(source.content):
        raise InputError(
            "a study, no design",
            where=f"{source.path}:{source.line('grid')}",
            remedy="run it with slewctl study",
        )


def refuse_design(source: Source) -> None:
    """Refuse a design where a study is read."""
    if "controller" in source.content and "grid" not in source.content:
        raise InputError(
            "a design, no study",
            where=f"{source.path}:{source.line('controller')}",
            remedy="judge it with slewctl check, or give [[grid]] tables and no controller",
        )


def name_designs(paths: FilePath | Iterable[FilePath]) -> dict[Path, str]:
    """Return a short name for each file: its stem, or as many folders as tell it from others.

    Parameters
    ----------
    paths : path, or iterable of them

    Returns
    -------
    dict of Path to str

    Examples
    --------
    >>> from pathlib import Path
    >>> from slewctl.files import name_designs
    >>> list(name_designs([Path("a/arm.toml"), Path("b/arm.toml"), Path("b/boom.toml")]).values())
    ['a/arm.toml', 'b/arm.toml', 'boom']
    """
    paths = check_paths(paths, "paths")
    names: dict[Path, str] = {}
    whole = {path: path.resolve().parts for path in paths}
    stems = Counter(path.stem for path in whole)
    for path, parts in whole.items():
        if stems[path.stem] == 1:
            names[path] = path.stem
            continue
        rivals = [p for p in whole.values() if p != parts]
        depth = 2
        while any(p[-depth:] == parts[-depth:] for p in rivals):
            depth += 1
        names[path] = "/".join(parts[-depth:])
    return names
