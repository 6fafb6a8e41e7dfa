"""Arms known by their modes: the equations by themselves, and a beam told by its own modes."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import eigh

import slewctl as sc
from slewctl import Arm, Beam, Hub, InputError, ModalData, Payload, Place
from slewctl.compare import Case, design_model, follow, spillover_ladder
from slewctl.files import read_arm, read_design
from slewctl.model import frequencies

TIP = Place("tip", 8.0, (0.15, -0.16, 0.1))
DATA = ModalData(
    600.0, (0.2, 0.7, 1.3), (20.0, 6.0, -4.0), (TIP, Place("root", moments=(3.0, 5.0, 1.0)))
)
SATELLITE = Arm(DATA, Hub(friction=0.5), damping_ratio=(0.005, 0.01), name="satellite")
LIMITS, NOISE = {"tip": 0.1, "torque": 10.0}, {"torque": 1.0, "theta": 1e-4, "theta_dot": 1e-3}
CANTILEVER = Arm(
    Beam(1.0, 1.0, 1.0), Hub(0.5, 0.1, 0.02), Payload(0.1), 0.01, damping_modes="hub-locked"
)


def response(arm: Arm, output: str, s: complex) -> complex:
    """Return the response to a torque by the equations of the data, written out."""
    data, k = arm.beam, np.arange(arm.beam.modes)
    omega, zeta = 2 * np.pi * np.array(data.frequencies_hz), arm.damping_ratios(len(k))
    delta = np.array(data.coupling)
    J = data.inertia + arm.hub_inertia
    mobile = -delta * s**2 / (s**2 + 2 * zeta * omega * s + omega**2)
    theta = 1 / (J * s**2 + arm.hub.friction * s + s**2 * (delta @ mobile))
    shown = {"theta": 1.0, "theta_dot": s, "tip": TIP.lever + np.array(TIP.shapes) @ mobile,
             "deflection@tip": np.array(TIP.shapes) @ mobile,
             "root_moment": np.array([3.0, 5.0, 1.0]) @ mobile}  # fmt: skip
    return theta * shown[output]


@pytest.mark.parametrize("output", ["theta", "theta_dot", "tip", "deflection@tip", "root_moment"])
def test_the_truth_answers_as_the_equations_of_the_data(output: str) -> None:
    for model in (sc.truth(SATELLITE), sc.assemble(SATELLITE, sc.Modal(3))):
        system = sc.state_space(model, [output], coordinates="modal")
        for s in (0.3j, 1.26j, 0.5 + 4.0j, 20.0j):
            assert complex(system(s)) == pytest.approx(response(SATELLITE, output, s), rel=1e-9)


def test_the_truth_is_what_is_given() -> None:
    model = sc.truth(SATELLITE, 20)
    assert model.complete
    assert model.modes == 3
    assert "its 3 modes as given" in str(model)
    np.testing.assert_allclose(frequencies(SATELLITE, 3).hz, DATA.frequencies_hz, rtol=1e-12)
    two = sc.truth(SATELLITE, 2)
    np.testing.assert_allclose(two.omega, model.omega[:2], rtol=1e-12)
    assert not two.complete


@settings(max_examples=10, deadline=None)
@given(st.floats(0.05, 5.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_a_beam_told_by_its_modes_is_that_beam(hub: float, radius: float, payload: float) -> None:
    """Its modes with the hub free, from 40 of those with the hub held."""
    arm = Arm(Beam(1.0, (1.0, -0.5), 1.0), Hub(hub, radius), Payload(payload, 0.01))
    sheet = sc.modal_data(arm, 40)
    np.testing.assert_allclose(sc.truth(sheet).omega[:2], sc.truth(arm, 2).omega, rtol=1e-4)


def test_its_responses_are_those_of_the_beam() -> None:
    sheet, names = sc.modal_data(CANTILEVER, 30), ["theta", "tip", "tip_deflection", "root_moment"]
    known, whole = (
        sc.state_space(model, names, coordinates="modal")
        for model in (sc.truth(sheet), sc.truth(CANTILEVER, 40))
    )
    for s in (0.3j, 3.0j, 9.0j):
        np.testing.assert_allclose(known(s), whole(s), rtol=2e-3)


def test_equal_appendages_are_one_of_as_many_times_everything() -> None:
    """Two beams on one hub by their modes, stacked, and as one beam of twice the size."""
    wing = replace(CANTILEVER, hub=Hub())
    sheet = sc.modal_data(wing, 6)
    both = sc.truth(sc.stacked_appendages({"left": sheet, "right": sheet}, Hub(0.5)))
    # Of twelve modes six leave the hub at rest; they are those with the hub held.
    held = frequencies(sheet, 6).hz
    hz = both.frequencies_hz
    assert all(np.min(np.abs(hz / f - 1)) < 1e-10 for f in held)
    equal = sc.truth(sc.equal_appendages(replace(sheet, hub=Hub(0.5)), 2))
    moving = [f for f in hz if np.min(np.abs(held / f - 1)) > 1e-8]
    np.testing.assert_allclose(moving, equal.frequencies_hz, rtol=1e-9)
    beams = sc.truth(sc.equal_appendages(replace(wing, hub=Hub(0.5)), 2), 2)
    np.testing.assert_allclose(equal.frequencies_hz[:2], beams.frequencies_hz, rtol=1e-3)
    tips = [sc.state_space(model, ["tip"])(2.0j) for model in (equal, beams)]
    np.testing.assert_allclose(*tips, rtol=1e-3)


def test_unequal_appendages_show_what_each_of_them_does() -> None:
    long = Arm(ModalData(300.0, (0.2, 1.3), (14.0, 3.0), (Place("tip", 9.0, (0.2, -0.1)),)),
               damping_ratio=(0.005, 0.02))  # fmt: skip
    short = Arm(ModalData(40.0, (0.9,), (6.0,), (Place("tip", 4.0, (0.3,)),)), damping_ratio=0.01)
    both = sc.stacked_appendages({"long": long, "short": short}, Hub(200.0))
    assert both.beam.frequencies_hz == (0.2, 0.9, 1.3)
    assert both.damping_ratio == (0.005, 0.01, 0.02)
    s, model = 2.0j, sc.truth(both)
    outputs = ["theta", "deflection@long_tip", "deflection@short_tip"]
    theta, *tips = sc.state_space(model, outputs, coordinates="modal")(s)[:, 0]
    for arm, seen in ((long, tips[0]), (short, tips[1])):
        data = arm.beam
        omega = 2 * np.pi * np.array(data.frequencies_hz)
        damped = s**2 + 2 * arm.damping_ratios(len(omega)) * omega * s + omega**2
        bent = -np.array(data.places[0].shapes) @ (np.array(data.coupling) / damped) * s**2
        assert seen / theta == pytest.approx(bent, rel=1e-9)


def test_behind_an_elastic_joint_the_truth_has_one_mode_more() -> None:
    """M, D and K of rotor, hub and modes: their frequencies, and a loop that the joint loses."""
    inertia, coupling, hub, rotor = 600.0, np.array([20.0, 4.0]), 50.0, 60.0
    stiffness, damping, omega = 4000.0, 5.0, 2 * np.pi * np.array([0.2, 1.3])
    joint = sc.Joint(stiffness, damping, rotor)
    data = ModalData(inertia, omega / (2 * np.pi), coupling, (Place("tip", 8.0, (0.15, 0.1)),))
    arm = Arm(data, Hub(hub), damping_ratio=0.005, joint=joint)
    M = np.diag([rotor, inertia + hub, 1.0, 1.0])
    M[1, 2:] = M[2:, 1] = coupling
    twist = np.array([1.0, -1.0, 0.0, 0.0])
    K = stiffness * np.outer(twist, twist) + np.diag([0, 0, *omega**2])
    D = damping * np.outer(twist, twist) + np.diag([0, 0, *(0.01 * omega)])
    own = np.sqrt(eigh(K, M, eigvals_only=True)[1:])
    truth = sc.truth(arm)
    np.testing.assert_allclose(truth.omega, own, rtol=1e-9)
    assert truth.complete
    np.testing.assert_allclose(frequencies(arm, 3, "rotor-locked").hz[0], truth_locked(M, K))
    with pytest.raises(InputError, match="3 modes of an arm whose data give 2"):
        frequencies(arm, 3)
    problem = sc.Problem(arm, {"tip": 0.1, "torque": 5.0}, {"torque": 0.2, "theta": 1e-4})
    kp, kd, lag = 710 * 0.36, 710 * 1.4 * 0.6, 1e-4
    law = control.tf([kd, kp], [lag, 1], inputs=["theta"], outputs=["torque"], name="PD")
    judged = problem.judge(law)
    A = np.block([[np.zeros((4, 4)), np.eye(4)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
    B = np.append(np.zeros(4), np.linalg.solve(M, [1.0, 0, 0, 0]))
    angle = np.eye(8)[1]
    closed = np.block(
        [
            [A - kd / lag * np.outer(B, angle), (kd / lag - kp) * B[:, None]],
            [angle / lag, -np.ones((1, 1)) / lag],
        ]
    )
    assert np.linalg.eigvals(closed).real.max() > 0.1
    assert not judged.stable
    good = problem.judge(sc.lqg(problem.plant("modal", n=1)))
    assert follow(good, "gain_margin_db").converged  # the truth ends where the data do


def truth_locked(M: np.ndarray, K: np.ndarray) -> float:
    """Return the lowest frequency in Hz with the rotor held."""
    return float(np.sqrt(eigh(K[1:, 1:], M[1:, 1:], eigvals_only=True)[0]) / (2 * np.pi))


def test_designs_are_made_and_judged_on_them(tmp_path: Path) -> None:
    problem = sc.Problem(SATELLITE, LIMITS, NOISE, slew=sc.Slew(30.0, 60.0))
    path = tmp_path / "design.toml"
    path.write_text(problem.to_toml(), encoding="utf-8")
    assert read_design(path).case.arm == SATELLITE
    judged = problem.judge(sc.lqg(problem.plant("modal", n=1)))
    assert judged.stable
    margin = follow(judged, "gain_margin_db")
    assert margin.converged
    assert [seen.modes for seen in margin.seen] == [3]
    assert "not converged" not in str(judged)
    case = Case("sat", SATELLITE, problem.objective, basis="modal", n=1, slew=problem.slew)
    assert (case.bases, case.orders) == (("modal",), (1, 2, 3))
    assert [rung.modes for rung in spillover_ladder(case).rungs] == [1, 2, 3]
    worst = sc.worst_case(case, {"frequency_factor": (0.9, 1.1)}, samples=2, searches=1)
    assert worst.arm.beam.frequencies_hz[0] != 0.2
    assert design_model(problem.truth, problem.objective, "modal-truncation", 1).plant.A.shape == (
        4,
        4,
    )


def test_without_a_tip_the_noise_on_the_torque_is_told_all_the_same() -> None:
    bare = replace(SATELLITE, beam=replace(DATA, places=()))
    problem = sc.Problem(bare, {"theta": 0.01, "torque": 10.0}, NOISE)
    judged = problem.judge(sc.lqg(problem.plant("modal", n=2)))
    seen = sc.Problem(SATELLITE, {"theta": 0.01, "torque": 10.0}, NOISE).judge(judged.controller)
    assert judged.noise.tip is None
    assert judged.noise.torque == pytest.approx(seen.noise.torque, rel=1e-9)
    with pytest.raises(InputError, match=r"nothing of a place 'tip'.* lever = 1\.0"):
        _ = judged.response


REFUSED = {
    "the basis 'modal'": lambda: sc.assemble(SATELLITE, "slewing", 2),
    "an arm that is known by its modes alone has no": lambda: sc.large_slew(sc.truth(SATELLITE)),
    "4 modes of an arm whose data give 3": lambda: sc.assemble(SATELLITE, "modal", 4),
    "frequencies.modes: 5 modes": lambda: sc.hub_locked_frequencies_hz(SATELLITE, 5),
    "paper beam has a beam": lambda: sc.assemble(sc.arms.paper_beam(), "modal", 1),
    "Σδ² = 452 kg·m² is not less": lambda: replace(SATELLITE, beam=replace(DATA, inertia=452.0)),
    "arm.payload: modal data are of": lambda: replace(SATELLITE, payload=Payload(1.0)),
    "arm.damping: modal data are of": lambda: replace(SATELLITE, damping=sc.Drag(1.0)),
    "frequencies_hz.1: the frequencies do not": lambda: replace(DATA, frequencies_hz=(2, 1, 3)),
    "coupling: 2 values for 3 modes": lambda: replace(DATA, coupling=(1.0, 2.0)),
    "place 'left'": lambda: sc.state_space(sc.truth(SATELLITE), ["deflection@left"]),
    "at a station": lambda: sc.state_space(sc.truth(SATELLITE), ["deflection@50mm"]),
    "no moments of the place 'tip'": lambda: sc.state_space(sc.truth(SATELLITE), ["moment@tip"]),
    "names no station": lambda: sc.state_space(sc.truth(sc.arms.paper_beam(), 2), ["moment@tip"]),
    "recommend: it needs an arm with a beam": lambda: sc.recommend(SATELLITE),
    "fit: it needs an arm with a beam": lambda: sc.fit(SATELLITE, [1.0], ["hub.inertia"]),
    "compare.bases.0: unknown name 'slewing'": lambda: Case("s", SATELLITE, sc.Objective(LIMITS, NOISE), bases=("slewing",)),
    "mass_factor: modal data tell of no mass": lambda: sc.vary(SATELLITE, mass_factor=1.1),
    "payload_mass: modal data are of the whole": lambda: sc.vary(SATELLITE, payload_mass=1.0),
    "coupling_factor: the arm has a beam": lambda: sc.vary(CANTILEVER, coupling_factor=1.1),
    "ratios are those of the free modes": lambda: sc.modal_data(replace(CANTILEVER, damping_modes="free"), 2),
}  # fmt: skip


@pytest.mark.parametrize("words", REFUSED)
def test_what_needs_a_beam_refuses_by_name(words: str) -> None:
    with pytest.raises(InputError) as caught:
        REFUSED[words]()
    assert words in str(caught.value)


def test_variations_change_what_the_data_tell() -> None:
    changed = sc.vary(SATELLITE, stiffness_factor=4.0, frequency_factor=0.5, coupling_factor=0.9)
    assert changed.beam.frequencies_hz == DATA.frequencies_hz
    np.testing.assert_allclose(changed.beam.coupling, 0.9 * np.array(DATA.coupling))
    assert sc.vary(SATELLITE, inertia_factor=2.0).beam.inertia == 1200.0
    assert sc.vary(CANTILEVER, frequency_factor=2.0).beam.bending_stiffness == 4.0
    assert pickle.loads(pickle.dumps(SATELLITE)) == SATELLITE


def test_files_hold_modal_data_and_wings(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text(SATELLITE.to_toml(), encoding="utf-8")
    assert read_arm(path) == SATELLITE
    wings = """
