"""Results that survive: whatever stands in the file, a resumed sweep ends with the same rows."""

from __future__ import annotations

import json
import os
import re
import resource
import stat
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slewctl.compare.study.results_file import rows
from slewctl.compare.study.sweep import Piece, sweep
from slewctl.errors import InputError
from slewctl.versions import versions

COUNT = 6
STAMP = {"study": "ä" * 20}


class Counted:
    """Work that remembers what it was given."""

    def __init__(self) -> None:
        self.done: list[int] = []

    def __call__(self, number: int) -> list[dict[str, Any]]:
        self.done.append(number)
        return [{"number": number, "third": number / 3, "text": "é\n"}]


def run(results: Path, *, resume: bool = False, count: int = COUNT, stamp: Any = STAMP) -> Any:
    """Sweep over numbers in this process; return which were worked on, and what was told."""
    work, told = Counted(), []
    with ThreadPoolExecutor(1) as threads:
        sweep(work, [Piece(f"{i:03d}", i) for i in range(count)], results, stamp=stamp,
              executor=threads, resume=resume, notice=told.append)  # fmt: skip
    return work.done, told


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """Results of a finished sweep."""
    run(tmp_path / "r.jsonl")
    return tmp_path / "r.jsonl"


Mutation = Callable[[bytes], bytes]


def _lines(text: bytes, order: Callable[[list[bytes]], Sequence[bytes]]) -> bytes:
    return b"".join(order(text.splitlines(keepends=True)))


@st.composite
def mutations(draw: st.DrawFn) -> Mutation:
    """Return a change of a file such as a disk, a kill, an editor or a merge makes."""
    place, length = draw(st.integers(0, 1500)), draw(st.integers(0, 400))
    inserted = draw(
        st.one_of(
            st.binary(max_size=40),
            st.sampled_from([
                b"null\n", b"[[[[\n", b"[" * 5000 + b"\n", b'{"key": "a", "rows": 5}\n',
                b'{"key": "000", "rows": [{"number": 7}]}\n', b"\n", b"\xff\n", b"\r\n",
                b'{"format": "slewctl-sweep-2", "stamp": {}}\n', b"9" * 5000 + b"\n",
            ]),
        )
    )  # fmt: skip
    first, second = draw(st.integers(0, COUNT)), draw(st.integers(0, COUNT))
    return draw(
        st.sampled_from([
            lambda text: text[:place],
            lambda text: text[:place] + text[place + length :],
            lambda text: text[:place] + inserted + text[place:],
            lambda text: text[:place] + inserted + text[place + len(inserted) :],
            lambda text: _lines(text, lambda lines: [*lines[:first], inserted, *lines[first:]]),
            lambda text: _lines(text, lambda lines: [*lines, *lines[first : first + 2]]),
            lambda text: _lines(text, lambda lines: [*lines[second:], *lines[:second]]),
            lambda text: _lines(text, lambda lines: lines[first:]),
        ])
    )  # fmt: skip


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(st.lists(mutations(), min_size=1, max_size=3))
def test_whatever_stands_in_the_file_the_rows_end_the_same(changes: list[Mutation]) -> None:
    with TemporaryDirectory() as folder:
        results = Path(folder) / "r.jsonl"
        run(results)
        whole, text = rows(results), results.read_bytes()
        entries = set(text.splitlines(keepends=True)[1:])
        for change in changes:
            text = change(text)
        results.write_bytes(text)
        # Lines end in \n alone; a \r before one belongs to it, and is damage.
        survive = entries & set(re.findall(rb"[^\n]*\n", text))
        if survive:  # nothing whole is done again
            assert len(run(results, resume=True)[0]) == COUNT - len(survive)
        else:  # refused only if there is nothing to lose
            try:
                run(results, resume=True)
            except InputError as error:
                told = str(error)
                results.unlink()
                run(results)
                assert re.fullmatch(r".*remove.*", told)
        assert rows(results) == whole
        assert run(results, resume=True) == ([], [])  # and all is whole again


@pytest.mark.parametrize(
    "line", ["null", "[[[[", "[" * 100_000, '{"key": "a", "rows": 5}', '{"key": "003"}', "", "7",
             '{"key": "other", "rows": [{"number": 9, "third": 3.0, "text": ""}]}'],
)  # fmt: skip
def test_lines_of_another_shape_are_named(results: Path, line: str) -> None:
    whole, lines = rows(results), results.read_text().splitlines()
    lost = int(json.loads(lines[4])["key"])
    lines[4] = line
    results.write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError, match=re.escape(f"{results}:5: damaged; go on with --resume")):
        rows(results)
    assert run(results, resume=True) == (
        [lost], [f"{results}:5: damaged; what it told is done again"]
    )  # fmt: skip
    assert rows(results) == whole


def test_no_changed_digit_is_believed(results: Path) -> None:
    whole, text = rows(results), results.read_text()
    assert text.count("0.3333333333333333") == 1
    results.write_text(text.replace("0.3333333333333333", "0.3333333333333334"))
    done, (told,) = run(results, resume=True)
    assert done == [1]
    assert re.match(rf"{results}:\d: damaged", told)
    assert rows(results) == whole


