"""Pages made from what the program itself goes by: its names, schema and registries."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from sphinx.application import Sphinx

from slewctl.files.schema import DesignTable, KelvinVoigtTable, RayleighTable
from slewctl.plant.signals import ACTUATORS, SIGNALS, STATION_SENSORS

ROOMS = ("slewctl.compare", "slewctl.check", "slewctl.testing")


def api() -> dict[str, str]:
    """One page for each room that users import from; a name stands by where it lives."""
    pages = {}
    for room in ("slewctl", *ROOMS):
        package = import_module(room)
        by_home: dict[str, list[str]] = {}
        for name in package.__all__:
            value = getattr(package, name)
            home = getattr(value, "__module__", room)
            home = home if home.startswith("slewctl.") else room
            by_home.setdefault(home.split(".")[1] if "." in home else room, []).append(name)
        text = [room, "=" * len(room), "", f".. currentmodule:: {room}", ""]
        for home, names in sorted(by_home.items()):
            text += [home, "-" * len(home), "", ".. autosummary::", "   :toctree: api", ""]
            text += [*(f"   {name}" for name in sorted(names)), ""]
        pages[room.replace(".", "-") + ".rst"] = "\n".join(text)
    return pages


def signals() -> str:
    """Return the table of signals."""
    rows = [f"| `{name}` | {signal.unit} | {signal.of} |" for name, signal in SIGNALS.items()]
    rows += [
        f"| `{name}@50mm`, `{name}@12700um` | {sensor.unit} | {sensor.of} at a station |"
        for name, sensor in STATION_SENSORS.items()
    ]
    return "\n".join(
        [
            "# Signals",
            "",
            "What can be measured, watched or penalised. A station is a whole number of "
            "millimetres (`mm`) or micrometres (`um`) from the clamp.",
            "",
            "| signal | unit | taken of |",
            "| --- | --- | --- |",
            *rows,
            "",
            f"The input is {' or '.join(f'`{name}`' for name in ACTUATORS)} (N·m or V).",
            "",
        ]
    )


def design_file() -> str:
    """Return every key of a design file."""
    text = [
        "# Design files",
        "",
        "A design file is TOML. It describes and runs no code; unknown keys are refused.",
        "Values are in SI units, but where the name of a key says another, as in `angle_deg`.",
        "",
    ]
    text += _table(DesignTable, "")
    for law, table in (("rayleigh", RayleighTable), ("kelvin-voigt", KelvinVoigtTable)):
        text += [f'## `[arm.damping]` with `kind = "{law}"`', "", *_keys(table)]
    return "\n".join(text)


def _table(table: type[BaseModel], path: str) -> list[str]:
    text = [f"## `[{path}]`" if path else "## The file", "", *_keys(table)]
    for name, field in table.model_fields.items():
        if inner := _inner(field):
            text += _table(inner, f"{path}.{name}".lstrip("."))
    return text


def _keys(table: type[BaseModel]) -> list[str]:
    rows = [
        f"| `{field.alias or name}` | {_unit(field)} | {_default(field)} "
        f"| {_example(field)} | {field.description or ''} |"
        for name, field in table.model_fields.items()
    ]
    head = ["| key | unit | default | example | meaning |", "| --- | --- | --- | --- | --- |"]
    return [*head, *rows, ""]


def _inner(field: FieldInfo) -> type[BaseModel] | None:
    kinds = (field.annotation, *get_args(field.annotation))
    tables = [k for k in kinds if isinstance(k, type) and issubclass(k, BaseModel)]
    return tables[0] if tables else None


def _extra(field: FieldInfo, key: str) -> Any:
    extra = field.json_schema_extra
    return extra.get(key) if isinstance(extra, dict) else None


def _unit(field: FieldInfo) -> str:
    return "table" if _inner(field) else str(_extra(field, "unit") or "")


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    if _inner(field) or field.default in (None, "", {}):
        return ""
    return f"`{field.default}`".replace("'", '"')


def _example(field: FieldInfo) -> str:
    return f"`{field.examples[0]}`" if field.examples else ""


def write(app: Sphinx, _: object) -> None:
    """Write what has changed beside the other pages."""
    folder = Path(app.srcdir) / "_generated"
    folder.mkdir(exist_ok=True)
    root = Path(app.srcdir).parent
    changes = (root / "CHANGELOG.md").read_text(encoding="utf-8")
    pages = api() | {"signals.md": signals(), "design-file.md": design_file()}
    for name, text in (pages | {"changelog.md": changes}).items():
        path = folder / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def absolute_values(*arguments: Any) -> None:
    """Keep |L| in a docstring from being read as a substitution."""
    lines: list[str] = arguments[-1]
    lines[:] = [line if "``" in line else line.replace("|", "\\|") for line in lines]


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("config-inited", write)  # before the pages are looked for
    app.connect("autodoc-process-docstring", absolute_values, priority=900)  # after numpydoc
    return {"parallel_read_safe": True}