[arm.hub]
inertia = 200.0
[arm.wings.long]
inertia = 300.0
frequencies_hz = [0.2, 1.3]
coupling = [14.0, 3.0]
damping_ratio = 0.005
[arm.wings.short]
inertia = 40.0
count = 2
frequencies_hz = [0.9]
coupling = [6.0]
"""
    path.write_text(wings, encoding="utf-8")
    arm = read_arm(path)
    assert arm.beam.inertia == 380.0
    assert arm.beam.coupling == (14.0, 6.0 * 2**0.5, 3.0)
    path.write_text(wings.replace("coupling = [6.0]", "coupling = [6.0, 1.0]"), encoding="utf-8")
    with pytest.raises(InputError, match=r"arm.toml:13: .*wings.short.coupling: 2 values"):
        read_arm(path)
    path.write_text(f"[arm]\ndamping_ratio = 0.1\n{wings}", encoding="utf-8")
    with pytest.raises(InputError, match=r"arm.toml:2: arm.damping_ratio: each wing has its own"):
        read_arm(path)
    panel = "[arm]\nappendages = 2\n[arm.beam]\nlength = 1.0\nmass_per_length = 2.0\nbending_stiffness = 1.0"
    path.write_text(panel, encoding="utf-8")
    assert read_arm(path).beam == Beam(1.0, 4.0, 2.0)
