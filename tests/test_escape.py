"""Text where it leaves: read back by the readers of each medium, it means itself."""

from __future__ import annotations

import csv
import io
import re
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slewctl.escape import (
    Escaped,
    console,
    csv_cell,
    github_data,
    github_property,
    markdown,
    one_line,
    visible,
    xml,
)

TEXT = st.text(st.characters() | st.sampled_from("\n\r\x1b\x00:#%=+-@`*_[]<>|!&\\."))
CONTROL = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]")


@given(TEXT)
def test_nothing_unprintable_is_left_and_once_is_enough(text: str) -> None:
    line = one_line(text)
    assert not CONTROL.search(line)
    assert one_line(line) == line
    assert not CONTROL.search(visible(text).replace("\n", "").replace("\t", ""))
    if not CONTROL.search(text):
        assert line == text


@given(TEXT)
def test_a_line_of_a_log_is_no_command(text: str) -> None:
    line = console(text)
    assert not CONTROL.search(line)
    assert not line.lstrip().startswith("::")
    assert "##[" not in line
    assert "##vso" not in line


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("\n::warning file=x::hi", r"\n::warning file=x::hi"),
        ("  ::error::x", r"  \x3a:error::x"),
        ("a ##[add-mask]b ##vso[x]", r"a #\x23[add-mask]b #\x23vso[x]"),
        ("\x1b[31mred\x9b\u202e", r"\x1b[31mred\x9b\u202e"),
        ("a::b # c ## d", "a::b # c ## d"),
    ],
)
def test_commands_are_spelt(text: str, line: str) -> None:
    assert console(text) == line
    assert console(Escaped("::error::mine")) == "::error::mine"


MARKDOWN = [
    ("<script>alert(1)</script>", r"\<script>alert(1)\</script>"),
    ("[x](http://y) ![z](w)", r"\[x\](http://y) !\[z\](w)"),
    ("# heading", r"\# heading"),
    ("- item", r"\- item"),
    ("12. item", r"12\. item"),
    ("12.5 % of < 0.01 %", "12.5 % of < 0.01 %"),
    ("a | b `c` *d* ~e~ $f$", r"a \| b \`c\` \*d\* \~e\~ \$f\$"),
    ("theta_dot _x_", r"theta_dot \_x\_"),
    ("&lt; & b", r"\&lt; & b"),
    ("a\n\n# b\r\n> c", "a # b > c"),
    ("---", r"\---"),
    (", ", ", "),
    ("\\[", "\\\\\\["),
    ("\x1b", r"\\x1b"),
]


@pytest.mark.parametrize(("text", "escaped"), MARKDOWN, ids=range(len(MARKDOWN)))
def test_markdown_means_itself(text: str, escaped: str) -> None:
    assert markdown(text) == escaped


@given(TEXT)
def test_markdown_is_one_line_that_opens_nothing(text: str) -> None:
    line = markdown(text)
    assert not CONTROL.search(line)
    bare = re.sub(r"\\[!-/:-@\[-`{-~]", "·", line)
    assert not re.search(r"[`*\[\]|~]|<[A-Za-z/!?]|^ ?[-+#>=]|^ ?\d{1,9}[.)] ", bare)


@given(st.lists(TEXT, min_size=1, max_size=3))
def test_a_spreadsheet_finds_no_formula(cells: list[str]) -> None:
    out = io.StringIO()
    csv.writer(out).writerow([csv_cell(cell) for cell in cells])
    (row,) = csv.reader(io.StringIO(out.getvalue(), newline=""))
    for cell, given_back in zip(cells, row, strict=True):
        assert given_back.removeprefix("'") == visible(cell).removeprefix("'")
        if given_back.lstrip().startswith(("=", "+", "-", "@")):
            float(given_back)


@pytest.mark.parametrize("number", ["-1.5", "+2", "-inf", "1e-3", "-1.5e-3"])
def test_numbers_are_no_formulas(number: str) -> None:
    assert csv_cell(number) == number
    assert csv_cell(f"{number}+cmd|' /C calc'!A0").startswith("'") == (number[0] in "+-")


@given(TEXT)
def test_xml_and_workflow_commands_hold_any_text(text: str) -> None:
    root = ElementTree.Element("a", b=xml(text))
    ElementTree.fromstring(ElementTree.tostring(root, encoding="unicode"))
    assert not re.search(r"[\r\n\x00-\x08\x1b]", github_data(text))
    assert not re.search(r"[:,\r\n]", github_property(text))
