"""Pages from templates: one self-contained HTML file, nothing fetched from a network."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape
from markupsafe import Markup

from slewctl.escape import markdown, visible
from slewctl.versions import installed

_PACKAGES = ("slewctl", "numpy", "scipy", "control", "matplotlib")


def render(template: str, **values: Any) -> str:
    """Return the page that `template` makes of `values`, escaped for HTML or Markdown."""
    page = _templates(template.endswith(".md")).get_template(template)
    return page.render(versions=versions(), **values)


@cache
def _templates(is_markdown: bool) -> Environment:
    """Return the templates, compiled once for all pages of a run."""
    environment = Environment(
        loader=PackageLoader("slewctl.report", "templates"),
        autoescape=select_autoescape(),
        finalize=_harmless_markdown if is_markdown else _visible,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(
        zip=zip, number=number, percent=percent, hertz=hertz, tiny=tiny, svg=Markup, tidy=tidy,
        lost=lost, words=words,
    )  # fmt: skip
    environment.globals.update(zip=zip)
    return environment


def _harmless_markdown(value: Any) -> Any:
    return markdown(value) if isinstance(value, str) else value


def _visible(value: Any) -> Any:
    """Return text without what a browser must not be given; jinja escapes the rest."""
    return visible(value) if isinstance(value, str) and not isinstance(value, Markup) else value


def versions() -> dict[str, str]:
    """Return the versions of the packages that the numbers depend on."""
    return {name: installed(name) for name in _PACKAGES}


def number(value: float | None, digits: int = 4) -> str:
    """Return a number for a table: a dash for none, ∞ for infinity."""
    if value is None or math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    return f"{value:.{digits}g}".replace("-", "−")


def percent(value: float | None, digits: int = 2) -> str:
    """Return a fraction in per cent, with a dash for none."""
    if value is None or not math.isfinite(value):
        return number(value)
    value = value or 0.0  # zero has no sign
    size = abs(100 * value)
    if 0 < size < 10.0**-digits:
        return f"< {10.0**-digits:g} %"
    text = f"{100 * value:,.{digits if size < 10 else 1 if size < 1000 else 0}f} %"
    return text.replace("-", "−")


def hertz(value: float | None) -> str:
    """Return a frequency with its unit."""
    return "–" if value is None else f"{number(value)} Hz"


def tiny(value: float | None) -> str:
    """Return an error or residual as a power of ten."""
    return "–" if value is None else f"{value:.1e}".replace("-", "−")


def tidy(value: float | str) -> str:
    """Return the value of an axis: names apart from each other, numbers without noughts."""
    return value.replace("+", ", ") if isinstance(value, str) else f"{value:g}"


def words(name: str) -> str:
    """Return a quantity's name as words, without the unit that stands beside it."""
    for unit in ("_db", "_deg", "_hz", "_s"):
        name = name.removesuffix(unit)
    return name.replace("_", " ")


def lost(value: float) -> str:
    """Return a loss that is infinite for an unstable loop and NaN where there is no design."""
    if math.isnan(value):
        return "no design"
    return percent(value) if math.isfinite(value) else "unstable"
