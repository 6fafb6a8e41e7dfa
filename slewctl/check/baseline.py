"""The last accepted run: what was measured then, so that nothing gets worse unseen.

A file of schema ``slewctl-baseline/2``: for each design file, named from the folder of the
baseline, a fingerprint of its text and of the programs that judged it, a digest of the text
alone, by which a renamed file is known again, and for each arm the worst values that verdicts
rest on.  A seal covers all of it, so that an edited value is not taken for a measured one.
Only designs that hold all their requirements are accepted.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from slewctl._types import FilePath
from slewctl.check.result import DesignResult
from slewctl.compare import QUANTITIES
from slewctl.errors import InputError, check_choice, check_number, check_path, shown
from slewctl.textfile import read_text

SCHEMA = "slewctl-baseline/2"
# Ten thousand designs.
_MOST_BYTES = 50_000_000
_ANEW = "restore the file, or delete it and make it anew with --update-baseline"
# Digits that are kept of a value: those behind them change from machine to machine.
_DIGITS = 10


@dataclass(frozen=True)
class Accepted:
    """What was accepted of one design.

    Attributes
    ----------
    fingerprint : str
        Of the design file's text and the programs that judged it.
    digest : str
        Of the text alone.
    arms : mapping of str to mapping
        By arm and quantity, the values measured; NaN where there was none.
    """

    fingerprint: str
    digest: str
    arms: Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class Baseline:
    """A baseline file.

    Attributes
    ----------
    path : Path
    designs : mapping of str to Accepted
        By the design file's path, relative to the baseline's folder.
    is_design : callable
        Whether at a path there is a design: what was accepted may be replaced by another file.
    """

    path: Path
    designs: Mapping[str, Accepted]
    is_design: Callable[[Path], bool] = Path.exists

    def key(self, file: Path) -> str:
        """Return the name of a design file from the baseline's folder, alike on every machine.

        Links are followed on both sides: through one, ".." is another folder than it seems.
        """
        whole = file.resolve()
        try:
            return Path(os.path.relpath(whole, self.path.parent.resolve())).as_posix()
        except ValueError:  # on another drive
            return whole.as_posix()

    def file(self, name: str) -> Path:
        """Return the design file of a name, whether or not there is the baseline's own folder."""
        return Path(os.path.normpath(self.path.parent.resolve() / name))

    def accepted(self, file: Path, digest: str = "") -> Accepted | None:
        """Return what was accepted of a design file, None if it is new.

        Parameters
        ----------
        file : Path
        digest : str, optional
            Of its text: a file that is gone and had the same text was renamed.
        """
        found = self.designs.get(self.key(file))
        if found is not None:
            return found
        for name, entry in self.designs.items():
            if digest and entry.digest == digest and not self.is_design(self.file(name)):
                return entry
        return None

    def lost(self, results: Iterable[DesignResult]) -> list[str]:
        """Return the names at which there is no design any more, but for those just judged."""
        judged = {self.key(result.file) for result in results}
        return [
            name
            for name in self.designs
            if name not in judged and not self.is_design(self.file(name))
        ]


def read_baseline(path: FilePath, *, may_be_missing: bool = False) -> Baseline:
    """Return a baseline file.

    Parameters
    ----------
    path : str or PathLike
    may_be_missing : bool
        Return an empty baseline for a file that isn't there.

    Returns
    -------
    Baseline

    Raises
    ------
    InputError
        If the file is missing, cannot be read, or is no baseline.

    Examples
    --------
    >>> from pathlib import Path
    >>> from slewctl.check import read_baseline
    >>> read_baseline(Path("never-accepted.json"), may_be_missing=True).designs
    {}
    """
    path = check_path(path, "path")
    try:
        text = read_text(path, most=_MOST_BYTES)
    except FileNotFoundError:
        if may_be_missing:
            return Baseline(path, {})
        raise InputError(
            "no such baseline", where=str(path), remedy="make it with --update-baseline"
        ) from None
    try:
        return Baseline(path, _designs(json.loads(text)))
    except InputError as error:
        raise error.within(str(path)) from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"not valid JSON: {error}", where=str(path), remedy=_ANEW) from error


