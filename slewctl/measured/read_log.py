"""Logs from files: CSV, MATLAB, NumPy and JSON."""

from __future__ import annotations

from collections.abc import Mapping

from slewctl._types import ComplexArray, FilePath
from slewctl.errors import InputError, SlewctlError, check_path, check_positive
from slewctl.measured.flaws import clock_of, on_the_clock
from slewctl.measured.log import Log
from slewctl.measured.table import holds, pick, pick_real, read_columns
from slewctl.measured.units import COUNTS, TIMES, Named, named
from slewctl.plant.signals import ACTUATORS

_TIME = {f"time_{unit}": factor for unit, factor in TIMES.items()} | {"time": 1.0}
_REFERENCE = "reference"


def read_log(
    file: FilePath,
    columns: Mapping[str, str] | None = None,
    *,
    sample_time: float | None = None,
    counts_per_turn: float | None = None,
) -> Log:
    """Read a log; names of columns say what they hold and in which unit.

    Parameters
    ----------
    file : path
        ``.csv``, ``.mat``, ``.npz`` or ``.json`` with the columns

        * ``time_s``, ``time_ms`` or ``time_us``, which may be left out with a `sample_time`,
        * one actuator: ``torque`` (N·m), ``voltage`` (V), also ``voltage_mv``,
        * one sensor, such as ``theta`` (rad), ``theta_deg``, ``theta_counts``, ``tip_mm``,
          ``root_moment``, ``moment@50mm``,
        * and ``reference``, if the log was made in closed loop.
    columns : mapping of str to str, optional
        The file's own name for each of these, as in
        ``{"time_s": "t", "voltage": "u", "theta_deg": "enc"}``.  Signals that it names are
        the ones taken.
    sample_time : float, optional
        In s.  With a time column the two must agree.
    counts_per_turn : float, optional
        Of the encoder, after quadrature, for ``theta_counts``.

    Returns
    -------
    Log
        `Log.remarks` tells gaps, an irregular clock, samples that are no numbers, a clipped
        input and the steps of an encoder.

    Raises
    ------
    InputError
        In one line: a file that is not there, a column that is not in it (with those that
        are), clocks that disagree.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> import slewctl as sc
    >>> file = Path(mkdtemp()) / "run.csv"
    >>> rows = [f"{k * 5},{(-1) ** (k // 4)},{k % 7}" for k in range(100)]
    >>> _ = file.write_text("\\n".join(["ms,u,enc", *rows]))
    >>> columns = {"time_ms": "ms", "voltage": "u", "theta_deg": "enc"}
    >>> log = sc.read_log(file, columns)
    >>> log.actuator, log.sensor, round(log.sample_time, 6)
    ('voltage', 'theta', 0.005)
    """
    path = check_path(file, "file")
    held = read_columns(path)
    asked = dict(columns or {})
    for name in asked.values():
        pick(held, name, str(path))
    known = {name: name for name in held if name not in asked.values()} | asked
    input_name, output_name = _signals(held, known, asked, counts_per_turn, str(path))
    wanted = {"input": input_name, "output": output_name}
    if _REFERENCE in known:
        wanted["reference"] = _REFERENCE
    signals = {role: pick_real(held, known[name], str(path)) for role, name in wanted.items()}
    scale = {name: _named(name, counts_per_turn) for name in (input_name, output_name)}
    told = [_units(scale[name], known[name]) for name in (input_name, output_name)]
    times = [name for name in known if name in _TIME]
    if times:
        time = _TIME[times[0]] * pick_real(held, known[times[0]], str(path))
        if any(len(column) != len(time) for column in signals.values()):
            raise InputError(
                f"there are {len(time)} times for "
                f"{', '.join(str(len(column)) for column in signals.values())} samples",
                where=str(path),
                remedy="give signals of one clock",
            )
        period, number, found = clock_of(time, sample_time, f"{path}: {known[times[0]]}")
        told += found
        signals = {role: on_the_clock(column, number) for role, column in signals.items()}
    elif sample_time is None:
        raise InputError(
            f"it has no time column: it holds {holds(held)}",
            where=str(path),
            remedy="map one, as columns={'time_s': …}, or give sample_time",
        )
    else:
        period = check_positive(sample_time, "sample_time")
    try:
        return Log(
            period,
            scale[input_name].factor * signals["input"],
            scale[output_name].factor * signals["output"],
            signals.get("reference"),
            scale[input_name].signal,
            scale[output_name].signal,
            path.name,
            tuple(text for text in told if text),
        )
    except SlewctlError as error:
        raise error.within(str(path)) from error


def _signals(
    held: Mapping[str, ComplexArray],
    known: Mapping[str, str],
    asked: Mapping[str, str],
    counts_per_turn: float | None,
    where: str,
) -> tuple[str, str]:
    """Return the names of the actuator's and of the sensor's column."""
    for name in asked:
        if name not in (*_TIME, _REFERENCE) and named(name, counts_per_turn or 1.0) is None:
            raise InputError(
                f"{name!r} is no signal of an arm",
                where="columns",
                remedy="name a time, torque or voltage, a sensor such as theta_deg, or reference",
            )
    found: list[str] = []
    faults, missing = [], []
    for kind, example in (("actuator", "voltage"), ("sensor", "theta")):
        of_kind = [
            name
            for name in known
            if (told := named(name, counts_per_turn or 1.0)) is not None
            and (told.signal in ACTUATORS) == (kind == "actuator")
        ]
        chosen = [name for name in of_kind if name in asked] or of_kind
        if len(chosen) != 1:
            faults.append(f"several {kind}s are in it" if chosen else f"no {kind} is known in it")
            missing.append(f"{example!r}: …")
        found += chosen[:1]
    if faults:  # all at once: who maps one of them has the next to map
        raise InputError(
            f"{' and '.join(faults)}: it holds {holds(held)}",
            where=where,
            remedy=f"map {'one' if len(faults) == 1 else 'both'}, as "
            f"columns={{{', '.join(missing)}}}",
        )
    return found[0], found[1]


def _named(name: str, counts_per_turn: float | None) -> Named:
    told = named(name, counts_per_turn)
    if told is None:  # what `_signals` chose has a name
        raise InputError(f"{name!r} is no signal of an arm", where="columns")
    return told


def _units(told: Named, column: str) -> str:
    """Return what a column was taken as, where its unit is not the toolbox's own."""
    if not told.unit:
        return ""
    unit = "encoder counts" if told.unit == COUNTS else told.unit
    return f"{column}: {told.signal} in {unit}, times {told.factor:.6g}"
