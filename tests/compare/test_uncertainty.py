"""The worst arm of a box: rerun, compared with a dense search, and the same every time."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest

from slewctl import (
    Arm,
    Beam,
    ClampedFree,
    Controller,
    Hub,
    InputError,
    Loop,
    Objective,
    Payload,
    assemble,
    close,
    generalised_plant,
    lqg,
    truth,
)
from slewctl.arm import vary
from slewctl.compare import QUANTITIES, Case, Yardstick, evaluate, quantities_of, read
from slewctl.compare.arm_box import PROPERTIES
from slewctl.compare.worst_arm import WorstCase, worst_case

pytestmark = pytest.mark.xdist_group("worst arm")
ARM = Arm(Beam(1.0, 1.0, 1.0), Hub(0.2, friction=0.05), Payload(0.05), damping_ratio=0.01)
CASE = Case(
    "trial",
    ARM,
    Objective({"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 1e-2, "tip": 1e-2}),
    n=2,
    truth_modes=5,
    orders=(2,),
)
BOX = {"stiffness_factor": (0.7, 1.3), "payload_mass": (0.0, 0.4)}


@cache
def controller() -> Controller:
    """The case's own controller."""
    return lqg(generalised_plant(assemble(CASE.arm, ClampedFree(CASE.n)), CASE.objective))


def rerun(found: WorstCase) -> Loop:
    """The case's own controller on the worst arm, without the search."""
    return close(truth(found.arm, CASE.truth_modes), CASE.objective, controller())


@pytest.fixture(scope="module")
def found() -> WorstCase:
    return worst_case(CASE, BOX, samples=8, searches=1, evaluations=25)


def test_the_worst_arm_can_be_rerun(found: WorstCase) -> None:
    assert found.arm == vary(ARM, **found.properties)
    loop = rerun(found)
    assert loop.stable == found.stable
    assert found.stable
    assert found.confirmed
    assert loop.margins.disk.value == pytest.approx(found.value, rel=1e-9)
    assert loop.margins.disk.frequency_hz == pytest.approx(found.frequency_hz, rel=1e-6)


def test_nothing_tried_is_worse_and_the_nominal_arm_is_the_case_itself(found: WorstCase) -> None:
    assert found.value == min(trial.value for trial in found.trials)
    assert {trial.how for trial in found.trials} == {"corner", "sample", "search"}
    assert found.tried == len({tuple(trial.properties.values()) for trial in found.trials})
    assert found.unstable == 0
    margins = evaluate(CASE).judgement.margins
    assert found.nominal.value == pytest.approx(margins.disk.value, rel=1e-9)
    for trial in found.trials:
        for name, (low, high) in BOX.items():
            assert low <= trial.properties[name] <= high


def test_corners_are_tried_to_the_last_bit(found: WorstCase) -> None:
    tried = [tuple(trial.properties.values()) for trial in found.trials if trial.how == "corner"]
    assert sorted(tried) == sorted(product(*BOX.values()))


@pytest.mark.slow
def test_no_arm_of_a_dense_grid_is_much_worse(found: WorstCase) -> None:
    lowest = np.inf
    for stiffness, mass in product(np.linspace(0.7, 1.3, 11), np.linspace(0.0, 0.4, 11)):
        varied = vary(ARM, stiffness_factor=float(stiffness), payload_mass=float(mass))
        loop = rerun(replace(found, arm=varied))
        lowest = min(lowest, loop.margins.disk.value if loop.stable else -1.0)
    assert found.value <= lowest * (1 + 1e-3)


def test_the_same_seed_gives_the_same_answer() -> None:
    options = {"samples": 4, "searches": 1, "evaluations": 6}
    one, two = (worst_case(CASE, BOX, **options, seed=3) for _ in range(2))
    assert [t.properties for t in one.trials] == [t.properties for t in two.trials]
    assert [t.value for t in one.trials] == [t.value for t in two.trials]
    other = worst_case(CASE, BOX, **options, seed=4)
    assert [t.properties for t in other.trials] != [t.properties for t in one.trials]


def test_a_larger_box_is_never_better() -> None:
    options = {"samples": 0, "searches": 0}
    inner = worst_case(CASE, {"payload_mass": (0.0, 0.2)}, **options)
    outer = worst_case(
        CASE, {"payload_mass": (0.0, 0.2), "stiffness_factor": (1.0, 1.3)}, **options
    )
    assert outer.value <= inner.value
    assert inner.at_corner
    assert inner.tried == 2
    assert outer.tried == 4


