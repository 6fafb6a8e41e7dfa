"""All faults of a file, so that they are told at once."""

from __future__ import annotations

from slewctl.errors import Faults, InputError

__all__ = ["Faults", "missing"]


def missing(where: str) -> InputError:
    """Return the refusal of a file without a key or table that it needs."""
    return InputError("missing", where=where, remedy="add it")
