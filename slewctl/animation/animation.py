"""An animation of one slew, or of two side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slewctl._types import FilePath
from slewctl.animation.gif import gif_bytes
from slewctl.animation.movement import Movement
from slewctl.animation.player import player
from slewctl.animation.scene import FACTORS, Scene
from slewctl.errors import InputError, check_positive
from slewctl.escape import quoted, visible
from slewctl.textfile import write_bytes

# The largest deflection that is drawn magnified, of the reach.
_DRAWN = 0.12
# Deflections are shown as they are from half of that.
_PLAIN = 0.5


@dataclass(frozen=True, eq=False, repr=False)
class Animation:
    """Slews that move, seen along the arm's axis, with their curves below.

    It shows itself in a notebook; without script, and on paper, it is a picture of poses.

    Parameters
    ----------
    movements : sequence of Movement
        One, or two side by side.
    names : sequence of str
        Of each.
    magnify : float, optional
        Factor of the deflections; by default one that shows them, and 1 where they are large.

    Raises
    ------
    InputError
        For a factor that is not positive, or other than one or two movements that move in time
        and are finite.
    """

    movements: Sequence[Movement]
    names: Sequence[str]
    magnify: float | None = None

    def __post_init__(self) -> None:
        if self.magnify is not None:
            check_positive(self.magnify, "magnify")
        if not 1 <= len(self.movements) <= 2 or len(self.names) != len(self.movements):
            raise InputError(
                f"{len(self.movements)} movements with {len(self.names)} names",
                where="movements",
                remedy="give one, or two side by side, with a name each",
            )
        for one in self.movements:
            if not one.t[-1] > 0 or not np.isfinite(one.bent).all():
                raise InputError(
                    "nothing moves in it, or not within the range of numbers",
                    where="movements",
                    remedy="simulate the slew anew",
                )

    @property
    def magnified(self) -> float:
        """The factor by which deflections are drawn larger than they are."""
        if self.magnify is not None:
            return float(self.magnify)
        largest = max(float(np.abs(one.bent).max()) for one in self.movements)
        reach = max(one.reach for one in self.movements)
        if not 0 < largest < _PLAIN * _DRAWN * reach:
            return 1.0
        return max(factor for factor in FACTORS if factor == 1 or factor * largest < _DRAWN * reach)

    @property
    def caption(self) -> str:
        """What is seen, in words."""
        m = self.magnified
        scale = "to scale" if m == 1 else f"with the deflection {m:g} times as large as it is"
        said = [
            f"The arm seen along its axis, {scale}; pale, a rigid arm that is where it is told."
        ]
        said += dict.fromkeys(one.told for one in self.movements if one.told)
        return " ".join(said)

    def __repr__(self) -> str:
        names = " and ".join(self.names)
        end = max(float(one.t[-1]) for one in self.movements)
        return f"<animation of {visible(names)}, {end:g} s>"

    def html(self) -> str:
        """Return a figure with its own style and script, to stand in any page."""
        return player(self._scene, self.caption)

    def _repr_html_(self) -> str:
        return self.html()

    def save(self, path: FilePath) -> Path:
        """Write a page of its own, or a GIF.

        Parameters
        ----------
        path : path
            Ends in ``.html`` or ``.gif``.

        Returns
        -------
        Path

        Raises
        ------
        InputError
            For another ending, or a file that cannot be written.
        """
        file = Path(path)
        ending = file.suffix.lower()
        if ending not in (".html", ".gif"):
            raise InputError(
                f"{file.suffix or 'no ending'} is no kind of animation",
                where=str(file),
                remedy="name a file that ends in .html or .gif",
            )
        if ending == ".gif":
            content = gif_bytes(self._scene, self.caption)
        else:
            title = quoted(" and ".join(self.names))
            content = _PAGE.format(title=title, figure=self.html()).encode()
        write_bytes(file, content)
        return file

    @property
    def _scene(self) -> Scene:
        return Scene(self.movements, self.names, self.magnified)


_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,">
<title>{title}</title>
<style>
:root {{ color-scheme: light dark; }}
body {{ margin: 1rem; font: 1rem/1.5 system-ui, sans-serif; }}
</style>
</head>
<body>
<main>
{figure}
</main>
</body>
</html>
"""
