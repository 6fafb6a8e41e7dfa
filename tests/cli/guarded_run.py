"""One command on one file, and everything about the run that nobody should see."""

from __future__ import annotations

import json
import os
import signal
import tempfile
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from xml.etree import ElementTree

from command_line import slewctl

# Seconds of processor that a command may take for a small file, of which it needs a tenth; on a
# busy machine, or waiting for something, five times as many of the clock.
LIMITS_S = {
    "check": 20,
    "ladder": 20,
    "modes": 20,
    "compare": 60,
    "study": 60,
    "recommend": 60,
    "worst": 60,
}
_HIDDEN = (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning)
_CONTROL = {chr(code) for code in range(32)} - {"\n", "\t"} | {"\x7f"}


class OutOfTimeError(BaseException):
    """A command took longer than it may; not an `Exception`, lest someone catch it."""


@dataclass(frozen=True)
class Run:
    """A finished run.

    Attributes
    ----------
    status : int or None
        None where an exception escaped.
    faults : tuple of str
        What should not have been, each starting with its kind.
    """

    status: int | None
    faults: tuple[str, ...]


def guarded_run(command: str, text: str, folder: Path) -> Run:
    """Write a file into an empty folder, run a command on it there, and look at all it did.

    Parameters
    ----------
    command : str
        A key of `LIMITS_S`.
    text : str
        Of the file.
    folder : Path
        An existing, empty folder.
    """
    path, out = folder / "mistaken.toml", folder / "out"
    path.write_text(text, encoding="utf-8")
    arguments: list[str | Path] = [command, path]
    if command in ("compare", "study"):
        arguments += ["--out", out]
    if command == "study":
        arguments += ["--workers", "1"]
    if command == "check":
        arguments += ["--all", "--json", out / "verdicts.json", "--junit", out / "verdicts.xml"]
    if command == "worst":
        arguments += ["--box", "stiffness_factor=0.9:1.1", "--samples", "0", "--searches", "0"]
    if command == "modes":
        arguments += ["-n", "2"]
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        try:
            with _inside(folder), _below_python() as written, _no_longer_than(LIMITS_S[command]):
                done = slewctl(*arguments)
        except OutOfTimeError:
            return Run(None, (f"hang: more than {LIMITS_S[command]} s",))
        except Exception as error:  # noqa: BLE001 -- whatever escapes is what is looked for
            return Run(None, (_escaped(error),))
    faults = [
        f"warning: {one.category.__name__}: {one.message} ({Path(one.filename).name}:{one.lineno})"
        for one in seen
        if not issubclass(one.category, _HIDDEN)
    ]
    faults += [f"written by a library: {line}" for line in written]
    if done.returncode not in (0, 1, 2):
        faults.append(f"status: {done.returncode}")
    if "Traceback" in done.stdout + done.stderr:
        faults.append(f"traceback: {done.stderr.strip().splitlines()[-1]}")
    if done.returncode == 2 and not done.stderr:
        faults.append("silence: status 2 without a word")
    faults += [
        f"no file named: {line[:200]}" for line in done.stderr.splitlines() if str(path) not in line
    ]
    if done.returncode == 0 and done.stderr:
        faults.append(f"noise: status 0 with {done.stderr[:200]!r}")
    if max(map(len, done.stderr.splitlines()), default=0) > 2000:
        faults.append(f"endless message: {len(done.stderr)} characters")
    told = _CONTROL & set(done.stdout + done.stderr)
    if told:
        faults.append(f"control characters on the terminal: {sorted(told)}")
    faults += _unreadable(out)
    strangers = {p.name for p in folder.iterdir()} - {"mistaken.toml", "out"}
    if strangers:
        faults.append(f"written outside --out: {sorted(strangers)}")
    if path.read_text(encoding="utf-8") != text:
        faults.append("the file itself was changed")
    return Run(done.returncode, tuple(faults))


def _unreadable(out: Path) -> Iterator[str]:
    """Yield what is wrong with the files of a report: JSON and XML that no reader takes."""
    for path in out.glob("**/*.json"):
        try:
            json.loads(path.read_text(encoding="utf-8"), parse_constant=_no_constant)
        except ValueError as error:
            yield f"unreadable {path.name}: {error}"
    for path in out.glob("**/*.xml"):
        try:
            ElementTree.parse(path)
        except ElementTree.ParseError as error:
            yield f"unreadable {path.name}: {error}"


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is no JSON")


def _escaped(error: Exception) -> str:
    """Return an exception that no command caught, with the last place of ours on its way."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [f for f in frames if f"{os.sep}slewctl{os.sep}" in f.filename] or frames
    place = f"{Path(ours[-1].filename).name}:{ours[-1].name}"
    return f"traceback: {type(error).__name__} in {place}: {str(error)[:200]}"


@contextmanager
def _inside(folder: Path) -> Iterator[None]:
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


@contextmanager
def _below_python() -> Iterator[list[str]]:
    """Yield a list that afterwards holds what compiled code, such as LAPACK, printed."""
    lines: list[str] = []
    with tempfile.TemporaryFile() as file:
        before = [(number, os.dup(number)) for number in (1, 2)]
        for number, _ in before:
            os.dup2(file.fileno(), number)
        try:
            yield lines
        finally:
            for number, kept in before:
                os.dup2(kept, number)
                os.close(kept)
            file.seek(0)
            lines += file.read().decode(errors="replace").splitlines()


@contextmanager
def _no_longer_than(seconds: float) -> Iterator[None]:
    def stop(_: int, __: FrameType | None) -> None:
        raise OutOfTimeError

    timers = ((signal.SIGPROF, signal.ITIMER_PROF, 1), (signal.SIGALRM, signal.ITIMER_REAL, 5))
    before = [signal.signal(number, stop) for number, _, _ in timers]
    for _, timer, times in timers:
        signal.setitimer(timer, times * seconds)
    try:
        yield
    finally:
        for (number, timer, _), handler in zip(timers, before, strict=True):
            signal.setitimer(timer, 0)
            signal.signal(number, handler)
