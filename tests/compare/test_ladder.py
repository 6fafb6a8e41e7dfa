"""The spillover ladder: its rungs, and the mode that an unstable loop has destabilised."""

from __future__ import annotations

from dataclasses import fields, replace

import control
import numpy as np
import pytest
from numpy.testing import assert_allclose

from slewctl import (
    Arm,
    Hub,
    HubMatched,
    InputError,
    Model,
    Objective,
    arms,
    assemble,
    close,
    generalised_plant,
    lqg,
    truth,
)
from slewctl.compare import (
    QUANTITIES,
    Case,
    destabilised_mode,
    evaluate,
    first_modes,
    read,
    spillover_ladder,
)
from slewctl.model import Truth

FROM_HUB = Objective({"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 1e-3, "theta_dot": 1e-2})
FROM_TIP = Objective({"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "tip": 1e-3})


def arm_with(hub: float, friction: float = 0.0) -> Arm:
    return replace(arms.paper_beam(), hub=Hub(hub, 0.0, friction), damping_ratio=0.005)


def case_of(objective: Objective, hub: float = 0.1944, **changes: object) -> Case:
    return Case("case", arm_with(hub), objective, truth_modes=12, **changes)  # type: ignore[arg-type]


def resonator(mode: int, model: Model) -> control.StateSpace:
    """Rate feedback of the wrong sign in a narrow band about one mode, and PD of the right one."""
    omega, theta = model.omega[mode - 1], model.mode_shapes[0, mode]
    pd = 1e-3 * model.mass[0, 0]
    width = 0.01 * omega
    # Three times what all damping takes from the mode: 2ζω/θ_k² + c_h + the PD's own.
    gain = 3 * (0.01 * omega / theta**2 + model.arm.hub.friction + pd)
    A = [[0.0, 1.0], [-(omega**2), -width]]
    return control.StateSpace(
        A, [[0.0, 0.0], [0.0, gain * width]], [[0.0, 1.0]], [[-pd, -pd]],
        inputs=["theta", "theta_dot"], outputs=["torque"],
    )  # fmt: skip


@pytest.mark.parametrize("modes", [1, 4])
def test_first_modes_are_the_smaller_truth(modes: int) -> None:
    arm = arm_with(0.1, friction=0.02)
    cut, expected = first_modes(truth(arm, 12), modes), truth(arm, modes)
    for name in ("mass", "damping", "stiffness", "mode_shapes", "omega", "input"):
        value = getattr(expected, name)
        assert_allclose(getattr(cut, name), value, atol=1e-12 * np.abs(value).max())
    x = np.linspace(0, 1, 5)
    assert_allclose(cut.displacement(x), expected.displacement(x), atol=1e-11)
    assert (cut.modes, cut.n, len(cut.frequency_errors)) == (modes, modes, modes)
    assert {field.name for field in fields(cut)} == {field.name for field in fields(Truth)}
    with pytest.raises(ValueError, match="read-only"):
        cut.mass[0, 0] = 1.0


def test_first_modes_refuses_what_it_cannot_cut() -> None:
    model = truth(arm_with(0.1), 3)
    for count in (0, 4, 1.5):
        with pytest.raises(InputError):
            first_modes(model, count)  # type: ignore[arg-type]


def test_last_rung_is_the_verdict_on_the_truth() -> None:
    case = case_of(FROM_HUB, basis="clamped-free", n=1)
    ladder, judged = spillover_ladder(case), evaluate(case).judgement
    last = ladder.rungs[-1]
    assert [rung.modes for rung in ladder.rungs] == list(range(1, 13))
    assert (last.stable, last.judgement.cost) == (judged.stable, judged.cost)
    for name in ("h2_loss", "gain_margin_db", "phase_margin_deg"):
        assert last.value(name) == read(judged, name).value
    assert ladder.stable_on_truth
    assert ladder.first_unstable is ladder.unstable_from is None
    assert "stable with N = 1 to 12" in str(ladder)


def test_each_rung_is_a_loop_of_its_own() -> None:
    """Every rung recomputed on a truth of its own, with its own optimum; none beats it."""
    case = case_of(FROM_TIP, basis="clamped-free", n=2)
    ladder = spillover_ladder(case)
    for rung in ladder.rungs[:3]:
        model = truth(case.arm, rung.modes)
        loop = close(model, case.objective, ladder.controller)
        assert_allclose(rung.frequency_hz, model.frequencies_hz[-1], rtol=1e-9)
        assert rung.stable == loop.stable
        assert_allclose(rung.judgement.cost, loop.h2.value, rtol=1e-7)
        best = lqg(generalised_plant(model, case.objective)).h2_cost
        assert_allclose(rung.judgement.optimum.h2_cost, best, rtol=1e-8)
        assert_allclose(rung.value("disk_margin"), loop.margins.disk.value, rtol=1e-5)
        assert rung.judgement.loss > -1e-7


def test_ladder_finds_the_neglected_mode() -> None:
    """From tip feedback, one mode known: the second one is lost as soon as it is there."""
    ladder = spillover_ladder(case_of(FROM_TIP), basis="hub-matched", n=1)
    assert (*ladder.origin, ladder.method) == ("hub-matched", 1, "lqg")
    lost = ladder.first_unstable
    assert lost is not None
    assert (lost.modes, ladder.unstable_from, ladder.stable_on_truth) == (2, 2, False)
    assert [lost.value(name) for name in QUANTITIES if name != "stable"] == [None] * (
        len(QUANTITIES) - 1
    )
    assert lost.judgement.optimum.h2_cost > 0
    found = lost.destabilised
    assert found is not None
    assert (found.number, found.neglected, found.method) == (2, True, "continuation")
    assert_allclose(found.frequency_hz, lost.frequency_hz, rtol=1e-12)
    assert_allclose(abs(found.pole) / (2 * np.pi), lost.judgement.unstable_hz[0], rtol=1e-9)
    assert "lost at N = 2: mode 2" in str(ladder)


def test_badly_modelled_mode_is_kept_not_neglected() -> None:
    """A slewing basis on a heavy hub has its first mode wrong: unstable before any spillover."""
    ladder = spillover_ladder(case_of(FROM_TIP), basis="slewing", n=1)
    first = ladder.rungs[0]
    assert not first.stable
    assert first.destabilised is not None
    assert (first.destabilised.number, first.destabilised.neglected) == (1, False)
    assert first.destabilised.method == "participation"
    assert first.destabilised.separation is None


def test_ladder_refuses_what_the_truth_cannot_judge() -> None:
    case = case_of(FROM_HUB)
    for changes in ({"n": 13}, {"n": 0}, {"basis": "slewng"}):
        with pytest.raises(InputError) as error:
            spillover_ladder(case, **changes)  # type: ignore[arg-type]
        assert error.value.remedy


@pytest.mark.parametrize("friction", [0.0, 1e-3])
@pytest.mark.parametrize("mode", [1, 2, 3, 5])
def test_mode_that_is_excited_on_purpose_is_found(mode: int, friction: float) -> None:
    model = truth(arm_with(0.003, friction), 8)
    loop = close(model, FROM_HUB, resonator(mode, model), sign=1)
    assert not loop.stable
    for kept in (0, mode - 1, mode, 8):
        found = destabilised_mode(loop, kept)
        assert found is not None
        assert (found.number, found.neglected) == (mode, mode > kept)
        assert found.pole.real > 0
        assert_allclose(found.pole.imag, model.omega[mode - 1], rtol=0.02)
        assert_allclose(found.frequency_hz, model.frequencies_hz[mode - 1], rtol=1e-12)
        assert found.participation > 0.2


def test_weak_feedback_agrees_with_perturbation_theory() -> None:
    """δλ = K(jω_k) θ_k²/(2jω_k) to first order, for a lagging controller of the hub angle."""
    model = truth(replace(arm_with(0.1), damping_ratio=1e-3), 6)
    theta, omega, band = model.mode_shapes[0], model.omega, 0.1 * model.omega[0]
    lead = control.tf([2 / band, 1], [1]) / control.tf([1 / (3 * band), 1], [1]) ** 2
    K = control.ss(-((band / theta[0]) ** 2) * lead)
    objective = Objective({"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 1e-3})
    named = control.StateSpace(K.A, K.B, K.C, K.D, inputs=["theta"], outputs=["torque"])
    shifts = np.array([K(1j * w) * t**2 / (2j * w) for w, t in zip(omega, theta[1:], strict=True)])
    growth = shifts.real - 1e-3 * omega
    found = destabilised_mode(close(model, objective, named, sign=1))
    assert found is not None
    assert growth.max() > 0
    assert found.number == 1 + np.argmax(growth)
    mode = found.number - 1
    assert_allclose(found.pole, 1j * omega[mode] - 1e-3 * omega[mode] + shifts[mode], rtol=2e-3)
    assert_allclose(found.pole.real, growth[mode], rtol=0.2)
    assert found.separation is not None
    assert found.separation > 0.1


def test_stable_loop_has_no_destabilised_mode() -> None:
    arm = arm_with(0.1944)
    plant = generalised_plant(assemble(arm, HubMatched(2)), FROM_HUB)
    assert destabilised_mode(close(truth(arm, 6), FROM_HUB, lqg(plant))) is None


def test_destabilised_mode_refuses_bad_counts() -> None:
    model = truth(arm_with(0.1), 4)
    loop = close(model, FROM_HUB, resonator(2, model), sign=1)
    for kept in (-1, 1.5):
        with pytest.raises(InputError):
            destabilised_mode(loop, kept)  # type: ignore[arg-type]
