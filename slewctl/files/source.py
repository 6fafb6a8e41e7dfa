"""A TOML file read: its text, what it holds, and at which line."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from slewctl._types import FilePath
from slewctl.breakdown import computing
from slewctl.errors import FaultsError, InputError, SlewctlError, check_path, clipped, shown
from slewctl.files.lines import KeyPath, key_lines
from slewctl.files.schema import ArmTable
from slewctl.textfile import read_text

# Levels of tables and arrays, and parts of a dotted key; five make a design file.
MOST_LEVELS = 50
_MOST_KEY = 200  # characters of a key; the longest of a design has 25
# Of one table; variations of an arm are the only keys that anybody counts in hundreds.
_MOST_KEYS = 2_000
# Keys and elements of a whole file; a beam of 2,000 stations has eight thousand.
_MOST_VALUES = 20_000
# As many as TOML promises to every program.
_MOST_INTEGER = 2**63

# Strings and comments, whose dots join no key.  One that does not end takes the rest.
_QUOTED = re.compile(
    r'"""(?:[^\\]|\\.)*?(?:"""|\Z)|\'\'\'.*?(?:\'\'\'|\Z)'
    r'|"(?:[^"\\\n]|\\[^\n])*"?|\'[^\'\n]*\'?|#[^\n]*',
    re.DOTALL,
)
_PARTS = re.compile(r"[^\W\d]\.")
_LONG_KEY = re.compile(rf"(?<![\w-])[\w-]++(?:[ \t]*+\.[ \t]*+[\w-]++){{{MOST_LEVELS}}}")


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

        A key may hold dots itself, such as ``controller.limits.deflection@0.5``, and name
        another file, as in ``controller.file: gains.json: num``.  None where the file holds
        nothing of it.
        """
        place = self._way((), self._in_file(where))
        return self.lines[place] if place else None

    @cached_property
    def _children(self) -> Mapping[KeyPath, Mapping[str, KeyPath]]:
        """The keys of each table and the elements of each array, by name."""
        found: dict[KeyPath, dict[str, KeyPath]] = {}
        for place in self.lines:
            found.setdefault(place[:-1], {})[str(place[-1])] = place
        return found

    @cached_property
    def _lengths(self) -> Mapping[KeyPath, list[int]]:
        """How long the names in each table are, the longest first."""
        return {
            table: sorted({len(name) for name in names}, reverse=True)
            for table, names in self._children.items()
        }

    def _way(self, start: KeyPath, where: str) -> KeyPath | None:
        """Return the longest way from a table along the dotted key; None if there is none."""
        for length in self._lengths.get(start, ()):
            place = self._children[start].get(where[:length])
            if place and where[length : length + 1] in ("", ".", ":"):
                rest = where[length + 1 :]
                return (self._way(place, rest) if rest else None) or place
        return None

    def refuse(self, error: SlewctlError) -> SlewctlError:
        """Return the error with this file, and the line of the key that it names, before it.

        What is missing stands at the nearest table, or at the head of the file.
        """
        if isinstance(error, FaultsError):
            faults = sorted(error.faults, key=lambda fault: self.line(self._key(fault)) or 1)
            return FaultsError([self.refuse(fault) for fault in faults])
        if re.match(rf"{re.escape(str(self.path))}:\d", error.where):  # it has its line
            return error
        key = self._key(error)
        line = self.line(key)
        if key.startswith("--") and line is None:  # an option of the command line
            return error.at(key)
        line = line or (1 if key else None)
        place = f"{self.path}:{line}" if line else str(self.path)
        return error.at(clipped(key, _MOST_KEY)).within(place)

    def _key(self, error: SlewctlError) -> str:
        """Return the key that an error names, which may have this file before it."""
        key = "" if error.where == str(self.path) else error.where.removeprefix(f"{self.path}: ")
        return self._in_file(key)

    def _in_file(self, key: str) -> str:
        """Return a key as the path to it in the file: parts of an arm go by their own names."""
        part, dot, _ = key.partition(".")
        of_arm = dot and part in ArmTable.model_fields and part not in self.content
        return f"arm.{key}" if of_arm else key

    @contextmanager
    def computing(self) -> Iterator[None]:
        """Run a computation so that whatever it raises names this file and the key's line."""
        try:
            with computing(str(self.path)):
                yield
        except SlewctlError as error:
            raise self.refuse(error) from error


def read_source(path: FilePath) -> Source:
    """Return a TOML file, read and located.

    Parameters
    ----------
    path : str or PathLike

    Returns
    -------
    Source

    Raises
    ------
    InputError
        If the file cannot be read, is not TOML, or is nested deeper or holds larger integers
        than any design needs.

    Examples
    --------
    >>> from slewctl.files import example_design, read_source
    >>> path = example_design()
    >>> read_source(path).content["model"]["n"]
    1
    """
    path = check_path(path, "path")
    try:
        text = read_text(path)
    except FileNotFoundError as error:
        raise InputError(
            f"cannot be read: {error.strerror}", where=str(path), remedy="check the path"
        ) from error
    return source_of_text(text, path)


def source_of_text(text: str, path: Path) -> Source:
    """Return the text of a TOML file as if it stood at a path.

    Parameters
    ----------
    text : str
    path : Path
        What refusals name, and beside which other files are looked for.

    Returns
    -------
    Source

    Raises
    ------
    InputError
        As `read_source`, but for a file that cannot be read.
    """
    _refuse_at_a_glance(path, text)
    try:
        content = tomllib.loads(text)
    except RecursionError:
        raise _too_deep(str(path)) from None
    except ValueError as error:  # no TOML, or a number of thousands of digits
        raise InputError(
            f"not valid TOML: {error}",
            where=f"{path}:{_bad_line(str(error), text)}",
            remedy='mend that line; a key with @ wants quotes, as in "moment@50mm" = 1.0',
        ) from error
    _refuse_masses(path, content)
    source = Source(path, text, content, key_lines(text))
    _refuse_extremes(source)
    return source


def _refuse_at_a_glance(path: Path, text: str) -> None:
    """Refuse what the parser would take long for: keys of many parts, thousands of values.

    A key has a sign of equality, a header one or two brackets, a part of a dotted key a dot
    behind it (in a number it follows a digit), and an element of an array a comma unless it is
    the last one; pairs of an inline table have commas too.
    """
    bare = _QUOTED.sub(lambda found: "x" + "\n" * found[0].count("\n"), text)
    found = _LONG_KEY.search(bare)
    if found is not None:
        raise _too_deep(f"{path}:{bare.count(chr(10), 0, found.start()) + 1}")
    dots = len(_PARTS.findall(bare))
    least = max(bare.count("="), bare.count(","), bare.count("[") // 2, dots)
    if least > _MOST_VALUES:
        raise _too_many(path, f"at least {least}")


def _refuse_extremes(source: Source) -> None:
    """Refuse nesting and integers that other programs, and Python itself, stumble over."""
    todo: list[tuple[KeyPath, object]] = [((), source.content)]
    while todo:
        place, value = todo.pop()
        line = f"{source.path}:{source.lines[place]}" if place else ""
        if len(place) > MOST_LEVELS:
            raise _too_deep(line)
        if isinstance(value, dict):
            todo += [((*place, key), item) for key, item in value.items()]
            if len(value) > _MOST_KEYS:
                raise InputError(
                    f"{len(value)} keys in one table",
                    where=f"{line}: {_name(place)}" if place else f"{source.path}:1",
                    remedy=f"keep {_MOST_KEYS}",
                )
        elif isinstance(value, list):
            todo += [((*place, index), item) for index, item in enumerate(value)]
        elif isinstance(value, int) and not -_MOST_INTEGER <= value < _MOST_INTEGER:
            raise InputError(
                f"{shown(value)} is beyond the integers of TOML",
                where=f"{line}: {_name(place)}",
                remedy="give less than 2^63, or a number with a decimal point",
            )


def _refuse_masses(path: Path, content: Mapping[str, Any]) -> None:
    """Refuse more keys and elements than anybody writes, before each of them costs time."""
    todo: list[object] = [content]
    count = 0
    while todo:
        value = todo.pop()
        if isinstance(value, dict | list):
            count += len(value)
            todo += value.values() if isinstance(value, dict) else value
    if count > _MOST_VALUES:
        raise _too_many(path, str(count))


def _too_many(path: Path, count: str) -> InputError:
    return InputError(
        f"{count} keys, parts of keys and elements",
        where=f"{path}:1",
        remedy=f"keep {_MOST_VALUES}",
    )


def _name(place: KeyPath) -> str:
    return clipped(".".join(map(str, place)), _MOST_KEY)


def _too_deep(where: str) -> InputError:
    return InputError(
        "not valid TOML: nested too deeply",
        where=where,
        remedy=f"write it flatter, with at most {MOST_LEVELS} levels",
    )


def _bad_line(message: str, text: str) -> int:
    """Return the line that the parser's message names, or the last one."""
    found = re.search(r"at line (\d+)", message)
    return int(found[1]) if found else text.rstrip("\n").count("\n") + 1
