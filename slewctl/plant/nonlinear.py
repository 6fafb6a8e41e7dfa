"""The nonlinear plant of a large slew as a `control.NonlinearIOSystem`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from slewctl._types import Array
from slewctl.errors import check_choice
from slewctl.model import Model
from slewctl.model.nonlinear import NonlinearModel, large_slew
from slewctl.model.spin import warn_of_softening
from slewctl.plant.readings import refuse_lags
from slewctl.plant.signals import ACTUATORS, check_signals, signal
from slewctl.plant.statespace import Actuator, drive

if TYPE_CHECKING:
    import control


def nonlinear_system(
    model: Model,
    outputs: Sequence[str] | str = ("theta", "theta_dot", "tip"),
    *,
    input: Actuator = "torque",
    stiffening: bool = True,
) -> control.NonlinearIOSystem:
    """Return the nonlinear model of an arm's large slews from its actuator to named outputs.

    States, input and outputs are named as in `state_space`, which is its linearisation
    about rest, so that either takes the other's place in `control.interconnect`.

    Parameters
    ----------
    model : Model
    outputs : sequence of str, or str
        As for `state_space`.  An acceleration is that along the arc, (r+x)θ̈ + v̈; the
        −θ̇²v that an accelerometer fixed to the turned beam reads beside it is left out.
    input : {"torque", "voltage"}
        The torque on the hub, or the voltage of the arm's motor.
    stiffening : bool
        Whether the tension of the turning beam stiffens it; see `large_slew`.

    Returns
    -------
    control.NonlinearIOSystem
        Continuous, with the states of `state_space`.

    Warns
    -----
    SpinSofteningWarning
        When evaluated, without stiffening, at a rate θ̇ at which the arm is unstable.

    Raises
    ------
    InputError
        For an unknown output or input, a voltage without a motor, or lags or dead time of
        the arm's actuator and sensors.
    LargeDeflectionError
        When evaluated at a deflection for which the equations do not hold.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> model = sc.assemble(arm, "clamped-free", n=2)
    >>> sc.nonlinear_system(model, ["theta", "tip"]).output_labels
    ['theta', 'tip']
    """
    equations = large_slew(model, stiffening)
    refuse_lags(model.arm, "nonlinear_system")
    names = check_signals(outputs, "outputs", model.arm.beam)
    check_choice(input, ACTUATORS, "input")
    gain, drag = drive(model.arm, input)
    coordinates = model.coordinates
    reading = _Readings(equations, names)

    def torque(state: Array, u: Array) -> float:
        return float(gain * u[0] - drag * state[model.n + 1])

    def update(t: float, state: Array, u: Array, params: dict[str, Any]) -> Array:
        rate = float(model.turning @ state[model.n + 1 :])
        if abs(rate) > equations.critical_spin_rad_s:
            warn_of_softening(rate, equations.critical_spin_rad_s)
        return equations.derivative(state, torque(state, u))

    def output(t: float, state: Array, u: Array, params: dict[str, Any]) -> Array:
        return reading(state, torque(state, u))

    import control  # see LinearSystem.to_control

    return control.nlsys(
        update,
        output,
        inputs=[input],
        outputs=list(names),
        states=[*coordinates, *(f"{name}_dot" for name in coordinates)],
        name=f"{model.basis.name}_{model.n}_nonlinear".replace(" ", "_").replace("-", "_"),
    )


class _Readings:
    """Outputs as rows of the displacements, the rates and the accelerations."""

    def __init__(self, equations: NonlinearModel, names: Sequence[str]) -> None:
        model = equations.linear
        self._equations = equations
        # rows[i, k] is the row of output i on the k-th of displacement, rate, acceleration.
        self._rows = np.zeros((len(names), 3, model.n + 1))
        for i, name in enumerate(names):
            found = signal(name, beam=model.arm.beam)
            motion = ("displacement", "rate", "acceleration").index(found.of)
            self._rows[i, motion] = found.row(model)
        self._accelerates = bool(self._rows[:, 2].any())

    def __call__(self, state: Array, torque: float) -> Array:
        x, rates = np.split(np.asarray(state, dtype=float), 2)
        found = self._rows[:, 0] @ x + self._rows[:, 1] @ rates
        if self._accelerates:
            found += self._rows[:, 2] @ self._equations.accelerations(x, rates, torque)
        return np.asarray(found)
