"""BLAS has one thread while slewctl computes, and gets its own back."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import slewctl as sc
from slewctl import _threads
from slewctl._threads import one_thread, single_threaded


def threads() -> set[int]:
    return {lib["num_threads"] for lib in threadpool_info() if lib["user_api"] == "blas"}


@pytest.fixture(autouse=True)
def _two_threads(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    # The suite is limited itself: what begins and ends here is a limit of its own.
    monkeypatch.setattr(_threads, "_LIMIT", _threads._Limit())
    with threadpool_limits(2, user_api="blas"):
        if threads() != {2}:
            pytest.skip("the libraries of this machine have no second thread")
        yield


def test_nested_limits_end_with_the_outermost() -> None:
    with one_thread():
        with one_thread():
            assert threads() == {1}
        assert threads() == {1}
    assert threads() == {2}


def test_an_error_gives_the_threads_back() -> None:
    @single_threaded
    def fails() -> None:
        assert threads() == {1}
        raise ValueError("as it does")

    with pytest.raises(ValueError, match="as it does"):
        fails()
    assert threads() == {2}


@pytest.mark.parametrize("first_out", ["main", "other"])
def test_overlapping_threads_leave_no_limit(first_out: str) -> None:
    entered, leave = threading.Event(), threading.Event()

    def work() -> None:
        with one_thread():
            entered.set()
            leave.wait(10)

    other = threading.Thread(target=work)
    with one_thread():
        other.start()
        assert entered.wait(10)
        assert threads() == {1}
        if first_out == "other":
            leave.set()
            other.join()
            assert threads() == {1}
    leave.set()
    other.join()
    assert threads() == {2}


def test_what_costs_is_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []
    enter = _threads._Limit.enter
    monkeypatch.setattr(_threads._Limit, "enter", lambda self: (seen.append(1), enter(self)))
    arm = sc.Arm(sc.arms.paper_beam().beam, hub=sc.Hub(inertia=0.2), damping_ratio=0.005)
    objective = sc.Objective({"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    plant = sc.generalised_plant(sc.assemble(arm, "clamped-free", 2), objective)
    controller = sc.lqg(plant)
    exact = sc.truth(arm, 5)
    for call in (
        lambda: sc.truth(arm, 5),
        lambda: sc.lqg(plant),
        lambda: sc.close(exact, objective, controller),
    ):
        seen.clear()
        call()
        assert seen
    assert threads() == {2}
