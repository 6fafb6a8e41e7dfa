"""The equations of a large slew in modes and momenta, the form that is integrated.

In the modes U of the linear model, [θ, q] = Uη, and with the momenta π = Uᵀ ∂T/∂ẋ as rates
the equations are, with S̃ = UᵀSU, δ = ηᵀS̃η, u = Uᵀb, t = Uᵀ∂θ̇/∂ẋ and c = tᵀt,

    η̇ = π − δθ̇t,      π̇ = −ω²η + θ̇²S̃η + uτ − UᵀDU η̇,      θ̇ = tᵀπ / (1 + δc).

u and t differ where an elastic joint lies between the torque and the hub.
Nothing in them is both nonlinear and stiff, which is what `GaussCollocation` is for.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from slewctl._types import Array
from slewctl.errors import AccuracyError, SlewctlError
from slewctl.model.nonlinear import NonlinearModel


class ModalForm:
    """The equations in modes and their momenta, y = [wη, π] (see the module's docstring).

    w is ω, and ω_1 for the rigid rotation, so that both halves of y are rates.

    Parameters
    ----------
    equations : NonlinearModel
    torque : callable
        τ in N·m at an array of times.
    """

    def __init__(self, equations: NonlinearModel, torque: Callable[[Array], Array]) -> None:
        model = equations.linear
        self.equations, self.torque = equations, torque
        self.U = model.mode_shapes
        self.u, self.hub = self.U[0].copy(), equations.turning
        self.size = model.n + 1
        self._w = np.concatenate([model.omega[:1], model.omega])
        squared = np.concatenate([[0.0], model.omega**2])
        self.damping = self.U.T @ model.damping @ self.U
        self._softening = self.U[1:].T @ equations.softening @ self.U[1:]
        self._compliance = float(self.hub @ self.hub)
        self.A = np.block(
            [
                [np.zeros((self.size, self.size)), np.diag(self._w)],
                [-np.diag(squared / self._w), -self.damping],
            ]
        )
        # The angle itself moves nothing and grows without bound.
        self.counted = np.ones(2 * self.size)
        self.counted[0] = 0.0
        self._excess: Array | None = None

    def _bent(self, y: Array) -> tuple[Array, Array, Array]:
        """Return S̃η, δ and 1 + δc at each row of y."""
        eta = y[..., : self.size] / self._w
        pull = eta @ self._softening
        change = (eta * pull).sum(axis=-1)
        return pull, change, 1 + change * self._compliance

    def forcing(self, times: Array) -> Array:
        """Return what the torque adds to ẏ at the stages."""
        g = np.zeros((len(times), 2 * self.size))
        g[:, self.size :] = self.torque(times)[:, None] * self.u
        return g

    def remainder(self, y: Array) -> Array | None:
        """Return the nonlinear part of ẏ; None where the mass matrix is indefinite."""
        pull, change, meeting = self._bent(y)
        if not np.all(meeting > 0):
            self._excess = self._deflection(y[np.argmin(meeting)])
            return None
        self._excess = None
        rate = (y[:, self.size :] @ self.hub) / meeting
        lost = (change * rate)[:, None] * self.hub
        f = np.empty_like(y)
        f[:, : self.size] = -lost * self._w
        f[:, self.size :] = (rate**2)[:, None] * pull + lost @ self.damping
        return f

    def from_state(self, state: Array) -> Array:
        """Return y of the state [θ, q, θ̇, q̇]."""
        x, rates = np.split(state, 2)
        model = self.equations.linear
        eta = self.U.T @ (model.mass @ x)  # U⁻¹ = UᵀM
        momenta = self.U.T @ (model.mass @ rates)
        y = np.concatenate([self._w * eta, momenta])
        _, change, meeting = self._bent(y)
        if not meeting > 0:
            raise self.equations.excessive(x[1:])
        y[self.size :] += change * (model.turning @ rates) * self.hub
        return y

    def to_states(self, y: Array) -> Array:
        """Return the states [θ, q, θ̇, q̇] (θ_m with a joint) of rows of y."""
        return np.hstack([(y[:, : self.size] / self._w) @ self.U.T, self.rates(y)])

    def rates(self, y: Array) -> Array:
        """Return [θ̇, q̇] of rows of y."""
        _, change, meeting = self._bent(y)
        momenta = y[:, self.size :]
        rate = (momenta @ self.hub) / meeting
        return np.asarray((momenta - (change * rate)[:, None] * self.hub) @ self.U.T)

    def _deflection(self, y: Array) -> Array:
        """Return q."""
        return np.asarray(self.U[1:] @ (y[: self.size] / self._w))

    def reason(self, error: AccuracyError) -> SlewctlError:
        """Return why the steps became so small: the arm bends too far, or else `error`."""
        return error if self._excess is None else self.equations.excessive(self._excess)
