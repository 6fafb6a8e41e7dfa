"""Sensors at a station on the beam: names, refusals, and what they read."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import quad
from strategies import deterministic

from slewctl.arm import Arm, Beam, Hub, Motor, Payload, Stations
from slewctl.basis import ClampedFree, Polynomial, Slewing
from slewctl.errors import InputError
from slewctl.model import Model, assemble, truth
from slewctl.plant import Objective, generalised_plant, state_space
from slewctl.plant.signals import SIGNALS, check_signals, signal

EPS = np.finfo(float).eps
SENSORS = ["moment@50mm", "deflection@650mm", "acceleration@12700um"]
BASES = [ClampedFree(3), Slewing(3), Polynomial(3)]


def response(system: control.StateSpace, omega: float) -> np.ndarray:
    return np.asarray(system(1j * omega)).reshape(system.noutputs)


@pytest.mark.parametrize("basis", BASES, ids=lambda basis: basis.name)
@pytest.mark.parametrize("coordinates", ["physical", "modal"])
def test_each_sensor_is_what_it_says(basis: object, coordinates: str, full_arm: Arm) -> None:
    """Solve (−ω²M + iωD + K)x = b for [θ, q] and form every reading from its definition."""
    model, omega, L, r = assemble(full_arm, basis), 5.0, 1.3, 0.12
    dynamic = -(omega**2) * model.mass + 1j * omega * model.damping + model.stiffness
    x = np.linalg.solve(dynamic, model.input)
    curvature = basis.evaluate(np.array([0.05 / L]), 2)[0] @ x[1:] / L**2
    expected = [
        (40.0 - 25.0 * (0.05 / L) ** 2) * curvature,
        basis.evaluate(np.array([0.65 / L]))[0] @ x[1:],
        -(omega**2) * ((r + 0.0127) * x[0] + basis.evaluate(np.array([0.0127 / L]))[0] @ x[1:]),
    ]
    got = response(state_space(model, SENSORS, coordinates=coordinates), omega)
    tolerance = 64 * EPS * np.linalg.cond(dynamic)
    for value, wanted in zip(got, expected, strict=True):
        assert abs(value - wanted) <= tolerance * max(abs(wanted), np.abs(x).max())


@pytest.mark.parametrize(
    ("fixed", "placed"),
    [
        ("root_moment", "moment@0mm"),
        ("root_moment", "moment@0um"),
        ("tip_deflection", "deflection@1300mm"),
        ("tip_acceleration", "acceleration@1300000um"),
    ],
)
def test_fixed_names_are_stations_at_the_ends(fixed: str, placed: str, full_arm: Arm) -> None:
    model = assemble(full_arm, ClampedFree(3))
    plant = state_space(model, [fixed, placed])
    assert_array_equal(plant.C[0], plant.C[1])
    assert_array_equal(plant.D[0], plant.D[1])
    assert np.any(plant.C[0])
    assert signal(placed).unit == SIGNALS[fixed].unit


@pytest.mark.parametrize("payload", [Payload(), Payload(0.4, 0.02)])
@pytest.mark.parametrize("millimetres", [0, 37, 400, 1000])
def test_moment_along_the_beam_balances_what_lies_outboard(
    payload: Payload, millimetres: int
) -> None:
    """Slowly turned: M(x) = −θ̈ (∫_x^L m̄(r+s)(s−x)ds + m_t(r+L)(L−x) + J_t), θ̈ = τ/J."""
    L, r, x, omega = 1.3, 0.12, millimetres / 1000, 1e-3
    arm = Arm(Beam(L, (2.0, -0.9), (40.0, 0.0, -25.0)), Hub(0.7, r), payload)
    model = assemble(arm, Polynomial(20))

    def weight(s: float) -> float:
        return (2.0 - 0.9 * s / L) * (r + s) * (s - x)

    outboard = quad(weight, x, L, epsabs=0, epsrel=1e-12)[0]
    outboard += payload.mass * (r + L) * (L - x) + payload.inertia
    moment = response(state_space(model, f"moment@{millimetres}mm", coordinates="modal"), omega)[0]
    # Corrections are of the order (ω/ω_1)², ω_1 > 10 rad/s.
    assert moment == pytest.approx(-outboard / model.mass[0, 0], rel=1e-7)


def test_moment_is_continuous_across_a_step_of_the_stiffness() -> None:
    """EI jumps by half and v'' by two; EI v'' does not.  1 µm beside it M has moved by 1e-6."""
    stepped = Stations((0.0, 0.5, 0.5, 1.2), (95.0, 95.0, 38.0, 38.0))
    model = truth(Arm(Beam(1.2, 0.5, stepped), Hub(0.1, 0.05)), 6)
    names = ["moment@499999um", "moment@500mm", "moment@500001um"]
    left, at, right = response(state_space(model, names, coordinates="modal"), 1.0)
    # A truth of 6 modes leaves its own jump of some 1e-4 in the higher modes' moments.
    assert at == pytest.approx(left, rel=1e-3)
    assert at == pytest.approx(right, rel=1e-5)


@given(st.integers(200, 3000), st.floats(0.05, 0.95))
@deterministic(60)
def test_sensor_on_a_step_reads_just_outboard(length: int, part: float) -> None:
    """However x/L rounds: profile and curvature are taken on the same side of the step."""
    at = round(part * length)
    L, x = length / 1000, at / 1000
    assume(0 < at < length)
    stepped = Stations((0.0, x, x, L), (3.0, 3.0, 1.0, 1.0))
    model = assemble(Arm(Beam(L, 1.0, stepped), Hub(1.0)), Polynomial(6, (x / L,)))
    on, beside = (signal(f"moment@{where}um").row(model) for where in (1000 * at, 1000 * at + 1))
    # 1 µm of 0.2 m, over which polynomials of degree 4 change by 4²·5e-6 at most.
    assert_allclose(on, beside, rtol=0, atol=1e-3 * np.abs(beside).max())


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("moment@0.05", "whole millimetres.*'moment@50mm'"),
        ("deflection@0.65", "'deflection@50mm'"),
        ("moment@50", "whole millimetres"),
        ("moment@5cm", "whole millimetres"),
        ("moment@-5mm", "whole millimetres"),
        ("moment@050mm", "whole millimetres"),
        ("moment@5e1mm", "whole millimetres"),
        ("moment@50 mm", "whole millimetres"),
        ("moment@٥mm", "whole millimetres"),
        ("moment@9999999999mm", "whole millimetres"),
        ("moment@", "whole millimetres"),
        ("moment", "'moment@50mm'"),
        ("acceleration", "'acceleration@50mm'"),
        ("strain@50", "'moment@50mm'"),
        ("momnt@50mm", "did you mean 'moment'"),
        ("strain@50mm", "known: acceleration, deflection, moment"),
        ("moment@1301mm", "beyond the tip of a beam of 1.3 m; give a station from 0mm to 1300mm"),
        ("deflection@1300001um", "beyond the tip"),
    ],
)
def test_wrong_stations_are_refused(name: str, message: str, full_arm: Arm) -> None:
    model = assemble(full_arm, Slewing(2))
    with pytest.raises(InputError, match=message) as error:
        state_space(model, ["theta", name])
    assert error.value.where == "outputs"
    assert error.value.remedy
    assert "\n" not in str(error.value)


def test_remedy_beyond_a_short_beam_is_in_micrometres() -> None:
    with pytest.raises(InputError, match="from 0mm to 450um"):
        check_signals(["moment@1mm"], "outputs", Beam(450e-6, 1.0, 1.0))
    assert check_signals(["moment@450um"], "outputs", Beam(450e-6, 1.0, 1.0)) == ("moment@450um",)


@pytest.mark.parametrize("millimetres", range(101, 3000, 97))
def test_the_tip_itself_is_on_the_beam(millimetres: int) -> None:
    """However the length rounds when it is computed in another way."""
    for length in (millimetres / 1000, millimetres * 1e-3, 3 * (millimetres / 3000)):
        model = assemble(Arm(Beam(length, 1.0, 1.0), Hub(1.0)), Slewing(1))
        plant = state_space(model, [f"deflection@{millimetres}mm", "tip_deflection"])
        assert_allclose(plant.C[0], plant.C[1], rtol=1e-12)


def test_profile_is_never_asked_beyond_the_tip() -> None:
    """A function of x that ends at the tip serves a station a rounding error beyond it."""
    length = np.nextafter(0.7, 0)

    def stiffness(x: np.ndarray) -> np.ndarray:
        if np.any(x > length):
            raise ValueError("beyond the data")
        return 2 - x

    arm = Arm(Beam(length, 1.0, stiffness), Hub(1.0))
    assert state_space(assemble(arm, Polynomial(3)), "moment@700mm").noutputs == 1


def test_one_name_twice_is_refused(full_arm: Arm) -> None:
    with pytest.raises(InputError, match="twice"):
        state_space(assemble(full_arm, Slewing(1)), ["moment@50mm", "moment@50mm"])


def root_moment_of(arm: Arm) -> control.StateSpace:
    return state_space(assemble(arm, Slewing(3)), "moment@0mm")


def test_moment_at_the_clamp_is_refused_where_it_would_read_zero() -> None:
    """As `root_moment` is; the rotor of a motor is hub inertia enough."""
    arm = Arm(Beam(1.0, 3.0, 5.0))
    with pytest.raises(InputError, match="bends at the root"):
        root_moment_of(arm)
    motor = Motor(1.0, 1.0, 1.0, rotor_inertia=1e-3)
    assert_array_equal(root_moment_of(replace(arm, motor=motor)).C, 0)
    assert np.any(state_space(assemble(arm, Slewing(3)), "moment@50mm").C)


def test_python_control_takes_the_names(full_arm: Arm) -> None:
    """StateSpace, interconnect by name and by 'system.signal', and picking one channel."""
    model: Model = assemble(full_arm, Slewing(2))
    plant = state_space(model, ["theta", "moment@50mm"])
    gain = np.array([[-4.0, 0.3]])
    feedback = control.ss(
        [], [], [], gain, inputs=["theta", "moment@50mm"], outputs=["torque"], name="feedback"
    )
    loop = control.interconnect([plant, feedback], inputs=["torque"], outputs=["moment@50mm"])
    assert_allclose(loop.A, plant.A + plant.B @ gain @ plant.C, rtol=0, atol=1e-12)
    assert loop.output_labels == ["moment@50mm"]
    wired = control.interconnect(
        [plant, feedback],
        connections=[
            ["feedback.moment@50mm", f"{plant.name}.moment@50mm"],
            ["feedback.theta", f"{plant.name}.theta"],
            [f"{plant.name}.torque", "feedback.torque"],
        ],
        inplist=[f"{plant.name}.torque"],
        outlist=[f"{plant.name}.moment@50mm"],
    )
    assert_allclose(wired.A, loop.A, rtol=0, atol=1e-12)
    one = plant["moment@50mm", "torque"]
    assert_array_equal(one.C[0], plant.C[1])


def test_generalised_plant_measures_and_penalises_at_stations(full_arm: Arm) -> None:
    objective = Objective(
        {"deflection@650mm": 0.01, "torque": 1.0},
        {"torque": 0.1, "theta": 1e-3, "moment@50mm": 0.02},
    )
    plant = generalised_plant(assemble(full_arm, ClampedFree(2)), objective)
    assert plant.sensors == ("theta", "moment@50mm")
    assert plant.system.input_labels == ["w_torque", "w_theta", "w_moment@50mm", "torque"]
    assert plant.system.output_labels[:2] == ["z_deflection@650mm", "z_torque"]


def test_acceleration_at_a_station_is_refused_in_a_cost(full_arm: Arm) -> None:
    objective = Objective(
        {"acceleration@650mm": 1.0, "torque": 1.0}, {"torque": 0.1, "theta": 1e-3}
    )
    with pytest.raises(InputError, match="acceleration@650mm responds to the torque"):
        generalised_plant(assemble(full_arm, ClampedFree(2)), objective)
