"""How good each basis is everywhere: worst errors of four functions over hubs, payloads, tapers.

Over J_h/J_beam in {0, 1e-3 … 1e3} and m_t/m_beam in {0, 0.01, 0.1, 1, 10} the worst relative
error, against the converged truth and over the flexible modes 1–3, of the frequency and of the
residues θ_k² (torque to hub angle) and θ_k·y_k(L) (torque to tip).

Run as ``python tests/benchmarks/bases.py``.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.polynomial import Polynomial as PowerSeries

from slewctl import Arm, Beam, Hub, Model, Payload, assemble, truth
from slewctl.basis import (
    ArmMatched,
    Basis,
    ClampedFree,
    HubMatched,
    Polynomial,
    Slewing,
    WithStatic,
)

FUNCTIONS, MODES = 4, 3
HUBS = (0.0, *(10.0**k for k in range(-3, 4)))
PAYLOADS = (0.0, 0.01, 0.1, 1.0, 10.0)
TAPERS = {
    "uniform": (1.0,),
    "1 − ξ/2": (1.0, -0.5),
    "1 − (5/6)ξ³": (1.0, 0.0, 0.0, -5.0 / 6.0),
    "1 − 0.9ξ": (1.0, -0.9),
}
COMPARED: dict[str, Basis] = {
    "slewing": Slewing(4),
    "clamped-free": ClampedFree(4),
    "polynomial": Polynomial(4),
    "slewing 3 + static": WithStatic(Slewing(3)),
    "clamped-free 3 + static": WithStatic(ClampedFree(3)),
    "hub-matched": HubMatched(4),
    "hub-matched 3 + static": WithStatic(HubMatched(3)),
    "arm-matched, 1 step": ArmMatched(4, 1),
    "arm-matched, 2 steps": ArmMatched(4, 2),
    "arm-matched (3 steps)": ArmMatched(4),
}


def make_arm(taper: tuple[float, ...], hub: float, payload: float) -> Arm:
    """Return the arm with m̄ = EI = `taper` whose hub and payload are these ratios."""
    mass = PowerSeries(taper)
    inertia = (mass * PowerSeries((0.0, 0.0, 1.0))).integ()(1.0)
    return Arm(Beam(1.0, taper, taper), Hub(hub * inertia), Payload(payload * mass.integ()(1.0)))


def quantities(model: Model) -> np.ndarray:
    """Return ω_k, θ_k² and θ_k·y_k(L) of the first flexible modes, shape (3, MODES)."""
    chosen = slice(1, MODES + 1)
    theta = model.mode_shapes[0, chosen]
    tip = (model.displacement(np.ones(1)) @ model.mode_shapes)[0, chosen]
    return np.array([model.omega[:MODES], theta**2, theta * tip])


def worst(taper: tuple[float, ...]) -> dict[str, np.ndarray]:
    """Return for each basis the worst relative errors (3,) over the grid."""
    found = {name: np.zeros(3) for name in COMPARED}
    for hub, payload in itertools.product(HUBS, PAYLOADS):
        arm = make_arm(taper, hub, payload)
        exact = quantities(truth(arm, 8))
        for name, basis in COMPARED.items():
            values = quantities(assemble(arm, basis))
            error = np.abs(values / exact - 1).max(axis=1)
            found[name] = np.maximum(found[name], error)
    return found


def main() -> None:
    """Print one table for each taper."""
    for label, taper in TAPERS.items():
        print(f"m̄ = EI = {label}: worst error in %")
        print(f"  {'basis':26s}{'frequency':>12s}{'θ residue':>12s}{'tip residue':>13s}")
        for name, error in worst(taper).items():
            print(f"  {name:26s}" + "".join(f"{100 * e:12.2g}" for e in error))


if __name__ == "__main__":
    main()
