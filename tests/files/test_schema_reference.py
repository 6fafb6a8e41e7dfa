"""Every key of a design or study file says its unit, its meaning and an example that holds."""

from __future__ import annotations

import dataclasses
import tomllib
from pathlib import Path
from typing import Annotated, Any, get_args

import pytest
from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo

from slewctl import (
    Actuator,
    Hub,
    InputError,
    Joint,
    KelvinVoigt,
    LumpedMass,
    Motor,
    Payload,
    Rayleigh,
    Sensor,
)
from slewctl.basis import NAMES
from slewctl.design import METHODS, options
from slewctl.files.chosen_tables import CHOSEN_TABLES, KelvinVoigtTable, RayleighTable
from slewctl.files.drive_tables import ActuatorTable, JointTable, SensorTable
from slewctl.files.schema import (
    DesignTable,
    HubTable,
    LumpedMassTable,
    ModelTable,
    MotorTable,
    PayloadTable,
)
from slewctl.files.study_schema import StudyTable


def tables(table: type[BaseModel]) -> set[type[BaseModel]]:
    """Return a table and all within it."""
    found = {table}
    waiting: list[Any] = [field.annotation for field in table.model_fields.values()]
    while waiting:
        kind = waiting.pop()
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            found |= tables(kind)
        waiting += get_args(kind)
    return found


ALL = tables(DesignTable) | tables(StudyTable) | set(CHOSEN_TABLES.values())
FIELDS = {
    f"{table.__name__}.{name}": field
    for table in sorted(ALL, key=lambda t: t.__name__)
    for name, field in table.model_fields.items()
}


def test_all_tables_are_seen() -> None:
    assert {"MotorTable.resistance", "GridTable.orders", "SlewTable.angle_deg"} < set(FIELDS)


@pytest.mark.parametrize("key", FIELDS)
def test_a_key_has_unit_meaning_and_an_example_that_the_schema_takes(key: str) -> None:
    field: FieldInfo = FIELDS[key]
    extra = field.json_schema_extra
    assert isinstance(extra, dict)
    assert extra["unit"]
    assert field.description
    assert field.examples
    kind: Any = (
        Annotated[(field.annotation, *field.metadata)] if field.metadata else field.annotation
    )
    TypeAdapter(kind).validate_python(field.examples[0])


def test_the_bases_named_are_those_there_are() -> None:
    meaning = ModelTable.model_fields["basis"].description
    assert meaning is not None
    assert all(name in meaning for name in NAMES)


def test_pages_made_of_the_schema_leave_nothing_out(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("sphinx", "numpydoc"):
        pytest.importorskip(name, reason="the extra docs is not installed")
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "docs" / "_ext"))
    import registries

    pages = registries.design_file() + registries.study_file()
    for key, field in FIELDS.items():
        assert f"| `{field.alias or key.split('.')[1]}` | " in pages
    taken = {name for method in METHODS for name in options(method)}
    assert taken == set(registries.OPTIONS)
    rows = [line for line in pages.splitlines() if line.startswith("| `")]
    assert rows
    for row in rows:
        assert all(cell.strip() for cell in row.strip("|").split(" | ")), row
    for cell in (row.split(" | ")[3] for row in rows):
        tomllib.loads(f"key = {cell.strip('`')}")


DESCRIBED: list[tuple[type[BaseModel], type[Any], dict[str, Any]]] = [
    (HubTable, Hub, {}),
    (PayloadTable, Payload, {}),
    (ActuatorTable, Actuator, {}),
    (SensorTable, Sensor, {}),
    (JointTable, Joint, {"stiffness": 100.0}),
    (LumpedMassTable, LumpedMass, {"x": 0.1}),
    (RayleighTable, Rayleigh, {"kind": "rayleigh"}),
    (KelvinVoigtTable, KelvinVoigt, {"kind": "kelvin-voigt", "retardation_time": 1e-4}),
    (
        MotorTable,
        Motor,
        {"resistance": 2.6, "torque_constant": 0.0077, "back_emf_constant": 0.0077},
    ),
]
VALUES = (-1.0, -0.0, 0.0, 1e-9, 0.5, 1.0, 1.5, 50.0, float("inf"), float("nan"), "1", True)


@pytest.mark.parametrize(("table", "described", "needed"), DESCRIBED)
def test_a_table_has_the_keys_and_defaults_of_what_it_describes(
    table: type[BaseModel], described: type[Any], needed: dict[str, Any]
) -> None:
    own = {field.name: field.default for field in dataclasses.fields(described)}
    keys = {name: field for name, field in table.model_fields.items() if name != "kind"}
    assert keys.keys() == own.keys()
    for name, field in keys.items():
        required = own[name] is dataclasses.MISSING
        assert field.is_required() == required
        assert required or field.default == own[name]


@pytest.mark.parametrize(("table", "described", "needed"), DESCRIBED)
def test_a_table_refuses_nothing_that_what_it_describes_takes(
    table: type[BaseModel], described: type[Any], needed: dict[str, Any]
) -> None:
    for field in dataclasses.fields(described):
        for value in VALUES:
            given = needed | {field.name: value}
            try:
                table.model_validate(given)
            except ValidationError:
                given.pop("kind", None)
                with pytest.raises(InputError):
                    described(**given)
