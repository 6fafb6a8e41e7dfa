"""Fixtures that several test rooms share; its presence makes `strategies` importable."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest
from hypothesis import settings

from slewctl import Arm, Beam, Hub, Payload
from slewctl._threads import one_thread
from slewctl.paper import PaperReproduction, reproduce

pytest_plugins = ["pytester"]

# How long an example takes is a matter of the machine and of what else it does. A run of CI
# tells what an edit did, so that its examples are the same each time; a run by hand draws new
# ones, and what it finds becomes an @example. --hypothesis-profile=thorough draws many.
settings.register_profile(
    "any machine", deadline=None, derandomize="CI" in os.environ, max_examples=50
)
settings.register_profile("thorough", deadline=None, max_examples=1000)
settings.load_profile("any machine")


@pytest.fixture(scope="session", autouse=True)
def _one_thread() -> Iterator[None]:
    """Keep BLAS to one thread, in the workers of ``-n auto`` too."""
    with one_thread():
        yield


@pytest.fixture(scope="session")
def full_arm() -> Arm:
    """A tapered arm that has everything: hub, radius, friction, payload and damping."""
    return Arm(
        Beam(1.3, (2.0, -0.9), (40.0, 0.0, -25.0)),
        Hub(inertia=0.7, radius=0.12, friction=0.3),
        Payload(mass=0.4, inertia=0.02),
        damping_ratio=0.01,
        name="full arm",
    )


@pytest.fixture(scope="session")
def reproduction() -> PaperReproduction:
    """The paper, reproduced once; its tests are in one group, which one process runs."""
    return reproduce()
