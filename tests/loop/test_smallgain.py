"""Small gain on left-out modes: never wrong when it certifies, and it names the mode."""

from __future__ import annotations

import numpy as np
import pytest

from slewctl import (
    Arm,
    Beam,
    ClampedFree,
    Hub,
    InputError,
    KelvinVoigt,
    Loop,
    Model,
    Objective,
    Payload,
    Slewing,
    UnstableLoopError,
    assemble,
    close,
    generalised_plant,
    lqg,
    truth,
)
from slewctl.loop.robust.small_gain import LeftOut, small_gain, spillover
from slewctl.numerics.frequency_response import FrequencyResponse

BEAM = Beam(1.0, (1.0, -0.4), (1.0, -0.4))


def designed(
    arm: Arm,
    n: int,
    tight: float,
    sensors: tuple[str, ...] = ("theta", "tip"),
    basis: type = ClampedFree,
) -> tuple[Loop, Model]:
    """An LQG loop on the truth, and its design model; `tight` limits the tip."""
    model = assemble(arm, basis(n))
    noise = {"torque": 0.1, **dict.fromkeys(sensors, 1e-3)}
    objective = Objective({"tip": tight, "torque": 1.0}, noise)
    return close(truth(arm, 12), objective, lqg(generalised_plant(model, objective))), model


def arms() -> list[Arm]:
    hub, payload = Hub(0.05), Payload(0.1)
    return [
        Arm(BEAM, hub, payload, damping_ratio=0.005),
        Arm(BEAM, Hub(0.05, friction=0.2), payload, damping_ratio=0.005),
        Arm(BEAM, Hub(0.3, 0.1), damping=KelvinVoigt(1e-4), damping_ratio=1e-4),
    ]


LOOPS = [designed(arm, n, tight) for arm in arms() for n, tight in ((1, 0.3), (3, 0.01))]
UNSTABLE = [
    designed(Arm(BEAM, damping_ratio=0.003), 3, 0.1, ("theta",)),
    designed(Arm(BEAM, Hub(1e-3), damping_ratio=0.003), 2, 0.1),
    designed(Arm(BEAM, Hub(0.3), damping_ratio=0.003), 1, 0.01, ("tip",), Slewing),
]
LOOPS += UNSTABLE


@pytest.mark.parametrize(("loop", "design"), LOOPS)
def test_the_parts_add_up_to_the_difference(loop: Loop, design: Model) -> None:
    """Rigid bodies cancel, so the flexible parts differ by what the whole models differ."""
    parts = LeftOut.of(loop, design)
    assert len(parts.truth) == loop.model.n
    assert sum(part.states for part in parts.truth) >= 2 * loop.model.n
    omega = np.geomspace(0.3 * loop.model.omega[0], 2 * loop.model.omega[-1], 40)
    reduced = generalised_plant(design, loop.objective).control_path
    expected = FrequencyResponse(loop.plant.control_path)(omega) - FrequencyResponse(reduced)(omega)
    found = FrequencyResponse(parts.difference.system)(omega)
    by_modes = sum(FrequencyResponse(parts.of_mode(k).system)(omega) for k in range(loop.model.n))
    size = np.abs(FrequencyResponse(reduced)(omega)).max()
    assert np.abs(found - expected).max() < 1e-9 * size
    assert np.abs(by_modes - found).max() < 1e-9 * size


