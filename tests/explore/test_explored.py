"""What the sliders do to a design file, and that what is then seen is what the gate says of it."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slewctl.arm import ModalData, catalogue, vary
from slewctl.basis import MODAL
from slewctl.check import judge_at_once
from slewctl.compare import Judge, evaluate, read
from slewctl.errors import SlewctlError
from slewctl.explore import Knob, changed_text, explored, knobs_of
from slewctl.explore.knobs import DAMPING, DELAY, SAMPLE_TIME, STIFFNESS
from slewctl.explore.result import before, seen_ladder
from slewctl.files import DesignFile, design_of_text, example_design, find_designs, read_design
from slewctl.files.starters import STARTERS, starter_files
from slewctl.gate import verdicts
from slewctl.report.explorer import with_ladder

DESIGNS = Path(__file__).parents[2] / "designs"
FILES = [*find_designs([DESIGNS]), *find_designs([DESIGNS / "rigs"])]


def knobs(design: DesignFile) -> tuple[Knob, ...]:
    return knobs_of(design, Judge(design.case).truth)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_file_stands_among_what_its_keys_may_be_given(path: Path) -> None:
    design = read_design(path)
    found = knobs(design)
    assert len({knob.key for knob in found}) == len(found) >= 5
    for knob in found:
        assert knob.value in knob.values
        assert len({knob.text(value) for value in knob.values}) == len(knob.values)
        if knob.key != "model.basis":
            assert list(knob.values) == sorted(knob.values)
    # A design is turned by its model and its speed; a given law by its gains, if it has some.
    given = design.case.is_given
    assert ("model.n" in {knob.key for knob in found}) != given


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_file_of_which_nothing_is_changed_is_the_file(path: Path) -> None:
    design = read_design(path)
    assert changed_text(design, {}) == design.source.text


@pytest.mark.slow
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_changed_key_is_the_only_one_that_changes(path: Path) -> None:
    design = read_design(path)
    for knob in knobs(design):
        if knob.key in (STIFFNESS, DAMPING, "model.basis"):
            continue
        place = knob.values.index(knob.value)
        value = knob.values[place + 1 if place + 1 < len(knob.values) else place - 1]
        text = changed_text(design, {knob.key: value})
        assert at(tomllib.loads(text), knob.key) == value
        there, here = (flat(tomllib.loads(t)) for t in (design.source.text, text))
        changed = {key for key in there.keys() | here.keys() if there.get(key) != here.get(key)}
        assert changed == {knob.key}
        assert comments(text) == comments(design.source.text)


@pytest.mark.slow
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
def test_stiffness_and_damping_are_those_of_a_varied_arm(path: Path, factor: float) -> None:
    design = read_design(path)
    arm = design.case.arm
    text = changed_text(design, {STIFFNESS: factor})
    stiffer = design_of_text(text, path).case.arm
    expected = vary(arm, stiffness_factor=factor) if not isinstance(arm.beam, ModalData) else None
    if expected is None:
        assert stiffer.beam.frequencies_hz == pytest.approx(
            np.sqrt(factor) * np.array(arm.beam.frequencies_hz), rel=1e-11
        )
    else:
        x = np.linspace(0.0, 1.0, 7)
        for profile in ("mass_profile", "stiffness_profile"):
            here, there = (getattr(each.beam, profile)(x) for each in (stiffer, expected))
            np.testing.assert_allclose(here, there, rtol=1e-11)
        for part in ("hub", "payload", "motor", "joint", "actuator", "sensors", "damping_ratio"):
            assert getattr(stiffer, part) == getattr(arm, part)
    if any(knob.key == DAMPING for knob in knobs(design)):
        text = changed_text(design, {DAMPING: factor})
        damped = design_of_text(text, path).case.arm.damping_ratio
        np.testing.assert_allclose(damped, factor * np.array(arm.damping_ratio), rtol=1e-11)


@pytest.mark.parametrize("origin", STARTERS)
def test_every_file_to_begin_with_can_be_explored(origin: str, tmp_path: Path) -> None:
    for name, text in starter_files(origin, "arm.toml").items():
        (tmp_path / name).write_text(text)
    found = explored(tmp_path / "arm.toml", {STIFFNESS: 1.26}, confirm=False)
    assert found.result.chosen.stable
    assert comments(changed_text(read_design(tmp_path / "arm.toml"), {"model.n": 1}))


def test_no_clock_takes_its_delay_out_of_the_file() -> None:
    design = read_design(DESIGNS / "06-sampled-lqg-with-delay.toml")
    text = changed_text(design, {SAMPLE_TIME: 0.0, DELAY: 0.002})
    assert {"sample_time", "delay"}.isdisjoint(tomllib.loads(text)["controller"])
    assert design_of_text(text, design.path).case.options == {}


def test_a_table_that_is_missing_is_made_where_it_is_needed() -> None:
    design = read_design(example_design())
    text = changed_text(design, {"arm.actuator.delay": 0.01, "arm.payload.mass": 0.0})
    assert 'catalogue = "paper-beam"' in text
    arm = design_of_text(text, design.path).case.arm
    assert arm.actuator is not None
    assert (arm.actuator.delay, arm.payload.mass) == (0.01, 0.0)


@cache
def all_designs() -> list[DesignFile]:
    return [*map(read_design, FILES), *map(of_catalogue, catalogue.names())]


@given(data=st.data())
@settings(max_examples=15)
def test_what_is_set_is_read_again_or_refused_in_one_line(data: st.DataObject) -> None:
    design = data.draw(st.sampled_from(all_designs()))
    chosen = {k.key: data.draw(st.sampled_from(k.values), k.key) for k in knobs(design)}
    if not chosen.get(SAMPLE_TIME, 1.0):
        chosen.pop(DELAY, None)
    text = changed_text(design, chosen)
    try:
        again = design_of_text(text, design.path)
    except SlewctlError as error:
        refusal = str(error)
        assert len(refusal.splitlines()) == 1
        return
    arm, case = again.case.arm, again.case
    for key, value in chosen.items():
        if key == "arm.hub.inertia":
            assert arm.hub.inertia == value
        elif key == "arm.payload.mass":
            assert arm.payload.mass == value
        elif key == "arm.damping_ratio":
            assert arm.damping_ratio == value
        elif key == DAMPING:
            np.testing.assert_allclose(
                arm.damping_ratio, value * np.array(design.case.arm.damping_ratio), rtol=1e-11
            )
        elif key == "arm.actuator.delay":
            assert (arm.actuator.delay if arm.actuator else 0.0) == value
        elif key == "model.n":
            assert case.n == value
        elif key == "model.basis":
            assert case.basis in (value, MODAL)
        elif key in (SAMPLE_TIME, DELAY):
            assert (case.options.get(key.partition(".")[2]) or 0.0) == value
        elif key.startswith("controller.limits."):
            assert case.objective.limits[key.rpartition(".")[2]] == value
        elif key != STIFFNESS:
            assert at(tomllib.loads(text), key) == value


def of_catalogue(name: str) -> DesignFile:
    """Return a design for an arm of the catalogue of which the file says nothing."""
    objective = "limits = { theta = 0.1, torque = 1.0 }\nnoise = { torque = 0.1, theta = 0.001 }"
    basis = MODAL if isinstance(catalogue.get(name).beam, ModalData) else "polynomial"
    text = f"""[arm]\ncatalogue = "{name}"
