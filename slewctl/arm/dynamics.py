"""What lies between a command and its torque, and between a motion and its reading."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.arm.magnitudes import check_size, check_size_or_zero
from slewctl.errors import InputError

# Of a second-order lag whose damping ratio is not given: no resonance, and the least delay.
_DAMPED = 0.7


@dataclass(frozen=True)
class _Dynamics:
    """A first-order lag, a second-order lag and a dead time, in series, of static gain one."""

    lag: float = 0.0
    frequency_hz: float | None = None
    damping_ratio: float | None = None
    delay: float = 0.0

    def __post_init__(self) -> None:
        part = type(self).__name__.lower()
        for name in ("lag", "delay"):
            value = check_size_or_zero(getattr(self, name), f"{part}.{name}")
            object.__setattr__(self, name, value)
        for name in ("frequency_hz", "damping_ratio"):
            if getattr(self, name) is not None:
                value = check_size(getattr(self, name), f"{part}.{name}")
                object.__setattr__(self, name, value)
        if self.damping_ratio is not None and self.frequency_hz is None:
            raise InputError(
                "a damping ratio of no second-order lag",
                where=f"{part}.damping_ratio",
                remedy=f"give {part}.frequency_hz too, or leave it out",
            )

    @property
    def lags(self) -> tuple[Array, Array, Array, Array]:
        """(A, B, C, D) of the lags in series, without the dead time; no states without lags.

        Its states have the unit of what passes.
        """
        A, B, C, D = np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.ones((1, 1))
        if self.lag:
            A, B = np.array([[-1 / self.lag]]), np.array([[1 / self.lag]])
            C, D = np.ones((1, 1)), np.zeros((1, 1))
        if self.frequency_hz is not None:
            omega = 2 * math.pi * self.frequency_hz
            ratio = _DAMPED if self.damping_ratio is None else self.damping_ratio
            own = omega * np.array([[0.0, 1.0], [-1.0, -2 * ratio]])
            entering = np.array([[0.0], [omega]])
            A = np.block([[A, np.zeros((len(A), 2))], [entering @ C, own]])
            B = np.vstack([B, entering @ D])
            C = np.concatenate([np.zeros(len(A) - 2), [1.0, 0.0]])[None]
            D = np.zeros((1, 1))
        return A, B, C, D


@dataclass(frozen=True)
class Actuator(_Dynamics):
    """What a drive makes of its command: lags, dead time, and a torque that it cannot exceed.

    The command, a torque or a motor's voltage, passes 1/(τs + 1), ω²/(s² + 2ζωs + ω²) and
    e^(−sT), as far as they are given.  The lags are states of every plant made of the arm, of
    the truth and of design models alike; the dead time is exact in stability, margins and
    sampled loops, and a Padé approximation where a continuous state space is asked for (see
    `slewctl.plant.dead_time`).  A disturbance torque meets the arm itself.

    Parameters
    ----------
    lag : float
        τ in s.
    frequency_hz : float, optional
        ω/2π of a second-order lag.
    damping_ratio : float, optional
        ζ of it; 0.7 by default.
    delay : float
        T in s.
    torque_limit : float, optional
        Largest torque in N·m on the output side of the gear, where there is no `Motor` to
        give it, or below the motor's.  The model is linear and exceeds it when told to; a
        slew says whether it did.

    Raises
    ------
    InputError
        For an impossible value, or a damping ratio without a frequency.

    Examples
    --------
    >>> import slewctl as sc
    >>> drive = sc.Actuator(lag=0.002, delay=0.001, torque_limit=2.0)
    >>> arm = sc.Arm(sc.Beam(1.0, 2.0, 40.0), sc.Hub(0.2), actuator=drive)
    >>> sc.state_space(sc.assemble(arm, "clamped-free", 1)).nstates
    9
    """

    torque_limit: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.torque_limit is not None:
            value = check_size(self.torque_limit, "actuator.torque_limit")
            object.__setattr__(self, "torque_limit", value)


@dataclass(frozen=True)
class Sensor(_Dynamics):
    """What a sensor makes of its signal: lags and dead time; its noise joins behind them.

    Parameters
    ----------
    lag : float
        Time constant of a first-order lag, in s.
    frequency_hz : float, optional
        Of a second-order lag.
    damping_ratio : float, optional
        Of it; 0.7 by default.
    delay : float
        Dead time in s; the same for all sensors that are measured together.

    Raises
    ------
    InputError
        For an impossible value, or a damping ratio without a frequency.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.Beam(1.0, 2.0, 40.0), sensors={"theta": sc.Sensor(lag=0.001)})
    >>> arm.sensor("theta").lag, arm.sensor("tip").lag
    (0.001, 0.0)
    """
