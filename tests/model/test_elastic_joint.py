"""An elastic joint between rotor and hub: frequencies, equations, energy, limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import slewctl as sc
from slewctl.basis import NAMES
from slewctl.model import frequencies
from slewctl.model.assembly import factors
from slewctl.model.locked import ritz_frequencies_hz
from slewctl.model.ritz import ritz_modes
from slewctl.model.subspace import lowest_modes

TWO_PI = 2 * np.pi
BEAM = sc.Beam(0.7, 4.0, 0.6)
ARM = sc.Arm(
    sc.Beam(0.8, (1.5, -0.6), (12.0, -7.0)),
    sc.Hub(0.05, radius=0.06, friction=0.02),
    sc.Payload(0.1, 0.002),
    damping_ratio=(0.01, 0.02),
    motor=sc.Motor(2.0, 0.05, 0.05, gear_ratio=10.0, gear_efficiency=0.9, rotor_inertia=4e-4),
    joint=sc.Joint(40.0, damping=0.03, rotor_inertia=0.01, rotor_friction=0.04),
)


@pytest.mark.parametrize(
    ("tip_mass", "published"),
    [
        (0.0, (3.27812245, 17.2250697, 48.0235285)),
        (2.0, (2.13807261, 12.9777777, 39.8925753)),
    ],
)
def test_published_frequencies(tip_mass: float, published: tuple[float, ...]) -> None:
    """Beam 0.7 m, 4 kg/m, 0.6 N·m², rotor 1 kg·m² on a joint of 100 N·m/rad, no hub."""
    arm = sc.Arm(BEAM, payload=sc.Payload(tip_mass), joint=sc.Joint(100.0, rotor_inertia=1.0))
    assert TWO_PI * sc.truth(arm, 3).frequencies_hz == pytest.approx(published, rel=4e-9)


def determinant(arm: sc.Arm, omega: float) -> float:
    """Return the characteristic determinant of a uniform arm, divided by cosh² βL.

    w = (r + x)θ + v on the beam: w(0) = rθ, w'(0) = θ, and the hub is turned by
    EI w''(0) − r EI w'''(0) and by the joint, whose rotor follows as k/(k − J_m ω²).
    """
    L, r = arm.beam.length, arm.hub.radius
    m, EI = float(arm.beam.mass_per_length), float(arm.beam.bending_stiffness)  # type: ignore[arg-type]
    mt, Jt = arm.payload.mass, arm.payload.inertia
    b = (m * omega**2 / EI) ** 0.25
    z = b * L
    # cos, sin, e^(−βx), e^(−β(L−x)) and their derivatives, at 0 and at L.
    e = np.exp(-z)
    at0 = np.array([[1, 0, 1, e], [0, 1, -1, e], [-1, 0, 1, e], [0, -1, -1, e]])
    c, s = np.cos(z), np.sin(z)
    atL = np.array([[c, s, e, 1], [-s, c, -e, 1], [-c, -s, e, 1], [s, -c, -e, 1]])
    scale = b ** np.arange(4)[:, None]
    at0, atL = at0 * scale, atL * scale
    k, Jm = arm.joint.stiffness, arm.rotor_inertia  # type: ignore[union-attr]
    hub = np.array([k - arm.hub.inertia * omega**2, -k])
    rows = np.zeros((6, 6))
    rows[0, :4], rows[0, 4] = at0[0], -r
    rows[1, :4], rows[1, 4] = at0[1] / b, -1 / b
    rows[2, :4], rows[2, 4:] = -EI * (at0[2] - r * at0[3]), hub
    rows[3, 4:] = [-k, k - Jm * omega**2]
    rows[4, :4] = EI * atL[2] - Jt * omega**2 * atL[1]
    rows[5, :4] = EI * atL[3] + mt * omega**2 * atL[0]
    return float(np.linalg.slogdet(rows / np.abs(rows).max(axis=1, keepdims=True))[0])


@settings(max_examples=12, deadline=None)
@given(
    hub=st.sampled_from([0.0, 0.02, 1.0]),
    radius=st.sampled_from([0.0, 0.1]),
    payload=st.sampled_from([(0.0, 0.0), (0.3, 0.01), (4.0, 0.0)]),
    stiffness=st.floats(0.5, 1e4),
    rotor=st.floats(1e-3, 10.0),
)
def test_every_frequency_is_a_root_of_the_determinant(
    hub: float, radius: float, payload: tuple[float, float], stiffness: float, rotor: float
) -> None:
    joint = sc.Joint(stiffness, rotor_inertia=rotor)
    arm = sc.Arm(BEAM, sc.Hub(hub, radius), sc.Payload(*payload), joint=joint)
    for omega in TWO_PI * sc.truth(arm, 5).frequencies_hz:
        below, above = (determinant(arm, omega * (1 + d)) for d in (-1e-8, 1e-8))
        assert below * above < 0


@pytest.mark.parametrize("hub_inertia", [0.0, 0.3])
def test_a_stiff_joint_is_none(hub_inertia: float) -> None:
    rigid = sc.truth(sc.Arm(BEAM, sc.Hub(hub_inertia + 0.2, 0.05)), 4)
    gaps = []
    for stiffness in (1e6, 1e8):
        joint = sc.Joint(stiffness, rotor_inertia=0.2)
        soft = sc.truth(sc.Arm(BEAM, sc.Hub(hub_inertia, 0.05), joint=joint), 4)
        gaps.append(1 - soft.frequencies_hz / rigid.frequencies_hz)
    assert np.all(gaps[0] > 0)
    assert gaps[0] / gaps[1] == pytest.approx(100, rel=0.01)  # in proportion to 1/k


def test_units_do_not_matter() -> None:
    """The same arm in grams, millimetres and milliseconds."""
    g, mm, ms = 1e3, 1e3, 1e3
    inertia, torque = g * mm**2, g * mm**2 / ms**2
    hub, payload, motor, joint = ARM.hub, ARM.payload, ARM.motor, ARM.joint
    assert motor is not None
    assert joint is not None
    small = replace(
        ARM,
        beam=sc.Beam(
            0.8 * mm,
            tuple(c * g / mm for c in (1.5, -0.6)),
            tuple(c * torque * mm for c in (12.0, -7.0)),
        ),
        hub=sc.Hub(hub.inertia * inertia, hub.radius * mm, hub.friction * torque * ms),
        payload=sc.Payload(payload.mass * g, payload.inertia * inertia),
        motor=replace(motor, rotor_inertia=motor.rotor_inertia * inertia),
        joint=sc.Joint(
            joint.stiffness * torque,
            joint.damping * torque * ms,
            joint.rotor_inertia * inertia,
            joint.rotor_friction * torque * ms,
        ),
    )
    ours, theirs = (
        np.sort_complex(np.linalg.eigvals(sc.state_space(sc.truth(a, 5), coordinates="modal").A))
        for a in (ARM, small)
    )
    assert theirs * ms == pytest.approx(ours, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_bases_fall_towards_the_truth(name: str) -> None:
    """The joint's own coordinate leaves them as good as they are on the arm without it."""

    def errors(arm: sc.Arm) -> list[np.ndarray]:
        exact = sc.truth(arm, 4).frequencies_hz
        return [sc.assemble(arm, name, n).frequencies_hz[:4] / exact - 1 for n in (4, 8)]

    few, many = errors(ARM)
    assert np.all(many > -1e-12)
    assert np.all(many <= few + 1e-12)
    for jointed, rigid in zip((few, many), errors(replace(ARM, joint=None)), strict=True):
        assert jointed.max() < rigid.max() + 1e-6


def test_the_rotor_is_not_counted_at_the_hub_as_well() -> None:
    model = sc.assemble(ARM, "polynomial", 6)
    rigid = sc.assemble(replace(ARM, joint=None), "polynomial", 6)
    assert ARM.rotor_inertia == pytest.approx(0.01 + 0.9 * 100 * 4e-4)
    assert model.mass[0, 0] == pytest.approx(rigid.mass[0, 0] + 0.01, rel=1e-14)
    # The twist's own inertia is that of all but the rotor.
    assert model.mass[1, 1] == pytest.approx(model.mass[0, 0] - ARM.rotor_inertia, rel=1e-13)
    assert model.mass[0, 2:] == pytest.approx(model.mass[1, 2:], rel=1e-12)
    assert model.stiffness[0] == pytest.approx(np.zeros(8), abs=0)
    assert model.stiffness[1] == pytest.approx(np.eye(8)[1] * 40.0, rel=1e-15)


@pytest.mark.parametrize("stiffening", [True, False])
def test_the_nonlinear_equations_are_those_of_rotor_hub_and_beam(stiffening: bool) -> None:
    """Written out in θ_m, θ and q, from the matrices of the arm without a joint."""
    arm = replace(ARM, damping_ratio=0.0)
    model = sc.assemble(arm, "polynomial", 3)
    equations = sc.large_slew(model, stiffening)
    rng = np.random.default_rng(5)
    x, rates = rng.normal(size=5) * 0.1, rng.normal(size=5) * 3
    torque = 0.7
    turned = np.eye(5)
    turned[1, 0] = 1  # [θ_m, θ, q] of [θ_m, θ − θ_m, q]
    y, ydot = turned @ x, turned @ rates
    yddot = turned @ equations.accelerations(x, rates, torque)
    own = replace(arm, joint=None, motor=None)  # the hub alone, without the rotor
    bare = sc.large_slew(sc.assemble(own, "polynomial", 3), stiffening)
    M, K, S = bare.linear.mass, bare.linear.stiffness, bare.softening
    q, qdot, qddot = y[2:], ydot[2:], yddot[2:]
    joint = arm.joint
    assert joint is not None
    twisting = joint.stiffness * (y[0] - y[1]) + joint.damping * (ydot[0] - ydot[1])
    rotor = arm.rotor_inertia * yddot[0] + joint.rotor_friction * ydot[0] + twisting
    hub = (
        (M[0, 0] + q @ S @ q) * yddot[1]
        + 2 * ydot[1] * (q @ S @ qdot)
        + M[0, 1:] @ qddot
        + arm.hub.friction * ydot[1]
    )
    beam = M[1:, 0] * yddot[1] + M[1:, 1:] @ qddot + (K[1:, 1:] - ydot[1] ** 2 * S) @ q
    size = np.abs(K[1:, 1:]).max() * 0.1
    assert rotor == pytest.approx(torque, abs=1e-12 * size)
    assert hub == pytest.approx(twisting, abs=1e-12 * size)
    assert beam == pytest.approx(np.zeros(3), abs=1e-12 * size)
    energy = equations.energy(np.concatenate([x, rates]))
    spring = joint.stiffness * (y[0] - y[1]) ** 2 / 2
    bent = bare.energy(np.concatenate([y[1:], ydot[1:]]))
    assert energy == pytest.approx(bent + spring + arm.rotor_inertia * ydot[0] ** 2 / 2, rel=1e-12)


def test_energy_and_momentum_of_a_free_swing() -> None:
    arm = replace(
        ARM,
        damping_ratio=0.0,
        hub=replace(ARM.hub, friction=0.0),
        joint=sc.Joint(40.0, rotor_inertia=0.05),
    )
    equations = sc.large_slew(sc.assemble(arm, "arm-matched", 2))
    start = np.array([0.0, 0.05, 0.02, -0.01, 4.0, 1.0, 0.0, 0.0])
    swing = sc.simulate_swing(equations, np.linspace(0, 2, 41), initial=start, rtol=1e-9)
    assert swing.energy == pytest.approx(swing.energy[0], rel=1e-8)
    momentum = equations.angular_momentum(swing.states)
    assert momentum == pytest.approx(momentum[0], rel=1e-8)
    assert swing.theta - swing.theta_motor == pytest.approx(swing.q[:, 0])
    driven = sc.simulate_swing(
        sc.large_slew(sc.assemble(ARM, "arm-matched", 2)), np.linspace(0, 2, 41), torque=0.5
    )
    assert driven.energy_error < 1e-6  # the work of the torque on the rotor less all friction


def test_zeros_of_rotor_and_hub() -> None:
    """They are the frequencies with the rotor held, and with the hub held."""
    arm = replace(
        ARM,
        damping_ratio=0.0,
        hub=replace(ARM.hub, friction=0.0),
        joint=sc.Joint(40.0, rotor_inertia=0.05),
    )
    basis = sc.Polynomial(6)
    model = sc.assemble(arm, basis)
    G = sc.state_space(model, ["theta_motor", "theta"], coordinates="modal")
    for k, boundary in enumerate(("rotor-locked", "hub-locked")):
        for hertz in ritz_frequencies_hz(arm, basis, boundary)[:4]:  # type: ignore[arg-type]
            at, beside = (abs(G(2j * np.pi * hertz * f)[k, 0]) for f in (1.0, 1.01))
            assert at < 1e-7 * beside
    rigid = replace(arm, joint=None)
    assert frequencies(arm, 3).hz == pytest.approx(frequencies(rigid, 3).hz, rel=1e-12)
    assert np.all(frequencies(arm, 3, "rotor-locked").hz < frequencies(arm, 3).hz)
    with pytest.raises(sc.InputError, match="elastic joint"):
        frequencies(rigid, 3, "rotor-locked")


def test_the_rotor_is_passive_and_the_hub_is_not() -> None:
    G = sc.state_space(sc.truth(ARM, 8), ["theta_motor_dot", "theta_dot"], coordinates="modal")
    omega = np.geomspace(0.05, 5e3, 4000)
    rotor, hub = G(1j * omega)[:, 0].real
    assert rotor.min() > 0
    assert hub.min() < -0.1 * hub.max()


def test_back_emf_and_friction_act_on_the_rotor() -> None:
    model = sc.assemble(ARM, "hub-matched", 2)
    joint, motor = ARM.joint, ARM.motor
    assert joint is not None
    assert motor is not None
    friction = joint.rotor_friction + motor.back_emf_damping
    braked = sc.assemble(
        replace(ARM, joint=replace(joint, rotor_friction=friction)), "hub-matched", 2
    )
    volts, torque = sc.state_space(model, input="voltage"), sc.state_space(braked)
    np.testing.assert_allclose(volts.A, torque.A, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(volts.B, motor.torque_per_volt * torque.B, rtol=1e-12, atol=1e-12)


def test_damping_ratios_are_those_of_the_free_arm() -> None:
    arm = replace(
        ARM,
        motor=None,
        hub=replace(ARM.hub, friction=0.0),
        joint=sc.Joint(40.0, rotor_inertia=0.05),
    )
    poles = np.linalg.eigvals(sc.state_space(sc.assemble(arm, "arm-matched", 3)).A)
    poles = sorted(poles[poles.imag > 1e-3], key=abs)
    ratios = [-pole.real / abs(pole) for pole in poles]
    assert ratios == pytest.approx([0.01, 0.02, 0.02, 0.02], rel=1e-6)
    # Kelvin–Voigt damps the beam's material, Rayleigh all that is elastic.
    for law, twist in ((sc.KelvinVoigt(1e-3), 0.0), (sc.Rayleigh(beta=1e-3), 0.04)):
        bent = replace(arm, damping=law, damping_ratio=0.0)
        assert sc.assemble(bent, "polynomial", 2).damping[1, 1] == pytest.approx(twist, abs=1e-15)


@pytest.mark.parametrize("boundary", ["free", "rotor-locked"])
def test_many_stations(boundary: str) -> None:
    """The iteration without matrices finds what the matrices give."""
    edges = tuple(np.linspace(0, 1, 12)[1:-1])
    basis = sc.Polynomial(11 * 4, edges)
    found = lowest_modes(ARM, basis, 3, boundary)  # type: ignore[arg-type]
    from slewctl.basis.with_joint import WithJoint

    whole = ritz_modes(factors(ARM, WithJoint(basis)), boundary)  # type: ignore[arg-type]
    assert found.omega[:3] == pytest.approx(whole.omega[:3], rel=1e-11)
    turned = np.sign(np.sum(found.shapes[:, :3] * whole.shapes[:, :3], axis=0))
    assert found.shapes[:, :3] * turned == pytest.approx(whole.shapes[:, :3], abs=1e-7)


def test_spinning_with_a_joint() -> None:
    """A stiff joint spins as none; a soft one whose hub swings about the steady rotor."""
    rigid, stiff = (
        sc.spin_frequencies_hz(sc.assemble(arm, "polynomial", 6), 3.0)
        for arm in (
            replace(ARM, joint=None),
            replace(ARM, joint=sc.Joint(1e8, rotor_inertia=0.05)),
        )
    )
    assert stiff[:3] == pytest.approx(rigid[:3], rel=1e-6)
    resting = sc.spin_frequencies_hz(sc.assemble(ARM, "polynomial", 6), 0.0)
    assert resting[:3] == pytest.approx(frequencies(ARM, 3, "rotor-locked").hz, rel=1e-6)
    with pytest.raises(sc.InputError, match="in the plane of rotation alone"):
        sc.spin_frequencies_hz(sc.assemble(ARM, "polynomial", 3), 3.0, "out")


@pytest.mark.parametrize(
    ("build", "told"),
    [
        (lambda: sc.Joint(0.0), "joint.stiffness"),
        (lambda: sc.Joint(1.0, damping=-1.0), "joint.damping"),
        (lambda: sc.Arm(BEAM, joint=sc.Joint(1.0)), "joint.rotor_inertia"),
        (lambda: sc.vary(sc.Arm(BEAM), joint_stiffness=2.0), "joint_stiffness"),
        (lambda: sc.assemble(sc.Arm(BEAM), sc.truth(ARM, 2).basis), "has not got"),
    ],
)
def test_refused_by_name(build: object, told: str) -> None:
    with pytest.raises(sc.InputError, match=told):
        build()  # type: ignore[operator]


def test_variation() -> None:
    softer = sc.vary(ARM, joint_stiffness_factor=0.5, joint_damping=0.1).joint
    assert softer == sc.Joint(20.0, 0.1, 0.01, 0.04)
