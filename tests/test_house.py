"""The house keeps its rules: which room may import which, and what a bare import costs."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from graphlib import TopologicalSorter
from importlib import import_module
from pathlib import Path

import pytest

import slewctl

PACKAGE = Path(slewctl.__file__).parent
SHARED = {
    "_interrupt",
    "_lazy",
    "_show",
    "_threads",
    "_types",
    "breakdown",
    "errors",
    "escape",
    "numerics",
    "textfile",
    "versions",
}
# Each room may import the rooms named here, beside itself and the shared modules.
MAY_IMPORT: dict[str, set[str]] = {
    "numerics": set(),
    "animation": set(),
    "export": set(),
    "arm": {"export"},
    "basis": {"arm"},
    "model": {"arm", "basis"},
    "plant": {"arm", "model"},
    "trajectory": set(),
    "measured": {"arm", "basis", "model", "plant", "export"},
    "design": {"arm", "model", "plant", "export"},
    "loop": {"animation", "arm", "model", "plant", "trajectory", "measured", "design"},
    "compare": {"arm", "basis", "model", "plant", "design", "loop"},
    "paper": {"arm", "basis", "model", "plant", "design", "loop"},
    "check": {"loop", "compare"},
    "embedded": {"export", "arm", "plant", "design", "loop", "compare"},
    "files": {
        "arm",
        "basis",
        "plant",
        "measured",
        "design",
        "loop",
        "compare",
        "check",
        "embedded",
    },
    "gate": {"arm", "plant", "design", "loop", "compare", "check", "embedded", "files"},
    "testing": {"plant", "design", "loop", "compare", "check", "files", "gate"},
    "report": {"animation", "arm", "measured", "loop", "compare", "paper"},
    "explore": {
        "export",
        "arm",
        "basis",
        "model",
        "design",
        "compare",
        "check",
        "files",
        "gate",
        "report",
    },
}
# The only rooms that may import these.
KEEPERS = {"matplotlib": {"report"}, "cvxpy": {"design", "paper"}, "pydantic": {"files"},
           "pytest": {"testing"}, "click": {"cli"}, "rich": {"cli"}, "PIL": {"animation"}, "jinja2": {"report"},
           "panel": {"explore"}, "tomlkit": {"explore"}}  # fmt: skip


def room_files() -> list[tuple[str, Path]]:
    """Return every file of a room with the room's name."""
    return [
        (path.relative_to(PACKAGE).parts[0], path) for path in sorted(PACKAGE.glob("*/**/*.py"))
    ]


