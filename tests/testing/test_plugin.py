"""The pytest plugin: which files it takes for designs, what it tells, and what it costs."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from quick_design import QUICK

import slewctl.testing.collect  # loaded here, so that inner runs need not reload it
from slewctl.files.schema import DesignTable
from slewctl.testing.plugin import TABLES

ROOT = Path(__file__).parents[2]
FAST = (
    QUICK
    + """\
disk_margin = 5
[variations.heavy]
payload_mass = 0.1
requirements.phase_margin_deg = 80
"""
)
BROKEN = FAST.replace("n = 2", "n = -2")

Inner = Callable[..., pytest.RunResult]


@pytest.fixture
def inner(pytester: pytest.Pytester, request: pytest.FixtureRequest) -> Inner:
    """Run pytest with the plugin, installed or not, in an empty folder."""
    pytester.syspathinsert(ROOT)
    here = request.config.pluginmanager.has_plugin("slewctl")
    plugin = [] if here else ["-p", "slewctl.testing.plugin"]
    # The last of them takes two seconds to say that it has nothing to say.
    plugin += ["-p", "no:cacheprovider", "-p", "no:hypothesispytest"]
    return lambda *options: pytester.runpytest_inprocess(*plugin, *options)


def designs(pytester: pytest.Pytester, folder: str = "designs", **texts: str) -> None:
    for name, text in texts.items():
        path = pytester.path / folder / f"{name}.toml"
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")


def test_a_design_is_a_test_for_each_requirement(pytester: pytest.Pytester, inner: Inner) -> None:
    designs(pytester, good=FAST)
    result = inner("--slewctl", "-v", "designs")
    result.assert_outcomes(passed=3, failed=2)
    result.stdout.fnmatch_lines_random(
        [
            "designs/good.toml::stable PASSED*",
            "designs/good.toml::gain_margin_db PASSED*",
            "designs/good.toml::disk_margin FAILED*",
            "designs/good.toml::stable[[]heavy] PASSED*",
            "designs/good.toml::phase_margin_deg[[]heavy] FAILED*",
        ]
    )


def test_the_worst_arm_and_a_measured_plant_have_tests_of_their_own(
    pytester: pytest.Pytester, inner: Inner
) -> None:
    source = ROOT / "designs" / "rigs"
    text = (source / "servo-with-ruler.toml").read_text(encoding="utf-8")
    box = "[uncertainty]\nbox = { stiffness_factor = [0.9, 1.1] }\n"
    designs(pytester, rig=text[: text.index("[variations")] + box)
    response = (source / "servo-with-ruler.csv").read_text(encoding="utf-8")
    (pytester.path / "designs" / "servo-with-ruler.csv").write_text(response, encoding="utf-8")
    result = inner("--slewctl", "--collect-only", "-q", "designs")
    names = [line.split("::")[1] for line in result.outlines if "::" in line]
    asked = ["stable", "gain_margin_db", "phase_margin_deg", "modulus_margin"]
    arms = ["", "[worst of the box]", "[measured]"]
    assert names == [name + arm for arm in arms for name in asked]


def test_a_failure_tells_value_limit_place_and_arm(pytester: pytest.Pytester, inner: Inner) -> None:
    designs(pytester, good=FAST)
    result = inner("--slewctl", "designs")
    result.stdout.re_match_lines(
        [
            r".*good\.toml:19: disk_margin does not hold",
            r"  value  0\.\d+ at [\d.]+ Hz",
            r"  limit  >= 5$",
            r".*good\.toml:22: phase_margin_deg does not hold",
            r"  value  [\d.]+ deg at [\d.]+ Hz",
            r"  limit  >= 80 deg",
            r"  arm    variation heavy",
        ]
    )
    result.stdout.no_fnmatch_line("*Traceback*")
    result.stdout.no_fnmatch_line("*def runtest*")


def test_a_broken_design_is_one_failure_and_hides_no_other(
    pytester: pytest.Pytester, inner: Inner
) -> None:
    designs(pytester, broken=BROKEN, torn="[arm]\n[controller]\nlimits = {", good=FAST)
    result = inner("--slewctl", "designs", "-k", "can_be_judged or gain_margin_db")
    result.assert_outcomes(passed=1, failed=2, deselected=4)
    result.stdout.fnmatch_lines(["*broken.toml:7: model.n: -2 is not allowed; give *"])
    result.stdout.fnmatch_lines(["*torn.toml:3: not valid TOML*"])


@pytest.mark.parametrize(
    "text",
    [
        "[project]\nname = 'x'\n",
        "[arm]\nx = 1\n",
        "[controller]\n",
        "arm = 1\ncontroller = 2\n",
        "][",
        "[model]\nx = 1\n[controller]\n",
        "[controller]\n[requirements]\n",
        "[farm]\n[models]\n",
        "[arm]\n[export]\n",
        "[arms]\n[exports]\n",
        '[arm]\ncatalogue = "paper-beam"\n[variations.fit-1-plus]\nstiffness_factor = 1.1\n',
    ],
)
def test_other_toml_files_are_left_alone(
    pytester: pytest.Pytester, inner: Inner, text: str
) -> None:
    designs(pytester, other=text)
    inner("--slewctl", "designs").assert_outcomes()


def test_a_broken_design_written_in_lines_does_not_go_unseen(
    pytester: pytest.Pytester, inner: Inner
) -> None:
    lines = "arm = { catalogue = 'paper-beam' }\ncontroller = { method = 'lqg' }\n"
    designs(pytester, good=FAST, torn=f"{lines}truth = {{ modes = 5\n")
    inner("--slewctl", "designs", "-k", "can_be_judged").assert_outcomes(failed=1, deselected=5)


@pytest.mark.parametrize("wrong", ["controler", "Controller", "control"])
def test_a_design_whose_table_is_mistyped_fails_as_it_does_in_the_gate(
    pytester: pytest.Pytester, inner: Inner, wrong: str
) -> None:
    designs(pytester, good=FAST, wrong=FAST.replace("[controller]", f"[{wrong}]"))
    result = inner("--slewctl", "designs", "-k", "can_be_judged")
    result.assert_outcomes(failed=1, deselected=5)
    result.stdout.fnmatch_lines([f"*wrong.toml:*{wrong}: unknown key*"])


def test_a_design_without_its_controller_or_with_a_mistyped_arm_fails(
    pytester: pytest.Pytester, inner: Inner
) -> None:
    designs(pytester, lost=FAST.replace("[controller]", "[truth.x]"))
    designs(pytester, typed=FAST.replace("[arm]", "[arn]"))
    inner("--slewctl", "designs").assert_outcomes(failed=2)


def test_the_plugin_knows_every_table_of_a_design() -> None:
    known = {
        name
        for name, field in DesignTable.model_fields.items()
        if name not in ("written_for", "title")
    }
    assert set(TABLES) == known


def test_a_folder_without_a_design_makes_no_green_run(
    pytester: pytest.Pytester, inner: Inner
) -> None:
    designs(pytester, sheet='[arm]\ncatalogue = "paper-beam"\n')
    pytester.makepyfile(test_x="def test_x(): pass")
    pytester.makeini("[pytest]\nslewctl_designs = designs\n")
    result = inner()
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*slewctl_designs: *designs: no design in it*"])


def test_nothing_is_collected_unless_asked(pytester: pytest.Pytester, inner: Inner) -> None:
    designs(pytester, good=FAST)
    pytester.makepyfile(test_x="def test_x(): pass")
    inner().assert_outcomes(passed=1)


def test_the_ini_option_names_folders(pytester: pytest.Pytester, inner: Inner) -> None:
    designs(pytester, good=BROKEN)
    designs(pytester, "elsewhere", good=BROKEN)
    pytester.makepyfile(test_x="def test_x(): pass")
    pytester.makeini("[pytest]\nslewctl_designs = designs\n")
    inner().assert_outcomes(passed=1, failed=1)
    inner("test_x.py").assert_outcomes(passed=1)
    inner("designs").assert_outcomes(failed=1)
    inner("elsewhere").assert_outcomes()


def test_the_ini_option_adds_to_testpaths_and_to_nothing_named(
    pytester: pytest.Pytester, inner: Inner
) -> None:
    designs(pytester, good=BROKEN)
    pytester.mkdir("tests").joinpath("test_x.py").write_text("def test_x(): pass")
    pytester.makeini("[pytest]\ntestpaths = tests\nslewctl_designs = designs\n")
    inner().assert_outcomes(passed=1, failed=1)
    inner("tests").assert_outcomes(passed=1)


def test_a_folder_that_is_not_there_makes_no_green_run(
    pytester: pytest.Pytester, inner: Inner
) -> None:
    pytester.makepyfile(test_x="def test_x(): pass")
    pytester.makeini("[pytest]\nslewctl_designs = desings\n")
    result = inner()
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*slewctl_designs: *desings: no such file or folder*"])
    inner("test_x.py").assert_outcomes(passed=1)


@pytest.mark.parametrize("encoding", ["latin-1", "utf-16"])
def test_a_design_in_another_encoding_fails_and_does_not_go_unseen(
    pytester: pytest.Pytester, inner: Inner, encoding: str
) -> None:
    folder = pytester.mkdir("designs")
    folder.joinpath("arm.toml").write_bytes(f'title = "Träger"\n{FAST}'.encode(encoding))
    folder.joinpath("other.toml").write_bytes('title = "Träger"\n'.encode(encoding))
    result = inner("--slewctl", "designs")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*arm.toml*UTF-8*"])


def test_a_pytest_that_does_not_say_what_it_looks_at_is_understood(
    pytester: pytest.Pytester, inner: Inner, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before 7.2 a configuration had no ``args_source``."""
    monkeypatch.setattr(pytest.Config, "args_source", property(lambda _: None, lambda *_: None), raising=False)  # fmt: skip
    designs(pytester, good=BROKEN)
    pytester.mkdir("tests").joinpath("test_x.py").write_text("def test_x(): pass")
    pytester.makeini("[pytest]\ntestpaths = tests\nslewctl_designs = designs\n")
    inner().assert_outcomes(passed=1, failed=1)
    inner("tests").assert_outcomes(passed=1)


