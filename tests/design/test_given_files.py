"""Controllers in files: written, read to the last bit, and never run."""

from __future__ import annotations

import json
import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import savemat

import slewctl as sc
from slewctl.errors import InputError
from slewctl.export import SUFFIXES, write_data

FORMATS = pytest.mark.parametrize("suffix", SUFFIXES)


def random_controller(seed: int, states: int, sampled: bool) -> sc.Controller:
    rng = np.random.default_rng(seed)
    sizes = {"A": (states, states), "B": (states, 2), "C": (1, states), "D": (1, 2)}
    parts = {name: rng.standard_normal(size) * 10.0 ** rng.integers(-9, 9, size)
             for name, size in sizes.items()}  # fmt: skip
    clock = {"sample_time": 1 / 3, "delay": 0.1} if sampled else {}
    return sc.given(**parts, inputs=["theta", "moment@50mm"], output="voltage",
                    feedback="negative", **clock)  # fmt: skip


def assert_same(one: sc.Controller, other: sc.Controller) -> None:
    for mine, theirs in zip(one.linear.matrices, other.linear.matrices, strict=True):
        assert mine.shape == theirs.shape
        assert mine.tobytes() == np.ascontiguousarray(theirs).tobytes() or np.array_equal(
            mine, theirs
        )
    assert one.sensors == other.sensors
    assert one.linear.output_labels == other.linear.output_labels
    assert one.linear.state_labels == other.linear.state_labels
    assert (one.sample_time, one.delay) == (other.sample_time, other.delay)
    assert np.array_equal(one.state_scale, other.state_scale)
    assert (one.entry is None) == (other.entry is None)
    assert one.entry is None or np.array_equal(one.entry, other.entry)
    assert one.arithmetic == other.arithmetic
    assert (one.reference is None) == (other.reference is None)
    if one.reference is not None and other.reference is not None:
        assert np.array_equal(one.reference.B, other.reference.B)
        assert np.array_equal(one.reference.D, other.reference.D)


@FORMATS
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=25)
@given(seed=st.integers(0, 999), states=st.integers(0, 4), sampled=st.booleans())
def test_a_controller_comes_back_to_the_last_bit(
    tmp_path: Path, suffix: str, seed: int, states: int, sampled: bool
) -> None:
    K = random_controller(seed, states, sampled)
    file = tmp_path / f"k{suffix}"
    K.save(file)
    assert_same(K, sc.given(file=file))


@FORMATS
def test_a_designed_controller_comes_back_with_its_reference(tmp_path: Path, suffix: str) -> None:
    arm = sc.Arm(sc.arms.paper_beam().beam, hub=sc.Hub(inertia=0.2), damping_ratio=0.005)
    problem = sc.Problem(arm, limits={"tip": 0.03, "torque": 1.0},
                         noise={"torque": 0.1, "theta": 0.01, "theta_dot": 0.1})  # fmt: skip
    K = sc.lqg(problem.plant("clamped-free", n=2), sample_time=0.01, delay=0.003)
    file = tmp_path / f"k{suffix}"
    K.save(file)
    again = sc.given(file=file)
    assert_same(K, again)
    assert again.method == "lqg"
    written = file.read_bytes()
    again.save(file)
    assert file.read_bytes() == written


@FORMATS
def test_a_rounded_controller_comes_back_with_its_numbers(tmp_path: Path, suffix: str) -> None:
    arm = sc.Arm(sc.arms.paper_beam().beam, hub=sc.Hub(inertia=0.2), damping_ratio=0.005)
    problem = sc.Problem(arm, limits={"tip": 0.03, "torque": 1.0},
                         noise={"torque": 0.1, "theta": 0.01, "theta_dot": 0.1})  # fmt: skip
    K = sc.lqg(problem.plant("clamped-free", n=1), sample_time=0.01)
    for rounded in (K.in_float32(), K.in_fixed_point(16, None, problem.loop_signals(K))):
        file = tmp_path / f"k{suffix}"
        rounded.save(file)
        again = sc.given(file=file)
        assert_same(rounded, again)
        assert str(again.arithmetic) == str(rounded.arithmetic) != "None"
    data = {**rounded.data, "arithmetic_states": [1]}
    write_data(file, data)
    with pytest.raises(sc.InputError, match=r"file: arithmetic: the word formats are not those"):
        sc.given(file=file)


