"""Named loops for the loop tests."""

from __future__ import annotations

from slewctl import (
    Arm,
    Beam,
    ClampedFree,
    Hub,
    Loop,
    Objective,
    assemble,
    close,
    generalised_plant,
    lqg,
    truth,
)

OBJECTIVE = Objective({"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
TWO_SENSORS = Objective(
    {"tip": 0.1, "torque": 1.0}, {"torque": 0.1, "theta": 0.01, "theta_dot": 0.05}
)


def uniform_arm(
    damping_ratio: float = 0.005, stiffness: float = 1.0, friction: float = 0.0, hub: float = 0.3
) -> Arm:
    return Arm(
        Beam(1.0, 1.0, stiffness), Hub(hub, 0.1, friction), damping_ratio=damping_ratio, name="arm"
    )


def loop_on(arm: Arm, objective: Objective = OBJECTIVE, modes: int = 10, n: int = 3) -> Loop:
    """Return the loop of an LQG design on `n` functions around `modes` true modes."""
    controller = lqg(generalised_plant(assemble(arm, ClampedFree(n)), objective))
    return close(truth(arm, modes), objective, controller)


def stable_loop() -> Loop:
    return loop_on(uniform_arm())


def unstable_loop() -> Loop:
    """An undamped arm: the modes that the design has not seen are driven unstable."""
    return loop_on(uniform_arm(damping_ratio=0.0), n=2)
