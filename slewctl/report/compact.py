"""Less text for the same picture: SVG as matplotlib writes it, made a third as long.

Every step leaves what is drawn as it is, but for coordinates, of which a tenth of a point is
kept: finer than a reader sees.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import pairwise

# A style that comes more often than this is written once and referred to.
_SELDOM = 2


def compact(text: str, name: str) -> str:
    """Return an ``<svg>`` element with less text.

    Parameters
    ----------
    text : str
    name : str
        Unique on the page; it prefixes the identifiers and classes inside.
    """
    text = re.sub(r"<metadata>.*?</metadata>|<!--.*?-->", "", text, flags=re.S)
    text = _renumbered(text, name)
    text = re.sub(r"\s+", " ", text).replace("> <", "><")
    text = text.replace("font-family: 'DejaVu Sans'; ", "").replace("xlink:href", "href")
    # The marks of an axis are lines, drawn in full where they are defined.
    text = re.sub(
        r'(<use [^>]*) style="fill: (\S+); stroke: \2; stroke-width: 0.[68]"', r"\1", text
    )
    text = re.sub(
        r'\b(?:points|transform|x|y|width|height)="[^"]*"',
        lambda found: re.sub(r"(\.\d)\d+", r"\1", found[0]),
        text,
    )
    text = re.sub(r'\bd="([^CQHVASz"]*)"', lambda found: f'd="{_relative(found[1])}"', text)
    text = re.sub(r'\bd="[^"]*"', lambda found: re.sub(r"(\.\d)\d+", r"\1", found[0]), text)
    return _styled_once(_ungrouped(text), name)


def _renumbered(text: str, name: str) -> str:
    """Return SVG text with the identifiers that something refers to counted, and no others.

    A hash of coordinates, as they come, changes with the last digit of one, and two figures
    of a page may share it; a count behind the figure's name does neither.
    """
    used = dict.fromkeys(re.findall(r'(?:url\(#|href="#)([^")]+)', text))
    fresh = {old: f"{name}-{k}" for k, old in enumerate(used)}
    text = re.sub(r' id="([^"]+)"', lambda m: f' id="{fresh[m[1]]}"' if m[1] in fresh else "", text)
    return re.sub(r'(url\(#|href="#)([^")]+)', lambda m: m[1] + fresh[m[2]], text)


def _relative(path: str) -> str:
    """Return a path of straight lines with each point given by its distance from the last."""
    return "".join(_line(part) for part in path.split("M") if part.strip())


def _line(part: str) -> str:
    tenths = [round(10 * float(number)) for number in part.replace("L", " ").split()]
    points = list(zip(tenths[::2], tenths[1::2], strict=True))
    steps = ((x - x0, y - y0) for (x0, y0), (x, y) in pairwise(points))
    first = "M" + "".join(_joined(points[0]))
    return first + ("l" + "".join(_joined(n for step in steps for n in step)) if points[1:] else "")


def _joined(tenths: Iterable[int]) -> Iterator[str]:
    """Yield numbers as short as they can be, with a space where one is needed."""
    for place, number in enumerate(tenths):
        text = f"{number / 10:g}".replace("0.", ".", 1) if abs(number) < 10 else f"{number / 10:g}"
        yield text if place == 0 or text.startswith("-") else " " + text


def _ungrouped(text: str) -> str:
    """Return SVG text without the groups that say nothing."""
    kept: list[bool] = []

    def tag(found: re.Match[str]) -> str:
        if found[0] == "</g>":
            return "</g>" if kept.pop() else ""
        if found[0].endswith("/>"):
            return ""  # nothing is in it
        kept.append(found[0] != "<g>")
        return found[0] if kept[-1] else ""

    return re.sub(r"<g\b[^>]*>|</g>", tag, text)


def _styled_once(text: str, name: str) -> str:
    """Return SVG text with every style that comes often written once, as a class."""
    counts = Counter(re.findall(r'style="([^"]*)"', text))
    rules = ""
    for place, look in enumerate(look for look, count in counts.items() if count > _SELDOM):
        text = text.replace(f'style="{look}"', f'class="{name}-{place}"')
        rules += f".{name}-{place}{{{look}}}"
    return text.replace("</style>", rules + "</style>", 1)