@pytest.mark.parametrize("suffix", [".json", ".npz", ".mat"])
def test_gains_are_found_by_name(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"gains{suffix}"
    gains = {"kp": 20.0, "kd": 9.0, "filter_hz": 30.0, "tuned_by": "hand"}
    if suffix == ".json":
        file.write_text(json.dumps(gains))
    elif suffix == ".npz":
        np.savez(file, **gains)
    else:
        savemat(file, gains)
    wanted = sc.given(pid={"kp": 20.0, "kd": 9.0, "filter_hz": 30.0})
    assert_same(sc.given(file=file), wanted)


def test_a_mat_file_holds_polynomials_as_rows(tmp_path: Path) -> None:
    file = tmp_path / "law.mat"
    savemat(file, {"num": np.array([[1.0, 2.0]]), "den": np.array([[1.0], [2.0], [3.0]])})
    wanted = sc.given(num=[1.0, 2.0], den=[1.0, 2.0, 3.0], feedback="negative")
    assert_same(sc.given(file=file, feedback="negative"), wanted)


def test_nothing_is_unpickled(tmp_path: Path) -> None:
    class Bomb:
        def __reduce__(self) -> tuple[object, ...]:
            return (Path.touch, (tmp_path / "gone off",))

    file = tmp_path / "law.npz"
    np.savez(file, A=np.array([Bomb()], dtype=object))
    with pytest.raises(InputError, match="holds no data in this format"):
        sc.given(file=file)
    raw = tmp_path / "raw.npz"
    raw.write_bytes(pickle.dumps(Bomb()))
    with pytest.raises(InputError, match="holds no data in this format"):
        sc.given(file=raw)
    assert not (tmp_path / "gone off").exists()


REFUSED = [
    ({"gain_p": 1.0, "gain_d": 2.0}, {}, "no control law is in it: it holds gain_p, gain_d"),
    ({"A": [[1.0]], "C": [[1.0]]}, {}, "B is missing in it: it holds A, C"),
    ({"num": [1.0]}, {}, "den is missing in it: it holds num"),
    ({"kp": 1.0, "sample_time": 0.01}, {"sample_time": 0.02, "discretise": "tustin"},
     "sample_time: 0.02 is given, the file says 0.01"),
    ({"kp": 1.0}, {"num": [1.0], "den": [1.0]}, "are given"),
]  # fmt: skip


@pytest.mark.parametrize(("data", "options", "told"), REFUSED)
def test_what_a_file_lacks_is_told_with_what_it_holds(
    tmp_path: Path, data: dict[str, object], options: dict[str, object], told: str
) -> None:
    file = tmp_path / "law.json"
    file.write_text(json.dumps(data))
    with pytest.raises(InputError) as refused:
        sc.given(file=file, **options)
    assert told in str(refused.value)


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("k.json", None, "there is no such file"),
        ("k.txt", b"", "unknown ending '.txt'"),
        ("k.json", b"{", "holds no data in this format"),
        ("k.json", b"[1]", "give a table of names"),
        ("k.json", b"\xff", "holds no data in this format"),
        ("k.npz", b"PK\x03\x04", "holds no data in this format"),
        ("k.npz", b"", "holds no data in this format"),
        ("k.mat", b"MATLAB 5.0", "holds no data in this format"),
        ("k.mat", b"", "holds no data in this format"),
    ],
)
def test_a_file_that_is_none_is_told(
    tmp_path: Path, name: str, content: bytes | None, told: str
) -> None:
    file = tmp_path / name
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(InputError) as refused:
        sc.given(file=file)
    assert told in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_folder_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        sc.given(pid={"kp": 1.0}).save(tmp_path / "none" / "k.json")
