"""Pages made from what the program itself goes by: its names, schema and registries."""

from __future__ import annotations

import inspect
import json
from importlib import import_module
from pathlib import Path
from typing import Any, get_args, get_origin

from numpydoc.docscrape import FunctionDoc
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from sphinx.application import Sphinx

from slewctl.design import METHODS
from slewctl.files.chosen_tables import CHOSEN_TABLES
from slewctl.files.schema import DesignTable
from slewctl.files.study_schema import StudyTable
from slewctl.plant.signals import ACTUATORS, SIGNALS, STATION_SENSORS

HEAD = ["| key | unit | default | example | meaning |", "| --- | --- | --- | --- | --- |"]
# Of the methods' options: unit, or what it is, and an example.
OPTIONS: dict[str, tuple[str, object]] = {
    "A": ("matrix", [[-50.0]]),
    "B": ("matrix", [[1.0]]),
    "C": ("matrix", [[200.0]]),
    "D": ("matrix", [[4.0]]),
    "added_damping": ("1", {"1": 0.05}),
    "bandwidth_hz": ("Hz", 0.5),
    "crossover_hz": ("Hz", 0.5),
    "damping_ratio": ("1", 0.7),
    "damping_ratio_min": ("1", 0.1),
    "decay_rate_min": ("1/s", 0.5),
    "delay": ("s", 0.005),
    "den": ("list", [0.02, 1.0]),
    "discretise": ("text", "tustin"),
    "feedback": ("text", "negative"),
    "file": ("text", "gains.json"),
    "filter_damping": ("1", 0.5),
    "formulation": ("text", "separated"),
    "gain": ("1", 0.2),
    "hinf_max": ("of actuator per first sensor", 50.0),
    "inputs": ("list", ["theta"]),
    "integral_limit": ("rad·s", 0.1),
    "leave": ("list", [2]),
    "minimise": ("text", "cost"),
    "modes": ("list", [1]),
    "notch_depth": ("1", 0.1),
    "notch_modes": ("list, or text", [1, 2]),
    "notch_width": ("1", 0.5),
    "num": ("list", [9.0, 20.0]),
    "observer_damping": ("1", 0.1),
    "observer_damping_ratio_min": ("1", 0.1),
    "observer_decay_rate_min": ("1/s", 1.0),
    "observer_poles": ("rad/s", [-4, -5, [-2, 10], [-2, -10]]),
    "observer_radius_max": ("rad/s", 500.0),
    "observer_speed": ("1", 3.0),
    "output": ("text", "voltage"),
    "payload_mass": ("kg", [0.0, 0.2]),
    "phase_lead_deg": ("deg", 50.0),
    "pid": ("table", {"kp": 20.0, "kd": 9.0, "filter_hz": 30.0}),
    "poles": ("rad/s", [-1, -2, [-1, 10], [-1, -10]]),
    "prewarp_hz": ("Hz", 2.0),
    "radius_max": ("rad/s", 200.0),
    "rolloff_hz": ("Hz", 20.0),
    "sample_time": ("s", 0.01),
    "sections": ("list of tables", [{"lowpass_hz": 60.0, "order": 1}]),
    "signal_used": ("text", "root_moment"),
    "std_max": ("that of each signal", {"torque": 0.5}),
    "stiffness": ("1", [0.9, 1.1]),
    "weight_hz": ("Hz", 5.0),
    "zeros": ("rad/s", [-2.0]),
}
# What a method takes in Python alone.
IN_PYTHON = ("plant", "system")
ROOMS = (
    "slewctl.compare",
    "slewctl.check",
    "slewctl.embedded",
    "slewctl.explore",
    "slewctl.testing",
)


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
            "millimetres (`mm`) or micrometres (`um`) from the clamp; an arm from modal data has "
            "places with names instead, as in `deflection@tip`.",
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
    for title, table in CHOSEN_TABLES.items():
        text += [f"## {title}", "", *_keys(table)]
    for method in METHODS:
        text += [f'## `[controller]` with `method = "{method}"`', "", *_options(method)]
    return "\n".join(text)


