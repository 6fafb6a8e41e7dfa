"""The last accepted run: what was measured then, so that nothing gets worse unseen.

A file of schema ``slewctl-baseline/1``: for each design file, named from the folder of the
baseline, a fingerprint of its text and of the programs that judged it, and for each arm the
values measured.  Only designs that hold all their requirements are accepted.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from slewctl.check.record import number
from slewctl.check.requirements import REQUIREMENTS
from slewctl.check.result import DesignResult
from slewctl.errors import InputError, check_choice, check_number, shown

SCHEMA = "slewctl-baseline/1"
_ANEW = "mend the file, or delete it and make it anew with --update-baseline"


@dataclass(frozen=True)
class Accepted:
    """What was accepted of one design.

    Attributes
    ----------
    fingerprint : str
    arms : mapping of str to mapping
        By arm, the values measured; NaN where there was none.
    """

    fingerprint: str
    arms: Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class Baseline:
    """A baseline file.

    Attributes
    ----------
    path : Path
    designs : mapping of str to Accepted
        By the design file's path, relative to the baseline's folder.
    """

    path: Path
    designs: Mapping[str, Accepted]

    def key(self, file: Path) -> str:
        """Return the name of a design file from the baseline's folder, alike on every machine."""
        try:
            return Path(os.path.relpath(file, self.path.parent)).as_posix()
        except ValueError:  # on another drive
            return file.resolve().as_posix()

    def accepted(self, file: Path) -> Accepted | None:
        """Return what was accepted of a design file, None if it is new."""
        return self.designs.get(self.key(file))


def read_baseline(path: Path, *, may_be_missing: bool = False) -> Baseline:
    """Return a baseline file.

    Parameters
    ----------
    path : Path
    may_be_missing : bool
        Return an empty baseline for a file that isn't there.

    Raises
    ------
    InputError
        If the file is missing, cannot be read, or is no baseline.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        if may_be_missing:
            return Baseline(path, {})
        raise InputError(
            "no such baseline", where=str(path), remedy="make it with --update-baseline"
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise InputError(
            f"cannot be read: {reason}", where=str(path), remedy="check the path"
        ) from error
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
            f"not a baseline of this slewctl: its schema is {shown(table.get('schema'))}",
            where="schema",
            remedy=_ANEW,
        )
    return {
        name: _accepted(_table(entry, f"designs.{name}"), f"designs.{name}")
        for name, entry in _table(table.get("designs"), "designs").items()
    }


def _accepted(entry: Mapping[str, Any], where: str) -> Accepted:
    arms = {}
    for arm, values in _table(entry.get("arms"), f"{where}.arms").items():
        place = f"{where}.arms.{arm}"
        arms[arm] = {
            check_choice(name, REQUIREMENTS, place): _value(value, f"{place}.{name}")
            for name, value in _table(values, place).items()
        }
    return Accepted(str(entry.get("fingerprint")), arms)


def _table(content: object, where: str) -> Mapping[str, Any]:
    if isinstance(content, dict):
        return content
    raise InputError(f"{shown(content)} is no table", where=where, remedy=_ANEW)


def _value(value: object, where: str) -> float:
    if value is None:
        return math.nan
    if value in ("inf", "-inf"):
        return float(str(value))
    return check_number(value, where)


def accept(baseline: Baseline, results: Sequence[DesignResult]) -> tuple[Baseline, list[str]]:
    """Return the baseline with the results that passed, and what else was done with it.

    A design that failed or broke keeps what was accepted before; one whose file is gone is
    dropped; one that was not looked at stays.
    """
    designs, notes = dict(baseline.designs), []
    for result in results:
        if result.status == "passed":
            values = {
                arm: {name: reading.value for name, reading in readings.items()}
                for arm, readings in result.recorded.items()
            }
            designs[baseline.key(result.file)] = Accepted(result.fingerprint, values)
        elif result.status != "unchanged":
            notes.append(f"{result.name}: not accepted, since it {_WHY[result.status]}")
    for name in list(designs):
        if not (baseline.path.parent / name).exists():
            notes.append(f"{name}: dropped, since the file is gone")
            del designs[name]
    return replace(baseline, designs=designs), notes


_WHY = {"failed": "fails a requirement", "broken": "could not be judged"}


def to_record(baseline: Baseline) -> dict[str, Any]:
    """Return a baseline as nested dictionaries, sorted by file."""
    designs = {
        name: {
            "fingerprint": entry.fingerprint,
            "arms": {
                arm: {name: number(value) for name, value in values.items()}
                for arm, values in entry.arms.items()
            },
        }
        for name, entry in sorted(baseline.designs.items())
    }
    return {"schema": SCHEMA, "designs": designs}
