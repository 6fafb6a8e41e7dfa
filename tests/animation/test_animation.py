"""Slews that move: the shape drawn is the arm's, nothing is cut off, files are whole."""

from __future__ import annotations

import io
import json
import math
import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from PIL import Image

import slewctl as sc
from slewctl.animation.animation import Animation
from slewctl.animation.movement import FRAMES, STATIONS, Movement, frames_of
from slewctl.animation.scene import PANE, Scene
from slewctl.errors import InputError
from slewctl.loop import Simulation


def turn(bent: float = 0.02, end: float = 4.0, frames: int = 81) -> Movement:
    t = np.linspace(0.0, end, frames)
    x = np.linspace(0.1, 1.1, STATIONS)
    wave = bent * np.sin(2 * math.pi * t / end)
    shape = (x - 0.1) ** 2
    angle = t / end * math.pi / 2
    curves = {"torque (N·m)": (t, wave)}
    return Movement(t, angle, angle, x, np.multiply.outer(wave, shape), curves)


def _slew_of(arm: sc.Arm, basis: str) -> Simulation:
    limits, noise = {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01}
    problem = sc.Problem(arm, limits, noise, slew=sc.Slew(30.0, 4.0))
    return problem.simulate(sc.lqg(problem.plant(basis, n=1)))


@pytest.fixture(scope="module")
def slew() -> Simulation:
    hub = sc.Hub(0.2, radius=0.05)
    return _slew_of(sc.Arm(sc.arms.paper_beam().beam, hub, damping_ratio=0.01), "clamped-free")


def test_the_shape_drawn_is_the_truths(slew: Simulation) -> None:
    shown = slew.movement
    at = np.searchsorted(slew.t, shown.t)
    np.testing.assert_array_equal(slew.t[at], shown.t)
    np.testing.assert_allclose(shown.bent[:, -1], slew.tip_deflection[at], atol=1e-12)
    arc = shown.reach * shown.theta + shown.bent[:, -1]
    np.testing.assert_allclose(arc, slew.tip[at], atol=1e-12)
    np.testing.assert_allclose(shown.bent[:, 0], 0.0, atol=1e-15)
    # Clamped at the hub: the beam leaves it along the arm's own direction.
    slope = np.abs(shown.bent[:, 1]) / shown.x[1]
    assert slope.max() < 0.1 * np.abs(shown.bent[:, -1]).max() / shown.reach
    assert (shown.x[0], shown.x[-1]) == (0.05, 1.05)


def test_a_rigid_arm_turns_on_a_circle() -> None:
    still = turn(bent=0.0)
    points = still.points(magnified=50.0)
    np.testing.assert_allclose(np.hypot(*points.T), still.x[:, None] * np.ones(81), rtol=1e-14)
    np.testing.assert_allclose(points[:, [0, -1]], still.rigid(), atol=1e-15)


def test_between_two_pictures_and_after_the_end() -> None:
    one = turn()
    later = one.at(np.array([0.0, 0.025, 99.0]))
    np.testing.assert_allclose(later.theta, [0.0, one.theta[1] / 2, one.theta[-1]])
    np.testing.assert_allclose(later.bent[1], one.bent[1] / 2)


def test_frames_follow_what_moves_and_hold_both_ends() -> None:
    t = np.sort(np.random.default_rng(1).uniform(0, 60, 50_000))
    moving = np.stack([np.tanh(t), np.exp(-t / 4) * np.sin(2 * np.pi * 4 * t)], axis=1)
    found = frames_of(t, moving)
    assert (found[0], found[-1]) == (0, len(t) - 1)
    assert len(found) < FRAMES
    for column in moving.T:
        drawn = np.interp(t, t[found], column[found])
        assert np.abs(column - drawn).max() <= 0.021 * np.ptp(column)
    fast = np.sin(2 * np.pi * 40 * t)[:, None]
    assert len(frames_of(t, fast)) == FRAMES  # more than is drawn: its caption says so
    assert frames_of(np.array([0.0, 1.0]), np.zeros((2, 1))).tolist() == [0, 1]


def test_everything_is_in_the_picture() -> None:
    scene = Scene([turn(0.3), turn(0.02, end=2.0)], ["a", "b"], 3.0)
    for one in scene.movements:
        for seen in (one.points(3.0), one.rigid()):
            x, y = np.moveaxis(scene.placed(seen), -1, 0)
            assert 0 < x.min() <= x.max() < PANE
            assert 0 < y.min() <= y.max() < scene.height
    assert scene.end == 4.0
    assert Scene([turn(end=0.05)], ["fast"], 1.0).slowed == 50.0
    assert scene.slowed == 1.0


def test_curves_keep_their_peaks() -> None:
    t = np.linspace(0, 4.0, 100_001)
    spike = np.where(np.arange(len(t)) == 41_234, 7.0, np.sin(t))
    scene = Scene([replace(turn(), curves={"torque": (t, spike)})], ["a"], 1.0)
    ((kept, values),) = scene.curves["torque"]
    assert len(kept) <= 602
    assert values.max() == 7.0
    assert values.min() == spike.min()
    assert (kept[0], kept[-1]) == (0.0, 4.0)
    assert np.all(np.diff(kept) > 0)


