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


class Table(BaseModel):
    """A TOML table that refuses unknown keys and converts nothing."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class BeamTable(Table):
    """``[arm.beam]``.

    A profile is a number, a list of polynomial coefficients in x/L (lowest power first), or
    stations ``{ x = [...], values = [...] }`` with x in metres; the reader checks it.
    """

    length: Positive
    mass_per_length: Any
    bending_stiffness: Any


class HubTable(Table):
    """``[arm.hub]``."""

    inertia: NonNegative = 0.0
    radius: NonNegative = 0.0
    friction: NonNegative = 0.0


class PayloadTable(Table):
    """``[arm.payload]``."""

    mass: NonNegative = 0.0
    inertia: NonNegative = 0.0


class RayleighTable(Table):
    """``[arm.damping]`` with kind = "rayleigh"."""

    kind: str
    alpha: NonNegative = 0.0
    beta: NonNegative = 0.0


class KelvinVoigtTable(Table):
    """``[arm.damping]`` with kind = "kelvin-voigt"."""

    kind: str
    retardation_time: NonNegative


class MotorTable(Table):
    """``[arm.motor]``."""

    resistance: Positive
    torque_constant: Positive
    back_emf_constant: NonNegative
    gear_ratio: Positive = 1.0
    gear_efficiency: Efficiency = 1.0
    motor_efficiency: Efficiency = 1.0
    rotor_inertia: NonNegative = 0.0
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
    n: Count


class ControllerTable(Table):
    """``[controller]``: method, weights in physical terms, and the method's own options.

    The case knows the options of its method and refuses what is none.
    """

    model_config = ConfigDict(extra="allow", strict=True, frozen=True)

    method: str
    limits: dict[str, Positive]
    noise: dict[str, Positive]


class SlewTable(Table):
    """``[slew]``: the turn that is simulated."""

    angle_deg: Finite
    duration_s: Positive
    horizon_s: Positive | None = None


class TruthTable(Table):
    """``[truth]``: what the design is judged on."""

    modes: Count = Case.truth_modes


class CompareTable(Table):
    """``[compare]``: what the design is compared with."""

    bases: Several[str] = list(Case.bases)
    orders: Several[Count] = list(Case.orders)


class DesignTable(Table):
    """A whole design file."""

    written_for: str = Field(DESIGN_SCHEMA, alias="schema")
    title: str = ""
    arm: ArmTable
    model: ModelTable
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
