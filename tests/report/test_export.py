"""JSON and CSV of results, and files that are written whole or not at all."""

from __future__ import annotations

import csv
import io
import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slewctl.errors import InputError
from slewctl.report.export import csv_text, json_text, parquet, to_plain, write_files


@dataclass(frozen=True)
class Inner:
    pole: complex
    values: np.ndarray


PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(-1e300, 1e300) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=12,
)  # fmt: skip


def rounded(value: object) -> object:
    """Return plain data with ten digits of every float."""
    if isinstance(value, list):
        return [rounded(item) for item in value]
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    return float(f"{value:.9e}") if isinstance(value, float) else value


@given(PLAIN)
def test_plain_values_survive_the_round_trip(value: object) -> None:
    assert json.loads(json_text(value)) == rounded(value)


def test_numbers_arrays_and_dataclasses() -> None:
    plain = to_plain({"a": Inner(1 - 2j, np.array([1.0, math.inf])), "b": np.float64(-math.inf)})
    assert plain == {"a": {"pole": [1.0, -2.0], "values": [1.0, "inf"]}, "b": "-inf"}


def test_long_curves_keep_five_digits_and_short_ones_ten() -> None:
    curve = np.linspace(1.0, 2.0, 101) / 3
    kept = np.array(to_plain(curve))
    assert np.abs(kept / curve - 1).max() <= 5.1e-5
    assert np.abs(np.array(to_plain(curve[:50])) / curve[:50] - 1).max() <= 5.1e-10


def test_csv_reads_back() -> None:
    text = csv_text([{"name": "a,b", "x": 0.1}, {"name": "c", "x": None}])
    rows = list(csv.DictReader(io.StringIO(text)))
    assert rows == [{"name": "a,b", "x": "0.1"}, {"name": "c", "x": ""}]
    assert csv_text([]) == ""


def test_parquet_reads_back_with_its_types() -> None:
    rows = [{"name": "a", "n": 1, "x": 0.1, "ok": True, "none": None, "often": math.inf},
            {"name": "b", "n": 2, "x": None, "ok": False, "none": None, "often": 1 / 3}]  # fmt: skip
    written = parquet(rows)
    assert pyarrow.parquet.read_table(io.BytesIO(written)).to_pylist() == rows
    assert parquet(rows) == written


def test_parquet_without_its_package_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("slewctl.report.export.find_spec", lambda _: None)
    with pytest.raises(InputError, match=r"pip install 'slewctl\[parquet\]'"):
        parquet([])


def test_nothing_is_half_written(tmp_path: Path) -> None:
    write_files(tmp_path / "out", {"a.txt": "old"})
    broken = {"a.txt": "new", "b/missing.txt": "no such folder"}
    with pytest.raises(InputError, match="cannot be written"):
        write_files(tmp_path / "out", broken)
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["a.txt"]
    assert (tmp_path / "out" / "a.txt").read_text() == "old"


def test_a_folder_in_the_way_leaves_everything_as_it_was(tmp_path: Path) -> None:
    (tmp_path / "b.txt").mkdir()
    (tmp_path / "a.txt").write_text("old")
    with pytest.raises(InputError, match=r"b\.txt is a folder"):
        write_files(tmp_path, {"a.txt": "new", "b.txt": "new"})
    assert (tmp_path / "a.txt").read_text() == "old"


def test_a_file_in_the_way_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="file"):
        write_files(tmp_path / "file" / "out", {"a": "b"})
