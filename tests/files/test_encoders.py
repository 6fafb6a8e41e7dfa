"""An encoder in a design file is the noise that its steps make."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import slewctl as sc
from slewctl.files import read_design

TEXT = """
arm = { catalogue = "paper-beam", hub.inertia = 0.2, damping_ratio = 0.01 }
model = { basis = "clamped-free", n = 1 }
[controller]
method = "lqg"
limits = { tip = 0.03, torque = 1.0 }
"""
CLOCK = "sample_time = 0.02\n"


def noise_of(tmp_path: Path, text: str) -> float:
    path = tmp_path / "design.toml"
    path.write_text(TEXT + text, encoding="utf-8")
    return read_design(path).case.objective.noise["theta"]


def test_a_sampled_reading_has_the_error_of_a_rounded_angle(tmp_path: Path) -> None:
    """The variance that a sample gets is that of angles rounded to the encoder's steps."""
    density = noise_of(
        tmp_path, CLOCK + "noise = { torque = 0.1, theta = { encoder_counts = 500 } }"
    )
    arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2))
    problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": density})
    sampled = sc.sampled_plant(problem.plant("clamped-free", n=1), 0.02)
    step = 2 * np.pi / 500
    angles = np.linspace(0.0, 7.0, 200_001)
    rounded = step * np.round(angles / step)
    np.testing.assert_allclose(sampled.sensor_noise[0, 0], np.var(rounded - angles), rtol=1e-2)


def test_its_own_clock_comes_first(tmp_path: Path) -> None:
    own = "noise = { torque = 0.1, theta = { encoder_counts = 500, sample_time = 0.001 } }"
    for text in (own, CLOCK + own):
        assert noise_of(tmp_path, text) == sc.encoder_noise(500, 0.001)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("theta = { encoder_counts = 500 }", "controller.noise.theta: the controller has no sample_time"),
        ("theta = { encoder_counts = 0, sample_time = 0.1 }", "noise.theta.encoder_counts: 0 is not allowed"),
        ("theta = { counts = 5 }", "noise.theta.counts: unknown key; did you mean 'encoder_counts'"),
        ("theta = 1, tip = { encoder_counts = 500, sample_time = 0.1 }", "noise.tip: an encoder reads an angle, and tip is in m"),
    ],
)  # fmt: skip
def test_an_impossible_encoder_is_refused_by_its_key(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(sc.InputError, match=told):
        noise_of(tmp_path, f"noise = {{ torque = 0.1, {text} }}")
