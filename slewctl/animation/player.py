"""An animation as a figure of a page: SVG with a small script, nothing from a network.

What moves is drawn by the script; without it, and on paper, there are poses at a few times.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np

from slewctl._types import Array
from slewctl.animation.movement import Movement
from slewctl.animation.scene import PANE, POSES, Scene
from slewctl.escape import quoted

# Of a curve's row, in pixels: height, and room for its words.
_ROW, _LEFT, _RIGHT, _ACROSS = 84.0, 8.0, 8.0, 760.0
# Deflections in whole parts of the largest.
_PARTS = 4095
_SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0)


def player(scene: Scene, caption: str) -> str:
    """Return the figure.

    Parameters
    ----------
    scene : Scene
    caption : str
    """
    panes = "".join(_pane(scene, k) for k in range(len(scene.movements)))
    rows = "".join(_row(scene, name, place) for place, name in enumerate(scene.curves))
    height = _ROW * len(scene.curves)
    # "</" would end the element that holds the data; numbers have none.
    data = json.dumps(_data(scene), separators=(",", ":"))
    slow = 1 / scene.slowed
    speeds = sorted({*(slow * s for s in _SPEEDS)})
    options = "".join(
        f'<option value="{s:g}"{" selected" if s == slow else ""}>'
        f"{'real time' if s == 1 else f'{s:g} times as fast'}</option>"
        for s in speeds
    )
    return (
        f'<figure class="slew-motion"><style>{_asset("player.css")}</style>'
        f'<div class="panes">{panes}</div>'
        f'<svg class="rows" viewBox="0 0 {_ACROSS:g} {height:g}" role="img" '
        f'aria-label="{quoted(", ".join(scene.curves))} over time">{rows}</svg>'
        '<div class="bar"><button type="button">Play</button>'
        f'<input type="range" min="0" max="{scene.end:.6g}" step="any" value="0" '
        'aria-label="time in seconds"><output aria-live="off">0 s</output>'
        f'<select aria-label="speed">{options}</select></div>'
        f"<figcaption>{quoted(caption)}</figcaption>"
        f'<script type="application/json">{data}</script>'
        f"<script>{_asset('player.js')}</script></figure>"
    )


@cache
def _asset(name: str) -> str:
    return (Path(__file__).with_name(name)).read_text(encoding="utf-8").strip()


def _pane(scene: Scene, k: int) -> str:
    one = scene.movements[k]
    poses = one.at(np.linspace(0.0, _moved(one), POSES))
    beams = "".join(
        f'<path class="beam" d="{_path(shape)}" opacity="{0.25 + 0.75 * i / (POSES - 1):.2f}"/>'
        for i, shape in enumerate(scene.placed(poses.points(scene.magnified)))
    )
    trace = _path(scene.placed(one.points(scene.magnified)[:, -1]))
    cx, cy = scene.placed(np.zeros(2))
    hub = max(one.x[0] * scene.scale, 3.0)
    name = quoted(scene.names[k])
    return (
        f'<svg class="arm{k}" viewBox="0 0 {PANE:g} {scene.height:.1f}" role="img" '
        f'aria-label="{name}: the arm at {POSES} times">'
        f'<g class="poses"><path class="trace" d="{trace}"/>{beams}</g>'
        '<g class="moving"><path class="rigid"/><path class="trace"/><path class="beam"/>'
        '<circle class="tip" r="3.5"/></g>'
        f'<circle class="hub" cx="{cx:.1f}" cy="{cy:.1f}" r="{hub:.1f}"/>'
        f'<path class="curve arm{k}" d="M6 11h22"/><text x="34" y="15">{name}</text></svg>'
    )


def _moved(one: Movement) -> float:
    """Return until when the reference moves, so that the poses show the turn."""
    still = np.flatnonzero(np.abs(np.diff(one.theta_ref)) > 0)
    return float(one.t[still[-1] + 1]) if len(still) else float(one.t[-1])


def _row(scene: Scene, name: str, place: int) -> str:
    curves = scene.curves[name]
    drawn = [values for _, values in curves if len(values)]
    low = min(0.0, *(float(values.min()) for values in drawn))
    high = max(0.0, *(float(values.max()) for values in drawn))
    top, tall = _ROW * place + 20.0, _ROW - 28.0
    size = tall / (high - low) if high > low else 0.0

    def y(values: Array) -> Array:
        return np.asarray(top + (high - values) * size)

    paths = ""
    for k, (t, values) in enumerate(curves):
        x = _LEFT + t / scene.end * (_ACROSS - _LEFT - _RIGHT)
        line = _path(np.stack([x, y(values)], axis=1)) if len(t) else ""
        paths += f'<path class="curve arm{k}" d="{line}"/>'
    zero = float(y(np.zeros(1))[0])
    span = f"{_short(low)} to {_short(high)}"
    return (
        f'<text x="{_LEFT:g}" y="{top - 7:.1f}">{quoted(name)}: {span}</text>'
        f'<path class="zero" d="M{_LEFT:g} {zero:.1f}H{_ACROSS - _RIGHT:g}"/>{paths}'
        f'<path class="now" d="M0 {top:.1f}v{tall:.1f}"/>'
    )


def _short(value: float) -> str:
    return f"{value:.3g}".replace("-", "−")


def _path(points: Array) -> str:
    """Return points as a path, in tenths of a pixel and relative to each other."""
    whole = np.round(10 * points).astype(int)
    steps = np.diff(whole, axis=0)
    start = f"M{whole[0, 0] / 10:g} {whole[0, 1] / 10:g}"
    return start + "l" + " ".join(f"{x / 10:g} {y / 10:g}" for x, y in steps)


def _data(scene: Scene) -> dict[str, object]:
    """Return what the script draws from: angles, and deflections in parts of the largest."""
    largest = max(float(np.abs(one.bent).max()) for one in scene.movements) or 1.0
    origin = scene.placed(np.zeros(2))
    return {
        "end": scene.end,
        "origin": np.round(origin, 2).tolist(),
        "part": scene.magnified * largest / _PARTS * scene.scale,
        "rows": [_LEFT, _ACROSS - _RIGHT, _ACROSS],
        "arms": [
            {
                "t": _numbers(one.t),
                "theta": _numbers(one.theta),
                "ref": _numbers(one.theta_ref),
                "x": [round(float(x), 2) for x in one.x * scene.scale],
                "bent": np.round(one.bent / largest * _PARTS).astype(int).ravel().tolist(),
            }
            for one in scene.movements
        ],
    }


def _numbers(values: Array) -> Sequence[float]:
    return [float(f"{value:.5g}") for value in values]
