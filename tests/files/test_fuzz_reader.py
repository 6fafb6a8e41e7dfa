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

COUNT = int(os.environ.get("SLEWCTL_FUZZ", "2000"))


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fuzz") / "x.toml"


@settings(deterministic(COUNT), suppress_health_check=list(HealthCheck))
@given(data=FILES)
def test_any_file_is_read_or_refused_in_short_lines(path: Path, data: bytes) -> None:
    check_reading(path, data)


def test_what_the_files_are_made_from_is_read(path: Path) -> None:
    assert all(check_reading(path, text.encode()) < 4 for text in WHOLE)
