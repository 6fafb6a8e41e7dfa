"""The file of a sweep's results: a line for each finished piece, each with its own checksum.

A line is kept only if its checksum, which covers what the sweep is, its key and its rows, is
right: a digit changed, a line torn by a kill or one of another sweep is found, named and its
piece done again.  One run at a time writes to the file; the lock is the system's own and goes
with the process that holds it.
"""

from __future__ import annotations

import errno
import json
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from hashlib import blake2b
from io import FileIO
from pathlib import Path
from sys import intern
from typing import Any, overload

from slewctl._types import FilePath
from slewctl.errors import InputError, check_path
from slewctl.versions import difference, versions

FORMAT = "slewctl-sweep-2"
# Damaged lines that are named one by one.
_NAMED = 5
_DIGEST_BYTES = 8
_SEAL = b'{"seal": "%s", '
_SEAL_LENGTH = len(_SEAL % b"") + 2 * _DIGEST_BYTES

Row = Mapping[str, Any]
Notice = Callable[[str], None]


@dataclass(frozen=True)
class Rows(Sequence[Row]):
    """Rows that share their keys; only their values are kept, so that a million of them fit.

    Attributes
    ----------
    keys : tuple of str
    values : sequence of tuple
        One for each row.
    """

    keys: tuple[str, ...]
    values: Sequence[tuple[Any, ...]]

    def __len__(self) -> int:
        return len(self.values)

    @overload
    def __getitem__(self, place: int) -> Row: ...
    @overload
    def __getitem__(self, place: slice) -> Rows: ...
    def __getitem__(self, place: int | slice) -> Row | Rows:
        if isinstance(place, slice):
            return Rows(self.keys, self.values[place])
        return dict(zip(self.keys, self.values[place], strict=True))


def rows(results: FilePath) -> Rows:
    """Return the rows of all finished pieces, ordered by the keys of the pieces.

    Parameters
    ----------
    results : str or PathLike
        As `sweep` wrote it.

    Returns
    -------
    iterable of mapping
        From names of columns to values.

    Raises
    ------
    InputError
        If the file is no result of a sweep, or a line of it is damaged.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> from slewctl.compare import Piece, rows, sweep
    >>> def square(number):
    ...     return [{"number": number, "square": number**2}]
    >>> path = Path(mkdtemp()) / "squares.jsonl"
    >>> sweep(square, [Piece("3", 3)], path, stamp={}, executor=ThreadPoolExecutor(1))
    >>> list(rows(path))
    [{'number': 3, 'square': 9}]
    """
    results = check_path(results, "results")
    keys: tuple[str, ...] = ()
    found: dict[str, list[tuple[Any, ...]]] = {}
    for entry in _entries(results):
        for row in entry["rows"]:
            keys = keys or tuple(row)
            if tuple(row) != keys:
                raise _no_results(results)
        found[entry["key"]] = [tuple(map(_shared, row.values())) for row in entry["rows"]]
    return Rows(keys, [values for key in sorted(found) for values in found[key]])


def _entries(results: Path) -> Iterator[dict[str, Any]]:
    """Yield the pieces of a file one by one, as they stand there."""
    try:
        with results.open("rb") as file:
            head = file.readline()
            if _unsealed(head, b"") is None:
                raise _no_results(results)
            salt = _salt(head)
            for number, text in enumerate(file, start=2):
                if entry := _entry(text, salt):
                    yield entry
                elif text.endswith(b"\n"):  # or else a kill has torn it
                    raise InputError(
                        "damaged",
                        where=f"{results}:{number}",
                        remedy="go on with --resume, which does it again",
                    )
    except OSError as error:
        raise InputError(
            f"cannot be read: {error.strerror}", where=str(results), remedy="check the path"
        ) from error


def _shared(value: Any) -> Any:
    """Return a value, of a text that comes again and again always the same copy."""
    return intern(value) if isinstance(value, str) else value


