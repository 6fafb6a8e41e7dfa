"""Options that several commands share."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import click

from slewctl.errors import InputError, SlewctlError


@contextmanager
def options_named(options: Mapping[str, str]) -> Iterator[None]:
    """Let what is wrong with a value from the command line name its option, and no file.

    Parameters
    ----------
    options : mapping of str to str
        Option by the place that errors name.
    """
    try:
        yield
    except SlewctlError as error:
        for place, option in options.items():
            if error.where == place or (place and error.where.startswith(f"{place}.")):
                # Of several properties which one; of numbered values the message says which.
                within = error.where[len(place) + 1 :].rstrip("0123456789")
                raise error.at(f"{option} {within}".rstrip()) from error
        raise


class _Folder(click.Path):
    """A folder to write to, refused at once and not behind hours of work."""

    def convert(
        self, value: object, param: click.Parameter | None, context: click.Context | None
    ) -> Path:
        """Return the path of the folder, which need not be there yet."""
        if not str(value).strip():
            self.fail("an empty name; give a folder, or . for this one.", param, context)
        folder = Path(super().convert(value, param, context))  # type: ignore[arg-type]
        _check_writable(folder)
        return folder


def _check_writable(folder: Path) -> None:
    """Refuse a folder in which, or in the nearest one that exists, nothing can be made."""
    try:
        base = next(part for part in (folder, *folder.absolute().parents) if part.exists())
        with tempfile.TemporaryDirectory(dir=base, prefix=".writing-"):
            pass
    except OSError as error:
        raise InputError(
            f"cannot be written: {error.strerror}",
            where=f"--out {folder}",
            remedy="name a folder that you may write to",
        ) from error


OUT_FOLDER = click.option(
    "--out", required=True, type=_Folder(path_type=Path, file_okay=False), metavar="DIR",
    help="Folder to write to; made if it isn't there.",
)  # fmt: skip

OUT_MAYBE = click.option(
    "--out", type=_Folder(path_type=Path, file_okay=False), metavar="DIR",
    help="Folder for a report; made if it isn't there. Without it nothing is written.",
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
