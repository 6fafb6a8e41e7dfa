"""Rational functions through a measured response, where no arm is wanted: vector fitting.

The poles are moved by vector fitting (B. Gustavsen and A. Semlyen, IEEE Trans. Power Delivery 14
(1999) 1052–1061), relaxed (B. Gustavsen, ibid. 21 (2006) 1587–1592), and then by nonlinear
least squares on the weighted error itself, with residues eliminated, which noise does not bias.
An interpolant such as AAA would go through the noise of every point.

A sampled response is fitted in w = (2/T)(z − 1)/(z + 1), in which it is as rational as in z.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from slewctl._show import Described
from slewctl._threads import single_threaded
from slewctl._types import Array, ComplexArray
from slewctl.errors import InputError, check_count
from slewctl.measured.response import Response, as_response
from slewctl.numerics.linear_system import LinearSystem

if TYPE_CHECKING:
    import control
    from control import FrequencyResponseData

# Damping ratio of the poles that the search begins with.
_LIGHT = 0.01
# Rounds of moving poles, the relative motion that ends them, and steps of the last search.
_ROUNDS, _SETTLED, _STEPS = 40, 1e-8, 60
# A constant of the relaxed sum this near to zero would send a pole to infinity.
_LEAST_CONSTANT = 1e-8
# Largest order that is tried, and orders without a better one that end the trial.
_MOST, _PATIENCE = 40, 3
# Of a pole that is kept stable, over its size: no slower decay.
_STABLE = 1e-9
# Residuals below this, relative, are rounding: no order explains them.
_EXACT = 1e-10


@dataclass(frozen=True, eq=False, repr=False)
class RationalFit(Described):
    """A rational function through a measured response, with real coefficients.

    Attributes
    ----------
    linear : LinearSystem
        In blocks of one and two states; on the response's clock if it has one.
    response : Response
    order : int
        Number of poles, those at zero included.
    poles_at_zero : int
        Fixed there, at z = 1 of a sampled response.
    stable : bool
        Whether all others are stable.
    relative_error, largest_error : float
        Root mean square, and largest, of |fitted − measured|/|measured|.
    scatter : float
        Root mean square error in the response's deviations, that of real and imaginary part
        alike; NaN where it has none.
    """

    linear: LinearSystem
    response: Response
    order: int
    poles_at_zero: int
    stable: bool
    relative_error: float
    largest_error: float
    scatter: float

    @property
    def system(self) -> control.StateSpace:
        """The function as a named system for python-control."""
        return self.linear.to_control()

    @property
    def poles(self) -> ComplexArray:
        """In rad/s, or in z on a clock."""
        return np.asarray(self.linear.poles(), dtype=complex)

    def __str__(self) -> str:
        what = self.response
        word = "stable" if self.stable else "NOT stable"
        at_zero = f", {self.poles_at_zero} of them at zero" if self.poles_at_zero else ""
        known = f", {self.scatter:.3g} deviations" if np.isfinite(self.scatter) else ""
        return (
            f"rational function from {what.actuator} to {what.sensor}: {self.order} poles"
            f"{at_zero}, {word}\n"
            f"  error {self.relative_error:.3g} rms relative, {self.largest_error:.3g} at most"
            f"{known}, at {len(what.values)} points"
        )


@single_threaded
def fit_rational(
    response: Response | FrequencyResponseData,
    order: int | None = None,
    *,
    poles_at_zero: int = 0,
    stable: bool = True,
) -> RationalFit:
    """Return a rational function with real coefficients through a measured response.

    Parameters
    ----------
    response : Response or control.FrequencyResponseData
        Weighted by its deviations, or relative where it has none.
    order : int, optional
        Number of poles.  By default that with the least Bayesian information criterion, up to
        40: one more pole must explain more than noise.
    poles_at_zero : int
        Of them, fixed at zero (at z = 1 on a clock): 2 for a hub angle that turns freely, 1
        with friction or a voltage as input.
    stable : bool
        Whether the others are kept stable.

    Returns
    -------
    RationalFit
        Its `system` is the function as a named `control.StateSpace`.

    Raises
    ------
    InputError
        For fewer points than the function has coefficients.

    Examples
    --------
    >>> import numpy as np
    >>> import slewctl as sc
    >>> s = 2j * np.pi * np.linspace(0.1, 5, 80)
    >>> measured = sc.Response(s.imag / (2 * np.pi), (s + 3) / (s * (s**2 + 0.2 * s + 90)))
    >>> found = sc.fit_rational(measured, order=3, poles_at_zero=1)
    >>> print(found)
    rational function from torque to theta: 3 poles, 1 of them at zero, stable
      error ... rms relative, ... at most, at 80 points
    >>> (np.sort(abs(found.poles)) ** 2).round(6).tolist()
    [0.0, 90.0, 90.0]
    """
    measured = as_response(response, "fit_rational.response")
    check_count(poles_at_zero, "fit_rational.poles_at_zero", 0)
    problem = _Problem(measured, poles_at_zero, stable)
    if order is not None:
        least = check_count(order, "fit_rational.order")
        if least < poles_at_zero or problem.coefficients(order) > 2 * len(measured.values):
            raise InputError(
                f"{order} poles for {len(measured.values)} points and {poles_at_zero} at zero",
                where="fit_rational.order",
                remedy="give an order between the poles at zero and the number of points",
            )
        return problem.finished(problem.poles(order - poles_at_zero))
    return problem.finished(_best(problem))


def _best(problem: _Problem) -> ComplexArray:
    """Return the poles of the order whose information criterion is the least."""
    best, least, worse = np.zeros(0, dtype=complex), np.inf, 0
    for count in range(problem.at_zero % 2, _MOST - problem.at_zero + 1):
        order = count + problem.at_zero
        if not order:
            continue
        if 2 * problem.coefficients(order) > len(problem.weight) or worse >= _PATIENCE:
            break
        poles = problem.poles(count)
        cost = problem.criterion(poles)
        best, least, worse = (poles, cost, 0) if cost < least else (best, least, worse + 1)
    return best


class _Problem:
    """The points in s, or in w, their weights, and the sums that go through them."""

    def __init__(self, response: Response, at_zero: int, stable: bool) -> None:
        self.response, self.at_zero, self._keep = response, at_zero, stable
        self.step = response.sample_time
        omega = response.omega
        s = 2 / self.step * np.tan(omega * self.step / 2) if self.step else omega
        good = np.abs(response.values) > 0
        self._scale = float(np.sqrt(s[good].min() * s[good].max()))
        self.s = 1j * s[good] / self._scale
        self.values = response.values[good]
        deviation = response.known_deviation[good]
        self.known = bool(np.all(np.isfinite(deviation) & (deviation > 0)))
        self.weight: Array = 1 / (np.abs(self.values) * (deviation if self.known else 1.0))

    def coefficients(self, order: int) -> int:
        """How many real numbers a function of an order has."""
        return 2 * order + 1 - self.at_zero

    def poles(self, count: int) -> ComplexArray:
        """Return so many poles, beside those at zero, that fit best: one of each pair."""
        low, high = self.s.imag.min(), self.s.imag.max()
        found = np.geomspace(low, high, count // 2) * (1j - _LIGHT)
        if count % 2:
            found = np.append(found, -np.sqrt(low * high))
        for _ in range(_ROUNDS if count else 0):
            before, found = found, self._moved(found)
            if len(before) == len(found) and np.all(
                np.abs(found - before) <= _SETTLED * np.abs(found)
            ):
                break
        return self._refined(found) if count else found

    def _sums(self, poles: ComplexArray) -> ComplexArray:
        """Return 1/(s − p) of each real pole, and the two real sums of each pair, at each s."""
        columns = []
        for pole in poles:
            one = 1 / (self.s - pole)
            if pole.imag:
                other = 1 / (self.s - pole.conj())
                columns += [one + other, 1j * (one - other)]
            else:
                columns.append(one)
        return np.array(columns, dtype=complex).reshape(-1, len(self.s)).T

    def _own(self, poles: ComplexArray) -> ComplexArray:
        """Return the columns of the function itself: poles, a constant and poles at zero."""
        at_zero = [self.s ** -float(m) for m in range(1, self.at_zero + 1)]
        return np.column_stack([self._sums(poles), np.ones_like(self.s), *at_zero])

    def _moved(self, poles: ComplexArray) -> ComplexArray:
        """Return the zeros of the relaxed sum that the poles of the response cancel."""
        own, sums = self._own(poles), self._sums(poles)
        relaxed = np.column_stack([sums, np.ones_like(self.s)])
        size = float(np.linalg.norm(self.weight * np.abs(self.values))) / len(self.s)
        rows = _real(np.hstack([own, -self.values[:, None] * relaxed]) * self.weight[:, None])
        last = np.concatenate([np.zeros(own.shape[1]), relaxed.real.sum(axis=0)]) * size
        right = np.zeros(len(rows) + 1)
        right[-1] = size * len(self.s)
        solution = _solved(np.vstack([rows, last]), right)
        sum_, constant = solution[own.shape[1] : -1], float(solution[-1])
        if abs(constant) < _LEAST_CONSTANT:
            constant = _LEAST_CONSTANT if constant >= 0 else -_LEAST_CONSTANT
        A, B = _blocks(poles)
        roots = np.linalg.eigvals(A - np.outer(B, sum_) / constant)
        return self._kept(np.asarray(roots, dtype=complex))

    def _kept(self, roots: ComplexArray) -> ComplexArray:
        """Return one of each pair, upper half, reflected where they must be stable."""
        if self._keep:
            roots = -np.maximum(np.abs(roots.real), _STABLE * np.abs(roots)) + 1j * roots.imag
        pairs = roots[roots.imag > 0]
        return np.concatenate([pairs, roots[roots.imag == 0]])

    def _linear(self, poles: ComplexArray) -> tuple[Array, Array]:
        """Return the coefficients of a function with these poles, and its weighted error."""
        rows = _real(self._own(poles) * self.weight[:, None])
        right = _real((self.values * self.weight)[:, None])[:, 0]
        solution = _solved(rows, right)
        return solution, rows @ solution - right

    def _refined(self, poles: ComplexArray) -> ComplexArray:
        """Return the poles of least weighted error, from poles near them."""
        from scipy.optimize import least_squares  # slow to load: not before it is wanted

        pairs = int(np.count_nonzero(poles.imag))
        # Decay and frequency, each over the pole's size.
        size = np.abs(poles)

        def at(x: Array) -> ComplexArray:
            imag = np.concatenate([x[len(poles) :] * size[:pairs], np.zeros(len(poles) - pairs)])
            return np.asarray(x[: len(poles)] * size + 1j * imag)

        start = np.concatenate([poles.real / size, poles.imag[:pairs] / size[:pairs]])
        upper = np.full(len(start), np.inf)
        if self._keep:
            upper[: len(poles)] = -_STABLE / 2

        def error(x: Array) -> Array:
            return self._linear(at(x))[1]

        found = least_squares(error, start, bounds=(-np.inf, upper), max_nfev=_STEPS, x_scale="jac")
        return at(found.x)

    def criterion(self, poles: ComplexArray) -> float:
        """Return the Bayesian information criterion of these poles (G. Schwarz, 1978)."""
        count = 2 * len(self.s)
        error = self._linear(poles)[1]
        square = float(error @ error)
        order = len(poles) + int(np.count_nonzero(poles.imag)) + self.at_zero
        penalty = self.coefficients(order) * np.log(count)
        if self.known:
            return square + penalty
        return count * float(np.log(max(square / count, _EXACT**2))) + penalty

    def finished(self, poles: ComplexArray) -> RationalFit:
        """Return the function with these poles."""
        solution, error = self._linear(poles)
        system = self._system(poles, solution)
        size = np.hypot(*error.reshape(2, -1)) / (self.weight * np.abs(self.values))
        return RationalFit(
            system,
            self.response,
            system.nstates,
            self.at_zero,
            bool(np.all(poles.real < 0)),
            float(np.sqrt(np.mean(size**2))),
            float(size.max()),
            float(np.sqrt(np.mean(error**2))) if self.known else float("nan"),
        )

    def _system(self, poles: ComplexArray, solution: Array) -> LinearSystem:
        count = len(solution) - 1 - self.at_zero
        A, B = _blocks(poles)
        n = len(A)
        # Poles at zero are a chain of integrators, the first of which has the input.
        whole = np.zeros((n + self.at_zero, n + self.at_zero))
        whole[:n, :n], whole[n:, n:] = A, np.eye(self.at_zero, k=-1)
        entering = np.concatenate([B, np.eye(self.at_zero)[:1].sum(axis=0)])
        C, D = np.delete(solution, count), float(solution[count])
        # Time was counted in units of the scale.
        A, B = whole * self._scale, entering * self._scale
        if self.step:
            # w = (2/T)(z − 1)/(z + 1), turned round.
            half, eye = A * self.step / 2, np.eye(len(A))
            C = np.asarray(np.linalg.solve((eye - half).T, C))
            D += float(C @ B) * self.step / 2
            A = np.asarray(np.linalg.solve(eye - half, eye + half))
            B = np.asarray(np.linalg.solve(eye - half, B)) * self.step
        return LinearSystem(
            A,
            B[:, None],
            C[None],
            np.array([[D]]),
            self.step,
            inputs=[self.response.actuator],
            outputs=[self.response.sensor],
            name=f"rational_{len(A)}",
        )


def _blocks(poles: ComplexArray) -> tuple[Array, Array]:
    """Return (A, B) of a sum of real poles and pairs, whose coefficients are then C."""
    size = len(poles) + int(np.count_nonzero(poles.imag))
    A, B = np.zeros((size, size)), np.zeros(size)
    at = 0
    for pole in poles:
        if pole.imag:
            A[at : at + 2, at : at + 2] = [[pole.real, pole.imag], [-pole.imag, pole.real]]
            B[at] = 2.0
            at += 2
        else:
            A[at, at], B[at] = pole.real, 1.0
            at += 1
    return A, B


def _real(columns: ComplexArray | Array) -> Array:
    return np.asarray(np.vstack([columns.real, columns.imag]))


def _solved(rows: Array, right: Array) -> Array:
    """Return the least squares of columns that differ in size."""
    size = np.linalg.norm(rows, axis=0)
    size = np.where(size > 0, size, 1.0)
    return np.asarray(np.linalg.lstsq(rows / size, right, rcond=None)[0] / size)
