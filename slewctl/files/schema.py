"""The keys of a design file, with their types; everything else is refused."""

from __future__ import annotations

from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from slewctl.compare import Case, Grid

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Efficiency = Annotated[float, Field(gt=0, le=1)]
Count = Annotated[int, Field(ge=1)]
T = TypeVar("T")
# More is no comparison that anybody reads.
Several = Annotated[list[T], Field(max_length=100)]

# What a design file may say that it is written for.
DESIGN_SCHEMA = "slewctl-design/1"


def _told(unit: str, meaning: str, example: float) -> Any:
    """Return what the reference of design files says of a key."""
    return Field(description=meaning, examples=[example], json_schema_extra={"unit": unit})


class Table(BaseModel):
    """A TOML table that refuses unknown keys and converts nothing."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class BeamTable(Table):
    """``[arm.beam]``.

    A profile is a number, a list of polynomial coefficients in x/L (lowest power first), or
    stations ``{ x = [...], values = [...] }`` with x in metres; the reader checks it.
    """

    length: Annotated[Positive, _told("m", "of the beam", 1.0)]
    mass_per_length: Annotated[
        Any, _told("kg/m", "a number, coefficients in x/L, or stations", 2.0)
    ]
    bending_stiffness: Annotated[
        Any, _told("N·m²", "a number, coefficients in x/L, or stations", 40.0)
    ]


class HubTable(Table):
    """``[arm.hub]``."""

    inertia: Annotated[NonNegative, _told("kg·m²", "about the axis", 0.2)] = 0.0
    radius: Annotated[NonNegative, _told("m", "from the axis to the clamp", 0.05)] = 0.0
    friction: Annotated[NonNegative, _told("N·m·s/rad", "viscous, of the axis", 0.1)] = 0.0


class PayloadTable(Table):
    """``[arm.payload]``."""

    mass: Annotated[NonNegative, _told("kg", "at the tip", 0.1)] = 0.0
    inertia: Annotated[NonNegative, _told("kg·m²", "about its own centre", 0.001)] = 0.0


class RayleighTable(Table):
    """``[arm.damping]`` with kind = "rayleigh"."""

    kind: str
    alpha: Annotated[NonNegative, _told("1/s", "of the mass matrix", 0.1)] = 0.0
    beta: Annotated[NonNegative, _told("s", "of the stiffness matrix", 1e-4)] = 0.0


class KelvinVoigtTable(Table):
    """``[arm.damping]`` with kind = "kelvin-voigt"."""

    kind: str
    retardation_time: Annotated[NonNegative, _told("s", "of the beam's material", 1e-4)]


class MotorTable(Table):
    """``[arm.motor]``."""

    resistance: Annotated[Positive, _told("Ω", "of the armature", 2.6)]
    torque_constant: Annotated[Positive, _told("N·m/A", "of the motor's shaft", 0.0077)]
    back_emf_constant: Annotated[NonNegative, _told("V·s/rad", "of the motor's shaft", 0.0077)]
    gear_ratio: Annotated[Positive, _told("", "turns of the motor for one of the hub", 70.0)] = 1.0
    gear_efficiency: Annotated[Efficiency, _told("", "from above 0 to 1", 0.9)] = 1.0
    motor_efficiency: Annotated[Efficiency, _told("", "from above 0 to 1", 0.69)] = 1.0
    rotor_inertia: Annotated[NonNegative, _told("kg·m²", "about the motor's shaft", 3.9e-7)] = 0.0
    torque_limit: Positive | None = None
    voltage_limit: Positive | None = None


class ArmTable(Table):
    """``[arm]``: a catalogue arm, changed where keys are given, or a full description.

    The reader checks the damping ratio (one, or a list) and the table of the damping law,
    whose keys depend on its kind.
    """

    catalogue: str | None = None
    name: str | None = None
    beam: BeamTable | None = None
    hub: HubTable | None = None
    payload: PayloadTable | None = None
    motor: MotorTable | None = None
    damping: dict[str, Any] | None = None
    damping_ratio: Any = None


class ModelTable(Table):
    """``[model]``: what the design is made on."""

    basis: str
    n: Annotated[Count, _told("", "number of admissible functions", 2)]


class ControllerTable(Table):
    """``[controller]``: method, weights in physical terms, and the method's own options.

    The case knows the options of its method and refuses what is none.
    """

    model_config = ConfigDict(extra="allow", strict=True, frozen=True)

    method: str
    # Every method but a given law needs both; the reader knows.
    limits: dict[str, Positive] | None = None
    noise: dict[str, Positive] | None = None


class SlewTable(Table):
    """``[slew]``: the turn that is simulated."""

    angle_deg: Annotated[Finite, _told("deg", "of the turn", 30.0)]
    duration_s: Annotated[Positive, _told("s", "of the reference", 4.0)]
    horizon_s: Positive | None = None


class TruthTable(Table):
    """``[truth]``: what the design is judged on."""

    modes: Annotated[Count, _told("", "flexible modes of the truth", 20)] = Case.truth_modes


class CompareTable(Table):
    """``[compare]``: what the design is compared with."""

    bases: Several[str] = list(Case.bases)
    orders: Several[Count] = list(Case.orders)


class DesignTable(Table):
    """A whole design file."""

    written_for: str = Field(DESIGN_SCHEMA, alias="schema")
    title: str = ""
    arm: ArmTable
    # Needed by every method but a given law; the reader knows.
    model: ModelTable | None = None
    controller: ControllerTable
    # Needed by what is read from a slew alone; the reader knows.
    slew: SlewTable | None = None
    truth: TruthTable = TruthTable()
    compare: CompareTable = CompareTable()
    # The check room knows the requirements, and the arm room what can be varied; they refuse
    # what is none.
    requirements: dict[str, Any] = {}
    variations: dict[str, dict[str, Any]] = {}


class GridTable(Table):
    """``[[grid]]``: the values of each axis; every combination is tried."""

    bases: list[str] = list(Grid.bases)
    orders: list[Count] = list(Grid.orders)
    methods: list[str] = list(Grid.methods)
    hub_ratios: list[NonNegative] = list(Grid.hub_ratios)
    payload_ratios: list[NonNegative] = list(Grid.payload_ratios)
    damping_ratios: list[NonNegative] = list(Grid.damping_ratios)
    bandwidths: list[Positive] = list(Grid.bandwidths)
    sensors: list[list[str]] = [list(names) for names in Grid.sensors]


class StudyTable(Table):
    """A whole study file."""

    title: str = ""
    arm: ArmTable
    truth: TruthTable = TruthTable()
    grid: list[GridTable]