def test_many_damaged_lines_are_counted(tmp_path: Path) -> None:
    results = tmp_path / "r"
    run(results, count=40)
    results.write_text(results.read_text().replace('"third"', '"fourth"'))
    done, told = run(results, count=40, resume=True)
    assert len(done) == 40
    assert len(told) == 6
    assert told[-1] == f"{results}: 35 more lines are damaged"


def test_rows_of_another_sweep_are_not_believed(results: Path, tmp_path: Path) -> None:
    """Not even under the same keys: a checksum holds for one study."""
    other = tmp_path / "other"
    run(other, stamp={"study": "b"})
    foreign = other.read_text().splitlines(keepends=True)[1:]
    head, *_ = results.read_text().splitlines(keepends=True)
    results.write_text(head + "".join(foreign))
    assert len(run(results, resume=True)[0]) == COUNT


def test_a_piece_that_is_none_of_the_sweep_is_taken_out(results: Path) -> None:
    done, (told,) = run(results, resume=True, count=4)
    assert done == []
    assert "2 pieces are none of this study's" in told
    assert [row["number"] for row in rows(results)] == [0, 1, 2, 3]


@pytest.mark.parametrize("size", [0, 1, 30, -1])
def test_a_torn_first_line_is_no_result(results: Path, size: int) -> None:
    """A full disk leaves a file without a whole line; a new run and a resumed one both work."""
    whole = rows(results)
    head = results.read_bytes().splitlines(keepends=True)[0]
    for resume in (False, True):
        results.write_bytes(head[:size])
        assert run(results, resume=resume)[0] == list(range(COUNT))
        assert rows(results) == whole


@pytest.mark.parametrize("head", [b"\n", b"x" * 40 + b"\n", b"y" * 3000 + b"\n"])
def test_a_damaged_head_costs_no_finished_piece(results: Path, head: bytes) -> None:
    whole = rows(results)
    lines = results.read_bytes().splitlines(keepends=True)
    results.write_bytes(head + b"".join(lines[1:]))
    assert run(results, resume=True) == (
        [], [f"{results}:1: damaged; what it told is done again"]
    )  # fmt: skip
    assert rows(results) == whole


def test_other_versions_are_refused_by_name(results: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    newer = {**versions(), "numpy": "99.1"}
    monkeypatch.setattr("slewctl.compare.study.results_file.versions", lambda: newer)
    with pytest.raises(InputError, match=rf"made with numpy {versions()['numpy']} \(here 99.1\)"):
        run(results, resume=True)


def test_a_second_run_at_the_same_time_is_refused(tmp_path: Path) -> None:
    results = tmp_path / "r"
    begun, end = threading.Event(), threading.Event()

    def waiting(number: int) -> list[dict[str, int]]:
        begun.set()
        end.wait(30)
        return [{"number": number}]

    with ThreadPoolExecutor(2) as threads:
        first = threads.submit(
            sweep, waiting, [Piece("0", 0)], results, stamp=STAMP, executor=threads
        )
        assert begun.wait(30)
        for resume in (False, True):
            with pytest.raises(InputError, match="another run is writing to this file"):
                run(results, resume=resume)
        end.set()
        first.result(30)
    assert len(rows(results)) == 1


def test_a_full_disk_is_told_and_keeps_what_was_finished(tmp_path: Path) -> None:
    results = tmp_path / "r"
    run(results)
    whole, size = rows(results), results.stat().st_size
    for room in (20, size - 150):  # for a part of the head, and of a later line
        results.unlink()
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1]))
        try:
            with pytest.raises(InputError, match="make room on the disk and go on with --resume"):
                run(results)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
        assert results.read_bytes()[-1:] in (b"", b"\n")  # no line is torn
        kept = max(results.read_bytes().count(b"\n") - 1, 0)
        assert (kept > 0) == (room > 20)
        assert len(run(results, resume=True)[0]) == COUNT - kept
        assert rows(results) == whole


@pytest.mark.parametrize("make", [Path.mkdir, os.mkfifo, lambda p: p.symlink_to("/dev/zero")])
def test_what_is_no_file_is_refused_at_once(tmp_path: Path, make: Callable[[Path], None]) -> None:
    make(tmp_path / "r")
    for resume in (False, True):
        with pytest.raises(InputError, match="not a file"):
            run(tmp_path / "r", resume=resume)


def test_the_file_keeps_its_mode(results: Path) -> None:
    results.chmod(0o600)
    results.write_bytes(b"?" + results.read_bytes())
    run(results, resume=True)
    assert stat.S_IMODE(results.stat().st_mode) == 0o600


def test_every_line_is_json(results: Path) -> None:
    lines = [json.loads(line) for line in results.read_text().splitlines()]
    assert all("seal" in line for line in lines)
    assert lines[0]["stamp"] == STAMP
    assert sorted(line["key"] for line in lines[1:]) == [f"{i:03d}" for i in range(COUNT)]
