"""Mistaken files through every command: a verdict or one line, and nothing else.

No traceback, no hang (`guarded_run.LIMITS_S`), no warning, status 0, 1 or 2, the file named in
every line of an error, nothing written beside ``--out``, and reports that can be read.
"""

from __future__ import annotations

import math
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest
from guarded_run import guarded_run
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from mutated_files import QUICK, STUDY, mutated, small_designs, toml

from slewctl.cli import study as cli_study
from slewctl.cli import worst as cli_worst
from slewctl.compare import judgement
from slewctl.compare.study import recommend, sweep

DESIGNS = small_designs()


def fuzz(examples: int) -> settings:
    """The same files on every run, and the first one that fails told as it is."""
    return settings(
        max_examples=examples, deadline=None, derandomize=True, database=None,
        phases=[Phase.generate], report_multiple_bugs=False,
        suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
    )  # fmt: skip


@st.composite
def mistaken(draw: st.DrawFn, files: tuple[dict[str, Any], ...]) -> str:
    """The text of one of these files with mistakes in it."""

    def choose(options: Any) -> Any:
        return options[draw(st.integers(0, len(options) - 1))]

    return toml(mutated(choose(files), choose))


quick = mistaken(tuple(DESIGNS[number] for number in QUICK))
every = mistaken(tuple(DESIGNS.values()))
studies = mistaken((STUDY,))


def stands(command: str, text: str) -> None:
    """Assert that a command bears a file."""
    # Two truths are enough to be mistaken on; more of them take most of the time.
    with tempfile.TemporaryDirectory() as folder, patch.object(judgement, "MOST_MODES", 40):
        run = guarded_run(command, text, Path(folder))
    assert run.faults == (), f"{run.faults}\n{text}"


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK)
def test_the_files_themselves_are_judged(name: str) -> None:
    """What is mutated is a design that works, or a refusal would prove nothing."""
    with tempfile.TemporaryDirectory() as folder:
        run = guarded_run("check", toml(DESIGNS[name]), Path(folder))
    assert run.faults == ()
    assert run.status in (0, 1)


@pytest.mark.slow
@given(quick)
@fuzz(30)
def test_check_bears_any_file(text: str) -> None:
    stands("check", text)


@pytest.mark.slow
@given(quick)
@fuzz(20)
def test_ladder_bears_any_file(text: str) -> None:
    stands("ladder", text)


@given(quick)
@fuzz(20)
def test_modes_bears_any_file(text: str) -> None:
    stands("modes", text)


@pytest.mark.slow
@given(quick)
@fuzz(8)
def test_compare_bears_any_file(text: str) -> None:
    stands("compare", text)


@pytest.mark.slow
@given(quick)
@fuzz(4)
def test_recommend_bears_any_file(text: str) -> None:
    few = {"ORDERS": (1, 2), "BANDWIDTHS": (0.3,)}
    # What a patient program is told is no fault, however busy the machine is.
    with patch.multiple(recommend, **few), patch.object(cli_study, "PATIENCE", math.inf):
        stands("recommend", text)


@pytest.mark.slow
@given(quick)
@fuzz(20)
def test_worst_bears_any_file(text: str) -> None:
    with patch.object(cli_worst, "PATIENCE", math.inf):
        stands("worst", text)


@pytest.mark.slow
@given(studies)
@fuzz(20)
def test_study_bears_any_file(text: str) -> None:
    # Processes would take longer to start than to work.
    with patch.object(sweep, "Processes", ThreadPoolExecutor):
        stands("study", text)


@pytest.mark.slow
@given(every)
@fuzz(12)
def test_check_bears_any_file_of_every_method(text: str) -> None:
    stands("check", text)
