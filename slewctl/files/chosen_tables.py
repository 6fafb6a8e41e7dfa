"""Tables whose keys depend on what stands in them: what the reader chooses between."""

from __future__ import annotations

from typing import Annotated

from slewctl.arm import Rayleigh
from slewctl.files.table import Count, NonNegative, Positive, Table, told


class RectangleTable(Table):
    """``section`` of ``[arm.beam]`` with a width: a rectangle."""

    width: Annotated[Positive, told("m", "across the plane of rotation", 0.03)]
    thickness: Annotated[
        Positive, told("m", "in the plane of rotation: it bends across it", 1.5e-3)
    ]
    youngs_modulus: Annotated[Positive, told("N/m²", "of the material", 2.0e11)]
    density: Annotated[Positive, told("kg/m³", "of the material", 7850.0)]


class TubeTable(Table):
    """``section`` of ``[arm.beam]`` with an outer diameter: a round tube, or a rod."""

    outer_diameter: Annotated[Positive, told("m", "of the tube", 0.04)]
    inner_diameter: Annotated[NonNegative, told("m", "of its hole", 0.036)] = 0.0
    youngs_modulus: Annotated[Positive, told("N/m²", "of the material", 7.0e10)]
    density: Annotated[Positive, told("kg/m³", "of the material", 2700.0)]


class RayleighTable(Table):
    """``[arm.damping]`` with kind = "rayleigh"."""

    kind: Annotated[str, told("text", "the law", "rayleigh")]
    alpha: Annotated[NonNegative, told("1/s", "of the mass matrix", 0.1)] = Rayleigh.alpha
    beta: Annotated[NonNegative, told("s", "of the stiffness matrix", 1e-4)] = Rayleigh.beta


class KelvinVoigtTable(Table):
    """``[arm.damping]`` with kind = "kelvin-voigt"."""

    kind: Annotated[str, told("text", "the law", "kelvin-voigt")]
    retardation_time: Annotated[NonNegative, told("s", "of the beam's material", 1e-4)]


class DragTable(Table):
    """``[arm.damping]`` with kind = "drag"."""

    kind: Annotated[str, told("text", "the law", "drag")]
    per_length: Annotated[NonNegative, told("N·s/m²", "force per length and velocity", 0.1)]


class EncoderTable(Table):
    """A sensor of ``noise`` in ``[controller]`` that is an encoder of the hub's angle."""

    encoder_counts: Annotated[Count, told("1", "per turn of the hub, after quadrature", 4096)]
    sample_time: Annotated[
        Positive | None,
        told("s", "that it is read with; by default the controller's own", 0.005),
    ] = None


# Tables whose keys depend on what stands in them, by how the reference calls them.
CHOSEN_TABLES: dict[str, type[Table]] = {
    '`[arm.damping]` with `kind = "rayleigh"`': RayleighTable,
    '`[arm.damping]` with `kind = "kelvin-voigt"`': KelvinVoigtTable,
    '`[arm.damping]` with `kind = "drag"`': DragTable,
    "`section` of `[arm.beam]`, a rectangle": RectangleTable,
    "`section` of `[arm.beam]`, a round tube": TubeTable,
    "A sensor of `noise` in `[controller]`, an encoder": EncoderTable,
}