def test_an_unstable_arm_is_worse_than_any_stable_one() -> None:
    """Half of the stiffness is more than the controller bears; the growth rate says how much."""
    found = worst_case(
        CASE, {"stiffness_factor": (0.02, 1.0)}, samples=4, searches=1, evaluations=10
    )
    assert not found.stable
    assert 0 < found.unstable < found.tried
    assert found.value < 0
    loop = rerun(found)
    assert not loop.stable
    assert float(loop.poles.real.max()) == pytest.approx(-found.value, rel=1e-6)
    assert found.frequency_hz == pytest.approx(loop.unstable_hz[0], rel=1e-6)
    assert "UNSTABLE" in str(found)
    ranked = sorted(found.trials, key=lambda trial: trial.value)
    assert [trial.stable for trial in ranked] == sorted(trial.stable for trial in ranked)
    # A table has no margin of a loop that is not stable.
    for row in found.rows():
        assert (row["disk_margin"] is None) == (row["growth_per_s"] is not None)
        assert (row["growth_per_s"] is None) == row["stable"]


@pytest.mark.slow
@pytest.mark.parametrize("quantity", [q.name for q in quantities_of(CASE.slew) if q.unit != "V"])
def test_every_quantity_can_be_the_one_that_is_worst(quantity: str) -> None:
    found = worst_case(CASE, {"payload_mass": (0.0, 0.1)}, quantity=quantity, samples=1, searches=0)
    model = truth(found.arm, CASE.truth_modes)
    again = Yardstick(model, CASE.objective).judge(rerun(found).controller, CASE.slew)
    assert found.value == pytest.approx(read(again, quantity).value, rel=1e-6)
    extreme = min if QUANTITIES[quantity].better == "greater" else max
    assert found.value == extreme(trial.value for trial in found.trials)
    assert found.quantity == quantity
    assert quantity in str(found)


def test_a_loop_of_ones_own_controller_is_judged_likewise() -> None:
    own = lqg(generalised_plant(assemble(ARM, ClampedFree(2)), CASE.objective)).system
    loop = close(truth(ARM, 20), CASE.objective, own, sign=1)
    found = worst_case(loop, {"damping_factor": (0.5, 2.0)}, samples=0, searches=0)
    assert found.modes == 20
    assert found.nominal.value == pytest.approx(loop.margins.disk.value, rel=1e-9)


@pytest.mark.parametrize(
    ("box", "where"),
    [
        ({}, "box"),
        ([("payload_mass", (0, 1))], "box"),
        ({"payload": (0.0, 1.0)}, "box.payload"),
        ({"payload_mass": 1.0}, "box.payload_mass"),
        ({"payload_mass": (0.0, 1.0, 2.0)}, "box.payload_mass"),
        ({"payload_mass": (1.0, 1.0)}, "box.payload_mass"),
        ({"payload_mass": (0.0, np.nan)}, "box.payload_mass"),
        ({"payload_mass": (-1.0, 1.0)}, "box.payload_mass"),
        ({"stiffness_factor": (0.0, 1.0)}, "box.stiffness_factor"),
        ({"damping_factor": (1.0, 200.0)}, "box.damping_factor"),
        (
            {"payload_mass": (0.0, 1.0), "payload_mass_factor": (1.0, 2.0)},
            "box.payload_mass_factor",
        ),
    ],
)
def test_impossible_boxes_are_refused_by_name(box: object, where: str) -> None:
    with pytest.raises(InputError) as error:
        worst_case(CASE, box)
    assert error.value.where == where
    assert error.value.remedy


def test_other_wrong_arguments_are_refused() -> None:
    box = {"payload_mass": (0.0, 1.0)}
    with pytest.raises(InputError, match="quantity"):
        worst_case(CASE, box, quantity="disk")
    with pytest.raises(InputError, match="samples"):
        worst_case(CASE, box, samples=-1)
    with pytest.raises(InputError, match="neither a Case nor a Loop"):
        worst_case(ARM, box)
    assert set(BOX) < set(PROPERTIES)


@pytest.mark.parametrize(
    ("option", "given"),
    [
        ("seed", {"samples": 0, "seed": 1}),
        ("evaluations", {"searches": 0, "evaluations": 5}),
    ],
)
def test_an_option_of_a_search_that_is_not_made_is_refused(
    option: str, given: dict[str, int]
) -> None:
    with pytest.raises(InputError, match="means nothing") as refusal:
        worst_case(CASE, BOX, **given)
    assert refusal.value.where == option
