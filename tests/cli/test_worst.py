"""The worst arm of a box, from the command line and in the gate."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from quick_design import QUICK

from slewctl import vary, worst_case
from slewctl.cli.worst import Asked, print_worst
from slewctl.compare import Judge
from slewctl.errors import InputError
from slewctl.files import read_design
from slewctl.files.uncertainty import WORST
from slewctl.gate import check_file

BOX = """
[uncertainty]
box = { payload_mass = [0.0, 0.2], stiffness_factor = [0.8, 1.2] }
samples = 2
searches = 0
"""
NOTHING = Asked((), None, None, None, None, None)


def write(folder: Path, rest: str) -> Path:
    path = folder / "design.toml"
    path.write_text(QUICK + rest)
    return path


def test_the_gate_holds_the_worst_arm_to_the_requirements(tmp_path: Path) -> None:
    path = write(tmp_path, BOX)
    design = read_design(path)
    assert design.uncertainty is not None
    found = worst_case(design.case, design.uncertainty.box, samples=2, searches=0)
    seen: list[str] = []
    result = check_file(path, working=seen.append)
    assert len(seen) == design.uncertainty.most_arms == 7
    assert result.notes == (str(found),)
    worst = [f.verdict for f in result.findings if f.arm == WORST]
    assert [v.requirement for v in worst] == [
        f.verdict.requirement for f in result.findings if f.arm == "nominal"
    ]
    again = Judge(design.case).vary(vary(design.case.arm, **found.properties)).margins
    # The gate follows it to finer truths.
    assert result.recorded[WORST]["disk_margin"].value == pytest.approx(again.disk.value, rel=1e-4)


def test_what_is_printed_is_the_search_and_holds_in_the_gate(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path, BOX)
    assert print_worst(path, NOTHING, as_json=False) == 0
    printed = capsys.readouterr().out
    design = read_design(path)
    found = worst_case(design.case, design.uncertainty.box, samples=2, searches=0)
    assert printed.startswith(str(found))
    held = printed[printed.index("[variations.worst]") :]
    (variation,) = read_design(write(tmp_path, held)).variations
    assert variation.arm == found.arm


def test_the_command_line_speaks_before_the_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path, BOX)
    asked = Asked(("damping_factor=0.5:1",), "modulus_margin", 0, None, None, None)
    print_worst(path, asked, as_json=True)
    record = json.loads(capsys.readouterr().out)
    assert record["quantity"] == "modulus_margin"
    assert [trial["damping_factor"] for trial in record["trials"]] == [0.5, 1.0]
    assert record["worst"]["value"] == min(t["modulus_margin"] for t in record["trials"])


REFUSED = [
    (("damping_factor",), {}, "--box: 'damping_factor' is not NAME=LOW:HIGH"),
    (
        ("damping_facto=0:1",),
        {},
        "--box damping_facto: unknown property 'damping_facto'; did you mean",
    ),
    (("damping_factor=2:1",), {}, "--box damping_factor: 2 … 1 is empty"),
    ((), {}, "--box: no box"),
    (("payload_mass=-1:1",), {}, "--box payload_mass: -1 is negative"),
    (("payload_mass=0:1", "payload_mass=0:2"), {}, "--box: payload_mass is given twice"),
    (("damping_factor=0.5:1",), {"quantity": "disc"}, "--quantity: unknown name 'disc'"),
    (("damping_factor=0.5:1",), {"samples": 0, "seed": 1}, "--seed: means nothing"),
]


@pytest.mark.parametrize(("box", "others", "told"), REFUSED)
def test_a_wrong_search_is_told_by_its_option(
    tmp_path: Path, box: tuple[str, ...], others: dict[str, object], told: str
) -> None:
    asked = Asked(box, **{**dict.fromkeys(NOTHING.__dict__.keys() - {"box"}), **others})
    with pytest.raises(InputError, match=re.escape(told)):
        print_worst(write(tmp_path, ""), asked, as_json=False)


def test_all_that_is_wrong_with_a_box_is_told_at_once(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        "[uncertainty]\nbox = { payload_mas = [0.0, 1.0], mass_factor = [1.0], hub_inertia = "
        '[2.0, 1.0] }\nquantity = "disc"\nsamples = 0\nseed = 3\nsearches = -1\n',
    )
    with pytest.raises(InputError) as refused:
        read_design(path)
    line = QUICK.count("\n") + 1
    found = re.findall(
        rf"^{re.escape(str(path))}:(\d+): uncertainty\.(\S+): ", str(refused.value), re.M
    )
    assert sorted((key, int(at) - line) for at, key in found) == [
        ("box.hub_inertia", 1), ("box.mass_factor", 1), ("box.payload_mas", 1), ("quantity", 2),
        ("searches", 5), ("seed", 4),
    ]  # fmt: skip


def test_a_cost_needs_weights_and_a_slew_its_table(tmp_path: Path) -> None:
    given = (
        '[arm]\ncatalogue = "paper-beam"\nhub = { inertia = 0.2 }\n[controller]\nmethod = "given"\n'
        "pid = { kp = 1.0 }\n" + BOX
    )
    path = tmp_path / "given.toml"
    path.write_text(given + 'quantity = "h2_loss"\n')
    with pytest.raises(InputError, match=r"uncertainty\.quantity: no limits and noise"):
        read_design(path)
    path.write_text(given + 'quantity = "overshoot"\n')
    with pytest.raises(InputError, match="slew: missing"):
        read_design(path)


def test_a_slew_that_the_file_has_not_is_not_searched(tmp_path: Path) -> None:
    path = tmp_path / "design.toml"
    path.write_text(QUICK.replace("[slew]\nangle_deg = 30\nduration_s = 2\n", "") + BOX)
    assert "[slew]" not in path.read_text()
    asked = Asked((), "settling_time", 0, 0, None, None)
    with pytest.raises(InputError, match=r"--quantity: the file has no \[slew\]"):
        print_worst(path, asked, as_json=False)


def test_where_no_arm_has_a_value_none_is_called_the_worst(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The drive is too weak for the slew, on every arm of the box."""
    path = tmp_path / "weak.toml"
    path.write_text(
        "arm = { catalogue = 'quanser-flexible-link', damping_ratio = 0.01, "
        "actuator = { torque_limit = 0.1 } }\n"
        "controller = { method = 'given', pid = { kp = 2.0, kd = 0.2, filter_hz = 30.0 }, "
        "output = 'torque' }\n"
        "slew = { angle_deg = 60.0, duration_s = 0.6 }\ntruth = { modes = 3 }\n"
    )
    asked = Asked(("payload_mass=0:0.05",), "settling_time", 2, 0, None, None)
    print_worst(path, asked, as_json=False)
    said = capsys.readouterr().out
    assert "settling_time has no value on any of them: the slew needs" in said
    assert "nan" not in said
    assert "[variations.worst]" not in said
    print_worst(path, asked, as_json=True)
    told = json.loads(capsys.readouterr().out)
    assert (told["worst"]["value"], told["worst"]["confirmed"]) == (None, False)
