"""Files of every kind of wrongness: real keys with wrong values, mutated designs, random bytes."""

from __future__ import annotations

import re
from pathlib import Path
from typing import get_args

from hypothesis import strategies as st
from quick_design import QUICK

from slewctl.errors import SlewctlError
from slewctl.files import find_designs, read_arm, read_design, read_study
from slewctl.files.schema import DesignTable
from slewctl.files.study_schema import StudyTable
from slewctl.files.table import Table

DESIGNS = Path(__file__).parents[2] / "designs"
WHOLE = [QUICK, *(path.read_text("utf-8") for path in sorted(DESIGNS.rglob("*.toml")))]


def keys_of(kind: type[Table]) -> set[str]:
    """Return the keys of a table and of all tables within it."""
    found = {field.alias or name for name, field in kind.model_fields.items()}
    waiting: list[object] = [field.annotation for field in kind.model_fields.values()]
    while waiting:
        part = waiting.pop()
        if isinstance(part, type) and issubclass(part, Table):
            found |= keys_of(part)
        waiting += get_args(part)
    return found


KEYS = sorted(keys_of(DesignTable) | keys_of(StudyTable) | {
    "limits", "tip", "torque", "theta", "stable", "disk_margin", "payload_mass", "mass_factor",
    "alpha", "beta", "x", "values", "", "a b", "::error::", "\x1b", "é",
})  # fmt: skip
SCALARS = st.one_of(
    st.sampled_from([
        "true", "nan", "-inf", "0", "-1", "1e-200", "1e300", "9" * 30, "9" * 5000, "0x" + "f" * 3600, "''",
        '"paper-beam"', '"lqg"', '"slewing"', '"\\u001b[31m"', '"\\n::error::x"', "2026-01-01", "[]", "{}",
        "[1, [2, 'a']]", "{ x = [0, 1], values = [1, 1] }", "[" * 40 + "]" * 40, '"' + "x" * 2000 + '"', "{ kind = 'rayleigh' }",
    ]),
    st.integers().map(str),
    st.floats().map(lambda x: repr(x).replace("e+", "e")),
    st.text(max_size=8).map(lambda text: '"""' + text.replace("\\", "\\\\").replace('"', "'").replace("\r", "") + '"""'),
)  # fmt: skip


def quoted(key: str) -> str:
    """Return a key as TOML takes it."""
    escaped = "".join(c if c.isprintable() and c not in '"\\' else f"\\u{ord(c):04x}" for c in key)
    return f'"{escaped}"'


NAMES = st.sampled_from(KEYS).map(quoted)
DOTTED = st.lists(NAMES, min_size=1, max_size=3).map(".".join)
STATEMENTS = st.one_of(
    st.tuples(DOTTED, SCALARS).map(" = ".join),
    DOTTED.map("[{}]".format),
    st.just("[[grid]]"),
)


@st.composite
def mutated(draw: st.DrawFn) -> bytes:
    """A real design with a few of its lines, values and characters changed."""
    lines = draw(st.sampled_from(WHOLE)).split("\n")
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(lines) - 1))
        key = lines[at].partition("=")[0]
        change = draw(st.sampled_from(["value", "value", "drop", "insert", "twice", "cut"]))
        if change == "value" and "=" in lines[at]:
            lines[at] = f"{key}= {draw(SCALARS)}"
        elif change == "insert":
            lines.insert(at, draw(STATEMENTS))
        elif change == "twice":
            lines.insert(at, lines[at])
        elif change == "cut":
            lines[at] = lines[at][: draw(st.integers(0, len(lines[at])))]
        else:
            lines[at] = ""
    return "\n".join(lines).encode("utf-8", "replace")


FILES = st.one_of(
    st.lists(STATEMENTS, max_size=8).map(lambda rows: "\n".join(rows).encode("utf-8", "replace")),
    mutated(),
    st.binary(max_size=200),
    st.text(max_size=200).map(lambda text: text.encode("utf-8", "replace")),
)


def check_reading(path: Path, data: bytes) -> int:
    """Read a file in every way; return how many ways refuse it, each in short lines."""
    path.write_bytes(data)
    refused = 0
    for read in (read_design, read_arm, read_study, lambda path: find_designs([path])):
        try:
            read(path)
        except SlewctlError as error:
            refused += 1
            message = str(error)
            assert message, data
            for line in message.split("\n"):
                assert line.startswith((f"{path}:", "and ")), line
                assert len(line) - len(str(path)) < 1000, line
                assert not re.search(r"[\x00-\x1f\x7f-\x9f]", line), line
    return refused
