"""The shape formulas as printed in the paper, in as many digits as their cancellation needs."""

from __future__ import annotations

from functools import cache

import mpmath as mp
import numpy as np

DIGITS = 50


def _digits(i: int) -> int:
    """Digits such that DIGITS remain after cosh βL ~ exp(iπ) has cancelled."""
    return DIGITS + int((i + 1) * np.pi / np.log(10)) + 10


@cache
def root(name: str, i: int) -> mp.mpf:
    """The i-th root of cos z cosh z = −1 or tan z = tanh z."""
    with mp.workdps(_digits(i)):
        if name == "clamped-free":
            guess = (2 * i - 1) * mp.pi / 2
            guess += (-1) ** (i + 1) * mp.sech(guess)
            return mp.findroot(lambda z: mp.cos(z) + mp.sech(z), guess)
        guess = (4 * i + 1) * mp.pi / 4
        return mp.findroot(lambda z: mp.sin(z) - mp.cos(z) * mp.tanh(z), guess)


def shape(name: str, i: int, xi: float, derivative: int) -> mp.mpf:
    """φ_i or a derivative of it at the double `xi`, correct to `DIGITS` digits."""
    with mp.workdps(_digits(i)):
        z, x = root(name, i), mp.mpf(float(xi))
        sine, cosine = _turned(mp.sin, z * x, derivative), _turned(mp.cos, z * x, derivative)
        sinh, cosh = mp.sinh(z * x), mp.cosh(z * x)
        if derivative % 2:
            sinh, cosh = cosh, sinh
        if name == "clamped-free":
            s = (mp.sin(z) + mp.sinh(z)) / (mp.cos(z) + mp.cosh(z))
            return z**derivative * (sine - sinh + s * (cosh - cosine))
        c = mp.sin(z) / mp.sinh(z)
        sigma = 1 / (2 * mp.sin(z) - z * (1 + c))
        line = (z * (1 + c) * x, z * (1 + c), 0, 0)[derivative]
        return sigma * (z**derivative * (sine + c * sinh) - line)


def _turned(function, angle: mp.mpf, times: int) -> mp.mpf:
    """The `times`-th derivative of sin or cos."""
    return function(angle + times * mp.pi / 2)
