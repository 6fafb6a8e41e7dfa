"""Design files to begin with, commented, that pass the gate as they are written."""

from __future__ import annotations

from importlib.resources import files
from math import pi

from slewctl.arm import ModalData, catalogue
from slewctl.basis import MODAL
from slewctl.compare.study.grid import objective_of, omega_of
from slewctl.errors import check_choice

STARTERS = {
    "beam": "an arm of your own by its measures, LQG",
    "modal-data": "an arm from a data sheet of its modes, LQG",
    "pid": "a PID that is there already, on the arm it is to run on",
    "measured": "the same on a fitted arm and on a measured response",
}
# Of the first flexible frequency: slow enough for any arm.
_BANDWIDTH = 0.1
# Noise of the torque over its limit.
_QUIET = 0.02


def starter_files(origin: str, name: str) -> dict[str, str]:
    """Return what a first design is written into: file names and texts.

    Parameters
    ----------
    origin : str
        One of `STARTERS`, or an arm of the catalogue.
    name : str
        Of the design file, such as ``"myarm.toml"``.

    Returns
    -------
    dict of str to str
        The design file, and what it reads.

    Raises
    ------
    InputError
        If nothing is known under that name.

    Examples
    --------
    >>> from slewctl.files import starter_files
    >>> list(starter_files("measured", "rig.toml"))
    ['rig.toml', 'rig.csv']
    """
    check_choice(origin, (*STARTERS, *catalogue.names()), "from")
    if origin in catalogue.names():
        return {name: _of_catalogue(origin, name)}
    response = f"{name.removesuffix('.toml')}.csv"
    text = _template(f"{origin}.toml").replace("{file}", name).replace("{response}", response)
    beside = {response: _template("measured.csv")} if origin == "measured" else {}
    return {name: text, **beside}


def _template(name: str) -> str:
    return (files("slewctl.files") / "templates" / name).read_text(encoding="utf-8")


def _of_catalogue(name: str, file: str) -> str:
    entry, arm = catalogue.CATALOGUE[name], catalogue.damped(name)
    sheet = isinstance(arm.beam, ModalData)
    omega = omega_of(arm, _BANDWIDTH)
    objective = objective_of(arm, _BANDWIDTH, ("theta", "theta_dot"))
    torque, ratio = objective.limits["torque"], entry.damping.ratio
    # Of noise the ratios alone matter: that of the torque is such as a drive may have.
    noise = {signal: _QUIET * torque * size for signal, size in objective.noise.items()}
    summary = entry.summary[0].upper() + entry.summary[1:]
    rounded = {
        "hertz": omega / (2 * pi),
        "duration": 2 * pi / omega,
        "tip": objective.limits["tip"],
        "torque": torque,
        **{f"{signal}_noise": size for signal, size in noise.items()},
    }
    return _template("catalogue.toml").format(
        file=file,
        name=name,
        summary=summary,
        source=entry.source,
        damping=list(ratio) if isinstance(ratio, tuple) else ratio,
        basis=MODAL if sheet else "arm-matched",
        n=1 if sheet else 2,
        softer="frequency_factor = 0.975" if sheet else "stiffness_factor = 0.95",
        **{key: f"{number:.2g}" for key, number in rounded.items()},
    )
