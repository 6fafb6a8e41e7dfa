"""Random arms with LQG designs on a few modes, for questions of spillover."""

from __future__ import annotations

import warnings

import numpy as np

from slewctl import (
    AccuracyError,
    Arm,
    Beam,
    ClampedFree,
    DesignError,
    Hub,
    HubMatched,
    Loop,
    Model,
    Objective,
    Payload,
    Slewing,
    assemble,
    close,
    generalised_plant,
    lqg,
    truth,
)

SENSORS = (
    ("theta",),
    ("theta", "theta_dot"),
    ("tip",),
    ("theta", "tip"),
    ("theta", "theta_dot", "tip"),
)
BASES = ("clamped-free", "slewing", "hub-matched")


def random_arm(rng: np.random.Generator) -> Arm:
    """Return an arm with a random taper, hub and payload, and light damping."""
    length, mass, stiffness = 10 ** rng.uniform([-1, -2, -2], [1, 2, 4])
    taper = float(rng.uniform(-0.8, 0.5))
    inertia = mass * length**3 / 3
    return Arm(
        Beam(length, (mass, taper * mass), (stiffness, taper * stiffness)),
        Hub(float(inertia * 10 ** rng.uniform(-2, 1)), float(length * rng.choice([0.0, 0.1]))),
        Payload(float(mass * length * rng.choice([0.0, 0.2, 1.0]))),
        damping_ratio=float(10 ** rng.uniform(-4, np.log10(0.02))),
    )


def random_objective(rng: np.random.Generator, model: Model) -> Objective:
    """Return weights and noises in units of the arm, over several decades of each."""
    speed = float(model.omega[0]) * 10 ** rng.uniform(-2, 0.3)
    torque = float(model.mass[0, 0] * speed**2)
    reach = model.arm.hub.radius + model.arm.beam.length
    unit = {"theta": 1.0, "theta_dot": speed, "tip": reach}
    spread = 10 ** rng.uniform(-3, 1)
    limit = str(rng.choice(["theta", "tip"]))
    sensors = SENSORS[int(rng.integers(len(SENSORS)))]
    return Objective(
        limits={limit: unit[limit], "torque": float(torque * 10 ** rng.uniform(-1, 1))},
        noise={
            "torque": torque,
            **{name: float(spread * unit[name] * 10 ** rng.uniform(-1, 1)) for name in sensors},
        },
    )


def random_design(rng: np.random.Generator, modes: int) -> tuple[Loop, Model]:
    """Return a loop on a truth of `modes` modes, and the model that it was designed on."""
    while True:
        arm = random_arm(rng)
        n, kind = int(rng.integers(1, 6)), str(rng.choice(BASES))
        basis = {"clamped-free": ClampedFree, "slewing": Slewing}.get(kind)
        design = assemble(arm, basis(n) if basis else HubMatched(n))
        objective = random_objective(rng, design)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", RuntimeWarning)
                controller = lqg(generalised_plant(design, objective))
        except (DesignError, AccuracyError, RuntimeWarning):
            continue  # weights so far apart that no design can be verified
        if controller.certificate.verified:
            return close(truth(arm, modes), objective, controller), design