class ResultsFile:
    """Results that this run alone writes to; see `results_file`.

    Attributes
    ----------
    done : set of str
        Keys of the pieces that were in the file when it was opened; the caller's to change.
    """

    def __init__(self, path: Path, file: FileIO, head: bytes) -> None:
        self.done: set[str] = set()
        self._path, self._file, self._head, self._salt = path, file, head, _salt(head)

    def start(self) -> None:
        """Write the head of a file that has nothing else."""
        self._file.truncate(0)
        self._append(self._head)

    def add(self, key: str, found: Sequence[Row]) -> None:
        """Write the rows of a piece, at once and whole."""
        self._append(_sealed(json.dumps({"key": key, "rows": list(found)}), self._salt))

    def remove(self, keys: set[str]) -> None:
        """Take pieces out of the file."""
        self._keep(lambda entry: entry["key"] not in keys)

    def take_over(self, notice: Notice) -> None:
        """Keep what is whole of an earlier run, and name the lines that are not.

        Raises
        ------
        InputError
            If these are the results of another sweep.
        """
        damaged = []
        for number, text in enumerate(self._lines(), start=1):
            if number == 1 and text != self._head:
                _check_head(text, self._head, self._path)
                damaged.append(number)
            if entry := _entry(text, self._salt):
                self.done.add(entry["key"])
            elif number > 1 and text.endswith(b"\n"):  # or else a kill has torn it
                damaged.append(number)
        headless = damaged[:1] == [1]
        if headless and not self.done:
            raise _no_results(self._path)
        for number in damaged[:_NAMED]:
            notice(f"{self._path}:{number}: damaged; what it told is done again")
        if len(damaged) > _NAMED:
            notice(f"{self._path}: {len(damaged) - _NAMED} more lines are damaged")
        self._keep()
        if headless:
            self._put_head()

    def _put_head(self) -> None:
        """Write the head over the first lines, and those behind the last."""
        room = 0
        for text in self._lines():
            if room >= len(self._head):
                break
            self._append(text)
            room += len(text)
        self._file.seek(0)
        self._write(self._head)
        self._keep()

    def _keep(self, wanted: Callable[[dict[str, Any]], bool] = lambda _: True) -> None:
        """Leave only the head and the pieces wanted, and go to the end.

        They move towards the head, in place: that needs no room on a full disk, and a kill
        meanwhile loses no more than a line.
        """
        place = end = 0
        for text in self._lines():
            entry = _entry(text, self._salt)
            if wanted(entry) if entry else (place, text) == (0, self._head):
                if end < place:
                    self._file.seek(end)
                    self._write(text)
                end += len(text)
            place += len(text)
        self._file.truncate(end)
        self._file.seek(end)

    def _lines(self) -> Iterator[bytes]:
        with self._path.open("rb") as file:
            yield from file

    def _append(self, line: bytes) -> None:
        """Write a whole line behind the last, or nothing of it."""
        start = self._file.tell()
        try:
            self._write(line)
        except InputError:
            with suppress(OSError):
                self._file.truncate(start)
            raise

    def _write(self, line: bytes) -> None:
        try:
            while line:
                line = line[self._file.write(line) :]
        except OSError as error:
            raise InputError(
                f"cannot be written: {error.strerror}",
                where=str(self._path),
                remedy="make room on the disk and go on with --resume; what was finished is kept",
            ) from error


