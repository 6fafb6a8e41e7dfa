"""Frequency responses from files: CSV, MATLAB, NumPy, JSON and universal files (UFF)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from slewctl._types import Array, ComplexArray, FilePath
from slewctl.errors import InputError, SlewctlError, check_choice, check_path, check_positive, shown
from slewctl.measured.response import Response
from slewctl.measured.table import holds, pick, pick_real, read_columns
from slewctl.measured.units import FREQUENCIES

UFF_SUFFIXES = (".uff", ".unv")
# Of a universal file's dataset 58: a frequency response.
_FREQUENCY_RESPONSE = 4
# What a column may hold.
_NAMES = (
    *(f"frequency_{unit}" for unit in FREQUENCIES), "response", "real", "imag", "gain", "gain_db",
    "phase_deg", "phase_rad", "coherence", "deviation",
)  # fmt: skip


def read_response(
    file: FilePath,
    columns: Mapping[str, str] | None = None,
    *,
    actuator: str = "torque",
    sensor: str = "theta",
    factor: float = 1.0,
    sample_time: float = 0.0,
    averages: float | None = None,
) -> Response:
    """Read a frequency response; names of columns say what they hold and in which unit.

    Parameters
    ----------
    file : path
        ``.csv``, ``.mat``, ``.npz`` or ``.json`` with the columns

        * ``frequency_hz`` or ``frequency_rad_s``,
        * ``response`` (complex, as 1+2j), or ``real`` and ``imag``, or ``gain`` or ``gain_db``
          with ``phase_deg`` or ``phase_rad``,
        * and, if it has them, ``coherence`` and ``deviation`` (see `Response`),

        or a universal file (``.uff``, ``.unv``) with a frequency response, which needs
        ``slewctl[uff]``.
    columns : mapping of str to str, optional
        The file's own name for each of these, as in ``{"gain_db": "Mag (dB)"}``; for a
        universal file ``{"response": "1x/2x"}``, response over reference.
    actuator : {"torque", "voltage"}
    sensor : str
        A signal of an arm.
    factor : float
        What the values are multiplied with to be in the sensor's SI unit per N·m or V, such as
        0.0174533 for degrees.
    sample_time : float
        See `Response`.
    averages : float, optional
        How many independent averages the coherence is of: it gives the deviations.

    Returns
    -------
    Response
        Points that are not finite are left out and told.

    Raises
    ------
    InputError
        In one line: a file that is not there, a column that is not in it (with those that
        are), fewer than two points.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> import slewctl as sc
    >>> file = Path(mkdtemp()) / "analyser.csv"
    >>> _ = file.write_text("f,mag,ph\\n1.0,6.0,-90\\n2.0,0.0,-120\\n")
    >>> columns = {"frequency_hz": "f", "gain_db": "mag", "phase_deg": "ph"}
    >>> abs(sc.read_response(file, columns).values).round(3).tolist()
    [1.995, 1.0]
    """
    path = check_path(file, "file")
    check_positive(factor, "factor")
    if averages is not None:
        check_positive(averages, "averages")
    asked = dict(columns or {})
    if path.suffix.lower() in UFF_SUFFIXES:
        frequencies, values, coherence = _from_uff(path, asked.get("response"))
        deviation = np.full(len(coherence), np.nan)
    else:
        frequencies, values, coherence, deviation = _from_columns(path, asked)
    good = np.isfinite(frequencies) & np.isfinite(values) & (frequencies > 0)
    left_out = int(np.count_nonzero(~good))
    remarks = (f"{left_out} points are no finite numbers, and left out",) if left_out else ()
    order = np.argsort(frequencies[good], kind="stable")
    coherence = coherence[good][order]
    deviation = deviation[good][order]
    if averages is not None:
        deviation = deviation_of(coherence, averages)
    try:
        return Response(
            frequencies[good][order],
            factor * values[good][order],
            deviation,
            coherence,
            sample_time,
            actuator,
            sensor,
            path.name,
            remarks,
        )
    except SlewctlError as error:
        raise error.within(str(path)) from error


def deviation_of(coherence: Array, averages: float) -> Array:
    """Return √((1 − C)/(2nC)), the relative deviation of a magnitude and that of a phase in rad.

    (J. S. Bendat and A. G. Piersol, Random Data, 4th ed., 2010, section 9.2.)
    """
    with np.errstate(divide="ignore"):
        return np.sqrt((1 - np.minimum(coherence, 1)) / (2 * averages * coherence))


def _from_columns(path: Path, asked: dict[str, str]) -> tuple[Array, ComplexArray, Array, Array]:
    held = read_columns(path)
    where = str(path)
    for name, column in asked.items():
        check_choice(name, _NAMES, "columns")
        pick(held, column, where)
    known = {**{name: name for name in held}, **asked}

    def has(name: str) -> bool:
        return known.get(name) in held

    def real(name: str) -> Array:
        return pick_real(held, known[name], where)

    units = [unit for unit in FREQUENCIES if has(f"frequency_{unit}")]
    if not units:
        raise _missing(held, where, "a frequency", "frequency_hz or frequency_rad_s")
    frequencies = FREQUENCIES[units[0]] * real(f"frequency_{units[0]}")
    unknown = np.full(len(frequencies), np.nan)
    coherence = real("coherence") if has("coherence") else unknown
    deviation = real("deviation") if has("deviation") else unknown
    if has("response"):
        values = pick(held, known["response"], where)
    elif has("real") and has("imag"):
        values = real("real") + 1j * real("imag")
    else:
        gains = [name for name in ("gain", "gain_db") if has(name)]
        phases = [name for name in ("phase_deg", "phase_rad") if has(name)]
        if not gains or not phases:
            raise _missing(
                held, where, "a response", "response, real and imag, or gain_db and phase_deg"
            )
        gain, phase = real(gains[0]), real(phases[0])
        if gains[0] == "gain_db":
            gain = 10 ** (gain / 20)
        elif (gain < 0).any():
            first = float(frequencies[int(np.argmax(gain < 0))])
            raise InputError(
                f"{known['gain']} is negative at {first:.6g} Hz: it is no magnitude",
                where=where,
                remedy="in decibels it is gain_db; of another sign, add 180 to the phase",
            )
        if phases[0] == "phase_deg":
            phase = np.deg2rad(phase)
        values = gain * np.exp(1j * phase)
    rows = [len(column) for column in (frequencies, values, coherence, deviation)]
    if len(set(rows)) > 1:
        raise InputError(
            f"its columns have {', '.join(map(str, rows))} rows",
            where=where,
            remedy="give one value a frequency",
        )
    return frequencies, values, coherence, deviation


def _missing(held: Mapping[str, Any], where: str, what: str, names: str) -> InputError:
    return InputError(
        f"no column is known as {what}: it holds {holds(held)}",
        where=where,
        remedy=f"map them, as columns={{{names.split()[0].strip(',')!r}: …}}; known are {names}",
    )


def _from_uff(path: Path, wanted: str | None) -> tuple[Array, ComplexArray, Array]:
    """Return a frequency response of a universal file (dataset 58)."""
    try:
        import pyuff  # an option: nothing else here needs it
    except ImportError as error:
        raise InputError(
            "pyuff is not installed", where=str(path), remedy="pip install 'slewctl[uff]'"
        ) from error
    if not path.is_file():
        raise InputError("there is no such file", where=str(path), remedy="check the path")
    try:
        sets = pyuff.UFF(str(path)).read_sets()
    except Exception as error:
        raise InputError(
            f"it is no universal file: {' '.join(str(error).split())}",
            where=str(path),
            remedy="write dataset 58",
        ) from error
    found = {
        _measured_at(each): each
        for each in (sets if isinstance(sets, list) else [sets])
        if each.get("type") == 58 and each.get("func_type") == _FREQUENCY_RESPONSE
    }
    if not found or (wanted is not None and wanted not in found):
        told = f"no {shown(wanted)}" if wanted and found else "no frequency response"
        raise InputError(
            f"{told} is in it: it holds {holds(found)}", where=str(path), remedy="name one of these"
        )
    if wanted is None and len(found) > 1:
        raise InputError(
            f"it holds {len(found)} frequency responses: {holds(found)}",
            where=str(path),
            remedy=f"name one, as columns={{'response': {next(iter(found))!r}}}",
        )
    one = found[wanted or next(iter(found))]
    frequencies = np.asarray(one["x"], dtype=float)
    return frequencies, np.asarray(one["data"], complex), np.full(len(frequencies), np.nan)


def _measured_at(dataset: Mapping[str, Any]) -> str:
    """Return where a response was measured over where it was excited: 3z/1x."""
    axes = {0: "", 1: "x", 2: "y", 3: "z", 4: "rx", 5: "ry", 6: "rz"}

    def place(kind: str) -> str:
        direction = int(dataset.get(f"{kind}_dir", 0))
        mark = "-" if direction < 0 else ""
        return f"{dataset.get(f'{kind}_node', 0)}{mark}{axes.get(abs(direction), '')}"

    return f"{place('rsp')}/{place('ref')}"
