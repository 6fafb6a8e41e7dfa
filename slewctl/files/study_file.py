"""Study files: one arm and the grids of designs tried for it."""

from __future__ import annotations

from slewctl._types import FilePath
from slewctl.compare import Grid, Study
from slewctl.errors import SlewctlError, check_path
from slewctl.files.arm_table import arm_of_table
from slewctl.files.find import refuse_design
from slewctl.files.refusals import validate
from slewctl.files.source import read_source
from slewctl.files.study_schema import GridTable, StudyTable


def read_study(path: FilePath) -> Study:
    """Return the study that a TOML file describes.

    Parameters
    ----------
    path : str or PathLike

    Returns
    -------
    Study

    Raises
    ------
    InputError
        If the file cannot be read, is not TOML, or has an unknown key or an impossible
        value; the message names file, line, key and remedy.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> from slewctl.files import read_study
    >>> path = Path(mkdtemp()) / "study.toml"
    >>> text = '''
    ... [arm]
    ... catalogue = "paper-beam"
    ... [[grid]]
    ... orders = [1, 2]
    ... '''
    >>> _ = path.write_text(text)
    >>> read_study(path).grids[0].orders
    (1, 2)
    """
    path = check_path(path, "path")
    source = read_source(path)
    refuse_design(source)
    try:
        table = validate(source.content, StudyTable)
        arm = arm_of_table(table.arm)
        grids = tuple(_grid(place, each) for place, each in enumerate(table.grid))
        return Study(path.stem, table.title, arm, grids, table.truth.modes)
    except SlewctlError as error:
        raise source.refuse(error) from error


def _grid(place: int, table: GridTable) -> Grid:
    try:
        return Grid(**table.model_dump(exclude_none=True))
    except SlewctlError as error:
        raise error.within(f"grid.{place}", ".") from error
