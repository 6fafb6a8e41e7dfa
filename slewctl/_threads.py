"""One BLAS thread while slewctl computes: on matrices this small more only wait for each other.

The limit is the process's.  The first computation to begin sets it; nested ones cost nothing.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, wraps
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

P = ParamSpec("P")
R = TypeVar("R")


class _Limit:
    """How many computations are under way, and what gives the threads back.

    The thread that set the limit gives it back when its own computations end, since
    threadpoolctl of today takes it from no other; so does the last one, for older ones.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._users = 0
        self._owner = 0
        self._owned = 0
        self._limiter: Any = None

    def enter(self) -> None:
        with self._lock:
            if not self._users:
                # OpenMP's own limit is each thread's, and is left alone.
                self._limiter = _controller().limit(limits=1, user_api="blas")
                self._owner, self._owned = threading.get_ident(), 0
            self._users += 1
            self._owned += threading.get_ident() == self._owner

    def leave(self) -> None:
        with self._lock:
            self._users -= 1
            mine = threading.get_ident() == self._owner
            self._owned -= mine
            if not self._users or (mine and not self._owned):
                self._limiter.restore_original_limits()


_LIMIT = _Limit()


@cache
def _controller() -> ThreadpoolController:
    """Return the libraries with threads of this process; to look for them takes a while."""
    # Only what is loaded is found.
    import scipy.linalg  # noqa: F401
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


@contextmanager
def one_thread() -> Iterator[None]:
    """Keep BLAS to one thread."""
    _LIMIT.enter()
    try:
        yield
    finally:
        _LIMIT.leave()


def single_threaded(function: Callable[P, R]) -> Callable[P, R]:
    """Return the function, during whose calls BLAS has one thread."""

    @wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        with one_thread():
            return function(*args, **kwargs)

    return limited
