"""Files that slewctl reads: ordinary ones, of a size that a person would write."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

from slewctl.errors import InputError

# In bytes; a hundred times the longest design file.
MOST_BYTES = 1_000_000


def read_text(path: Path, *, most: int = MOST_BYTES) -> str:
    """Return the text of an ordinary file; nothing is ever waited for.

    Parameters
    ----------
    path : Path
    most : int
        Bytes that are read at most.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    InputError
        If the file cannot be read, is a folder, a pipe or a device, is larger than `most`, or
        is not UTF-8.
    """
    data = read_bytes(path, most=most)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        what = f"cannot be read: it is not UTF-8 text (byte {error.start})"
        raise _refused(path, what, "save it as UTF-8") from error


def read_bytes(path: Path, *, most: int = MOST_BYTES) -> bytes:
    """Return the bytes of an ordinary file; as `read_text`, whatever they mean."""
    try:
        data = _read(path, most)
    except FileNotFoundError:
        raise
    except (OSError, ValueError) as error:  # no path at all, such as one with a NUL
        reason = getattr(error, "strerror", None) or "it is no path"
        raise _refused(path, f"cannot be read: {reason}", "check the path") from error
    if len(data) > most:
        raise _refused(path, f"is larger than {most / 1e6:g} MB", "give less")
    return data


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file beside its place and rename it: there is the old one or the new one.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        beside.write_bytes(content)
        os.replace(beside, path)
    except OSError as error:
        raise _refused(path, f"cannot be written: {error.strerror}", "check the path") from error
    finally:
        beside.unlink(missing_ok=True)


def _read(path: Path, most: int) -> bytes:
    """Return the bytes of an ordinary file, one more than `most` if there are more."""
    # A pipe would be waited for when it is opened, unless told otherwise.
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    if path.is_dir():  # Windows does not open one
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    with open(os.open(path, flags), "rb") as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise OSError(None, "it is not an ordinary file")
        return file.read(most + 1)


def _refused(path: Path, what: str, remedy: str) -> InputError:
    return InputError(what, where=str(path), remedy=remedy)
