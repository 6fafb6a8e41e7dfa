"""Named numbers, lists and texts in a file: JSON, MATLAB's ``.mat`` or NumPy's ``.npz``.

Files are read as data: nothing in them is ever unpickled or run.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from slewctl._types import FilePath
from slewctl.errors import InputError, check_path, suggest
from slewctl.textfile import read_bytes, write_bytes

# In bytes; a controller of a thousand states has 8 MB.
MOST_BYTES = 50_000_000


def write_data(path: FilePath, data: Mapping[str, Any]) -> None:
    """Write named values; the file's ending says how.

    Parameters
    ----------
    path : str or PathLike
        Ending in ``.json``, ``.mat`` or ``.npz``.
    data : mapping of str to value
        Arrays, numbers, texts and lists of texts; JSON holds tables as well.

    Raises
    ------
    InputError
        For another ending, or a file that cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> path = Path(mkdtemp()) / "gains.json"
    >>> write_data(path, {"num": [1.0], "den": [1.0, 2.0]})
    >>> read_data(path)["den"]
    [1.0, 2.0]
    """
    path = check_path(path, "path")
    write, _ = _format(path)
    write_bytes(path, write(data))


def data_bytes(form: str, data: Mapping[str, Any]) -> bytes:
    """Return named values as the content of a file.

    Parameters
    ----------
    form : {"json", "mat", "npz"}
    data : mapping of str to value
    """
    return _FORMATS[f".{form}"][0](data)


def read_data(path: FilePath) -> dict[str, Any]:
    """Return what a file holds by name; the file's ending says how it is written.

    Parameters
    ----------
    path : str or PathLike
        Ending in ``.json``, ``.mat`` or ``.npz``.

    Returns
    -------
    dict of str to value
        Arrays, numbers and texts.

    Raises
    ------
    InputError
        For another ending, or a file that cannot be read or is not of its kind.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> path = Path(mkdtemp()) / "gains.npz"
    >>> write_data(path, {"gain": 2.5})
    >>> float(read_data(path)["gain"])
    2.5
    """
    path = check_path(path, "path")
    _, read = _format(path)
    try:
        content = read_bytes(path, most=MOST_BYTES)
    except FileNotFoundError as error:
        raise InputError(
            "there is no such file", where=str(path), remedy="check the path"
        ) from error
    try:
        return read(content)
    except (ValueError, OSError, KeyError, TypeError, EOFError, NotImplementedError,
            RecursionError, MemoryError, IndexError, zipfile.BadZipFile) as error:  # fmt: skip
        told = " ".join(str(error).split()) or type(error).__name__
        raise InputError(
            f"it holds no data in this format: {told}",
            where=str(path),
            remedy=f"write it as {', '.join(SUFFIXES)}, without objects",
        ) from error


def _format(path: Path) -> tuple[Callable[..., bytes], Callable[..., dict[str, Any]]]:
    suffix = path.suffix.lower()
    if suffix not in _FORMATS:
        raise InputError(
            f"unknown ending {suffix!r}", where=str(path), remedy=lambda: suggest(suffix, SUFFIXES)
        )
    return _FORMATS[suffix]


def _to_json(data: Mapping[str, Any]) -> bytes:
    text = json.dumps(_plain(dict(data)), indent=1, ensure_ascii=False, allow_nan=False)
    return (text + "\n").encode()


def _plain(value: Any) -> Any:
    """Return a value of lists, numbers and texts alone."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, list | tuple) else value


def _from_json(content: bytes) -> dict[str, Any]:
    found = json.loads(content.decode("utf-8-sig"))
    if not isinstance(found, dict):
        raise TypeError("give a table of names")
    return found


def _to_npz(data: Mapping[str, Any]) -> bytes:
    buffer = io.BytesIO()
    arrays: dict[str, Any] = {name: np.asarray(value) for name, value in data.items()}
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def _from_npz(content: bytes) -> dict[str, Any]:
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        return {name: _bare(archive[name]) for name in archive.files}


def _to_mat(data: Mapping[str, Any]) -> bytes:
    from scipy.io import savemat  # slow to load: not before it is wanted

    buffer = io.BytesIO()
    told = {name: _cells(value) for name, value in data.items()}
    savemat(buffer, told)  # type: ignore[arg-type]  # the stubs know no open file
    return _undated(buffer.getvalue())


def _undated(content: bytes) -> bytes:
    """Return a MATLAB file whose header does not say when it was written."""
    header = b"MATLAB 5.0 MAT-file, written by slewctl"
    return header.ljust(116) + content[116:]


def _cells(value: Any) -> Any:
    """Return a list of texts as MATLAB has it."""
    return np.array(value, dtype=object) if isinstance(value, list | tuple) else value


def _from_mat(content: bytes) -> dict[str, Any]:
    from scipy.io import loadmat  # slow to load: not before it is wanted
    from scipy.io.matlab import MatReadError

    try:
        found = loadmat(io.BytesIO(content), chars_as_strings=True)  # type: ignore[arg-type]
    except MatReadError as error:
        raise ValueError(str(error)) from error
    return {name: _bare(value) for name, value in found.items() if not name.startswith("__")}


def _bare(value: Any) -> Any:
    """Return texts and lists of texts of an array as such, other arrays as they are."""
    if value.dtype.kind == "O":
        items = [np.asarray(item) for item in value.ravel()]
        if any(item.dtype.kind != "U" for item in items):
            return None  # MATLAB's structures, objects and functions are no numbers
        return ["".join(item.ravel()) for item in items]
    if value.dtype.kind == "U":
        texts = [str(text) for text in value.ravel()]
        return texts[0] if value.ndim == 0 or value.shape == (1,) else texts
    return value


_FORMATS: dict[str, tuple[Callable[..., bytes], Callable[..., dict[str, Any]]]] = {
    ".json": (_to_json, _from_json),
    ".mat": (_to_mat, _from_mat),
    ".npz": (_to_npz, _from_npz),
}
SUFFIXES = tuple(_FORMATS)
"""Endings of files that can be written and read."""
