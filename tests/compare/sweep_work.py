"""Work for sweeps, importable by the worker processes."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import numpy as np

from slewctl.errors import InputError


def squares(number: int) -> list[dict[str, float]]:
    return [{"number": number, "square": float(number**2)}]


def eigenvalues(seed: int) -> list[dict[str, float]]:
    """A result whose last digits depend on the number of BLAS threads."""
    matrix = np.random.default_rng(seed).normal(size=(120, 120))
    return [{"seed": seed, "largest": float(np.abs(np.linalg.eigvals(matrix)).max())}]


def slow(number: int) -> list[dict[str, int]]:
    time.sleep(0.2)
    return [{"number": number}]


def deadly(work: tuple[int, str]) -> list[dict[str, int]]:
    """Kill the worker: always for number 3, and once only for number 5."""
    number, folder = work
    once = Path(folder) / "killed"
    if number == 3 or (number == 5 and not once.exists()):
        once.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return [{"number": number}]


def refusing(number: int) -> list[dict[str, int]]:
    raise InputError("wrong", where="a.b", remedy="mend it")
