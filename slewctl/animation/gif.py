"""An animation as a GIF, for where no script runs; drawn by Pillow, which matplotlib brings."""

from __future__ import annotations

import io
import math
import textwrap
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from slewctl._types import Array
from slewctl.animation.scene import MARGIN, PANE, Scene
from slewctl.escape import visible

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

# Seconds between two pictures at least, and pictures at most.
_STEP, _MOST = 0.05, 160
# Drawn so many times as large, then made smaller: lines without steps.
_FINE = 2
# Height of a line of words and of a row of curves in pixels, and letters in a pane's width.
_LINE, _ROW, _LETTERS, _SIZE = 17, 58, 56, 11
_SHADES = 5  # of each colour on the ground, where a line ends; more are taken for the ground
_GROUND, _INK, _PALE, _TRACE = "#ffffff", "#1c2126", "#d4dadf", "#9db8c9"
_ARMS = ("#0072b2", "#d55e00")


def gif_bytes(scene: Scene, caption: str) -> bytes:
    """Return the animation; it goes on for ever, as fast as the slew or slowed as said.

    Parameters
    ----------
    scene : Scene
    caption : str
    """
    from PIL import Image, ImageDraw, ImageFont  # Pillow is only needed here

    lasting = scene.end * scene.slowed
    step = max(_STEP, math.ceil(100 * lasting / _MOST) / 100)  # whole hundredths
    times = np.append(np.arange(0.0, lasting, step), lasting) / scene.slowed
    font = ImageFont.truetype(str(_font_file()), _SIZE)
    arms = _Arms(scene, times)
    slow = f" Slowed {scene.slowed:g} times." if scene.slowed != 1 else ""
    words = textwrap.wrap(visible(caption) + slow, _LETTERS * len(scene.names))
    width, top = round(PANE * len(scene.names)), round(scene.height)
    height = top + _ROW * len(scene.curves) + _LINE * len(words) + 8
    ground = Image.new("RGB", (_FINE * width, _FINE * height), _GROUND)
    arms.curves(ImageDraw.Draw(ground), width, top)
    colours = Image.new("P", (1, 1))
    colours.putpalette(_palette())
    pictures = []
    for k, t in enumerate(times):
        picture = ground.copy()
        arms.draw(ImageDraw.Draw(picture), k, width, top)
        small = picture.reduce(_FINE)
        pen = ImageDraw.Draw(small)
        for pane, name in enumerate(scene.names):
            pen.text((PANE * pane + 6, 3), f"{visible(name)}, {t:.2f} s", _INK, font)
        for row, name in enumerate(scene.curves):
            pen.text((6, top + _ROW * row), name, _INK, font)
        for row, line in enumerate(words):
            pen.text((6, height - _LINE * (len(words) - row) - 2), line, _INK, font)
        pictures.append(small.quantize(palette=colours, dither=Image.Dither.NONE))
    first, *others = pictures
    out = io.BytesIO()
    lasts = round(1000 * step)
    first.save(out, "GIF", save_all=True, append_images=others, duration=lasts, loop=0)
    return out.getvalue()


def _font_file() -> Path:
    """Return a font with the letters of most names, which matplotlib brings."""
    found = find_spec("matplotlib")
    place = Path(found.origin if found and found.origin else "")
    return place.parent / "mpl-data" / "fonts" / "ttf" / "DejaVuSans.ttf"


def _palette() -> list[int]:
    """Return the colours and their shades towards the ground, three numbers each."""
    ground = np.full(3, 255.0)
    found = [ground]
    for name in (_INK, _PALE, _TRACE, *_ARMS):
        colour = np.array([int(name[k : k + 2], 16) for k in (1, 3, 5)])
        found += [ground + (colour - ground) * k / _SHADES for k in range(1, _SHADES + 1)]
    return np.round(np.concatenate(found)).astype(int).tolist()


class _Arms:
    """The arms of a scene at some times, in pixels of a large picture."""

    def __init__(self, scene: Scene, times: Array) -> None:
        moving = [one.at(times) for one in scene.movements]
        self._scene, self._times = scene, times
        self._traces = [
            (one.t, self._placed(k, one.points(scene.magnified)[:, -1]))
            for k, one in enumerate(scene.movements)
        ]
        self._beams = [self._placed(k, one.points(scene.magnified)) for k, one in enumerate(moving)]
        self._rigid = [self._placed(k, one.rigid()) for k, one in enumerate(moving)]
        self._axes = self._placed(0, np.zeros((1, 1, 2)))[0, 0]
        self._hub = [max(one.x[0] * scene.scale, 3.0) for one in moving]

    def _placed(self, pane: int, points: Array) -> Array:
        return _FINE * (self._scene.placed(points) + np.array([PANE * pane, 0.0]))

    def draw(self, pen: ImageDraw, k: int, width: int, top: int) -> None:
        """Draw all arms at one time, and mark it on the curves."""
        for pane, beams in enumerate(self._beams):
            _line(pen, self._rigid[pane][k], _PALE, 5)
            t, trace = self._traces[pane]
            passed = trace[: np.searchsorted(t, self._times[k], side="right")]
            _line(pen, np.concatenate([passed, beams[k, -1:]]), _TRACE, 1)
            _line(pen, beams[k], _ARMS[pane], 3)
            x, y = self._axes[0] + _FINE * PANE * pane, self._axes[1]
            r = _FINE * self._hub[pane]
            pen.ellipse((x - r, y - r, x + r, y + r), fill=_INK)
        x = MARGIN + self._times[k] / self._scene.end * (width - 2 * MARGIN)
        foot = top + _ROW * len(self._scene.curves)
        _line(pen, _FINE * np.array([[x, top + _LINE], [x, foot]]), _INK, 1)

    def curves(self, pen: ImageDraw, width: int, top: int) -> None:
        """Draw the curves, which stay."""
        for row, curves in enumerate(self._scene.curves.values()):
            values = np.concatenate([np.zeros(1), *(values for _, values in curves)])
            low, size = values.min(), np.ptp(values) or 1.0
            foot, tall = top + _ROW * (row + 1) - 6, _ROW - _LINE - 8
            zero = foot + low / size * tall
            _line(pen, _FINE * np.array([[MARGIN, zero], [width - MARGIN, zero]]), _PALE, 1)
            for (t, values), look in zip(curves, _ARMS, strict=False):
                x = MARGIN + t / self._scene.end * (width - 2 * MARGIN)
                y = foot - (values - low) / size * tall
                _line(pen, _FINE * np.stack([x, y], axis=1), look, 1)


def _line(pen: ImageDraw, points: Array, colour: str, wide: int) -> None:
    if len(points) > 1:
        pen.line([tuple(point) for point in points.tolist()], colour, _FINE * wide, joint="curve")