@contextmanager
def results_file(
    path: Path, stamp: Mapping[str, Any], *, resume: bool, notice: Notice
) -> Iterator[ResultsFile]:
    """Open the results of a sweep for this run alone, made if they are not there.

    Parameters
    ----------
    path : Path
    stamp : mapping
        What the sweep is.
    resume : bool
        Go on with results that are there.
    notice : callable
        Called with a sentence for every damaged line, which is taken out of the file.

    Raises
    ------
    InputError
        If the file cannot be written, another run writes to it, it is there and `resume`
        was not asked for, or it holds the results of something else.
    """
    content = {"format": FORMAT, "versions": versions(), "stamp": stamp}
    head = _sealed(json.dumps(content, sort_keys=True), b"")
    with _file(path) as file:
        _lock(file, path, notice)
        results = ResultsFile(path, file, head)
        with path.open("rb") as reader:
            fresh = head.startswith(reader.read(len(head) + 1))
        if fresh:  # no more than a kill, or a full disk, has left of the head
            results.start()
        elif resume:
            results.take_over(notice)
        else:
            raise InputError(
                "this file is there already",
                where=str(path),
                remedy="go on with it by --resume, or remove it",
            )
        yield results


def _check_head(first: bytes, head: bytes, path: Path) -> None:
    """Refuse the results of another sweep; a damaged head can be that of any."""
    found, wanted = _unsealed(first, b""), _unsealed(head, b"")
    if first == head or not isinstance(found, dict) or not isinstance(wanted, dict):
        return
    if found.get("format") != FORMAT or found.get("stamp") != wanted["stamp"]:
        raise InputError(
            "these are the results of another study or version",
            where=str(path),
            remedy="use another folder, or remove the file",
        )
    raise InputError(
        f"these results were made with {difference(found['versions'], versions())}",
        where=str(path),
        remedy="go on with the same versions, or remove the file",
    )


def _entry(text: bytes, salt: bytes) -> dict[str, Any] | None:
    """Return the piece of a line, or None for a line that is none."""
    match _unsealed(text, salt):
        case {"key": str(), "rows": [*found]} as entry if all(isinstance(r, dict) for r in found):
            return entry
    return None


def _salt(head: bytes) -> bytes:
    return blake2b(head).digest()


def _digest(body: bytes, salt: bytes) -> bytes:
    return blake2b(body, digest_size=_DIGEST_BYTES, key=salt).hexdigest().encode()


def _sealed(body: str, salt: bytes) -> bytes:
    """Return a line of JSON whose first value is the checksum of all others."""
    text = body.encode()
    return _SEAL % _digest(text, salt) + text[1:] + b"\n"


def _unsealed(line: bytes, salt: bytes) -> Any:
    """Return what a line holds, or None if it isn't what `_sealed` has written."""
    body = b"{" + line[_SEAL_LENGTH:-1]
    if line != _SEAL % _digest(body, salt) + body[1:] + b"\n":
        return None
    return json.loads(body)


@contextmanager
def _file(path: Path) -> Iterator[FileIO]:
    """Open a file to read and write, made if it isn't there."""
    if path.exists() and not path.is_file():
        raise InputError("not a file", where=str(path), remedy="name another folder")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o666)
    except OSError as error:
        raise InputError(
            f"cannot be written: {error.strerror}",
            where=str(path),
            remedy="name a folder that you may write to",
        ) from error
    with FileIO(descriptor, "r+") as file:
        yield file


def _lock(file: FileIO, path: Path, notice: Notice) -> None:
    """Hold a file for as long as it is open in this process."""
    try:
        _lock_now(file.fileno())
    except OSError as error:
        if error.errno in (errno.EACCES, errno.EAGAIN):
            raise InputError(
                "another run is writing to this file",
                where=str(path),
                remedy="wait for it to end, or name another folder",
            ) from error
        notice(f"{path}: cannot be locked here ({error.strerror}); start no second run on it")


if sys.platform == "win32":
    import msvcrt

    def _lock_now(descriptor: int) -> None:
        os.lseek(descriptor, 2**31 - 2, os.SEEK_SET)  # others may read what stands before
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        os.lseek(descriptor, 0, os.SEEK_SET)

else:
    import fcntl

    def _lock_now(descriptor: int) -> None:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _no_results(path: Path) -> InputError:
    return InputError(
        "not the results of a sweep", where=str(path), remedy="name another file, or remove it"
    )
