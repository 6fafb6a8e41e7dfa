"""Where in a TOML text each key stands, which the standard parser does not tell.

The text has been accepted by `tomllib` before, so that nothing is checked here: strings,
comments and brackets only have to be recognised.
"""

from __future__ import annotations

import re
import tomllib
from bisect import bisect_right

# The way to a value: keys of tables, and indices into arrays.
KeyPath = tuple[str | int, ...]

_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
# Of a multi-line string, up to two quotes before the three that close it are content.
_STRINGS = (
    re.compile(r'"""(?:[^\\]|\\.)*?"""(?:"{0,2})', re.DOTALL),
    re.compile(r"'''.*?'''(?:'{0,2})", re.DOTALL),
    re.compile(r'"(?:[^"\\\n]|\\.)*"'),
    re.compile(r"'[^'\n]*'"),
)
_SCALAR = re.compile(r"[^,\]}\n#]*")


def key_lines(text: str) -> dict[KeyPath, int]:
    """Return the line, counted from 1, of every key, table and array element of a TOML text.

    Parameters
    ----------
    text : str
        Valid TOML.  Lines end with a newline.

    Returns
    -------
    dict of tuple to int
        A table written with a header of its own stands at that header, any other one at the
        first key that leads through it; the elements of an array have their index as key.

    Examples
    --------
    >>> from slewctl.files import key_lines
    >>> key_lines("model = { n = 2 }")
    {('model',): 1, ('model', 'n'): 1}
    """
    return _Scanner(text).scan()


class _Scanner:
    """Walks through the text once, from statement to statement."""

    def __init__(self, text: str) -> None:
        self.text, self.at = text, 0
        self.ends = [found.start() for found in re.finditer("\n", text)]
        self.lines: dict[KeyPath, int] = {}
        self.counts: dict[KeyPath, int] = {}  # elements so far of each [[array of tables]]

    def scan(self) -> dict[KeyPath, int]:
        table: KeyPath = ()
        self.skip_blank()
        while self.at < len(self.text):
            if self.peek("["):
                table = self.header()
            else:
                self.pair(table)
            self.skip_blank()
        return self.lines

    def peek(self, start: str) -> bool:
        return self.text.startswith(start, self.at)

    def skip_blank(self) -> None:
        """Skip space, line ends and comments."""
        self.at = self.take(_BLANK)[1]

    def take(self, pattern: re.Pattern[str]) -> tuple[str, int]:
        found = pattern.match(self.text, self.at)
        return ("", self.at) if found is None else (found[0], found.end())

    def header(self) -> KeyPath:
        """Read ``[a.b]`` or ``[[a.b]]`` and return the table that the next pairs belong to."""
        several = self.peek("[[")
        line = self.line()
        self.at += 2 if several else 1
        *parents, name = self.key()
        table = (*self.way((), parents, line), name)
        if several:
            self.lines.setdefault(table, line)
            self.counts[table] = self.counts.get(table, 0) + 1
            table = (*table, self.counts[table] - 1)
        self.lines[table] = line
        self.at = self.text.index("]", self.at) + (2 if several else 1)
        return table

    def way(self, table: KeyPath, names: list[str], line: int) -> KeyPath:
        """Return the table reached by names; tables not seen before stand on this line."""
        for name in names:
            table = (*table, name)
            self.lines.setdefault(table, line)
            if table in self.counts:  # the last element is meant
                table = (*table, self.counts[table] - 1)
        return table

    def pair(self, table: KeyPath) -> None:
        """Read ``key = value``."""
        line = self.line()
        *parents, name = self.key()
        place = (*self.way(table, parents, line), name)
        self.lines[place] = line
        self.at = self.text.index("=", self.at) + 1
        self.skip_blank()
        self.value(place)

    def key(self) -> list[str]:
        """Read a key, dotted or not, and return its parts."""
        parts: list[str] = []
        while True:
            self.skip_blank()
            if self.text[self.at] in "\"'":
                raw, end = self.string()
                # The parser knows the escapes; a lone string is always a whole document.
                parts.append(tomllib.loads(f"key = {raw}")["key"])
            else:
                raw, end = self.take(_BARE_KEY)
                parts.append(raw)
            self.at = end
            self.skip_blank()
            if not self.peek("."):
                return parts
            self.at += 1

    def string(self) -> tuple[str, int]:
        found = next(p for p in _STRINGS if p.match(self.text, self.at))
        return self.take(found)

    def value(self, place: KeyPath) -> None:
        if self.text[self.at] in "\"'":
            self.at = self.string()[1]
        elif self.peek("["):
            self.elements(place, "]")
        elif self.peek("{"):
            self.elements(place, "}")
        else:
            self.at = self.take(_SCALAR)[1]

    def elements(self, place: KeyPath, closing: str) -> None:
        """Read an array or an inline table."""
        self.at += 1
        index = 0
        self.skip_blank()
        while not self.peek(closing):
            if closing == "}":
                self.pair(place)
            else:
                self.lines[(*place, index)] = self.line()
                self.value((*place, index))
                index += 1
            self.skip_blank()
            if self.peek(","):
                self.at += 1
                self.skip_blank()
        self.at += 1

    def line(self) -> int:
        return bisect_right(self.ends, self.at - 1) + 1
