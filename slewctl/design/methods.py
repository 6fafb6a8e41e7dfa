"""The design methods by the names that design files call them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping

from slewctl import design
from slewctl.design.result import Controller

GIVEN = "given"
"""The name of what is no method: a law that was made elsewhere, on nothing known here."""

Method = Callable[..., Controller]


class _Methods(Mapping[str, Method]):
    """Functions by name, each with its file loaded when it is asked for: most runs ask for one."""

    def __init__(self, functions: Mapping[str, Callable[[], Method]]) -> None:
        self._functions = functions

    def __getitem__(self, name: str) -> Method:
        return self._functions[name]()

    def __iter__(self) -> Iterator[str]:
        return iter(self._functions)

    def __len__(self) -> int:
        return len(self._functions)

    def __contains__(self, name: object) -> bool:
        return name in self._functions


# Each takes a plant and, by keyword alone, options of its own: the keys of [controller].
METHODS: Mapping[str, Method] = _Methods(
    {
        "lqg": lambda: design.lqg,
        "h2-lmi": lambda: design.h2_lmi,
        "h2-region": lambda: design.h2_region,
        "h2-hinf": lambda: design.h2_hinf,
        "payload-lmi": lambda: design.payload_lmi,
        "variance-bound": lambda: design.variance_bound,
        "pole-placement": lambda: design.pole_placement,
        "pd-notch": lambda: design.pd_notch,
        "positive-position": lambda: design.positive_position,
        "lead": lambda: design.lead,
        GIVEN: lambda: design.given_on_plant,
    }
)


def options(method: str) -> tuple[str, ...]:
    """Return the names of the options that a method of `METHODS` takes.

    Parameters
    ----------
    method : str
        Of `METHODS`.

    Returns
    -------
    tuple of str

    Examples
    --------
    >>> from slewctl.design import options
    >>> options("lqg")
    ('integral_limit', 'sample_time', 'delay')
    """
    parameters = inspect.signature(METHODS[method]).parameters.values()
    return tuple(p.name for p in parameters if p.kind is p.KEYWORD_ONLY)
