"""A Dask cluster as the executor of a study: checked before the work, and told when it fails."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

from slewctl.compare.study.sweep import WorkerDiedError
from slewctl.errors import InputError, shown
from slewctl.versions import difference, versions

# Seconds in which a scheduler, and a first worker, must answer.
_TIMEOUT = 10

# Loggers with levels of their own which, when a connection breaks, print lines and tracebacks
# beside the one error that is raised for it, sometimes after it: so they stay silent.
_SAY_IT_TOO = ("distributed", "distributed.client", "tornado.application")


@contextmanager
def dask_cluster(address: str) -> Iterator[Executor]:
    """Yield the executor of a Dask cluster whose workers can do the same work as this process.

    Scheduler and workers run the code that they are sent, and this process unpickles what
    they send back: without TLS whoever can reach the address can run code on all of them.
    Name only a scheduler that you trust, in a network that you trust; ``tls://`` takes its
    certificates from Dask's configuration (``distributed.comm.tls``). What fails is raised as
    an error, and Dask's own log of it is silenced in this process.

    Parameters
    ----------
    address : str
        Of the scheduler, such as ``tcp://host:8786``.

    Returns
    -------
    context manager of concurrent.futures.Executor

    Raises
    ------
    InputError
        If Dask is not installed, no scheduler answers there, it has no workers, or a worker
        has no slewctl or other versions than this process.
    WorkerDiedError
        From within its block, if a piece of work kills every worker that takes it.

    Examples
    --------
    >>> from slewctl.compare import dask_cluster
    >>> with dask_cluster("tcp://scheduler:8786") as executor:  # doctest: +SKIP
    ...     result = sc.run_study(study, path, stamp={}, executor=executor)
    """
    try:
        import distributed  # an extra: only those who ask for it need it
    except ImportError as error:
        raise InputError(
            "Dask is not installed", where="dask", remedy="pip install 'slewctl[dask]'"
        ) from error
    for name in _SAY_IT_TOO:
        logging.getLogger(name).setLevel(logging.CRITICAL)
    _check_address(distributed, address)
    with distributed.Client(address, timeout=_TIMEOUT, set_as_default=False) as client:
        _check_workers(client, address)
        try:
            yield client.get_executor()
        except distributed.KilledWorker as error:
            raise WorkerDiedError(
                f"a piece of work has killed every worker of {address} that took it",
                where="dask",
                remedy="look for want of memory; go on with --resume: what was finished is kept",
            ) from error


def _check_address(distributed: Any, address: str) -> None:
    """Refuse an address where nothing answers: Dask's client would fail there, and not end."""

    async def reach() -> None:
        security = distributed.Security().get_connection_args("client")
        if address.startswith(("tls:", "wss:")) and security["ssl_context"] is None:
            raise InputError(
                f"no certificates for {address}",
                where="dask",
                remedy="name them in Dask's configuration under distributed.comm.tls",
            )
        comm = await distributed.comm.connect(address, timeout=_TIMEOUT, **security)
        await comm.close()

    try:
        with ThreadPoolExecutor(1) as thread:  # a notebook has a loop of its own
            thread.submit(asyncio.run, reach()).result()
    except InputError:
        raise
    except (OSError, ValueError, TypeError, AssertionError) as error:
        reason = " ".join(str(error).split())
        raise InputError(
            f"no Dask scheduler answers at {shown(address)}" + (f": {reason}" if reason else ""),
            where="dask",
            remedy="give its address, such as tcp://host:8786",
        ) from error


def _check_workers(client: Any, address: str) -> None:
    """Refuse a cluster on which a piece would hang, kill its worker or have other digits."""
    try:
        client.wait_for_workers(1, timeout=_TIMEOUT)
    except TimeoutError as error:
        raise InputError(
            f"the scheduler at {address} has no worker",
            where="dask",
            remedy=f"start one: dask worker {address}",
        ) from error
    for worker, found in client.run(versions, on_error="return").items():
        if isinstance(found, Exception):
            raise InputError(
                f"the worker {worker} cannot import slewctl ({found})",
                where="dask",
                remedy="install slewctl there, in the same version",
            )
        if other := difference(found, versions()):
            raise InputError(
                f"the worker {worker} has {other}",
                where="dask",
                remedy="install the same versions there: digits depend on them",
            )
