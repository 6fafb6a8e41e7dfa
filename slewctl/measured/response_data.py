"""A measured response as least squares: the logarithm of measured over computed, point by point."""

from __future__ import annotations

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.measured.log import Log
from slewctl.measured.response import Response
from slewctl.measured.rig_model import Channel, Modes, equations, response_of
from slewctl.measured.rig_parameters import Rig
from slewctl.plant.statespace import Actuator

# Of a response from a log, to start from: as many points, and those that show anything.
_MOST_POINTS = 150
_LEAST_COHERENCE = 0.05
# So many in a row with such a coherence are no accident of a few averages, and one of twenty
# that is more than noise gives them.
_IN_A_ROW, _COHERENT, _BY_CHANCE = 5, 0.3, 0.05
# Deviations that are smaller are smaller than what the model leaves out.
_LEAST_DEVIATION = 1e-4


class ResponseData:
    """The points of a response with their weights.

    Parameters
    ----------
    response : Response
    modes : Modes
        Of the model.
    """

    def __init__(self, response: Response, modes: Modes) -> None:
        self.response = response
        self.modes = modes
        self.channel = channel_of(response)
        deviation = response.known_deviation
        self.scatter_known = bool(np.all(np.isfinite(deviation)))
        self.deviation = (
            np.maximum(deviation, _LEAST_DEVIATION)
            if self.scatter_known
            else np.ones(len(deviation))
        )

    def computed(self, rig: Rig) -> ComplexArray:
        """Return the response of a rig at the measured frequencies."""
        return rig_response(rig, self.channel, self.modes, self.response.omega)

    def ratio(self, rig: Rig) -> ComplexArray:
        """Return log(measured/computed) at each point."""
        with np.errstate(divide="ignore"):
            return np.log(self.response.values / self.computed(rig))

    def residual(self, rig: Rig) -> Array:
        """Return the logarithm's parts in standard deviations, shape (2m,)."""
        weighted = self.ratio(rig) / self.deviation
        return np.concatenate([weighted.real, weighted.imag])

    def magnitudes_off(self, rig: Rig) -> float:
        """Return how far the magnitudes are off whatever the gain, as a robust mean square."""
        log = self.ratio(rig).real
        weight = 1 / (self.deviation**2 + 0.05**2)
        log = log - _weighted_median(log, weight)
        return float(np.sum(weight * (np.sqrt(1 + log**2) - 1)) / np.sum(weight))

    def log_gain(self, rig: Rig) -> float:
        """Return the logarithm of the gain that the magnitudes lack."""
        return _weighted_median(self.ratio(rig).real, 1 / (self.deviation**2 + 0.05**2))

    def misfit(self, rig: Rig) -> float:
        """Return a robust sum of squares."""
        return float(np.sum(np.sqrt(1 + self.residual(rig) ** 2) - 1))


def channel_of(measured: Response | Log) -> Channel:
    """Return what a measurement is of."""
    actuator: Actuator = "voltage" if measured.actuator == "voltage" else "torque"
    return Channel(actuator, measured.sensor, measured.sample_time)


def rig_response(rig: Rig, channel: Channel, modes: Modes, omega: Array) -> ComplexArray:
    """Return the response of a rig at each ω in rad/s."""
    system = equations(rig.arm, channel.actuator, channel.sensor, modes)
    return rig.gain * response_of(system, omega, channel.sample_time, rig.delay)


def thinned(response: Response) -> Response:
    """Return the points of a response that show anything, and not too many.

    What is above the last frequency at which the arm is seen would, by its number alone, leave
    none of the others.
    """
    coherence = np.asarray(response.coherence)
    good = coherence > max(_LEAST_COHERENCE, _chance(response))
    good &= response.frequencies_hz <= highest_seen(response)
    if np.count_nonzero(good) < 2:
        good = coherence > _LEAST_COHERENCE
    index = np.flatnonzero(good) if np.count_nonzero(good) > 1 else np.arange(len(good))
    return response.at_points(index[:: -(-len(index) // _MOST_POINTS)])


def highest_seen(response: Response) -> float:
    """Return the frequency in Hz up to which a response shows the arm, by its coherence."""
    least = max(_COHERENT, _chance(response))
    seen = (np.asarray(response.coherence) > least).astype(float)
    width = min(_IN_A_ROW, len(seen))
    rows = np.flatnonzero(np.convolve(seen, np.ones(width), "valid") > width - 0.5)
    last = int(rows[-1]) + width - 1 if len(rows) else len(seen) - 1
    return float(response.frequencies_hz[last])


def _chance(response: Response) -> float:
    """Return the coherence that noise alone gives at one point in twenty (Bendat and Piersol).

    The number of averages is that which makes the deviations of the coherence.
    """
    coherence, deviation = np.asarray(response.coherence), response.known_deviation
    with np.errstate(divide="ignore", invalid="ignore"):
        averages = 1 + (1 / coherence - 1) / (2 * deviation**2)
    known = averages[np.isfinite(averages)]
    if not len(known):
        return 0.0
    return float(1 - _BY_CHANCE ** (1 / max(float(np.median(known)) - 1, 1.0)))


def _weighted_median(values: Array, weights: Array) -> float:
    order = np.argsort(values)
    reached = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(reached, reached[-1] / 2)])
