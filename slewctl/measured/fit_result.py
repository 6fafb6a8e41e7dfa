"""What a fit found, and how well the measurements determine it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import gammaincc

from slewctl._show import Axes, Described, axes_or_new
from slewctl._types import Array
from slewctl.arm import Arm
from slewctl.arm.parts import arm_table
from slewctl.errors import check_choice
from slewctl.export import toml_text
from slewctl.model.ritz import Boundary

_STRONG = 0.95  # correlations worth a sentence


@dataclass(frozen=True)
class Estimate:
    """One adjusted property.

    Attributes
    ----------
    name, unit : str
    start, value : float
        Before and after the fit.
    standard_deviation : float
        In the same unit: inf when the measurements do not determine the property, nan when
        their scatter is neither given nor to be estimated.
    at_limit : bool
        Whether the value is held at zero, where the measurements want none or less, or at the
        least or the largest that a fit looks for.
    """

    name: str
    unit: str
    start: float
    value: float
    standard_deviation: float
    at_limit: bool

    def __str__(self) -> str:
        if math.isinf(self.standard_deviation):
            spread = "not determined by the measurement"
        elif math.isnan(self.standard_deviation):
            spread = "± unknown"
        else:
            spread = f"± {self.standard_deviation:.2g}"
        limit = " (at its limit)" if self.at_limit else ""
        return f"{self.name} = {self.value:.6g} {self.unit} {spread}{limit}, from {self.start:.6g}"


@dataclass(frozen=True, eq=False, repr=False)
class Fit(Described):
    """An arm adjusted to measured frequencies.

    Attributes
    ----------
    arm : Arm
        The adjusted arm.
    boundary : {"hub-locked", "free"}
    modes : tuple of int
        Numbers of the measured modes.
    measured_hz, predicted_hz : ndarray, shape (m,)
        Measured frequencies and those of the adjusted arm, converged.
    residuals : ndarray, shape (m,)
        Relative: predicted/measured − 1.
    uncertainty : ndarray, shape (m,)
        Relative standard deviation of each measurement: given, or estimated from the
        residuals, or nan.
    uncertainty_given : bool
    estimates : tuple of Estimate, length n
        The adjusted properties, in the order asked for.
    covariance : ndarray, shape (n, n)
        Of the properties in their units, linearised; nan where one is not determined.
    undetermined : tuple of tuple of str
        Groups of properties that the frequencies do not tell apart; a group of one has no
        effect on them at all.
    degrees_of_freedom : int
        Measurements beyond the independent combinations of properties adjusted to them.
    model_error : float
        Estimated relative error of the predicted frequencies.
    """

    arm: Arm
    boundary: Boundary
    modes: tuple[int, ...]
    measured_hz: Array
    predicted_hz: Array
    residuals: Array
    uncertainty: Array
    uncertainty_given: bool
    estimates: tuple[Estimate, ...]
    covariance: Array
    undetermined: tuple[tuple[str, ...], ...]
    degrees_of_freedom: int
    model_error: float

    def __post_init__(self) -> None:
        for name in ("measured_hz", "predicted_hz", "residuals", "uncertainty", "covariance"):
            getattr(self, name).setflags(write=False)

    def __getitem__(self, name: str) -> Estimate:
        """Return the estimate of the property called `name`."""
        named = {estimate.name: estimate for estimate in self.estimates}
        return named[check_choice(name, named, "fit")]

    def to_toml(self, **tables: Mapping[str, Any]) -> str:
        """Return the adjusted arm as a file, or with further tables as a design file.

        Parameters
        ----------
        **tables
            Of the design file, such as ``model={"basis": "arm-matched", "n": 2}``,
            ``controller={"method": "lqg", …}`` and ``requirements={…}``.
        """
        return toml_text({"arm": arm_table(self.arm), **tables})

    @property
    def correlation(self) -> Array:
        """Correlations of the properties, shape (n, n)."""
        spread = np.sqrt(np.diag(self.covariance))
        # Data that the model meets exactly leave no scatter, and nothing to correlate.
        with np.errstate(invalid="ignore", divide="ignore"):
            return self.covariance / np.outer(spread, spread)

    @property
    def misfit_probability(self) -> float:
        """Chance that scatter of the given size alone would fit worse (χ² test); nan without.

        Small means that the arm's model, the mode numbers or the stated uncertainty is wrong.
        """
        if not self.uncertainty_given or self.degrees_of_freedom == 0:
            return math.nan
        square = float(np.sum((self.residuals / self.uncertainty) ** 2))
        return float(gammaincc(self.degrees_of_freedom / 2, square / 2))

    def __str__(self) -> str:
        lines = [f"fit of {self.arm.name} to {len(self.modes)} {self.boundary} frequencies"]
        lines += [f"  {estimate}" for estimate in self.estimates]
        lines += [f"  {remark}" for remark in self._remarks()]
        rows = zip(self.modes, self.measured_hz, self.predicted_hz, self.residuals, strict=True)
        lines += [
            f"  mode {mode}: measured {measured:.6g} Hz, fitted {fitted:.6g} Hz ({off:+.2%})"
            for mode, measured, fitted, off in rows
        ]
        return "\n".join(lines)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw how far each fitted frequency is from the measured one, with its uncertainty.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            By default those of a new figure.
        """
        ax = axes_or_new(ax)
        known = np.where(np.isfinite(self.uncertainty), self.uncertainty, 0.0)
        ax.errorbar(self.modes, 100 * self.residuals, 100 * known, fmt="o", capsize=4)
        ax.axhline(0, color="0.4", lw=0.8)
        ax.set_xticks(self.modes)
        ax.set_xlabel("mode")
        ax.set_ylabel("fitted over measured frequency, minus one (%)")
        return ax

    def _remarks(self) -> list[str]:
        remarks = []
        for group in self.undetermined:
            if len(group) == 1:
                remarks.append(f"{group[0]} has no effect on these frequencies")
            else:
                remarks.append(f"{', '.join(group)} cannot be told apart: fix one of them")
        remarks += correlated(self.estimates, self.correlation)
        if not self.uncertainty_given:
            scatter = float(self.uncertainty[0])
            known = f"{scatter:.2g} relative, from the residuals"
            remarks.append(f"scatter: {'unknown' if math.isnan(scatter) else known}")
        elif self.degrees_of_freedom:
            remarks.append(f"chance of a worse fit by scatter alone: {self.misfit_probability:.2g}")
        return remarks


def correlated(estimates: Sequence[Estimate], correlation: Array) -> list[str]:
    """Return, in words, which properties are strongly correlated."""
    return [
        f"{estimates[i].name} and {estimates[j].name} are correlated: {correlation[i, j]:+.3f}"
        for i in range(len(estimates))
        for j in range(i + 1, len(estimates))
        if abs(correlation[i, j]) > _STRONG
    ]
