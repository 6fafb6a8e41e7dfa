"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path

import click

OUT_FOLDER = click.option(
    "--out", required=True, type=click.Path(path_type=Path, file_okay=False), metavar="DIR",
    help="Folder for the report; made if it isn't there.",
)  # fmt: skip


def _can_write_parquet(_: click.Context, __: click.Parameter, asked: bool) -> bool:
    """Refuse at once, and not behind hours of work, what could not be written."""
    if asked:
        from slewctl.report import check_parquet  # matplotlib comes with it

        check_parquet()
    return asked


PARQUET = click.option(
    "--parquet", is_flag=True, callback=_can_write_parquet,
    help="Write the tables as Parquet too; needs slewctl[parquet].",
)  # fmt: skip