def imports(path: Path) -> list[tuple[str, bool]]:
    """Return the modules that a file imports, and whether at its top level."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    found = []
    checked = [
        node
        for block in tree.body
        if isinstance(block, ast.If) and ast.unparse(block.test) == "TYPE_CHECKING"
        for node in block.body
    ]
    top = [*tree.body, *checked]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [(alias.name, node in top) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            assert node.module is not None
            found.append((node.module, node in top))
            if node.module == "slewctl":
                found += [(f"slewctl.{alias.name}", node in top) for alias in node.names]
    return found


def test_rooms_import_only_from_the_left() -> None:
    rooms = {room for room, _ in room_files()}
    assert rooms - {"cli"} == set(MAY_IMPORT)
    for room, path in room_files():
        if room == "cli":
            continue
        for module, top in imports(path):
            if module.startswith("slewctl."):
                other = module.split(".")[1]
                assert other == room or other in SHARED | MAY_IMPORT[room], f"{path}: {module}"
                # The plugin is loaded by every run of pytest, and has nothing to do in most.
                late = path.name == "plugin.py" and other == room
                assert top or late, f"{path}: deferred import of {module}"


def dotted(path: Path) -> str:
    """Return the name by which a file of the package is imported."""
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def inner(module: str) -> str:
    """Return the inner room, or the file, of a room that a module of it belongs to."""
    parts = module.split(".")[2:]
    return parts[0] if parts else "__init__"


@pytest.mark.parametrize("room", sorted(MAY_IMPORT))
def test_inner_rooms_import_in_one_direction(room: str) -> None:
    graph: dict[str, set[str]] = {}
    for path in (PACKAGE / room).glob("**/*.py"):
        here = inner(dotted(path))
        wanted = {
            inner(module) for module, _ in imports(path) if module.startswith(f"slewctl.{room}.")
        }
        graph.setdefault(here, set()).update(wanted - {here})
    list(TopologicalSorter(graph).static_order())  # CycleError


def test_inner_rooms_keep_an_empty_init() -> None:
    inits = list(PACKAGE.glob("*/*/**/__init__.py"))
    assert inits
    assert [path for path in inits if path.read_text(encoding="utf-8").strip()] == []


def test_no_file_is_longer_than_a_reader_bears() -> None:
    lines = {path: len(path.read_text("utf-8").splitlines()) for path in PACKAGE.glob("**/*.py")}
    assert {path.name: length for path, length in lines.items() if length > 400} == {}


def test_no_package_hides_a_module_of_its_own() -> None:
    for path in PACKAGE.glob("**/__init__.py"):
        package = import_module(dotted(path))
        modules = {module.stem for module in path.parent.glob("*.py")}
        assert modules & set(getattr(package, "__all__", ())) == set(), path


def test_control_is_loaded_where_a_users_object_is_made_or_read() -> None:
    for _, path in room_files():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for node in tree.body:
            if isinstance(node, ast.Import | ast.ImportFrom):
                assert "control" not in ast.unparse(node).replace(".", " ").split(), path


@pytest.mark.parametrize(
    "code",
    [
        "import slewctl",
        "import slewctl.testing, slewctl.compare, slewctl.design, slewctl.cli.commands",
    ],
)
def test_the_door_opens_at_once(code: str) -> None:
    heavy = "{'numpy', 'scipy', 'control', 'matplotlib', 'cvxpy', 'pydantic', 'rich', 'jinja2'}"
    done = f"import sys; {code}; sys.exit(str({heavy} & set(sys.modules)))"
    told = subprocess.run([sys.executable, "-c", done], capture_output=True, text=True, check=False)
    assert told.stderr.strip() == "set()"


def test_a_verdict_does_without_python_control() -> None:
    code = (
        "import sys, slewctl as sc\n"
        "arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)\n"
        "o = sc.Objective({'tip': 0.1, 'torque': 1}, {'torque': 0.1, 'theta': 1e-3})\n"
        "K = sc.lqg(sc.generalised_plant(sc.assemble(arm, sc.ClampedFree(1)), o))\n"
        "loop = sc.close(sc.truth(arm), o, K); loop.describe()\n"
        "assert not {'control', 'matplotlib', 'scipy.signal'} & set(sys.modules)\n"
        "assert loop.return_ratio.__class__.__module__ == 'control.statesp'\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_heavy_packages_stay_in_their_rooms() -> None:
    for room, path in room_files():
        for module, _ in imports(path):
            top = module.split(".")[0]
            assert room in KEEPERS.get(top, {room}), f"{path}: {module}"


def test_cvxpy_is_loaded_by_the_first_synthesis_only() -> None:
    code = (
        "import sys, slewctl as sc, slewctl.design as d; assert 'cvxpy' not in sys.modules\n"
        "arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)\n"
        "o = sc.Objective({'tip': 0.1, 'torque': 1}, {'torque': 0.1, 'theta': 1e-3})\n"
        "p = sc.generalised_plant(sc.assemble(arm, sc.ClampedFree(1)), o)\n"
        "sc.lqg(p); assert 'cvxpy' not in sys.modules\n"
        "d.h2_lmi(p); assert 'cvxpy' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_every_public_name_exists_and_is_documented() -> None:
    for name in slewctl.__all__:
        assert getattr(slewctl, name).__doc__, name


def numbers_alone(value: ast.expr | None) -> bool:
    """Whether an expression is made of numbers: 1e-9, (3, 2.0), -1, 1 - 1e-6."""
    if isinstance(value, ast.Tuple | ast.List):
        return all(map(numbers_alone, value.elts))
    if isinstance(value, ast.UnaryOp):
        return numbers_alone(value.operand)
    if isinstance(value, ast.BinOp):
        return numbers_alone(value.left) and numbers_alone(value.right)
    return isinstance(value, ast.Constant) and type(value.value) in (int, float)


def unexplained(text: str) -> list[str]:
    """Return the numeric constants of a file that no comment beside or above them explains.

    A comment speaks for the constants below it up to the next blank line.
    """
    lines = text.splitlines()
    found = []
    body = ast.parse(text).body
    for node, after in zip(body, [*body, None][1:], strict=True):
        if not isinstance(node, ast.Assign | ast.AnnAssign) or not numbers_alone(node.value):
            continue
        above = node.lineno - 2
        while above >= 0 and lines[above].strip() and not lines[above].startswith("#"):
            above -= 1
        if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
            continue  # a docstring of its own
        if not lines[above].startswith("#") and "#" not in lines[node.end_lineno - 1]:
            found.append(lines[node.lineno - 1])
    return found


def test_a_number_without_a_word_is_found() -> None:
    assert unexplained("A = 1\n# Said.\nB = 2\nC = (3, -1.0)\n\nD = 4\nE = 5  # said\n") == [
        "A = 1",
        "D = 4",
    ]


def test_every_number_of_the_package_says_where_it_comes_from() -> None:
    silent = {
        str(path.relative_to(PACKAGE)): found
        for path in PACKAGE.glob("**/*.py")
        if (found := unexplained(path.read_text(encoding="utf-8")))
    }
    assert not silent


@pytest.mark.xdist_group("kept together")
def test_tests_that_share_a_build_stay_with_one_worker(request: pytest.FixtureRequest) -> None:
    if "PYTEST_XDIST_WORKER" in os.environ:
        assert request.node.nodeid.endswith("@kept together")
