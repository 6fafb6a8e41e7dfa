"""What lets a command begin sooner; nothing that it computes or prints depends on it."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import LazyLoader
from types import ModuleType

# scipy takes every public name of numpy, and with them these two, which it never uses: a
# translator of Fortran and a test suite.
_LATE = ("numpy.f2py", "numpy.testing")
# Objects made, less those that are gone, after which Python looks for cycles among them: while
# modules are loaded there are none, and from its own 700 on it would look a hundred times.
_OBJECTS = 20_000


class _Late:
    """Finds modules that are loaded when something of theirs is asked for."""

    @staticmethod
    def find_spec(
        name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return what Python finds, to be loaded late; None of modules that are not to be."""
        spec = PathFinder.find_spec(name, path, target) if name in _LATE else None
        if spec is not None and spec.loader is not None:
            spec.loader = LazyLoader(spec.loader)
        return spec


def begin_sooner() -> None:
    """Put off what no command needs; before anything large is loaded."""
    gc.set_threshold(_OBJECTS, *gc.get_threshold()[1:])
    # Plugins of pydantic watch services; to look for them reads what every package is called.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    if _Late not in sys.meta_path:
        sys.meta_path.insert(0, _Late)
