"""Columns of numbers by name: of a CSV file, MATLAB's ``.mat``, NumPy's ``.npz`` or JSON."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from slewctl._types import Array, ComplexArray, FilePath
from slewctl.errors import InputError, check_path, shown
from slewctl.export import SUFFIXES, read_data
from slewctl.textfile import read_text

# In bytes; an hour of four signals at a kilohertz.
MOST_BYTES = 200_000_000
CSV_SUFFIXES = (".csv", ".txt", ".tsv", ".dat")
# Names of a file that a message tells.
_MOST_TOLD = 20
_DELIMITERS = ("\t", ";", ",")


def read_columns(file: FilePath) -> dict[str, ComplexArray]:
    """Return the columns of a file by name, empty cells as NaN.

    Parameters
    ----------
    file : path
        ``.csv`` (also ``.txt``, ``.tsv``, ``.dat``) with a line of names, its cells apart by
        commas, semicolons (decimal commas allowed), tabs or spaces, lines with ``#`` left
        out, unless the last of them before the numbers holds the names; columns without names
        are called 1, 2 and so on; or ``.mat``, ``.npz``, ``.json`` with one array a name.

    Returns
    -------
    dict of str to ndarray

    Raises
    ------
    InputError
        If the file is not there, holds no columns of numbers, or its ending is unknown.
    """
    path = check_path(file, "file")
    if path.suffix.lower() in CSV_SUFFIXES:
        return _from_text(path)
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(
            f"unknown ending {path.suffix!r}",
            where=str(path),
            remedy=f"give {', '.join((*CSV_SUFFIXES, *SUFFIXES))}",
        )
    found = {
        str(name): column
        for name, value in read_data(path).items()
        if (column := _column(value)) is not None
    }
    if not found:
        raise InputError(
            "it holds no columns of numbers", where=str(path), remedy="write one array a name"
        )
    return found


def pick(columns: Mapping[str, ComplexArray], name: str, where: str) -> ComplexArray:
    """Return the column called `name`; refuse another name and tell what there is."""
    if name not in columns:
        raise InputError(
            f"there is no column {shown(name)}: it holds {holds(columns)}",
            where=where,
            remedy="name one of these",
        )
    return columns[name]


def pick_real(columns: Mapping[str, ComplexArray], name: str, where: str) -> Array:
    """Return a column as real numbers; refuse complex ones."""
    column = pick(columns, name, where)
    if np.any(column.imag):
        raise InputError(
            f"column {shown(name)} is complex", where=where, remedy="give a real signal"
        )
    return np.asarray(column.real)


def holds(columns: Mapping[str, Any]) -> str:
    """Return the names of columns for a message."""
    return ", ".join(list(columns)[:_MOST_TOLD]) or "nothing"


def _column(value: Any) -> ComplexArray | None:
    """Return a value as a column of complex numbers; None if it is none."""
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "iufcb" or max(array.shape, default=1) != array.size:
            return None
        return array.ravel().astype(complex)
    except (TypeError, ValueError):
        return None


def _from_text(path: Path) -> dict[str, ComplexArray]:
    try:
        text = read_text(path, most=MOST_BYTES)
    except FileNotFoundError as error:
        raise InputError(
            "there is no such file", where=str(path), remedy="check the path"
        ) from error
    filled = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip()]
    lines = [(k, line) for k, line in filled if not line.lstrip().startswith("#")]
    if len(lines) < 2:
        raise InputError(
            "it holds no columns of numbers",
            where=str(path),
            remedy="write a line of names and a line for each sample",
        )
    delimiter = next((mark for mark in _DELIMITERS if mark in lines[0][1]), None)
    names = [name.strip() for name in _cells(lines[0][1], delimiter)]
    if all(_number(name, delimiter) is not None for name in names):
        before = [line for k, line in filled if k < lines[0][0]]
        names = _names_above(before, len(names), delimiter)
    elif any(name and _number(name, delimiter) is not None for name in names):
        raise InputError(
            f"its first line holds names and numbers: {shown(lines[0][1])}",
            where=f"{path}:{lines[0][0]}",
            remedy="begin with a line of names",
        )
    else:
        lines = lines[1:]
    twice = next((name for k, name in enumerate(names) if name in names[:k]), None)
    if twice is not None:
        raise InputError(
            f"two columns are called {shown(twice)}",
            where=str(path),
            remedy="give each column a name of its own",
        )
    rows = [_row(line, names, delimiter, f"{path}:{number}") for number, line in lines]
    return dict(zip(names, np.array(rows, dtype=complex).T, strict=True))


def _names_above(comments: list[str], count: int, delimiter: str | None) -> list[str]:
    """Return the names in the last line before the numbers, behind a ``#``, or 1, 2, …"""
    told = comments[-1].lstrip().lstrip("#") if comments else ""
    names = [name.strip() for name in _cells(told, delimiter)] if told.strip() else []
    if len(names) == count and all(_number(name, delimiter) is None for name in names):
        return names
    return [str(k + 1) for k in range(count)]


def _cells(line: str, delimiter: str | None) -> list[str]:
    return line.split() if delimiter is None else next(csv.reader([line], delimiter=delimiter))


def _row(line: str, names: list[str], delimiter: str | None, where: str) -> list[complex]:
    cells = _cells(line, delimiter)
    if len(cells) != len(names):
        raise InputError(
            f"{len(cells)} cells under {len(names)} names",
            where=where,
            remedy="give every name a cell, empty where there is no number",
        )
    row = [_number(cell, delimiter) for cell in cells]
    for name, cell, number in zip(names, cells, row, strict=True):
        if number is None:
            raise InputError(
                f"{shown(cell)} under {shown(name)} is no number", where=where, remedy="mend it"
            )
    return [number for number in row if number is not None]


def _number(cell: str, delimiter: str | None) -> complex | None:
    """Return the number in a cell, NaN for an empty one, None if it is something else."""
    text = cell.strip()
    if not text:
        return complex(np.nan)
    if delimiter == ";":
        text = text.replace(",", ".")
    try:
        return complex(float(text))
    except ValueError:
        pass
    try:
        return complex(text.replace(" ", "").replace("i", "j"))
    except ValueError:
        return None
