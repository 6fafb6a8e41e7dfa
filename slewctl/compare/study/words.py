"""Lists in words, for the sentences of a study."""

from __future__ import annotations

from collections.abc import Sequence


def hubs(ratios: Sequence[float]) -> str:
    """Return hub ratios in words."""
    parts = ["without a hub"] if 0 in ratios else []
    others = [f"{ratio:g}" for ratio in ratios if ratio]
    if others:
        what = "hub inertias" if len(others) > 1 else "a hub inertia"
        parts.append(f"with {what} of {joined(others)} times the beam's")
    return joined(parts)


def joined(parts: Sequence[str], word: str = "and") -> str:
    """Return words as a list with "and" before the last."""
    return f" {word} ".join(filter(None, [", ".join(parts[:-1]), *parts[-1:]]))