@pytest.mark.parametrize(("bent", "factor"), [(0.5, 1.0), (0.02, 5.0), (2e-6, 5e4), (0.0, 1.0)])
def test_deflections_are_magnified_so_that_they_are_seen(bent: float, factor: float) -> None:
    animation = Animation([turn(bent)], ["a"])
    assert animation.magnified == factor
    assert ("to scale" in animation.caption) == (factor == 1)
    assert Animation([turn(bent)], ["a"], magnify=2.5).magnified == 2.5


def test_a_page_of_its_own_is_well_formed_and_harmless(tmp_path: Path, slew: Simulation) -> None:
    name = '</script><b> & "x"'
    path = slew.animate(slew, names=[name, "b"]).save(tmp_path / "slew.html")
    text = path.read_text("utf-8")
    assert name not in text
    assert "&lt;/script&gt;&lt;b&gt; &amp; &quot;x&quot;" in text
    assert "http" not in text
    for picture in re.findall(r"<svg.*?</svg>", text, re.DOTALL):
        ET.fromstring(picture)
    (data,) = re.findall(r'<script type="application/json">(.*?)</script>', text, re.DOTALL)
    arms = json.loads(data)["arms"]
    assert len(arms) == 2
    assert len(arms[0]["bent"]) == len(arms[0]["t"]) * STATIONS
    assert slew.animate()._repr_html_().startswith('<figure class="slew-motion">')
    assert repr(slew.animate(names=["a"])) == "<animation of a, 12 s>"


@pytest.mark.slow
def test_a_gif_lasts_as_long_as_the_slew_and_begins_at_its_start(tmp_path: Path) -> None:
    for end, lasting in ((4.0, 4.0), (0.1, 2.0)):
        one = turn(end=end)
        path = Animation([one], ["a"]).save(tmp_path / "slew.gif")
        pane = round(Scene([one], ["a"], 5.0).height)
        picture = Image.open(io.BytesIO(path.read_bytes()))
        total = 0
        for k in range(picture.n_frames):
            picture.seek(k)
            total += picture.info["duration"]
        assert total / 1000 == pytest.approx(lasting, abs=0.06)
        picture.seek(0)
        first = np.asarray(picture.convert("RGB")).astype(int)
        blue = np.argwhere(np.abs(first[:pane] - [0, 114, 178]).sum(axis=2) < 40)
        # At the start the arm points to the right: wide and flat.
        assert np.ptp(blue[:, 1]) > 200
        assert np.ptp(blue[:, 0]) < 8
        assert (first[2, 2] == 255).all()


@pytest.mark.slow
def test_what_cannot_be_animated_is_refused(tmp_path: Path, slew: Simulation) -> None:
    with pytest.raises(InputError, match=r"slew\.mp4: \.mp4 is no kind of animation"):
        slew.animate().save(tmp_path / "slew.mp4")
    with pytest.raises(InputError, match="cannot be written"):
        slew.animate().save(tmp_path / "none" / "slew.gif")
    with pytest.raises(InputError, match=r"names: .* give one name each"):
        slew.animate(names=["a", "b"])
    for wrong in ("a", 5, [3], [None], {"a"}):
        with pytest.raises(InputError, match="names"):
            slew.animate(names=wrong)  # type: ignore[arg-type]
    for movements in ([], [turn()] * 3, [replace(turn(), bent=np.full((81, STATIONS), np.nan))]):
        with pytest.raises(InputError, match=r"^movements: "):
            Animation(movements, ["a"] * len(movements))
    with pytest.raises(InputError, match="magnify"):
        slew.animate(magnify=0.0)
    with pytest.raises(InputError, match=r"beside: .* is no simulation"):
        slew.animate(3)  # type: ignore[arg-type]


def test_modal_data_say_that_the_shape_is_a_guess() -> None:
    tip = sc.Place("tip", 1.5, [0.8])
    wing = sc.ModalData(inertia=2.0, frequencies_hz=[0.5], coupling=[1.0], places=[tip])
    shown = _slew_of(sc.Arm(wing, damping_ratio=0.01), "modal").movement
    assert (shown.x[0], shown.reach) == (0.0, 1.5)
    assert "guess" in shown.told
    assert "guess" in Animation([shown], ["wing"]).caption


def test_an_elastic_joints_twist_is_no_bending_of_the_beam() -> None:
    beam = sc.arms.paper_beam().beam
    arm = sc.Arm(beam, sc.Hub(0.2), damping_ratio=0.01, joint=sc.Joint(5.0, rotor_inertia=0.1))
    slew = _slew_of(arm, "arm-matched")
    at = np.searchsorted(slew.t, slew.movement.t)
    np.testing.assert_allclose(slew.movement.bent[:, -1], slew.tip_deflection[at], atol=1e-12)
    np.testing.assert_array_equal(slew.movement.theta, slew.theta[at])
