"""``[variations.NAME]``: what is read, what is refused, and where."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from slewctl import InputError
from slewctl.arm import vary
from slewctl.files import name_designs, read_design

BASE = """\
[arm]
catalogue = "paper-beam"
damping_ratio = 0.01
hub = { inertia = 0.5 }
[model]
basis = "slewing"
n = 2
[controller]
method = "lqg"
limits = { tip = 0.1, torque = 1 }
noise = { torque = 0.1, theta = 1e-3 }
[slew]
angle_deg = 30
duration_s = 2
[requirements]
gain_margin_db = 6
"""


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "design.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_variations_change_the_arm_and_keep_or_replace_the_requirements(tmp_path: Path) -> None:
    text = BASE + (
        "[variations.heavy]\npayload_mass = 0.2\nstiffness_factor = 0.9\n"
        "[variations.light]\npayload_mass = 0.0\nrequirements = { disk_margin = 0.3 }\n"
        "[variations.bare]\nhub_friction = 0.1\n[variations.bare.requirements]\n"
    )
    design = read_design(written(tmp_path, text))
    heavy, light, bare = design.variations
    assert [v.name for v in design.variations] == ["heavy", "light", "bare"]
    assert heavy.arm == vary(design.case.arm, payload_mass=0.2, stiffness_factor=0.9)
    assert heavy.requirements == design.requirements == {"gain_margin_db": 6}
    assert light.requirements == {"disk_margin": 0.3}
    assert bare.requirements == {}
    assert design.case.arm.payload.mass == 0


def test_a_file_without_variations_has_none(tmp_path: Path) -> None:
    assert read_design(written(tmp_path, BASE)).variations == ()


REFUSALS = [
    ("[variations.heavy]\npayload_mas = 1", 18, "variations.heavy.payload_mas: unknown key; did you mean 'payload_mass'"),
    ("[variations.heavy]\n\npayload_mass = -1", 19, "variations.heavy.payload_mass: -1 is negative"),
    ("[variations.heavy]\npayload_mass = nan", 18, "variations.heavy.payload_mass: nan is not a finite number"),
    ("[variations.heavy]\npayload_mass = true", 18, "variations.heavy.payload_mass: True is not a finite number"),
    ('[variations.heavy]\npayload_mass = "1"', 18, "variations.heavy.payload_mass: '1' is not a finite number"),
    ("[variations.heavy]\nstiffness_factor = 0", 18, "variations.heavy.stiffness_factor: 0 is not positive"),
    ("[variations.heavy]\npayload_mass_factor = 2", 18, "the arm has no payload mass to multiply; give payload_mass itself"),
    ("[variations.heavy]", 17, "variations.heavy: changes nothing; give at least one of payload_mass,"),
    ("[variations.heavy]\nrequirements.stable = true", 17, "variations.heavy: changes nothing"),
    ("[variations.heavy]\nmass_factor = 1.1\nrequirements.gain = 3", 19, "variations.heavy.requirements.gain: unknown name 'gain'"),
    ("[variations.heavy]\nmass_factor = 1.1\nrequirements.disk_margin = -3", 19, "variations.heavy.requirements.disk_margin: -3 is negative"),
    ("[variations.heavy]\nmass_factor = 1.1\nrequirements = 3", 19, "variations.heavy.requirements: 3 is not allowed; give a table"),
    ("[variations.nominal]\nmass_factor = 1.1", 17, "variations.nominal: 'nominal' cannot name a variation"),
    ('[variations."a\\nb"]\nmass_factor = 1.1', 17, "cannot name a variation"),
    ("[variations]\nheavy = 1.1", 18, "variations.heavy: 1.1 is not allowed; give a table"),
]  # fmt: skip


@pytest.mark.parametrize(("table", "line", "words"), REFUSALS, ids=[w for _, _, w in REFUSALS])
def test_refusals_name_file_line_key_and_remedy(
    tmp_path: Path, table: str, line: int, words: str
) -> None:
    path = written(tmp_path, BASE + table + "\n")
    with pytest.raises(InputError) as caught:
        read_design(path)
    assert str(caught.value).startswith(f"{path}:{line}: ")
    assert words in str(caught.value)
    assert ";" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a = " + "[" * 5000 + "]" * 5000, "nested too deeply"),
        ("a = " + "9" * 5000, "not valid TOML"),
        ("a = 1\na = 2\n", ":2: not valid TOML"),
        ("a = 1\nb = [1, 2\n", "not valid TOML"),
        ("a = 2020-02-31\n", "not valid TOML"),
    ],
)
def test_strange_texts_are_refused_in_one_line(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError) as caught:
        read_design(written(tmp_path, text))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_names_tell_designs_apart_by_as_many_folders_as_it_takes(tmp_path: Path) -> None:
    paths = [tmp_path / way for way in ("p/a/x.toml", "q/a/x.toml", "b/x.toml", "b/y.toml")]
    names = name_designs(paths)
    assert [names[path] for path in paths] == ["p/a/x.toml", "q/a/x.toml", "b/x.toml", "y"]


HOSTILE = "__import__('os').system('touch owned') {{ 7*7 }} ${PATH} `id` !!python/object:os.system"


@pytest.mark.slow
def test_a_design_file_runs_no_code(tmp_path: Path) -> None:
    """No text of a file is compiled, executed, imported or handed to a shell."""
    text = BASE.replace("[arm]", f'title = "{HOSTILE}"\n[arm]\nname = "{HOSTILE}"')
    text += f'[variations."{HOSTILE}"]\nmass_factor = 1.1\n'
    path = written(tmp_path, text)
    code = f"""
import sys
from pathlib import Path
from slewctl.files import read_design
read_design(Path({str(path)!r}))  # what is imported late is imported now
seen = []
def watch(event, arguments):
    if event in ("exec", "compile", "import", "os.system", "os.exec", "subprocess.Popen", "pickle.find_class"):
        seen.append((event, str(arguments)[:200]))
sys.addaudithook(watch)
design = read_design(Path({str(path)!r}))
found = list(seen)
print(design.case.title == design.case.arm.name == design.variations[0].name, found)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, check=True
    )
    assert done.stdout.strip() == "True []"
    assert not (tmp_path / "owned").exists()
