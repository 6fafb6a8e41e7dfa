"""Files that no person writes: refused in a short line, at once, with the limit."""

from __future__ import annotations

import os
import re
import sys
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest
from quick_design import QUICK

from slewctl.errors import InputError, SlewctlError, shown
from slewctl.files import find_designs, read_arm, read_design, read_source, read_study
from slewctl.textfile import read_text

TEXTS = [
    ("title = 0x" + "f" * 3600, ":1: title: a whole number of 14400 bits"),
    ("a = [1, {b = 9223372036854775808}]", ":1: a.1.b: 9223372036854775808 is beyond"),
    ("title." + "a." * 990 + "a = 1", ":1: not valid TOML: nested too deeply; write it flatter, with at most 50 levels"),
    ("\n\n['x'" + " .\t'y.z'" * 20_000 + "]", ":3: not valid TOML: nested too deeply"),
    ("a" + ".b" * 450_000 + " = 1", ":1: not valid TOML: nested too deeply"),
    ("a = " + "[" * 60 + "]" * 60, ":1: not valid TOML: nested too deeply"),
    ("a = " + "{b=" * 60 + "1" + "}" * 60, ":1: not valid TOML: nested too deeply"),
    ("#" * 1_000_001, ": is larger than 1 MB"),
    ('"' * 300_001, "not valid TOML"),
    ("a = " + '"""\\"' * 60_000, "not valid TOML"),
    ("a " * 150_000, "not valid TOML"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "words"), TEXTS, ids=[words for _, words in TEXTS])
