"""Keys and their lines: texts whose every number is the line that it stands on."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slewctl.files import key_lines, read_source

DESIGNS = Path(__file__).parents[2] / "designs"

# Statements of several lines.  NN is the key, and LINE becomes the number of its line.
STATEMENTS = [
    "kNN = LINE",
    "  kNN=LINE # kNN = 7",
    '"k.NN" = LINE',
    "'k NN' = LINE",
    '"k\\u00e9\\"NN" = LINE',
    "aNN.b . 'c.d' = LINE",
    "aNN.b = LINE\naNN.c.d = LINE",
    "kNN = [LINE, LINE, # ]\n  LINE,\n\n LINE ,\n]",
    "kNN = [[LINE], [\nLINE, [LINE]]]",
    "kNN = { x = LINE, y.z = LINE, \"w\" = [LINE, { v = LINE }] }",
    "kNN = [\n  { x = LINE },\n  { x = LINE, y = 'a]b}c' },\n]",
    'sNN = """\n[fake]\nk = 3 # no\n\\""" still """\nkNN = LINE',
    "sNN = '''\n[fake]\\'''\nkNN = LINE",
    'sNN = """two quotes at the end"""""\nkNN = LINE',
    "sNN = 'it # is { [' # so\nkNN = LINE",
    'sNN = "a \\" # \\\\" \nkNN = LINE',
    "sNN = []\ntNN = {}\nkNN = LINE",
    "dNN = 1979-05-27 07:32:00Z\nfNN = -1.5e-3\nbNN = true\nkNN = LINE",
    "# [not.a.table]",
    "",
    "[tNN]\nk = LINE",
    "[ tNN . 'u.v' ] # [x]\nk = LINE",
    "[[tNN.u]]\nk = LINE\n[[tNN.u]]\nk = LINE\n[tNN.u.v]\nk = LINE\n[[tNN.u.w]]\nk = LINE",
]  # fmt: skip


def numbered(statements: list[str]) -> str:
    """Return the statements as one text with keys and lines filled in."""
    text = "\n".join(s.replace("NN", str(i)) for i, s in enumerate(statements))
    lines = text.split("\n")
    return "\n".join(line.replace("LINE", str(i)) for i, line in enumerate(lines, start=1))


def leaves(
    value: object, way: tuple[str | int, ...] = ()
) -> Iterator[tuple[tuple[str | int, ...], object]]:
    """Yield the way to every key and element of a parsed text, with what is there."""
    if way:
        yield way, value
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from leaves(inner, (*way, key))
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            yield from leaves(inner, (*way, index))


@given(st.lists(st.sampled_from(STATEMENTS), max_size=12))
def test_every_key_is_found_on_its_line(statements: list[str]) -> None:
    text = numbered(statements)
    parsed = dict(leaves(tomllib.loads(text)))
    lines = key_lines(text)
    assert set(lines) == set(parsed)
    for way, value in parsed.items():
        if isinstance(value, int) and not isinstance(value, bool):
            assert lines[way] == value, (way, text)


def test_each_kind_of_statement_is_found() -> None:
    for statement in STATEMENTS:
        text = numbered([statement])
        parsed = dict(leaves(tomllib.loads(text)))
        lines = key_lines(text)
        assert set(lines) == set(parsed), statement
        for way, value in parsed.items():
            if isinstance(value, int) and not isinstance(value, bool):
                assert lines[way] == value, statement


def test_a_table_stands_at_its_own_header() -> None:
    lines = key_lines("[a.b]\nx = 1\n[a]\ny.z = 2\ny.w = 3\n")
    assert lines == {
        ("a",): 3, ("a", "b"): 1, ("a", "b", "x"): 2,
        ("a", "y"): 4, ("a", "y", "z"): 4, ("a", "y", "w"): 5,
    }  # fmt: skip


@pytest.mark.parametrize("text", ["", "\n\n", "# only a comment", "a = 1"])
def test_short_texts(text: str) -> None:
    assert set(key_lines(text)) == set(dict(leaves(tomllib.loads(text))))


@pytest.mark.parametrize("path", sorted(DESIGNS.glob("*.toml")), ids=lambda p: p.stem)
def test_designs_are_located(path: Path) -> None:
    source = read_source(path)
    assert set(source.lines) == set(dict(leaves(source.content)))
    rows = source.text.split("\n")
    for way, line in source.lines.items():
        if isinstance(way[-1], str):
            assert way[-1] in rows[line - 1]


def test_dotted_places_lead_to_lines(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    path.write_text(
        '[arm]\n[arm.beam]\nlength = 1\n[controller]\nlimits = { tip = 1,  "deflection@0.5" = 2 }\n'
        "[compare]\norders = [\n 1,\n 2,\n]\n"
    )
    source = read_source(path)
    places = {
        "arm": 1, "arm.beam": 2, "arm.beam.length": 3, "beam.length": 3, "arm.beam.width": 2,
        "controller.limits.deflection@0.5": 5, "controller.noise": 4, "compare.orders.1": 9,
        "slew": None, "": None, "controllers": None,
    }  # fmt: skip
    assert {where: source.line(where) for where in places} == places


def test_windows_line_ends_count_once(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    path.write_bytes(b'a = 1\r\ns = """\r\n\r\n"""\r\nb = 5\r\n')
    assert read_source(path).lines == {("a",): 1, ("s",): 2, ("b",): 5}