def study_file() -> str:
    """Return every key of a study file that a design file has not."""
    text = [
        "# Study files",
        "",
        "What `slewctl study` tries, in TOML: the arm and the truth of a [design file]"
        "(design-file.md), and a grid or several.",
        "",
    ]
    return "\n".join([*text, *_table(StudyTable, "", but=("arm", "truth"))])


def _options(method: str) -> list[str]:
    """Return a method's options from its signature and docstring."""
    function = METHODS[method]
    defaults = {name: p.default for name, p in inspect.signature(function).parameters.items()}
    told = {
        name.strip(): " ".join(line.strip() for line in described.desc)
        for described in FunctionDoc(function)["Parameters"]
        for name in described.name.split(",")
    }
    rows = [
        f"| `{name}` | {OPTIONS[name][0]} | {_value(default)} | {_value(OPTIONS[name][1])} "
        f"| {told[name]} |"
        for name, default in defaults.items()
        if name not in IN_PYTHON
    ]
    if not rows:
        return ["No options of its own.", ""]
    return [*HEAD, *rows, ""]


def _table(table: type[BaseModel], path: str, but: tuple[str, ...] = ()) -> list[str]:
    text = [f"## `{path}`" if path else "## The file", "", *_keys(table)]
    for name, field in table.model_fields.items():
        if (inner := _inner(field)) and name not in but:
            inside = f"{path.strip('[]')}.{name}".lstrip(".")
            several = any(get_origin(kind) is list for kind in _kinds(field.annotation))
            text += _table(inner, f"[[{inside}]]" if several else f"[{inside}]")
    return text


def _keys(table: type[BaseModel]) -> list[str]:
    rows = [
        f"| `{field.alias or name}` | {unit(field)} | {default(field)} "
        f"| {example(field)} | {field.description or ''} |"
        for name, field in table.model_fields.items()
    ]
    return [*HEAD, *rows, ""]


def _inner(field: FieldInfo) -> type[BaseModel] | None:
    kinds = _kinds(field.annotation)
    tables = [k for k in kinds if isinstance(k, type) and issubclass(k, BaseModel)]
    return tables[0] if tables else None


def _kinds(annotation: Any) -> list[Any]:
    """Return a type and all that it is made of."""
    return [annotation, *(kind for part in get_args(annotation) for kind in _kinds(part))]


def _extra(field: FieldInfo, key: str) -> Any:
    extra = field.json_schema_extra
    return extra.get(key) if isinstance(extra, dict) else None


def unit(field: FieldInfo) -> str:
    """Return the unit of a key, or what it is."""
    return str(_extra(field, "unit") or "")


def default(field: FieldInfo) -> str:
    """Return the default of a key as TOML."""
    if field.is_required():
        return "required"
    return _value(field.default)


def example(field: FieldInfo) -> str:
    """Return an example of a key as TOML."""
    return _value(field.examples[0]) if field.examples else ""


def _value(value: object) -> str:
    if value is None or value in ("", {}, ()):
        return "none"
    if isinstance(value, BaseModel):
        return "as below"
    return f"`{_toml(value)}`"


def _toml(value: Any) -> str:
    """Return a value as a file has it; tables inline."""
    if isinstance(value, dict):
        keys = {key if key.isidentifier() else json.dumps(key): value[key] for key in value}
        return "{ " + ", ".join(f"{key} = {_toml(item)}" for key, item in keys.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value, ensure_ascii=False)


def write(app: Sphinx, _: object) -> None:
    """Write what has changed beside the other pages."""
    folder = Path(app.srcdir) / "_generated"
    folder.mkdir(exist_ok=True)
    root = Path(app.srcdir).parent
    changes = (root / "CHANGELOG.md").read_text(encoding="utf-8")
    pages = api() | {"signals.md": signals(), "design-file.md": design_file()}
    pages["study-file.md"] = study_file()
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
