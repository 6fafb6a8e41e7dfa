"""All faults of a file, so that they are told at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import ParamSpec, TypeVar, cast

from slewctl.errors import FaultsError, InputError, SlewctlError, faults_of

P = ParamSpec("P")
T = TypeVar("T")


class Faults:
    """The faults found so far."""

    def __init__(self) -> None:
        self._found: dict[tuple[str, str], SlewctlError] = {}

    def __bool__(self) -> bool:
        return bool(self._found)

    def add(self, faults: Iterable[SlewctlError]) -> None:
        """Add faults; one that is known is not told twice."""
        for fault in faults:
            self._found.setdefault((fault.where, fault.what), fault)

    def attempt(self, make: Callable[P, T], *args: P.args, **keys: P.kwargs) -> T | None:
        """Return what `make` returns, or None after adding what it refuses."""
        try:
            return make(*args, **keys)
        except SlewctlError as error:
            self.add(faults_of(error))
            return None

    def settled(self, made: T | None) -> T:
        """Return what was made, if nothing is wrong at all."""
        self.tell()
        return cast(T, made)

    def tell(self) -> None:
        """Raise what was found, if anything was."""
        found = list(self._found.values())
        if len(found) == 1:
            raise found[0]
        if found:
            raise FaultsError(found)


def missing(where: str) -> InputError:
    """Return the refusal of a file without a key or table that it needs."""
    return InputError("missing", where=where, remedy="add it")
