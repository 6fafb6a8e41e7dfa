"""Whatever a file holds, reading it ends in a design or in a short refusal.

``SLEWCTL_FUZZ`` is the number of files; `tests/benchmarks` tries ten times as many.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from reader_fuzz import FILES, WHOLE, check_reading
from strategies import deterministic

COUNT = int(os.environ.get("SLEWCTL_FUZZ", "500"))


@pytest.mark.parametrize("count", [100, pytest.param(COUNT, marks=pytest.mark.slow)])
def test_any_file_is_read_or_refused_in_short_lines(tmp_path: Path, count: int) -> None:
    @settings(deterministic(count), suppress_health_check=list(HealthCheck))
    @given(data=FILES)
    def reads(data: bytes) -> None:
        check_reading(tmp_path / "x.toml", data)

    reads()


def test_what_the_files_are_made_from_is_read(tmp_path: Path) -> None:
    """A design, or a study, and its arm: the two other ways refuse it."""
    assert all(check_reading(tmp_path / "x.toml", text.encode()) <= 2 for text in WHOLE)
