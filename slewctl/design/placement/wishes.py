"""What a designer wishes of the poles, turned into the poles wanted of each mode.

The options come as they stand in a design file: numbers, lists and tables.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from numbers import Complex, Real

import numpy as np

from slewctl._types import ComplexArray
from slewctl.design.mode_numbers import check_mode, check_modes
from slewctl.design.placement.pole_pairs import (
    LonePole,
    PolePair,
    Roots,
    flexible_modes,
    mode_name,
    paired,
)
from slewctl.errors import (
    DesignError,
    InputError,
    check_each,
    check_nonnegative,
    check_number,
    check_positive,
    shown,
)

# Errors of the estimate decay faster at their own frequency up to this damping ratio.
_OBSERVER_RATIO = 0.7
# The observer damps a mode that the state feedback does not move at least so, unless told.
_LEAST_RATIO = 0.1
# A pole and the conjugate of another that differ by less, relative, belong together.
_CONJUGATE = 1e-9

Wanted = dict[int, Roots]


def wished(
    pairs: Sequence[Roots],
    bandwidth_hz: object,
    damping_ratio: object,
    added_damping: object,
    leave: frozenset[int],
) -> Wanted:
    """Return the wanted pair of each mode that is to be moved.

    Parameters
    ----------
    pairs : sequence of PolePair or LonePole
        The plant's own, in rad/s, the rigid body first.  A lone pole stays.
    bandwidth_hz, damping_ratio, added_damping : object
        See `slewctl.design.placement.pole_placement`.
    leave : frozenset of int
        Numbers of the modes left alone, from `left_alone`.
    """
    bandwidth = 2 * math.pi * check_positive(bandwidth_hz, "bandwidth_hz")
    wanted: Wanted = {0: PolePair.mode(bandwidth, check_positive(damping_ratio, "damping_ratio"))}
    for number, added in _added(added_damping, flexible_modes(pairs), leave).items():
        if added == 0:
            continue
        own = pairs[number]
        ratio = own.ratio + added
        if not ratio < 1:
            raise InputError(
                f"{mode_name(number, own)} would have a damping ratio of {ratio:.3g}",
                where=_place(added_damping, number),
                remedy=f"add less than {1 - own.ratio:.3g}"
                if own.ratio < 1
                else "name it in leave: it does not oscillate",
            )
        wanted[number] = PolePair.mode(own.frequency, ratio)
    return wanted


def _added(given: object, modes: int, leave: frozenset[int]) -> dict[int, float]:
    """Return the damping ratio to add to each mode that is named or meant."""
    where = "added_damping"
    if isinstance(given, Real) and not isinstance(given, bool):
        ratio = check_nonnegative(given, where)
        if ratio and len(leave) == modes:
            raise InputError(
                "every flexible mode is left alone, so that no mode is damped",
                where=where,
                remedy="take one of them out of leave, or leave it out",
            )
        return {number: ratio for number in range(1, modes + 1) if number not in leave}
    if isinstance(given, Mapping):
        named = {_mode_key(key): value for key, value in given.items()}
    elif isinstance(given, Sequence) and not isinstance(given, str):
        named = dict(enumerate(given, start=1))
    else:
        raise InputError(
            f"{shown(given)} says no damping",
            where=where,
            remedy='give a number, a list of one for each mode, or a table such as { "1" = 0.05 }',
        )
    ratios = {}
    for number, value in named.items():
        place = _place(given, number)
        check_mode(number, modes, place)
        ratios[number] = check_nonnegative(value, place)
        if ratios[number] > 0 and number in leave:
            raise InputError(
                f"mode {number} is to be left alone and to be damped",
                where=place,
                remedy="take it out of one of leave and added_damping",
            )
    return ratios


def _place(added: object, number: int) -> str:
    """Return where the damping of a mode is given: in a table by number, in a list from 0."""
    if isinstance(added, Real):
        return "added_damping"
    return f"added_damping.{number if isinstance(added, Mapping) else number - 1}"


def _mode_key(key: object) -> int:
    text = str(key)
    if isinstance(key, bool) or not text.isdecimal():
        raise InputError(
            f"{shown(key)} is not the number of a mode",
            where="added_damping",
            remedy='number the flexible modes from 1, as in { "1" = 0.05 }',
        )
    return int(text)


def left_alone(given: object, modes: int) -> frozenset[int]:
    """Return the numbers of the modes that are to keep their poles.

    Raises
    ------
    InputError
        If it is no list, or a mode is not one of 1 … `modes`.
    """
    if isinstance(given, str) or not isinstance(given, Sequence):
        raise InputError(
            f"{shown(given)} is not a list of modes", where="leave", remedy="give one, as in [2, 3]"
        )
    if 0 in given:
        raise InputError(
            "0 would be the rigid-body rotation, which cannot be left to drift",
            where=f"leave.{given.index(0)}",
            remedy="number the flexible modes from 1",
        )
    return frozenset(check_modes(given, modes, "leave"))


def check_damped(pairs: Sequence[Roots], wanted: Mapping[int, Roots]) -> None:
    """Refuse to leave a mode alone that is not stable by itself."""
    for number, pair in enumerate(pairs):
        if number not in wanted and pair.damping <= 1e-12 * pair.frequency:
            raise DesignError(
                f"{mode_name(number, pair)} has no damping of its own and is left alone",
                where="added_damping",
                remedy="add some to it, or give the arm its damping_ratio",
            )


def explicit(given: object, where: str, *, stable: bool = False) -> ComplexArray:
    """Return a list of poles: real numbers, complex ones or pairs [re, im], in rad/s.

    Raises
    ------
    InputError
        If it is no such list, a complex pole comes without its conjugate, or one that is to be
        stable is not left of the imaginary axis.
    """
    if isinstance(given, np.ndarray):
        given = given.tolist()
    if isinstance(given, str) or not isinstance(given, Sequence):
        raise InputError(
            f"{shown(given)} is not a list of poles",
            where=where,
            remedy="give one in rad/s, as in [-3.0, [-2.0, 2.0], [-2.0, -2.0]]",
        )
    poles = check_each(given, where, _stable_pole if stable else _pole)
    return _conjugate(np.array(poles, dtype=complex), where)


def _pole(value: object, where: str) -> complex:
    if isinstance(value, Sequence) and not isinstance(value, str) and len(value) == 2:
        return complex(check_number(value[0], where), check_number(value[1], where))
    if isinstance(value, Complex) and not isinstance(value, bool):
        number = complex(value)
        return complex(check_number(number.real, where), check_number(number.imag, where))
    raise InputError(
        f"{shown(value)} is not a pole",
        where=where,
        remedy="give a real number, or [real part, imaginary part], in rad/s",
    )


def _stable_pole(value: object, where: str) -> complex:
    pole = _pole(value, where)
    if not pole.real < 0:
        raise InputError(
            f"the pole {pole.real:g}{pole.imag:+g}j is not left of the imaginary axis",
            where=where,
            remedy="give poles with a negative real part",
        )
    return pole


def _conjugate(poles: ComplexArray, where: str) -> ComplexArray:
    """Return poles with each complex one followed by exactly its conjugate."""
    result = [pole for pole in poles if pole.imag == 0]
    lower = [pole for pole in poles if pole.imag < 0]
    for pole in (p for p in poles if p.imag > 0):
        distance = [abs(other.conjugate() - pole) for other in lower]
        if not distance or min(distance) > _CONJUGATE * abs(pole):
            raise _without_conjugate(pole, poles, where)
        other = lower.pop(int(np.argmin(distance)))
        pole = (pole + other.conjugate()) / 2
        result += [pole, pole.conjugate()]
    if lower:
        raise _without_conjugate(lower[0], poles, where)
    return np.array(result, dtype=complex)


def _without_conjugate(pole: complex, poles: ComplexArray, where: str) -> InputError:
    conjugate = f"[{pole.real:g}, {-pole.imag:g}]"
    return InputError(
        f"the pole {pole.real:g}{pole.imag:+g}j comes without its conjugate",
        where=f"{where}.{int(np.argmax(poles == pole))}",
        remedy=f"add {conjugate}: a real gain makes both or neither",
    )


def matched(
    pairs: Sequence[Roots], poles: ComplexArray, where: str, leave: frozenset[int] = frozenset()
) -> Wanted:
    """Return explicit poles as wanted pairs; a mode whose own poles are among them stays.

    Parameters
    ----------
    pairs : sequence of PolePair
        The plant's own, in rad/s.
    poles : ndarray of complex
        From `explicit`.
    where : str
    leave : frozenset of int
        Modes left alone, whose poles are not among those given.

    Raises
    ------
    InputError
        If there are not two poles for each mode that is not left alone, and one for a lag.
    """
    moved = [number for number in range(len(pairs)) if number not in leave]
    needed = sum(len(pairs[number].poles) for number in moved)
    if len(poles) != needed:
        modes, lag = divmod(needed, 2)
        raise InputError(
            f"{len(poles)} poles for {modes} modes, the rigid-body rotation included"
            f"{', and a real pole' if lag else ''}",
            where=where,
            remedy=f"give {needed}, two for each{' and one' if lag else ''}, or leave some modes "
            "alone",
        )
    # The pole of a lag may stay wherever it stands among the real ones given.
    own = [complex(pole) for pole in poles]
    kept_lag = next(
        (
            pole
            for pole in own
            for pair in pairs
            if not pole.imag and pair.same(LonePole(pole.real))
        ),
        None,
    )
    if kept_lag is not None:
        own.remove(kept_lag)
        moved.pop()
    wanted = list(paired(np.array(own)))
    for number in tuple(moved):
        kept = next((pair for pair in wanted if pair.same(pairs[number])), None)
        if kept is not None:
            wanted.remove(kept)
            moved.remove(number)
    return dict(zip(moved, wanted, strict=True))


def faster(pair: Roots, speed: float) -> Roots:
    """Return a pair that decays `speed` times as fast.

    At the same frequency as long as its damping ratio stays below 0.7 (or its own, if that
    is higher), farther out beyond: a vibration is not asked to be estimated at a multiple of
    its frequency.

    Parameters
    ----------
    pair : PolePair or LonePole
    speed : float
    """
    if isinstance(pair, LonePole):
        return pair.times(speed)
    ratio = speed * pair.ratio
    highest = max(_OBSERVER_RATIO, pair.ratio)
    if ratio <= highest:
        return PolePair.mode(pair.frequency, ratio)
    return PolePair.mode(pair.frequency * ratio / highest, highest)


def followed(
    own: Sequence[Roots],
    wanted: Mapping[int, Roots],
    alone: frozenset[int],
    speed: float,
    damping: object | None,
) -> Wanted:
    """Return the pairs wanted of an observer for a state feedback with the pairs `wanted`.

    Parameters
    ----------
    own : sequence of PolePair or LonePole
    wanted : mapping of int to PolePair or LonePole
    alone : frozenset of int
        Modes that the observer leaves alone too.
    speed : float
        See `faster`.
    damping : object, optional
        Least damping ratio for the modes that the state feedback does not move, by default a
        tenth.

    Raises
    ------
    InputError
        If it is no damping ratio, or given where there is no such mode.
    """
    least = check_nonnegative(_LEAST_RATIO if damping is None else damping, "observer_damping")
    if least >= 1:
        raise InputError(
            f"{least:g} is not below 1", where="observer_damping", remedy="give one such as 0.1"
        )
    pairs = {number: faster(pair, speed) for number, pair in wanted.items()}
    unmoved = [number for number in range(len(own)) if number not in {*pairs, *alone}]
    if damping is not None and not unmoved:
        raise InputError(
            "there is no mode that the state feedback does not move and leave does not name",
            where="observer_damping",
            remedy="leave it out",
        )
    for number in unmoved:
        pair = own[number]
        if pair.ratio < least:
            pairs[number] = PolePair.mode(pair.frequency, least)
    return pairs