@pytest.mark.parametrize(("loop", "design"), LOOPS)
def test_value_is_the_largest_of_k_s_delta_over_frequency(loop: Loop, design: Model) -> None:
    """K(I − PK)⁻¹Δ evaluated from transfer functions, with the design loop closed by hand."""
    found = small_gain(loop, design)
    omega = 2 * np.pi * found.frequency_hz * np.array([0.7, 0.999, 1.0, 1.001, 1.4])
    P = FrequencyResponse(generalised_plant(design, loop.objective).control_path)(omega)
    G = FrequencyResponse(loop.plant.control_path)(omega)
    K = FrequencyResponse(loop.controller.system)(omega)
    columns = (len(omega), -1, 1)
    P, G, K = P.reshape(columns), G.reshape(columns), K.reshape(len(omega), 1, -1)
    values = np.abs([
        (k @ np.linalg.solve(np.eye(len(p)) - p @ k, g - p))[0, 0]
        for p, g, k in zip(P, G, K, strict=True)
    ])  # fmt: skip
    assert values[2] == pytest.approx(found.value, rel=1e-5)
    assert values.max() <= found.value * (1 + 1e-6)
    assert found.certified == (found.value < 1)
    assert not (found.certified and not loop.stable)


@pytest.mark.slow
@pytest.mark.parametrize(("loop", "design"), LOOPS)
def test_the_critical_share_is_where_the_poles_cross(loop: Loop, design: Model) -> None:
    """Shares of Δ between the design model and the truth, closed by brute force."""
    found = spillover(loop, design)
    seen = LeftOut.of(loop, design).seen(LeftOut.of(loop, design).difference)

    def growth(share: float) -> float:
        return float(np.linalg.eigvals(seen.A + share * seen.B @ seen.C).real.max())

    assert growth(0.0) < 0
    assert (growth(1.0) < 0) == loop.stable
    if np.isfinite(found.critical_scale):
        assert (
            growth(found.critical_scale * (1 - 1e-6))
            < 0
            < growth(found.critical_scale * (1 + 1e-6))
        )
    if not loop.stable:
        assert found.critical_scale <= 1
    assert found.critical_scale >= 1 / small_gain(loop, design).value * (1 - 1e-6)
    for mode in found.modes:
        assert mode.critical_scale >= 1 / mode.gain * (1 - 1e-6) if mode.gain else True
        assert not (mode.spills_over and mode.gain < 1)
    assert found.worst.gain == max(mode.gain for mode in found.modes)
    assert [mode.modelled for mode in found.modes] == [k < design.n for k in range(loop.model.n)]


@pytest.mark.slow
@pytest.mark.parametrize(("loop", "design"), UNSTABLE)
def test_the_mode_that_spills_over_is_named(loop: Loop, design: Model) -> None:
    assert not loop.stable
    found = spillover(loop, design)
    number = int(np.argmin(np.abs(loop.model.frequencies_hz - found.critical_hz))) + 1
    assert found.first == f"mode {number} ({loop.model.frequencies_hz[number - 1]:.4g} Hz)"
    assert found.modes[number - 1].spills_over
    assert min(abs(hertz / found.critical_hz - 1) for hertz in loop.unstable_hz) < 0.1
    assert small_gain(loop, design).value > 1


def test_a_design_on_the_truth_itself_leaves_nothing_out() -> None:
    arm = arms()[0]
    model = truth(arm, 4)
    objective = Objective({"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 1e-3})
    loop = close(model, objective, lqg(generalised_plant(model, objective)))
    assert small_gain(loop, model).value < 1e-6
    found = spillover(loop, model)
    assert found.critical_scale == np.inf
    assert found.first == ""
    assert not any(mode.spills_over for mode in found.modes)


def test_what_has_no_answer_is_refused() -> None:
    loop, design = LOOPS[0]
    with pytest.raises(InputError, match="same rigid body"):
        small_gain(loop, assemble(Arm(BEAM, Hub(0.06), Payload(0.1), 0.005), ClampedFree(1)))
    with pytest.raises(InputError, match="not a Model"):
        small_gain(loop, "model")
    with pytest.raises(InputError, match="continuous controller"):
        small_gain("loop", design)
    with pytest.raises(InputError, match="undamped"):
        small_gain(*designed(Arm(BEAM, Hub(0.05)), 1, 0.3))
    loop, _ = UNSTABLE[0]
    with pytest.raises(UnstableLoopError, match="design model"):
        small_gain(loop, assemble(loop.model.arm, ClampedFree(10)))