def test_extreme_texts_are_refused_in_a_short_line(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "x.toml"
    path.write_text(text)
    for read in (read_design, read_arm, read_study):
        with pytest.raises(InputError) as caught:
            read(path)
        message = str(caught.value)
        assert message.startswith(f"{path}{words}" if words.startswith(":") else str(path))
        assert words in message
        assert len(message) - len(str(path)) < 300
        assert "\n" not in message


def test_dots_in_strings_and_comments_join_no_key(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    dots = "a." * 500 + "a"
    path.write_text(f'# {dots}\nt = "{dots}"\nu = \'{dots}\'\nv = """\n{dots}\n"""\nw = 1\n')
    assert read_source(path).lines[("w",)] == 7


def test_more_variations_than_anybody_waits_for_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    many = "".join(f"{k}.mass_factor=2\n" for k in range(3000))
    path.write_text(QUICK + "[variations]\n" + many)
    with pytest.raises(InputError, match=r":19: variations: 3000 keys in one table; keep 2000"):
        read_design(path)
    path.write_text(QUICK + "[variations]\n" + many[: many.index("1500.")])
    with pytest.raises(InputError, match=r":19: variations: 1500 variations; keep 1000"):
        read_design(path)


MASSES = {
    "requirements": QUICK + "\n".join(f"r{k} = 1" for k in range(80_000)),
    "options": QUICK.replace(
        "[requirements]", "\n".join(f"r{k} = 1" for k in range(80_000)) + "\n[requirements]"
    ),
    "tables": QUICK + "\n".join(f"[r{k}]" for k in range(80_000)),
    "list": QUICK + "\n[compare]\norders = [" + "1," * 300_000 + "]",
    "lists in a list": QUICK + "\nx = [" + "[]," * 300_000 + "]",
    "tables in a list": QUICK + "[[x]]\n" * 160_000,
    "dotted keys": "".join(f"k{k}.{'.'.join(['a'] * 40)} = 1\n" for k in range(4500)),
    "dotted headers": "".join(f"[k{k}.a.b.c.d]\n" for k in range(55_000)),
    "quoted keys": "".join(f'"k{k}"."\\u0061" = 1\n' for k in range(40_000)),
}


@pytest.mark.parametrize("text", MASSES.values(), ids=MASSES)
def test_masses_of_keys_and_elements_are_refused_unread(
    tmp_path: Path, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before the parser spends seconds on them."""
    path = tmp_path / "x.toml"
    path.write_text(text)
    monkeypatch.setattr("tomllib.loads", pytest.fail)
    with pytest.raises(InputError, match=r"x\.toml:1: at least \d+ keys.*; keep 20000"):
        read_design(path)


def test_numbers_and_inline_tables_count_once(tmp_path: Path) -> None:
    """A limit on values is none on digits, dots of numbers, strings or comments."""
    path = tmp_path / "x.toml"
    numbers = ", ".join("{ x = 1.5, y = 2.5 }" for _ in range(4000))
    quiet = "# a = [1, 2]\n" * 30_000 + 't = "' + "=,[." * 30_000 + '"\n'
    path.write_text(f"{quiet}n = [{numbers}]\nm = [{'1.5, ' * 5000}]\n")
    assert len(read_source(path).content["n"]) == 4000
    path.write_text("x = [" + "1.5," * 19_000 + "]\n")
    assert len(read_source(path).content["x"]) == 19_000


@pytest.mark.parametrize("key", ["limits", "noise"])
def test_more_signals_than_an_arm_has_are_refused(tmp_path: Path, key: str) -> None:
    path = tmp_path / "x.toml"
    many = ", ".join(f'"deflection@{k}" = 1.0' for k in range(1000))
    path.write_text(re.sub(rf"{key} = {{.*}}", f"{key} = {{ {many} }}", QUICK))
    with pytest.raises(InputError, match=rf"controller.{key}: 1000 are too many; give at most"):
        read_design(path)


def test_no_nearest_name_is_looked_for_in_faults_that_are_only_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []
    monkeypatch.setattr(
        "slewctl.errors.get_close_matches", lambda name, *_, **__: asked.append(name) or []
    )
    path = tmp_path / "x.toml"
    path.write_text(QUICK + "\n".join(f"r{k} = 1" for k in range(1900)))
    with pytest.raises(InputError) as caught:
        read_design(path)
    assert str(caught.value).endswith("and 1880 more faults")
    assert len(set(asked)) == 20


def test_more_bases_and_orders_than_anybody_reads_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    many = ", ".join(['"slewing"'] * 9_000), ", ".join(["1"] * 9_000)
    path.write_text(QUICK + "[compare]\nbases = [{}]\norders = [{}]\n".format(*many))
    with pytest.raises(InputError) as caught:
        read_design(path)
    for key in ("bases", "orders"):
        words = f"compare.{key}: 9000 are too many; give at most 100"
        assert words in str(caught.value)


def test_a_model_larger_than_any_truth_is_told_what_is_the_most(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    path.write_text(QUICK.replace("n = 2", "n = 1000000000"))
    with pytest.raises(InputError) as caught:
        read_design(path)
    assert "2000000000" not in str(caught.value)
    assert "design on at most" in str(caught.value)


class Unprintable:
    def __repr__(self) -> str:
        raise OSError("no")


NESTED: list[object] = []
for _ in range(100_000):
    NESTED = [NESTED]

VALUES: list[object] = [
    10**5000, -(16**3600), [10**5000], {"a": 10**5000}, NESTED, {"a": {"b": NESTED}}, "x" * 10**6,
    "\n::error::\x1b[31m\x00\u2028\ud800", b"\x00" * 10**6, [0] * 10**6, set(range(10**5)), Unprintable(),
    np.zeros(10**6), Decimal("1e999999"), float("nan"), None, range(10**9),
]  # fmt: skip


@pytest.mark.parametrize("value", VALUES, ids=range(len(VALUES)))
def test_any_value_is_shown_on_one_printable_line(value: object) -> None:
    text = shown(value)
    assert 0 < len(text) <= 60
    assert text.isprintable()
    message = str(SlewctlError(text, where="a\n::error::\x1b", remedy="x\ny" * 10**6))
    assert message.isprintable()
    assert len(message) < 500


def test_ordinary_values_are_shown_as_python_writes_them() -> None:
    for value in (3, -0.5, "a", [1, "2"], {"a": 1.5}, True, None, (1,), 2**64):
        assert shown(value) == repr(value)


@pytest.mark.skipif(os.name == "nt", reason="pipes and devices of Unix")
def test_only_ordinary_files_are_read(tmp_path: Path) -> None:
    """None of these waits, and a folder with all of them still shows its designs."""
    folder = tmp_path / "designs"
    folder.mkdir()
    os.mkfifo(folder / "pipe.toml")
    (folder / "zero.toml").symlink_to("/dev/zero")
    (folder / "gone.toml").symlink_to(tmp_path / "nowhere")
    (folder / "folder.toml").mkdir()
    (folder / "good.toml").write_text(QUICK)
    found = find_designs([folder])
    assert [path.stem for path in found] == ["gone", "good", "pipe", "zero"]
    for name in ("pipe", "zero"):
        assert find_designs([folder / f"{name}.toml"])
        for read in (read_design, read_arm, read_study):
            with pytest.raises(InputError, match="cannot be read: it is not an ordinary file"):
                read(folder / f"{name}.toml")
    with pytest.raises(InputError, match="cannot be read: Is a directory"):
        read_design(folder / "folder.toml")
    with pytest.raises(InputError, match="cannot be read"):
        read_design(folder / "gone.toml")


def test_no_more_than_asked_for_is_read(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_bytes(b"\xef\xbb\xbf" + "é".encode() * 10)
    assert read_text(path) == "é" * 10
    assert read_text(path, most=23) == "é" * 10
    with pytest.raises(InputError, match=r"larger than 2\.2e-05 MB"):
        read_text(path, most=22)
    with pytest.raises(FileNotFoundError):
        read_text(tmp_path / "nothing")
    with pytest.raises(InputError, match="cannot be read: it is no path"):
        read_text(Path("a\0b"))


def test_studies_are_no_designs_whatever_their_folder(tmp_path: Path) -> None:
    study = tmp_path / "a-study.toml"
    study.write_text('[arm]\ncatalogue = "paper-beam"\n[[grid]]\norders = [1]\n')
    with pytest.raises(InputError, match="only studies or arms, no design in this folder"):
        find_designs([tmp_path])
    half = tmp_path / "half.toml"
    half.write_text(QUICK.replace("[controller]", "[control]"))
    assert find_designs([tmp_path]) == (half,)
    assert find_designs([study, half]) == (half,)
    assert find_designs([study]) == ()


def test_the_limit_of_python_itself_is_not_touched() -> None:
    assert sys.get_int_max_str_digits() == sys.int_info.default_max_str_digits
