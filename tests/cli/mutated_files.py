"""Design and study files with mistakes in them, for the commands to stumble over."""

from __future__ import annotations

import copy
import json
import math
import re
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

DESIGNS = Path(__file__).parents[2] / "designs"
Choose = Callable[[Sequence[Any]], Any]

_BARE = re.compile(r"[A-Za-z0-9_-]+")

# Methods without a solver of matrix inequalities: a run takes a fraction of a second.
QUICK = ("01", "02", "03", "05", "06", "07", "08", "09")

STUDY = {
    "title": "two bases",
    "arm": {"catalogue": "paper-beam"},
    "truth": {"modes": 4},
    "grid": [{"bases": ["clamped-free"], "orders": [1], "hub_ratios": [1.0],
              "payload_ratios": [0.0], "damping_ratios": [0.005], "bandwidths": [0.3],
              "sensors": [["theta", "theta_dot"]]}],
}  # fmt: skip


@dataclass(frozen=True)
class Raw:
    """A value in TOML's own words, which no Python value is written as."""

    text: str


ODD: tuple[Any, ...] = (
    0, -1, 1, 2.5, 1e300, -1e300, 1e-300, 5e-324, 1e-200, 1e200, 1e-12, 1e12, -0.0,
    math.nan, math.inf, -math.inf, 10**30, -(2**70), 2**63, Raw("0x" + "f" * 3600),
    "", "text", "theta", "torque", "\n::warning file=x::y", "\x1b[31mred", "<script>", "=1+1",
    "x" * 3000, True, False, [], [[]], [1e300, -1e300], ["a", 1], {}, {"a": 1}, {"x": [0, 1]},
    Raw("1979-05-27"), Raw("[[[[[[[[[[[[[[[[[[[[1]]]]]]]]]]]]]]]]]]]]"),
)  # fmt: skip
NAMES = ("x", "R", "inertia", "n", "", "\n::error::y", "\x1b[2J", "a.b", "θ", "modes", "x" * 300)
EXTREMES = (0.0, 1e300, 1e-300, 5e-324, 1e-200, 1e200, 1e-100, 1e100, 1e-12, 1e12)
FACTORS = (0.0, -1.0, 1e-6, 1e-3, 0.1, 0.5, 2.0, 10.0, 1e3, 1e6)


def small_designs() -> dict[str, dict[str, Any]]:
    """Return the ready designs on few modes, by the number that their file starts with."""
    found = {}
    for path in sorted(DESIGNS.glob("*.toml")):
        content = tomllib.loads(path.read_text(encoding="utf-8"))
        content["truth"] = {"modes": 6}
        if "model" in content:  # a law that is given needs none
            content["model"]["n"] = min(content["model"]["n"], 2)
            content["compare"] = {"bases": [content["model"]["basis"]], "orders": [1]}
        found[path.name[:2]] = content
    return found


def mutated(content: dict[str, Any], choose: Choose) -> dict[str, Any]:
    """Return a copy with one to three mistakes."""
    changed = copy.deepcopy(content)
    for _ in range(choose((1, 1, 1, 2, 3))):
        _change(changed, choose)
    return changed


def _change(content: dict[str, Any], choose: Choose) -> None:
    """Make one mistake in place: often a number out of all measure, else a wrong shape."""
    places = list(_places(content))
    numbers = [place for place in places if isinstance(place[0][place[1]], float)]
    if not places:
        return
    kind = choose((*("extreme", "scaled") * 4, "odd", "odd", "gone", "unknown", "swapped", "moved"))
    if kind in ("extreme", "scaled") and numbers:
        holder, key = choose(numbers)
        holder[key] = choose(EXTREMES) if kind == "extreme" else holder[key] * choose(FACTORS)
        return
    holder, key = choose(places)
    if kind == "gone":
        del holder[key]
    elif kind == "unknown" and isinstance(holder, dict):
        holder[choose(NAMES)] = choose(ODD)
    elif kind == "swapped":
        other, name = choose(places)
        holder[key], other[name] = other[name], copy.deepcopy(holder[key])
    elif kind == "moved" and isinstance(holder, dict):
        holder[choose(NAMES)] = holder.pop(key)
    else:
        holder[key] = choose(ODD)


def _places(content: Any) -> Any:
    """Yield every table or list with each of its keys."""
    pairs = content.items() if isinstance(content, dict) else enumerate(content)
    for key, value in list(pairs):
        yield content, key
        if isinstance(value, dict | list):
            yield from _places(value)


def toml(content: dict[str, Any]) -> str:
    """Return a mapping as TOML, each table on lines of its own down to the second level."""
    lines: list[str] = []
    _table(content, (), lines)
    return "\n".join(lines) + "\n"


def _table(content: dict[str, Any], way: tuple[str, ...], lines: list[str]) -> None:
    later = {}
    for key, value in content.items():
        if isinstance(value, dict) and len(way) < 2:
            later[key] = value
        else:
            lines.append(f"{_key(key)} = {_value(value)}")
    for key, value in later.items():
        lines.append(f"[{'.'.join(_key(name) for name in (*way, key))}]")
        _table(value, (*way, key), lines)


def _key(name: object) -> str:
    return str(name) if _BARE.fullmatch(str(name)) else json.dumps(str(name))


def _value(value: Any) -> str:
    if isinstance(value, Raw):
        return value.text
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    return str(value)
