"""Text of unknown origin made harmless where it leaves: one function for each medium.

Names, titles and keys come from files that anybody may have written.  What is only text here
is a command elsewhere: to a terminal, a CI log, a spreadsheet, a browser.  Patterns are
compiled where they are first used; most programs use few of them.
"""

from __future__ import annotations

import re

# Control characters, what ends a line in some reader, what turns the direction of writing, and
# halves of characters, which no encoding takes.
_UNPRINTABLE = "\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff"
_CONTROL = f"[{_UNPRINTABLE}]"
_CONTROL_OR_BREAK = f"[\t\n{_UNPRINTABLE}]"
# What XML 1.0 cannot hold, not even escaped.
_NOT_XML = "[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]"
# Commands of CI logs: GitHub's at the start of a line, older ones and Azure's anywhere in it.
_CI_START = r"^\s*::"
_CI_ANYWHERE = r"##(?=\[|vso)"
# What CommonMark and GitHub's tables give a meaning to; an underscore or an angle bracket has
# one only in some places, and the marks of blocks only at the start.
_MARKDOWN = r"[\\`*\[\]|~$]|(?<!\w)_|_(?!\w)|<(?=[A-Za-z/!?])|&(?=#?\w+;)"
_MARKDOWN_START = r"^ ?(?:(?=[-+#>=])|\d{1,9}(?=[.)](?: |$)))"

_NUMBER = r"(?ai)[-+]?(?:\d+\.?\d*(?:e[-+]?\d+)?|inf|nan)"


class Escaped(str):
    """Text that has been escaped for where it goes, or is a command on purpose."""

    __slots__ = ()


def one_line(text: str) -> str:
    r"""Return text on one line: what cannot be printed is spelt, such as ``\x1b``.

    Text that has been through this is left as it is.
    """
    return re.sub(_CONTROL_OR_BREAK, _spelt, text)


def visible(text: str) -> str:
    """Return text with its lines and tabs, and everything else that cannot be printed spelt."""
    return re.sub(_CONTROL, _spelt, text)


def console(text: str) -> str:
    """Return text as one line of a terminal or of a CI log, where it commands nothing."""
    if isinstance(text, Escaped):
        return text
    line = re.sub(_CI_ANYWHERE, r"#\\x23", one_line(text))
    return re.sub(_CI_START, lambda found: found[0][:-2] + r"\x3a:", line)


def quoted(text: str) -> str:
    """Return text as it may stand in a page, or in quotes in a tag."""
    shown = visible(text).replace("&", "&amp;").replace("<", "&lt;")
    return shown.replace(">", "&gt;").replace('"', "&quot;")


def markdown(text: str) -> str:
    """Return text as a part of a line of Markdown that means itself."""
    line = re.sub(_MARKDOWN, r"\\\g<0>", one_line(re.sub(r"[ \t\r\n]+", " ", text)))
    return re.sub(_MARKDOWN_START, r"\g<0>\\", line)


def csv_cell(text: str) -> str:
    """Return text as a cell that no spreadsheet takes for a formula (CWE-1236)."""
    cell = visible(text)
    is_formula = cell.lstrip().startswith(("=", "+", "-", "@")) and not re.fullmatch(_NUMBER, cell)
    return f"'{cell}" if is_formula else cell


def xml(text: str) -> str:
    """Return text without what XML cannot hold; an XML writer does the rest."""
    return re.sub(_NOT_XML, "\ufffd", text)


def github_data(text: str) -> str:
    """Return text as the message of a workflow command of GitHub Actions."""
    return visible(text).replace("%", "%25").replace("\n", "%0A")


def github_property(text: str) -> str:
    """Return text as a property of a workflow command of GitHub Actions."""
    return github_data(text).replace(":", "%3A").replace(",", "%2C")


def _spelt(found: re.Match[str]) -> str:
    return found[0].encode("unicode_escape").decode("ascii")
