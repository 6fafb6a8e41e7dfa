"""A log of a rig: what was commanded and what was measured, on one clock."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from slewctl._show import Axes, Described, axes_or_new
from slewctl._types import Array
from slewctl.errors import InputError, check_choice, check_positive
from slewctl.measured.flaws import check_measurable, clipping, longest_stretch, quantum
from slewctl.measured.units import unit_of
from slewctl.plant.signals import ACTUATORS, signal

# Less than this is no record of a motion.
_FEWEST = 16


@dataclass(frozen=True, eq=False, repr=False)
class Log(Described):
    """Input and output of a rig, sampled together while a clock held the input.

    Samples that are no numbers end a stretch; the longest one is kept, and told.

    Parameters
    ----------
    sample_time : float
        T in s: u(k) is held from kT to (k + 1)T, y(k) sampled at kT.
    input, output : array_like, shape (n,)
        In N·m or V, and in the sensor's unit.
    reference : array_like, shape (n,), optional
        What the rig was told to follow, if the log was made in closed loop: any signal that
        moves the loop and knows nothing of the noise, in any unit.  One that does not move is
        none.
    actuator : {"torque", "voltage"}
    sensor : str
        A signal of an arm, such as ``theta``.
    source : str
        Where it comes from.
    remarks : tuple of str
        What was found: gaps, an irregular clock, a clipped input, an encoder's steps.

    Attributes
    ----------
    resolution : float
        Step of the output in its unit, as an encoder's; zero where none is seen.
    cut : tuple of bool
        Whether anything was given before it, and after it, that is left out for a gap.

    Raises
    ------
    InputError
        For fewer than 16 samples, signals of unlike lengths, an input or an output that does
        not move, or numbers that nothing measures.

    Examples
    --------
    >>> import numpy as np
    >>> import slewctl as sc
    >>> u = sc.prbs(2000, amplitude=1.0, seed=1)
    >>> log = sc.Log(0.005, u, np.round(np.cumsum(u) / 100, 1))
    >>> round(log.resolution, 3), round(log.duration, 3)
    (0.1, 10.0)
    """

    sample_time: float
    input: Array
    output: Array
    reference: Array | None = None
    actuator: str = "torque"
    sensor: str = "theta"
    source: str = ""
    remarks: tuple[str, ...] = field(default=())
    resolution: float = field(default=0.0, init=False)
    cut: tuple[bool, bool] = field(default=(False, False), init=False)

    def __post_init__(self) -> None:
        check_positive(self.sample_time, "log.sample_time")
        check_choice(self.actuator, ACTUATORS, "log.actuator")
        signal(self.sensor, "log.sensor")
        signals = {
            name: _column(getattr(self, name), name)
            for name in ("input", "output", "reference")
            if getattr(self, name) is not None
        }
        if len({len(column) for column in signals.values()}) > 1:
            raise InputError(
                f"its signals have {', '.join(str(len(s)) for s in signals.values())} samples",
                where="log",
                remedy="give signals of one clock",
            )
        for name, column in signals.items():
            check_measurable(column, f"log.{name}")
        before = len(signals["input"])
        stretch, told = longest_stretch(signals, self.sample_time)
        signals = {name: column[stretch] for name, column in signals.items()}
        count = len(signals["input"])
        if count < _FEWEST:
            gaps = f" ({told[0]})" if told else ""
            raise InputError(
                f"{count} samples make no record{gaps}",
                where="log",
                remedy=f"give at least {_FEWEST}",
            )
        for name, remedy in (
            ("input", "excite the arm, as with prbs"),
            ("output", "look whether the sensor is connected, and its column the right one"),
        ):
            if not np.ptp(signals[name]):
                raise InputError(f"the {name} does not move", where=f"log.{name}", remedy=remedy)
        if "reference" in signals and not np.ptp(signals["reference"]):
            del signals["reference"]
            object.__setattr__(self, "reference", None)
            told += ("the reference does not move: the log is taken as one of an open loop",)
        step = quantum(signals["output"])
        told += clipping(signals["input"], unit_of(self.actuator))
        told += _encoder(signals["output"], step, self.sensor)
        set_ = object.__setattr__
        for name, column in signals.items():
            column.setflags(write=False)
            set_(self, name, column)
        set_(self, "resolution", step)
        set_(self, "cut", (stretch.start > 0, stretch.stop < before))
        set_(self, "remarks", (*self.remarks, *told))

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.input)

    @property
    def duration(self) -> float:
        """Length of the record in s."""
        return self.samples * self.sample_time

    @property
    def closed_loop(self) -> bool:
        """Whether a reference was logged, so that the input may know the output's noise."""
        return self.reference is not None

    def __str__(self) -> str:
        source = f" ({self.source})" if self.source else ""
        loop = ", closed loop" if self.closed_loop else ""
        first = (
            f"log from {self.actuator} to {self.sensor}{source}: {self.samples} samples, "
            f"{self.duration:.4g} s at {self.sample_time:.6g} s{loop}"
        )
        return "\n".join([first, *(f"  {remark}" for remark in self.remarks)])

    def plot(self, axes: Axes | None = None) -> Axes:
        """Draw input and output over time.

        Parameters
        ----------
        axes : array of two matplotlib Axes, optional
            By default those of a new figure.
        """
        drawn: Any = axes_or_new(axes, rows=2)
        time = np.arange(self.samples) * self.sample_time
        for ax, name, values in zip(
            drawn, (self.actuator, self.sensor), (self.input, self.output), strict=True
        ):
            ax.plot(time, values)
            ax.set_ylabel(f"{name} ({unit_of(name)})")
        drawn[1].set_xlabel("time (s)")
        return drawn


def _column(given: Any, name: str) -> Array:
    try:
        column = np.array(given, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(
            "it is no list of numbers", where=f"log.{name}", remedy="give numbers"
        ) from error
    if column.ndim != 1:
        raise InputError(
            f"its shape is {column.shape}", where=f"log.{name}", remedy="give one number a sample"
        )
    return column


def _encoder(output: Array, step: float, sensor: str) -> tuple[str, ...]:
    """Return what a quantised output means, in words."""
    if not step:
        return ()
    turn = f", {2 * np.pi / step:.5g} a turn" if unit_of(sensor) == "rad" else ""
    moves = float(np.std(np.diff(output))) / step
    return (
        f"the output moves in steps of {step:.4g} {unit_of(sensor)}{turn}: noise of "
        f"{step / np.sqrt(12):.2g} rms; from sample to sample it moves {moves:.2g} steps rms",
    )