def test_studies_and_texts_beyond_reading_are_told_apart_by_their_content(
    pytester: pytest.Pytester, inner: Inner
) -> None:
    study = '[arm]\ncatalogue = "paper-beam"\n[[grid]]\norders = [1]\n'
    endless = "x" + ".a" * 20_000 + " = 1\n"
    large = "#" * 1_000_001
    designs(pytester, study=study, endless=endless + "[arm]\n[controller]\n", other=endless)
    designs(pytester, large="[arm]\n[controller]\n" + large)
    result = inner("--slewctl", "designs")
    result.assert_outcomes(failed=2)
    result.stdout.fnmatch_lines(["*endless.toml:1: not valid TOML: nested too deeply*"])
    result.stdout.fnmatch_lines(["*large.toml: is larger than 1 MB*"])


def test_designs_can_be_selected_by_their_mark(pytester: pytest.Pytester, inner: Inner) -> None:
    designs(pytester, good=BROKEN)
    pytester.makepyfile(test_x="def test_x(): pass")
    inner("--slewctl", "--strict-markers", "-m", "slewctl").assert_outcomes(failed=1, deselected=1)
    inner("--slewctl", "-m", "not slewctl").assert_outcomes(passed=1, deselected=1)


def test_a_design_is_judged_once_and_only_if_a_test_of_it_runs(
    pytester: pytest.Pytester, inner: Inner, monkeypatch: pytest.MonkeyPatch
) -> None:
    judged = []
    examine = slewctl.testing.collect.examine
    monkeypatch.setattr(
        slewctl.testing.collect, "examine", lambda d: judged.append(d.path.stem) or examine(d)
    )
    designs(pytester, a=FAST, b=FAST)
    inner("--slewctl", "--collect-only", "designs")
    assert judged == []
    inner("--slewctl", "designs/b.toml")
    assert judged == ["b"]


def test_the_plugin_costs_nothing_when_it_is_not_used() -> None:
    code = (
        "import sys, pytest\n"
        "status = pytest.main(['--co', '-q', '-p', 'no:cacheprovider', '--noconftest', sys.argv[1]])\n"
        "loaded = {'slewctl.errors', 'numpy', 'scipy', 'control', 'click'} & set(sys.modules)\n"
        "assert 'slewctl.testing.plugin' in sys.modules and not loaded, loaded"
    )
    plugin = [
        "-c",
        f"import sys; sys.path.insert(0, {str(ROOT)!r}); import slewctl.testing.plugin\n{code}",
    ]
    done = subprocess.run(
        [sys.executable, *plugin, str(ROOT / "designs")],
        capture_output=True, text=True, check=False, cwd=ROOT / "designs",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def test_the_package_registers_the_plugin() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert project["project"]["entry-points"]["pytest11"] == {"slewctl": "slewctl.testing.plugin"}
    assert (ROOT / "slewctl" / "testing" / "plugin.py").is_file()
