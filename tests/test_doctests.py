"""Every example of a docstring runs and says what it shows."""

from __future__ import annotations

import doctest
import inspect
import re
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

import slewctl

PACKAGE = Path(slewctl.__file__).parent
WITH_EXAMPLES = sorted(
    ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
    for path in PACKAGE.glob("**/*.py")
    if ">>>" in path.read_text(encoding="utf-8")
)


@pytest.mark.parametrize("module", WITH_EXAMPLES)
def test_examples_run(module: str) -> None:
    found = doctest.testmod(import_module(module), optionflags=doctest.ELLIPSIS)
    assert found.failed == 0


def public(kind: Callable[[object], bool]) -> dict[str, Any]:
    """Return what is public in the package and of a kind, by its full name."""
    found = {}
    for path in PACKAGE.glob("**/__init__.py"):
        package = import_module(".".join(path.relative_to(PACKAGE.parent).parent.parts))
        for name in getattr(package, "__all__", ()):
            thing = getattr(package, name)
            if kind(thing) and thing.__module__.startswith("slewctl"):
                found[f"{thing.__module__}.{thing.__qualname__}"] = thing
    return found


FUNCTIONS = public(inspect.isfunction)
CLASSES = public(lambda thing: inspect.isclass(thing) and is_dataclass(thing))


def section(text: str, name: str) -> str:
    """Return a section of a numpydoc docstring; empty where it is missing."""
    found = re.search(rf"^{name}\n-{{{len(name)}}}\n(.*?)(?=^\w[\w ]*\n---|\Z)", text, re.M | re.S)
    return found[1] if found else ""


def names(text: str) -> set[str]:
    """Return what a section of parameters or attributes names."""
    told = re.findall(r"^([*\w][*\w, ]*?)(?: :.*)?$", text, re.M)
    return {word.strip(" *") for line in told for word in line.split(",")}


def test_sections_are_found() -> None:
    text = "Do it.\n\nParameters\n----------\na : int\n\nReturns\n-------\nint\n    In s.\n"
    assert section(text, "Parameters").strip() == "a : int"
    assert section(text, "Returns").split() == ["int", "In", "s."]
    assert section(text, "Raises") == ""
    assert len(FUNCTIONS) > 100


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_every_public_function_says_what_it_takes_and_gives_and_shows_it(name: str) -> None:
    function = FUNCTIONS[name]
    text = inspect.getdoc(function) or ""
    assert ">>>" in section(text, "Examples"), "no example"
    signature = inspect.signature(function)
    assert names(section(text, "Parameters")) >= set(signature.parameters)
    if signature.return_annotation != "None":
        assert (section(text, "Returns") or section(text, "Yields")).strip(), "no result"


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_every_public_class_says_what_it_holds(name: str) -> None:
    told: set[str] = set()
    for base in CLASSES[name].__mro__:
        text = inspect.cleandoc(base.__doc__ or "")
        told |= names(section(text, "Parameters")) | names(section(text, "Attributes"))
    assert told >= {field.name for field in fields(CLASSES[name]) if field.name[0] != "_"}


@pytest.mark.parametrize("name", ["Arm", "Beam", "Hub", "Objective", "Problem", "Slew", "Slewing"])
def test_what_a_user_describes_is_shown(name: str) -> None:
    assert ">>>" in section(inspect.getdoc(getattr(slewctl, name)) or "", "Examples")
