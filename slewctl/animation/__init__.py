"""Slews that move: on a page, in a notebook, as a GIF."""
