"""Hypothesis strategies and settings that several test rooms share."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import settings
from hypothesis import strategies as st

from slewctl import Arm, Beam, Drag, Hub, LumpedMass, Payload, Stations


def deterministic(max_examples: int) -> settings:
    """Settings for a property test that takes the same examples on every run."""
    return settings(max_examples=max_examples, deadline=None, derandomize=True, database=None)


positive = st.floats(0.2, 5.0)


@st.composite
def tapers(draw: st.DrawFn) -> float | tuple[float, ...] | Stations:
    """A profile of the unit-length beam: constant, polynomial, tabulated or stepped."""
    scale = draw(positive)
    kind = draw(st.sampled_from(["constant", "polynomial", "stations", "step"]))
    if kind == "constant":
        return scale
    drop = draw(st.floats(-1.0, 0.8))
    if kind == "polynomial":
        power = draw(st.integers(1, 4))
        return (scale, *[0.0] * (power - 1), -drop * scale)
    at = draw(st.sampled_from([0.25, 0.4, 0.7]))
    if kind == "step":
        return Stations((0.0, at, at, 1.0), (scale, scale, scale * (1 - drop), scale * (1 - drop)))
    return Stations((0.0, at, 1.0), (scale, scale * (1 - drop), scale * (1 - drop / 2)))


@st.composite
def arms(draw: st.DrawFn, damping: bool = False) -> Arm:
    """An arm of unit length with any hub and payload, from none to much heavier than the beam."""
    inertia = st.one_of(st.just(0.0), st.floats(1e-3, 1e2))
    hub = Hub(
        inertia=draw(inertia),
        radius=draw(st.one_of(st.just(0.0), st.floats(0.01, 0.5))),
        friction=draw(st.one_of(st.just(0.0), st.floats(1e-3, 1.0))) if damping else 0.0,
    )
    payload = Payload(
        mass=draw(st.one_of(st.just(0.0), st.floats(0.05, 20.0))),
        inertia=draw(st.one_of(st.just(0.0), st.floats(1e-3, 2.0))),
    )
    ratio = draw(st.one_of(st.just(0.0), st.floats(1e-4, 0.3))) if damping else 0.0
    return Arm(Beam(1.0, draw(tapers()), draw(tapers())), hub, payload, damping_ratio=ratio)


@st.composite
def loaded_arms(draw: st.DrawFn) -> Arm:
    """A damped arm with up to two masses along its beam, and drag or ratios of held modes."""
    arm = draw(arms(damping=True))
    masses = st.lists(
        st.builds(LumpedMass, st.floats(0.0, 1.0), st.floats(0.0, 5.0), st.floats(0.0, 0.5)),
        max_size=2,
    )
    drag = draw(st.one_of(st.none(), st.builds(Drag, st.floats(1e-3, 1.0))))
    modes = draw(st.sampled_from(["free", "hub-locked"]))
    return replace(arm, masses=tuple(draw(masses)), damping=drag, damping_modes=modes)
