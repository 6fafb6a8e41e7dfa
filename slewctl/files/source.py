"""A TOML file read: its text, what it holds, and at which line."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from slewctl.errors import InputError, SlewctlError
from slewctl.files.lines import KeyPath, key_lines


@dataclass(frozen=True)
class Source:
    """A TOML file.

    Attributes
    ----------
    path : Path
    text : str
    content : mapping
        As `tomllib` reads it.
    lines : mapping of tuple to int
        Line of every key, from `key_lines`.
    """

    path: Path
    text: str
    content: Mapping[str, Any]
    lines: Mapping[KeyPath, int]

    def line(self, where: str) -> int | None:
        """Return the line of a dotted key, or of the innermost table that leads to it.

        A key may hold dots itself, such as ``controller.limits.deflection@0.5``.  None where
        the file holds nothing of it.
        """
        place = self._way((), where) or self._way(("arm",), where)
        return self.lines[place] if place else None

    def _way(self, start: KeyPath, where: str) -> KeyPath | None:
        """Return the longest way from a table along the dotted key; None if there is none."""
        children = (place for place in self.lines if place[:-1] == start)
        leads = [
            place
            for place in children
            if where == str(place[-1]) or where.startswith(f"{place[-1]}.")
        ]
        if not leads:
            return None
        place = max(leads, key=lambda place: len(str(place[-1])))
        rest = where.removeprefix(str(place[-1])).removeprefix(".")
        return (self._way(place, rest) if rest else None) or place

    def refuse(self, error: SlewctlError) -> SlewctlError:
        """Return the error with this file, and the line of the key that it names, before it."""
        line = self.line(error.where)
        return error.within(f"{self.path}:{line}" if line else str(self.path))


def read_source(path: Path) -> Source:
    """Return a TOML file, read and located.

    Raises
    ------
    InputError
        If the file cannot be read or is not TOML.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise InputError(
            f"cannot be read: {reason}", where=str(path), remedy="check the path"
        ) from error
    try:
        return Source(path, text, tomllib.loads(text), key_lines(text))
    except RecursionError:
        raise InputError(
            "not valid TOML: nested too deeply", where=str(path), remedy="write it flatter"
        ) from None
    except ValueError as error:  # no TOML, or a number of thousands of digits
        raise InputError(
            f"not valid TOML: {error}",
            where=f"{path}:{_bad_line(str(error), text)}",
            remedy='mend that line; a key with @ wants quotes, as in "moment@50mm" = 1.0',
        ) from error


def _bad_line(message: str, text: str) -> int:
    """Return the line that the parser's message names, or the last one."""
    found = re.search(r"at line (\d+)", message)
    return int(found[1]) if found else text.rstrip("\n").count("\n") + 1
