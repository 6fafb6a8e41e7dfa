"""Names that are loaded when they are asked for: of an invented package and of every own one."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

import slewctl

HERE = Path(slewctl.__file__).parent
INIT = """\
from typing import TYPE_CHECKING

from slewctl._lazy import attach

if TYPE_CHECKING:
    from invented.home import first, second as other
    from invented.inner import place as places
    from invented.broken import never

at_once = 1
__all__ = ["first", "other", "places"]
__getattr__, __dir__ = attach(__name__, __file__)
"""


@pytest.fixture
def invented(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    folder = tmp_path / "invented"
    folder.mkdir()
    (folder / "inner").mkdir()
    files = {
        "__init__": INIT, "home": "first, second = object(), object()",
        "inner/__init__": "", "inner/place": "", "broken": "import a_package_that_nobody_has",
    }  # fmt: skip
    for name, text in files.items():
        (folder / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    yield import_module("invented")
    for name in [name for name in sys.modules if name.split(".")[0] == "invented"]:
        del sys.modules[name]


def test_a_name_is_loaded_when_it_is_asked_for_and_once(invented: ModuleType) -> None:
    assert "invented.home" not in sys.modules
    assert "first" not in vars(invented)
    first = invented.first
    assert first is sys.modules["invented.home"].first
    assert vars(invented)["first"] is first  # Python itself finds it from now on
    assert "invented.inner" not in sys.modules


def test_a_name_may_be_another_and_a_module(invented: ModuleType) -> None:
    assert invented.other is import_module("invented.home").second
    assert not hasattr(invented, "second")
    assert invented.places is sys.modules["invented.inner.place"]


def test_names_are_listed_before_they_are_loaded(invented: ModuleType) -> None:
    assert {"first", "other", "places", "never", "at_once", "__all__"} <= set(dir(invented))
    assert dir(invented) == sorted(dir(invented))
    assert "invented.home" not in sys.modules


def test_an_unknown_name_is_no_attribute(invented: ModuleType) -> None:
    with pytest.raises(AttributeError, match=r"^module 'invented' has no attribute 'frist'$"):
        invented.frist  # noqa: B018
    assert not hasattr(invented, "frist")
    with pytest.raises(ImportError, match="frist"):
        exec("from invented import frist")


def test_what_is_wrong_with_a_home_is_not_hidden(invented: ModuleType) -> None:
    with pytest.raises(ModuleNotFoundError, match="a_package_that_nobody_has"):
        invented.never  # noqa: B018


def test_a_star_import_brings_what_is_public(invented: ModuleType) -> None:
    found: dict[str, object] = {}
    exec("from invented import *", found)
    assert found.keys() - {"__builtins__"} == {"first", "other", "places"}


def lazy_packages() -> list[str]:
    """Return the names of the packages that load their names lazily."""
    inits = [p for p in sorted(HERE.glob("**/__init__.py")) if "attach(" in p.read_text("utf-8")]
    return [".".join(p.relative_to(HERE.parent).parent.parts) for p in inits]


def announced(package: str) -> set[str]:
    """Return the names that a package imports for type checkers."""
    tree = ast.parse(Path(import_module(package).__file__ or "").read_text("utf-8"))
    return {
        alias.asname or alias.name
        for block in tree.body if isinstance(block, ast.If)
        for node in block.body if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }  # fmt: skip


def test_the_door_and_every_room_with_names_are_lazy() -> None:
    assert {"slewctl", "slewctl.arm", "slewctl.design", "slewctl.loop"} <= set(lazy_packages())


@pytest.mark.parametrize("package", lazy_packages())
def test_a_package_lists_and_gives_what_it_announces(package: str) -> None:
    module = import_module(package)
    assert set(module.__all__) <= announced(package) | vars(module).keys()
    assert set(module.__all__) | announced(package) <= set(dir(module))
    for name in announced(package):
        assert getattr(module, name) is not None
    with pytest.raises(AttributeError, match=f"module '{package}' has no attribute 'no_such'"):
        module.no_such  # noqa: B018


def test_star_imports_bring_all_public_names_of_a_fresh_package() -> None:
    lines = ["import importlib"]
    for package in lazy_packages():
        lines += [
            "found = {}", f"exec('from {package} import *', found)",
            f"public = set(importlib.import_module('{package}').__all__)",
            f"assert found.keys() - {{'__builtins__'}} == public, ('{package}', found.keys() ^ public)",
        ]  # fmt: skip
    subprocess.run([sys.executable, "-c", "\n".join(lines)], check=True)