def _designs(content: object) -> dict[str, Accepted]:
    table = _table(content, "")
    if table.get("schema") != SCHEMA:
        raise InputError(
            f"its schema is {shown(table.get('schema'))}, this slewctl's is {SCHEMA!r}: what is "
            "recorded means something else",
            where="schema",
            remedy="delete the file and accept the designs anew with --update-baseline",
        )
    return {
        name: _accepted(name, _table(entry, f"designs.{name}"), f"designs.{name}")
        for name, entry in _table(table.get("designs"), "designs").items()
    }


def _accepted(name: str, entry: Mapping[str, Any], where: str) -> Accepted:
    if entry.get("seal") != _seal(name, entry):
        raise InputError("was edited after it was written", where=where, remedy=_ANEW)
    arms = {}
    for arm, values in _table(entry.get("arms"), f"{where}.arms").items():
        place = f"{where}.arms.{arm}"
        arms[arm] = {
            check_choice(name, QUANTITIES, place): _value(name, value, f"{place}.{name}")
            for name, value in _table(values, place).items()
        }
    return Accepted(str(entry.get("fingerprint")), str(entry.get("digest")), arms)


def _seal(name: str, entry: Mapping[str, Any]) -> str:
    """Return a digest of all that an entry says."""
    said = [name, *(entry.get(key) for key in ("fingerprint", "digest", "arms"))]
    return sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()


def _table(content: object, where: str) -> Mapping[str, Any]:
    if isinstance(content, dict):
        return content
    raise InputError(f"{shown(content)} is no table", where=where, remedy=_ANEW)


def _value(name: str, value: object, where: str) -> float:
    if value is None:
        return math.nan
    # An infinite margin may be accepted; any other infinity would let everything pass.
    if value == "inf" and QUANTITIES[name].better == "greater":
        return math.inf
    return check_number(value, where)


def accept(baseline: Baseline, results: Sequence[DesignResult]) -> tuple[Baseline, list[str]]:
    """Return the baseline with the results that passed, and what else was done with it.

    A design that failed or broke keeps what was accepted before; one whose file is gone is
    dropped; one that was not looked at stays.

    Parameters
    ----------
    baseline : Baseline
    results : sequence of DesignResult

    Returns
    -------
    tuple of Baseline and list of str
        The second in words.

    Examples
    --------
    >>> from pathlib import Path
    >>> from slewctl.check import DesignResult, Baseline, accept
    >>> broken = DesignResult("arm", Path("designs/arm.toml"), error="no such basis")
    >>> accept(Baseline(Path("accepted.json"), {}), [broken])[0].designs
    {}
    """
    designs, notes = dict(baseline.designs), []
    for result in results:
        if result.status == "passed":
            values = {
                arm: {name: reading.value for name, reading in readings.items()}
                for arm, readings in result.recorded.items()
            }
            designs[baseline.key(result.file)] = Accepted(result.fingerprint, result.digest, values)
        elif result.status in _WHY:
            notes.append(f"{result.name}: not accepted, since it {_WHY[result.status]}")
    for name in baseline.lost(results):
        why = "it is no design any more" if baseline.file(name).exists() else "the file is gone"
        notes.append(f"{name}: dropped, since {why}")
        del designs[name]
    return replace(baseline, designs=designs), notes


_WHY = {"failed": "fails a requirement", "broken": "could not be judged"}


def to_record(baseline: Baseline) -> dict[str, Any]:
    """Return a baseline as nested dictionaries, sorted by file.

    Parameters
    ----------
    baseline : Baseline

    Returns
    -------
    dict of str to object

    Examples
    --------
    >>> from pathlib import Path
    >>> from slewctl.check.baseline import Baseline, to_record
    >>> to_record(Baseline(Path("accepted.json"), {}))["designs"]
    {}
    """
    designs = {name: _entry(name, entry) for name, entry in sorted(baseline.designs.items())}
    return {"schema": SCHEMA, "designs": designs}


def _entry(name: str, entry: Accepted) -> dict[str, Any]:
    arms = {
        arm: {quantity: _rounded(value) for quantity, value in values.items()}
        for arm, values in entry.arms.items()
    }
    said = {"fingerprint": entry.fingerprint, "digest": entry.digest, "arms": arms}
    return said | {"seal": _seal(name, said)}


def _rounded(value: float) -> float | str | None:
    """Return a value as the file holds it."""
    if math.isnan(value):
        return None
    return float(f"{value:.{_DIGITS - 1}e}") if math.isfinite(value) else str(value)
