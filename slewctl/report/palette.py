"""Colours and line styles of the bases, alike in every figure."""

from __future__ import annotations

# Okabe and Ito's palette, distinguishable with every kind of colour vision.
COLOURS = {
    "clamped-free": "#0072B2",
    "slewing": "#D55E00",
    "hub-matched": "#CC79A7",
    "arm-matched": "#009E73",
    "polynomial": "#E69F00",
    "truth": "#7f7f7f",
    "": "#0072B2",  # a given law, which is on no basis
}
SPARE_COLOURS = ("#CC79A7", "#E69F00", "#56B4E9", "#009E73")
# Lengths of dash and gap in pixels; empty for a line without gaps.
DASHES = {
    "clamped-free": "6 3",
    "slewing": "",
    "hub-matched": "7 2 2 2",
    "arm-matched": "3 2",
    "polynomial": "7 3 1 3",
    "truth": "",
    "": "",
}
ALARM = "#CC3311"


def colour(source: str, position: int = 0) -> str:
    """Return the colour of a basis or the truth; of others by their position."""
    return COLOURS.get(source, SPARE_COLOURS[position % len(SPARE_COLOURS)])


def dashes(source: str) -> str:
    """Return the dashes of a basis or the truth."""
    return DASHES.get(source, "1 3")
