"""A whole study: every point of it, over any executor."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from typing import Any

from slewctl._types import FilePath
from slewctl.compare.study.grid import Study
from slewctl.compare.study.point import Work, evaluate_point
from slewctl.compare.study.result import StudyResult
from slewctl.compare.study.results_file import Notice, rows
from slewctl.compare.study.sweep import Groups, Piece, sweep


def places(study: Study) -> Groups:
    """Return how many places a study has, counted with every grid, and points at the largest.

    A place is a setting: its truth and optimum serve all points that are judged there.
    """
    sizes = [len(grid.methods) * len(grid.bases) * len(grid.orders) for grid in study.grids]
    counts = [len(grid) // size for grid, size in zip(study.grids, sizes, strict=True)]
    return Groups(sum(counts), max(sizes))


def run_study(
    study: Study,
    results: FilePath,
    *,
    stamp: Mapping[str, Any],
    executor: Executor | None = None,
    workers: int | None = None,
    resume: bool = False,
    progress: Callable[[int], None] | None = None,
    notice: Notice | None = None,
) -> StudyResult:
    """Try every point of a study; see `sweep` for the parameters and errors.

    Parameters
    ----------
    study : Study
    results : str or PathLike
        Gets a line for each point.
    stamp, executor, workers, resume, progress, notice
        As for `sweep`.

    Returns
    -------
    StudyResult

    Examples
    --------
    >>> import slewctl as sc
    >>> from slewctl.compare import Grid, Study
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> grid = Grid(bases=("slewing",), orders=(1,), hub_ratios=(1.0,), payload_ratios=(0.0,),
    ...     damping_ratios=(0.01,), bandwidths=(0.5,))
    >>> study = Study("hubs", "", arm, (grid,), truth_modes=10)
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> path = Path(mkdtemp()) / "rows.jsonl"
    >>> result = sc.run_study(study, path, stamp={}, executor=ThreadPoolExecutor(1))
    >>> len(result.rows)
    1
    """

    def pieces() -> Iterator[Piece]:
        for point in study.points():
            work = Work(study.arm, study.truth_modes, point)
            yield Piece(point.key, work, group=repr(point.setting))

    sweep(
        evaluate_point, pieces(), results, stamp=stamp, executor=executor, workers=workers,
        groups=places(study), resume=resume, progress=progress, notice=notice,
    )  # fmt: skip
    return StudyResult(study, rows(results))
