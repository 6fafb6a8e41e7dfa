"""Random flexible loops: LQG designs on random reduced models, closed on larger truths."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from slewctl import (
    AccuracyError,
    Arm,
    Beam,
    ClampedFree,
    Controller,
    DesignError,
    Hub,
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

_SENSORS = (
    ("theta",),
    ("theta", "theta_dot"),
    ("tip",),
    ("theta", "tip"),
    ("theta", "root_moment"),
    ("theta", "theta_dot", "tip"),
    ("theta", "tip_dot"),
)


def random_arm(rng: np.random.Generator) -> Arm:
    """Return an arm with a random taper, hub, payload, friction and light damping."""
    length = float(10 ** rng.uniform(-1, 1))
    mass = float(10 ** rng.uniform(-2, 2))
    stiffness = float(10 ** rng.uniform(-2, 4))
    taper = float(rng.uniform(-0.8, 0.5))
    beam_mass = mass * length
    inertia = beam_mass * length**2 / 3
    return Arm(
        Beam(length, (mass, taper * mass), (stiffness, taper * stiffness)),
        Hub(
            inertia=inertia * float(10 ** rng.uniform(-2, 1)),
            radius=length * float(rng.choice([0.0, 0.1, 0.5])),
            friction=0.0,
        ),
        Payload(beam_mass * float(rng.choice([0.0, 0.2, 1.0]))),
        damping_ratio=float(10 ** rng.uniform(-4, np.log10(0.02))),
    )


def random_objective(rng: np.random.Generator, model: Model) -> Objective:
    """Return weights and noises whose units follow the arm, over several decades of each."""
    J = float(model.mass[0, 0])
    reach = model.arm.hub.radius + model.arm.beam.length
    speed = float(model.omega[0]) * float(10 ** rng.uniform(-2, 0.3))
    torque = J * speed**2
    unit = {"theta": 1.0, "theta_dot": speed, "tip": reach, "tip_dot": reach * speed}
    unit["root_moment"] = torque
    spread = float(10 ** rng.uniform(-3, 1))
    sensors = _SENSORS[int(rng.integers(len(_SENSORS)))]
    limit = str(rng.choice(["theta", "tip"]))
    noise = {name: spread * unit[name] * float(10 ** rng.uniform(-1, 1)) for name in sensors}
    return Objective(
        limits={limit: unit[limit], "torque": torque * float(10 ** rng.uniform(-1, 1))},
        noise={"torque": torque, **noise},
    )


def random_design(rng: np.random.Generator, arm: Arm) -> tuple[Objective, Controller]:
    """Return an objective and the LQG controller of a random reduced model of `arm`."""
    kind = ClampedFree if rng.random() < 0.5 else Slewing
    model = assemble(arm, kind(int(rng.integers(1, 6))))
    objective = random_objective(rng, model)
    return objective, lqg(generalised_plant(model, objective))


def stable_loops(seed: int, count: int) -> Iterator[Loop]:
    """Yield `count` random loops that are stable on truths of 5 to 25 modes."""
    rng = np.random.default_rng(seed)
    found = 0
    while found < count:
        arm = random_arm(rng)
        try:
            objective, controller = random_design(rng, arm)
        except (DesignError, AccuracyError):
            continue
        loop = close(truth(arm, int(rng.integers(5, 26))), objective, controller)
        if loop.stable:
            found += 1
            yield loop