[model]\nbasis = "{basis}"\nn = 1
[controller]\nmethod = "lqg"\n{objective}\n"""
    return design_of_text(text, Path(f"{name}.toml"))


def test_what_the_catalogue_gives_can_be_taken_away() -> None:
    for name in catalogue.names():
        if isinstance(catalogue.get(name).beam, ModalData):
            continue
        design = of_catalogue(name)
        nothing = {"arm.hub.inertia": 0.0, "arm.payload.mass": 0.0, "arm.payload.inertia": 0.0}
        arm = design_of_text(changed_text(design, nothing), design.path).case.arm
        assert (arm.hub.inertia, arm.payload.mass) == (0.0, 0.0)
        text = changed_text(design, {DAMPING: 2.0})
        np.testing.assert_allclose(
            design_of_text(text, design.path).case.arm.damping_ratio,
            2 * np.array(design.case.arm.damping_ratio),
        )


def test_an_arm_without_damping_has_no_slider_of_a_factor() -> None:
    design = of_catalogue("paper-beam")
    text = changed_text(design, {}).replace("[model]", "damping_ratio = [0.0, 0.0]\n[model]")
    assert DAMPING not in {knob.key for knob in knobs(design_of_text(text, design.path))}


@pytest.mark.slow
def test_what_is_confirmed_is_what_the_gate_says_of_the_saved_file(tmp_path: Path) -> None:
    found = explored(DESIGNS / "12-any-payload.toml", {"arm.hub.inertia": 0.25, "model.n": 1})
    path = tmp_path / "saved.toml"
    path.write_text(found.text)
    saved = read_design(path)
    gate = verdicts(saved, evaluate(saved.case).judgement)
    assert [(f.arm, f.verdict) for f in found.findings] == [(f.arm, f.verdict) for f in gate]
    assert {f.arm for f in gate} == {"nominal", "loaded"}
    assert found.confirmed
    assert found.holds
    assert found.result.ladders[0].rungs[-1].modes == saved.case.truth_modes


def test_a_first_look_is_of_one_truth_and_says_so() -> None:
    path, set_to = DESIGNS / "03-boom-with-payload.toml", {"model.n": 2}
    found = explored(path, set_to, confirm=False)
    judgement = found.result.chosen.judgement
    for finding in found.findings:
        verdict = finding.verdict
        assert verdict.value == read(judgement, verdict.quantity.name).value
        assert [modes for modes, _ in verdict.seen] == [found.result.case.truth_modes]
    assert "being confirmed" in found.body()
    held = explored(path, set_to, confirm=False, ladder=False).body()
    assert held.count("<figure") == found.body().count("<figure")
    assert held != found.body() == with_ladder(held, seen_ladder(found.design))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("06-sampled-lqg-with-delay", {"model.n": 1}),
        ("14-given-pid", {"arm.actuator.delay": 0.002}),
        ("rigs/satellite-from-modal-data", {"controller.limits.torque": 2.0}),
    ],
)
def test_the_ladder_of_a_first_look_is_the_climbed_one(name: str, settings: dict) -> None:
    path = DESIGNS / f"{name}.toml"
    seen, climbed = (
        explored(path, settings, confirm=proved).result.ladders[-1] for proved in (False, True)
    )
    known_at = {rung.modes: rung for rung in climbed.rungs}
    assert (seen.rungs[0].modes, seen.rungs[-1].modes) == (min(known_at), max(known_at))
    assert seen.unstable_from == climbed.unstable_from
    for at_once in seen.rungs:
        proved = known_at[at_once.modes]
        assert at_once.stable == proved.stable
        # What is seen of a margin is never below what is proved of it.
        margin, known = at_once.value("disk_margin"), proved.value("disk_margin")
        assert (margin is None) == (known is None) == (not proved.stable)
        assert margin is None or known * (1 - 1e-9) <= margin <= known * 1.001
        loss, known = at_once.value("h2_loss"), proved.value("h2_loss")
        assert (loss is None) == (known is None)
        assert loss is None or loss == pytest.approx(known, rel=1e-5, abs=1e-6)


def test_an_unstable_loop_fails_at_once() -> None:
    late = {"arm.actuator.delay": 0.05, "controller.pid.kp": 60.0}
    found = explored(DESIGNS / "14-given-pid.toml", late, confirm=False)
    assert not found.result.chosen.stable
    failed = judge_at_once(found.result.chosen.judgement, {"gain_margin_db": 0.0})
    assert [verdict.passed for verdict in failed] == [False, False]
    assert "unstable" in found.body()


def test_the_file_itself_stays_beside_what_is_set() -> None:
    design = read_design(example_design())
    own = before(design)
    found = explored(design, {"model.n": 3}, beside=own, confirm=False)
    labels = [str(curve.origin) for curve in found.result.curves]
    assert labels == ["as in the file: clamped-free, n = 1", "clamped-free, n = 3"]
    np.testing.assert_array_equal(found.result.curves[0].gain_db, own.curves[0].gain_db)
    assert all(label in found.body() for label in labels)
    assert [ladder.origin for ladder in found.result.ladders] == [
        curve.origin for curve in found.result.curves
    ]
    assert before(read_design(DESIGNS / "14-given-pid.toml")) is None


def test_a_line_that_stays_is_written_once_and_the_same() -> None:
    design = read_design(example_design())
    settings = {"controller.limits.torque": 1.3}
    own = before(design)
    first = explored(design, settings, beside=own, confirm=False).body()
    explored(design, {"arm.hub.inertia": 0.3}, beside=own, confirm=False).body()
    again = explored(design, settings, beside=own, confirm=False).body()
    fresh = explored(design, settings, beside=before(design), confirm=False).body()
    assert first == again == fresh


def test_a_notebook_gets_the_whole_page_in_a_frame() -> None:
    shown = explored(example_design())._repr_html_()
    assert shown.startswith("<iframe")
    assert "&lt;script&gt;" in shown
    assert "https://" not in shown
    assert "http://" not in shown.replace("http://www.w3.org", "")


def at(content: dict, key: str) -> object:
    for name in key.split("."):
        content = content[name]
    return content


def flat(content: object, way: str = "") -> dict[str, object]:
    if not isinstance(content, dict):
        return {way[1:]: content}
    return {k: v for name, item in content.items() for k, v in flat(item, f"{way}.{name}").items()}


def comments(text: str) -> list[str]:
    return [line.partition("#")[2] for line in text.splitlines() if "#" in line]


def test_wings_are_turned_together(tmp_path: Path) -> None:
    path = tmp_path / "wings.toml"
    path.write_text(WINGS, encoding="utf-8")
    design = read_design(path)
    found = knobs(design)
    assert {STIFFNESS, DAMPING} < {knob.key for knob in found}
    text = changed_text(design, {STIFFNESS: 4.0, DAMPING: 2.0})
    assert comments(text) == [" of the data sheet"]
    wings = tomllib.loads(text)["arm"]["wings"]
    assert [wing["frequencies_hz"] for wing in wings.values()] == [[0.4], [0.6, 2.0]]
    assert [wing["damping_ratio"] for wing in wings.values()] == [0.01, 0.02]
    once = design.case.arm.beam
    twice = design_of_text(text, path).case.arm.beam
    np.testing.assert_allclose(twice.frequencies_hz, 2 * np.array(once.frequencies_hz))


WINGS = """
[arm]
hub = { inertia = 600.0 }
[arm.wings.left]
inertia = 300.0
frequencies_hz = [0.2] # of the data sheet
coupling = [14.0]
damping_ratio = 0.005
[arm.wings.right]
inertia = 250.0
frequencies_hz = [0.3, 1.0]
coupling = [10.0, 3.0]
damping_ratio = 0.01
[model]
basis = "modal"
n = 1
[controller]
method = "lqg"
limits = { theta = 0.01, torque = 5.0 }
noise = { torque = 0.5, theta = 1e-4, theta_dot = 1e-4 }
"""
