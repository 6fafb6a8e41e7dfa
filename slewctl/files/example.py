"""A design file to try things on."""

from __future__ import annotations

from pathlib import Path
from tempfile import mkdtemp

_TEXT = """\
arm = { catalogue = "paper-beam", hub.inertia = 0.2, damping_ratio = 0.01 }
model = { basis = "clamped-free", n = 1 }
requirements = { gain_margin_db = 3.0 }
[controller]
method = "lqg"
limits = { tip = 0.03, torque = 1.0 }
noise = { torque = 0.1, theta = 0.01 }
"""


def example_design() -> Path:
    """Write a small design into a new temporary folder, for examples and first steps.

    Returns
    -------
    Path
        Of ``arm.toml``.

    Examples
    --------
    >>> example_design().name
    'arm.toml'
    """
    path = Path(mkdtemp()) / "arm.toml"
    path.write_text(_TEXT, encoding="utf-8")
    return path
