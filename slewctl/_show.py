"""How results show themselves in a notebook: a table, a data frame, axes to draw on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

from slewctl._types import Array
from slewctl.errors import InputError

# Names for annotations only: neither package is loaded before someone asks for it.
if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame
else:
    Axes = DataFrame = Any

__all__ = [
    "Axes",
    "DataFrame",
    "Described",
    "Tabular",
    "axes_or_new",
    "rows_of",
    "table_html",
    "to_frame",
]

# Of a result that is typed at a prompt, beside its first line.
_MOST_LINES = 11


class Described:
    """A result of many numbers: typing it prints what its ``__str__`` says and not all of them."""

    def __repr__(self) -> str:
        first, *rest = str(self).splitlines()
        return "\n".join([f"<{first}>", *rest[:_MOST_LINES]])

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"


class Tabular:
    """A result made of rows: a notebook shows them as a table, pandas as a data frame."""

    def rows(self) -> list[dict[str, object]]:
        """Return the rows, all with the same keys."""
        raise NotImplementedError

    @property
    def caption(self) -> str:
        """What stands over the table."""
        return ""

    def _repr_html_(self) -> str:
        return table_html(self.rows(), self.caption)

    def to_frame(self) -> DataFrame:
        """Return the rows as a pandas data frame."""
        return to_frame(self.rows())


def table_html(rows: Sequence[Mapping[str, Any]], caption: str = "") -> str:
    """Return rows with the same keys as an HTML table.

    Parameters
    ----------
    rows : sequence of mapping
    caption : str
    """
    if not rows:
        return f"<p>{escape(caption)}</p>"
    head = "".join(f"<th>{escape(key)}</th>" for key in rows[0])
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(_cell(value))}</td>" for value in row.values()) + "</tr>"
        for row in rows
    )
    title = f"<caption>{escape(caption)}</caption>" if caption else ""
    return f"<table>{title}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _cell(value: object) -> str:
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def rows_of(columns: Mapping[str, Array]) -> list[dict[str, object]]:
    """Return columns of one length as rows of plain numbers.

    Parameters
    ----------
    columns : mapping of str to ndarray, shape (n,)
    """
    listed = [column.tolist() for column in columns.values()]
    return [dict(zip(columns, row, strict=True)) for row in zip(*listed, strict=True)]


def to_frame(rows: Sequence[Mapping[str, Any]]) -> DataFrame:
    """Return rows as a pandas data frame.

    Raises
    ------
    InputError
        If pandas is not installed.
    """
    try:
        import pandas  # an option: nothing else here needs it
    except ImportError as error:
        raise InputError(
            "pandas is not installed", where="to_frame", remedy="pip install pandas"
        ) from error
    return pandas.DataFrame([dict(row) for row in rows])


def axes_or_new(ax: Axes | None, rows: int = 1) -> Axes:
    """Return `ax`, or the axes of a new figure, several one above the other as an array."""
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt  # only those who draw wait for it

    return plt.subplots(rows, sharex=True, layout="constrained")[1]
