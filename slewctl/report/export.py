"""Results as JSON, CSV and Parquet, and files that are never half-written."""

from __future__ import annotations

import csv
import gzip
import io
import json
import math
import os
import shutil
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from slewctl.errors import InputError
from slewctl.escape import csv_cell

# Ten digits are kept of every number: those behind them change from machine to machine.
_DIGITS = 10
# Long arrays are curves: five digits draw them, and keep the files small.
_CURVE_LENGTH = 50
_CURVE_DIGITS = 5


# Of a small object in JSON.
_LINE = 200


def to_plain(value: Any) -> Any:
    """Return `value` as JSON knows it.

    Dataclasses become objects, arrays lists, complex numbers ``[re, im]`` and infinities
    the strings "inf" and "-inf".  Numbers keep ten digits, arrays longer than fifty five.
    """
    kind = type(value)
    if kind is float:  # most of what there is
        return _rounded(value, _DIGITS) if math.isfinite(value) else str(value)
    if value is None or kind in (str, int, bool):
        return value
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: to_plain(getattr(value, f.name)) for f in fields(value) if f.init}
    if isinstance(value, Mapping):
        return {str(key): to_plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return _plain_array(value)
    if isinstance(value, list | tuple):
        return [to_plain(item) for item in value]
    if isinstance(value, complex | np.complexfloating):
        return [to_plain(value.real), to_plain(value.imag)]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return _rounded(float(value), _DIGITS) if math.isfinite(value) else str(float(value))
    if callable(value):
        return f"function {getattr(value, '__name__', 'unnamed')}"
    return value if value is None or isinstance(value, str | Enum) else str(value)


def _plain_array(array: np.ndarray[Any, Any]) -> Any:
    if array.ndim > 1:
        return [_plain_array(row) for row in array]
    items = array.tolist()
    if array.dtype == np.float64 and np.isfinite(array).all():
        plain = _shortened(items, _DIGITS)
        return plain if len(items) <= _CURVE_LENGTH else _shortened(plain, _CURVE_DIGITS)
    items = [to_plain(item) for item in items]
    if len(items) <= _CURVE_LENGTH:
        return items
    return [_rounded(item, _CURVE_DIGITS) for item in items]


def _shortened(numbers: Iterable[float], digits: int) -> list[float]:
    """Return finite numbers with fewer digits."""
    form = f"{{:.{digits - 1}e}}".format
    short = [float(form(number)) for number in numbers]
    if math.inf in short or -math.inf in short:  # the largest numbers round to infinity
        return [_rounded(number, digits) for number in numbers]
    return short


def _rounded(item: Any, digits: int) -> Any:
    if isinstance(item, list):
        return [_rounded(part, digits) for part in item]
    if not isinstance(item, float):
        return item
    short = float(f"{item:.{digits - 1}e}")
    return short if math.isfinite(short) else item  # the largest numbers round to infinity


def json_text(value: Any) -> str:
    """Return `value` as JSON text; see `to_plain`."""
    return _indented(to_plain(value)) + "\n"


def _indented(value: Any, margin: str = "") -> str:
    """Return JSON with an object's keys, and lists of objects, on lines of their own.

    Small objects of nothing but single values take one line.
    """
    inner = margin + " "
    plain = json.dumps(value, allow_nan=False, ensure_ascii=False)
    if isinstance(value, dict) and not _nested(value) and len(plain) <= _LINE:
        return plain
    if isinstance(value, dict) and value:
        items = [f"{json.dumps(key)}: {_indented(item, inner)}" for key, item in value.items()]
        return "{\n" + ",\n".join(inner + item for item in items) + f"\n{margin}}}"
    if isinstance(value, list) and any(isinstance(item, dict) for item in value):
        items = [_indented(item, inner) for item in value]
        return "[\n" + ",\n".join(inner + item for item in items) + f"\n{margin}]"
    return plain


def _nested(value: dict[str, Any]) -> bool:
    return any(isinstance(item, (dict, list)) for item in value.values())


def csv_text(rows: Iterable[Mapping[str, Any]]) -> str:
    """Return rows, all with the same keys, as CSV text with a header."""
    out = io.StringIO()
    _write_csv(rows, out)
    return out.getvalue()


def _write_csv(rows: Iterable[Mapping[str, Any]], out: TextIO) -> None:
    """Write rows one by one, so that a million of them need no memory."""
    writer = csv.writer(out, lineterminator="\n")
    names: list[str] = []
    for row in rows:
        if not names:
            names = list(row)
            writer.writerow(names)
        writer.writerow([_csv_cell(row[name]) for name in names])


def _csv_cell(item: Any) -> Any:
    """Return a cell: text is made harmless, and infinite numbers become words."""
    return _harmless(item) if isinstance(item, str) else to_plain(item)


# A column says the same few words again and again.
_harmless = lru_cache(maxsize=1024)(csv_cell)


def packed_csv(rows: Iterable[Mapping[str, Any]]) -> bytes:
    """Return long tables as gzipped CSV, the same bytes every time; pandas reads it as it is."""
    packed = io.BytesIO()
    with (
        gzip.GzipFile(fileobj=packed, mode="wb", mtime=0) as file,
        io.TextIOWrapper(file, encoding="utf-8", newline="") as out,
    ):
        _write_csv(rows, out)
    return packed.getvalue()


def check_parquet() -> None:
    """Refuse Parquet where the package that writes it is not installed.

    Raises
    ------
    InputError

    Examples
    --------
    >>> from slewctl.report import check_parquet
    >>> check_parquet()  # doctest: +SKIP
    """
    if find_spec("pyarrow") is None:
        raise InputError(
            "Parquet needs pyarrow, which is not installed",
            where="--parquet",
            remedy="pip install 'slewctl[parquet]', or use the CSV files",
        )


def parquet(rows: Sequence[Mapping[str, Any]]) -> bytes:
    """Return rows, all with the same keys, as a Parquet file with columns of their own types.

    Numbers are whole, not rounded as in CSV; None is null.

    Raises
    ------
    InputError
        If pyarrow is not installed.
    """
    check_parquet()
    import pyarrow  # an option: only those who ask for Parquet need it
    import pyarrow.parquet

    # Column by column: rows as mappings would take several times the memory of what they hold.
    names = list(rows[0]) if rows else []
    columns = {name: [row[name] for row in rows] for name in names}
    out = io.BytesIO()
    pyarrow.parquet.write_table(pyarrow.table(columns), out, compression="zstd")
    return out.getvalue()


def write_files(folder: Path, files: Mapping[str, str | bytes]) -> None:
    """Write files whole: all of them beside their places first, then renamed.

    Nothing is renamed before everything is written, and the first file named, the page that
    leads to the others, is renamed last.

    Raises
    ------
    InputError
        If the folder cannot be made or written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in files:
            if (folder / name).is_dir():
                raise IsADirectoryError(None, f"{name} is a folder")
        with tempfile.TemporaryDirectory(dir=folder, prefix=".writing-") as beside:
            for name, content in files.items():
                data = content if isinstance(content, bytes) else content.encode()
                (Path(beside) / name).write_bytes(data)
                if (folder / name).exists():  # who may read it stays as it is
                    shutil.copymode(folder / name, Path(beside) / name)
            for name in reversed(list(files)):
                os.replace(Path(beside) / name, folder / name)
    except OSError as error:
        raise InputError(
            f"cannot be written: {error.strerror}",
            where=str(folder),
            remedy="name a folder that you may write to",
        ) from error
