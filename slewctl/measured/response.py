"""A measured frequency response, with how well it is known."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import chdtri

from slewctl._show import Axes, Described, axes_or_new
from slewctl._types import Array, ComplexArray
from slewctl.errors import InputError, check_choice, check_nonnegative, check_number, shown
from slewctl.measured.flaws import check_measurable
from slewctl.measured.units import unit_of
from slewctl.plant.signals import ACTUATORS, signal

if TYPE_CHECKING:
    import control


@dataclass(frozen=True, eq=False, repr=False)
class Response(Described):
    """A frequency response from an actuator to a sensor, as it was measured.

    Parameters
    ----------
    frequencies_hz : array_like, shape (m,)
        Increasing, > 0; m >= 2.
    values : array_like of complex, shape (m,)
        In the sensor's unit per unit of the actuator.
    deviation : array_like, shape (m,), optional
        Standard deviation of the magnitude, relative, and of the phase in rad: √((1 − C)/(2nC))
        with n averages of coherence C.  NaN where it is not known.
    coherence : array_like, shape (m,), optional
        NaN where it is not known.
    sample_time : float
        Of the clock that held the input and sampled the output, in s; zero for a response
        of the continuous arm, as an analyser's with sines.
    actuator : {"torque", "voltage"}
    sensor : str
        A signal of an arm, such as ``theta``.
    source : str
        Where it comes from.
    remarks : tuple of str
        What was found about it.

    Raises
    ------
    InputError
        For fewer than two points, frequencies that do not increase, impossible values, or
        frequencies above half the sampling frequency.

    Examples
    --------
    >>> import slewctl as sc
    >>> measured = sc.Response([1.0, 2.0], [-0.5, -0.1 - 0.02j], actuator="voltage")
    >>> len(measured.frequencies_hz), measured.sensor
    (2, 'theta')
    """

    frequencies_hz: Array
    values: ComplexArray
    deviation: Array | None = None
    coherence: Array | None = None
    sample_time: float = 0.0
    actuator: str = "torque"
    sensor: str = "theta"
    source: str = ""
    remarks: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        check_choice(self.actuator, ACTUATORS, "response.actuator")
        signal(self.sensor, "response.sensor")
        check_nonnegative(self.sample_time, "response.sample_time")
        frequencies = _column(self.frequencies_hz, "frequencies_hz", float)
        if len(frequencies) < 2:
            raise InputError(
                "one point makes no response" if len(frequencies) else "it holds no points",
                where="response.frequencies_hz",
                remedy="measure at several frequencies",
            )
        if not np.all(np.isfinite(frequencies)) or np.any(np.diff(frequencies, prepend=0.0) <= 0):
            raise InputError(
                "the frequencies do not increase from above zero",
                where="response.frequencies_hz",
                remedy="sort them, and leave zero out",
            )
        if self.sample_time and frequencies[-1] > 0.5 / self.sample_time * (1 + 1e-9):
            raise InputError(
                f"{frequencies[-1]:g} Hz is above half of the clock's {1 / self.sample_time:g} Hz",
                where="response.frequencies_hz",
                remedy="check the sample time, or the unit of the frequencies",
            )
        values = _column(self.values, "values", complex, len(frequencies))
        if not np.all(np.isfinite(values)):
            raise InputError(
                "some values are not finite numbers",
                where="response.values",
                remedy="leave these points out",
            )
        check_measurable(values, "response.values")
        if not np.any(values):
            raise InputError(
                "all values are zero",
                where="response.values",
                remedy="look whether the sensor is connected, and its column the right one",
            )
        set_ = object.__setattr__
        set_(self, "frequencies_hz", frequencies)
        set_(self, "values", values)
        for name in ("deviation", "coherence"):
            given = getattr(self, name)
            kept = np.full(len(values), np.nan) if given is None else given
            kept = _column(kept, name, float, len(values))
            if np.any(kept < 0) or (name == "coherence" and np.any(kept > 1 + 1e-9)):
                raise InputError(
                    f"{shown(float(kept[(kept < 0) | (kept > 1)][0]))} is no {name}",
                    where=f"response.{name}",
                    remedy="give numbers >= 0" if name == "deviation" else "give numbers 0…1",
                )
            set_(self, name, kept)
        for name in ("frequencies_hz", "values", "deviation", "coherence"):
            getattr(self, name).setflags(write=False)

    @property
    def omega(self) -> Array:
        """Frequencies in rad/s."""
        return 2 * np.pi * self.frequencies_hz

    @property
    def known_deviation(self) -> Array:
        """Standard deviations, NaN where they are not known, shape (m,)."""
        return np.asarray(self.deviation)

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return f"{unit_of(self.sensor)}/({unit_of(self.actuator)})"

    def radius(self, level: float = 0.95) -> Array:
        """Return the radius of the disk around each value that holds the truth, shape (m,).

        Parameters
        ----------
        level : float
            Probability.
        """
        return np.abs(self.values) * self.known_deviation * np.sqrt(chdtri(2, 1 - level))

    def band(self, level: float = 0.95) -> tuple[Array, Array]:
        """Return the smallest and the largest magnitude at each point, each of shape (m,).

        Parameters
        ----------
        level : float
            Probability that a magnitude is between them.
        """
        spread = np.exp(self.known_deviation * np.sqrt(chdtri(1, 1 - level)))
        return np.abs(self.values) / spread, np.abs(self.values) * spread

    def between(self, lowest_hz: float, highest_hz: float) -> Response:
        """Return the part of the response in a band of frequencies.

        Parameters
        ----------
        lowest_hz, highest_hz : float
        """
        lowest, highest = check_number(lowest_hz, "lowest_hz"), check_number(highest_hz, "highest")
        inside = (self.frequencies_hz >= lowest) & (self.frequencies_hz <= highest)
        return self.at_points(inside)

    def at_points(self, chosen: Any) -> Response:
        """Return the response at chosen points alone.

        Parameters
        ----------
        chosen : ndarray
            Index or mask.
        """
        return Response(
            self.frequencies_hz[chosen],
            self.values[chosen],
            self.known_deviation[chosen],
            np.asarray(self.coherence)[chosen],
            self.sample_time,
            self.actuator,
            self.sensor,
            self.source,
            self.remarks,
        )

    def to_control(self) -> control.FrequencyResponseData:
        """Return the same for python-control."""
        import control  # only who wants one of its systems waits for it

        return control.FrequencyResponseData(
            self.values,
            self.omega,
            dt=self.sample_time,
            inputs=[self.actuator],
            outputs=[self.sensor],
        )

    def __str__(self) -> str:
        clock = f", clock {self.sample_time:g} s" if self.sample_time else ""
        source = f" ({self.source})" if self.source else ""
        first = (
            f"response from {self.actuator} to {self.sensor}{source}: "
            f"{len(self.values)} points from {self.frequencies_hz[0]:.4g} to "
            f"{self.frequencies_hz[-1]:.4g} Hz{clock}"
        )
        return "\n".join([first, *(f"  {remark}" for remark in self.remarks)])

    def plot(self, axes: Axes | None = None) -> Axes:
        """Draw magnitude with its 95 % band, phase and coherence.

        Parameters
        ----------
        axes : array of three matplotlib Axes, optional
            By default those of a new figure.
        """
        drawn: Any = axes_or_new(axes, rows=3)
        low, high = self.band()
        drawn[0].fill_between(self.frequencies_hz, low, high, alpha=0.3, lw=0)
        drawn[0].loglog(self.frequencies_hz, np.abs(self.values))
        drawn[0].set_ylabel(f"magnitude ({self.unit})")
        drawn[1].semilogx(self.frequencies_hz, np.angle(self.values, deg=True))
        drawn[1].set_ylabel("phase (deg)")
        drawn[2].semilogx(self.frequencies_hz, np.asarray(self.coherence))
        drawn[2].set_ylabel("coherence")
        drawn[2].set_xlabel("frequency (Hz)")
        return drawn


def as_response(given: object, where: str) -> Response:
    """Return a `Response`, or what a `control.FrequencyResponseData` holds as one.

    Parameters
    ----------
    given : Response or control.FrequencyResponseData
        Of one input and one output; the names of its signals are kept where they are those of
        an arm.
    where : str
        For the error.
    """
    if isinstance(given, Response):
        return given
    if not is_frd(given):
        raise InputError(
            f"{shown(given)} is no frequency response",
            where=where,
            remedy="give a slewctl.Response or a control.FrequencyResponseData",
        )
    frd: Any = given
    if (frd.ninputs, frd.noutputs) != (1, 1):
        raise InputError(
            f"it has {frd.ninputs} inputs and {frd.noutputs} outputs",
            where=where,
            remedy="choose one of each, as in frd[0, 0]",
        )
    if frd.dt is True:
        raise InputError(
            "its sample time is not known", where=where, remedy="give its dt in seconds"
        )
    omega = np.asarray(frd.omega, dtype=float)
    values = np.asarray(frd.frdata if hasattr(frd, "frdata") else frd.fresp)[0, 0]
    keep = omega > 0
    actuator, sensor = frd.input_labels[0], frd.output_labels[0]
    return Response(
        omega[keep] / (2 * np.pi),
        values[keep],
        sample_time=float(frd.dt or 0.0),
        actuator=actuator if actuator in ACTUATORS else "torque",
        sensor=sensor if _is_signal(sensor) else "theta",
        source=frd.name,
    )


def is_frd(given: object) -> bool:
    """Return whether a user gave frequency response data of python-control."""
    control = sys.modules.get("control")
    return control is not None and isinstance(given, control.FrequencyResponseData)


def _is_signal(name: str) -> bool:
    try:
        signal(name)
    except InputError:
        return False
    return True


def _column(given: Any, name: str, kind: type, length: int | None = None) -> Any:
    where = f"response.{name}"
    try:
        column: Any = np.array(given, dtype=kind)
    except (TypeError, ValueError) as error:
        raise InputError("it is no list of numbers", where=where, remedy="give numbers") from error
    if column.ndim != 1 or (length is not None and len(column) != length):
        raise InputError(
            f"its shape is {column.shape}", where=where, remedy="give one number a frequency"
        )
    return column
