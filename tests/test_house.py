"""The house rules: import direction, the four folders, what may be committed."""

import ast
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import networkx as nx
import pytest

ROOT = Path(__file__).resolve().parent.parent
ALLOWED = {
    "core": {"core"},
    "topologies": {"topologies", "core"},
    "scenarios": {"scenarios", "core"},
    "studies": {"studies", "core", "topologies", "scenarios"},
}
STUDIES = (
    "errors", "store", "spec", "trials", "workers", "results", "laws", "presentation", "catalogue",
    "cost", "scalability", "resilience", "explain", "report", "api", "cli",
)  # fmt: skip
"""The rooms of studies/, each of which may import those before it."""
MAX_BYTES = 1_000_000


def imported_modules(source: str, module: str, *, is_package: bool) -> Iterator[tuple[int, str]]:
    """Line and absolute dotted name of everything that a module imports."""
    package = module.split(".") if is_package else module.split(".")[:-1]
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name
        elif isinstance(node, ast.ImportFrom):
            start = package[: len(package) - node.level + 1] if node.level else []
            stem = ".".join([*start, *filter(None, [node.module])])
            # `from .. import core` imports a package, `from ..core import x` a name of one.
            for alias in node.names:
                yield node.lineno, f"{stem}.{alias.name}"


def forbidden_imports(source: str, module: str, *, is_package: bool = False) -> list[str]:
    """What a module of one of the packages imports of ours and may not."""
    package = module.split(".")[1]
    found = []
    for line, name in imported_modules(source, module, is_package=is_package):
        first, _, rest = name.partition(".")
        ours = rest.split(".")[0]
        if first in ALLOWED:
            found.append(f"{module}:{line} imports {name}; write nested_agents.{first} relatively")
        elif first == "nested_agents" and ours not in ALLOWED[package]:
            found.append(f"{module}:{line} imports {name}; {package} may not")
    return found


def modules_of(package: str) -> Iterator[tuple[Path, str]]:
    for path in sorted((ROOT / package).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        is_package = parts[-1] == "__init__"
        yield path, ".".join(["nested_agents", *(parts[:-1] if is_package else parts)])


@pytest.mark.parametrize("package", ALLOWED)
def test_imports_point_one_way(package: str) -> None:
    found = []
    for path, module in modules_of(package):
        source = path.read_text(encoding="utf-8")
        found += forbidden_imports(source, module, is_package=path.name == "__init__.py")
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("nested_agents.core.team", "from ..scenarios import Box"),
        ("nested_agents.core.team", "from .. import studies"),
        ("nested_agents.core.team", "from .. import Team"),
        ("nested_agents.core.team", "import nested_agents"),
        ("nested_agents.core.team", "import nested_agents.topologies.chain as c"),
        ("nested_agents.core.team", "import core"),
        ("nested_agents.topologies.chain", "def f():\n    from ..scenarios.box import Box"),
        ("nested_agents.scenarios.box", "from nested_agents.topologies import chain"),
        ("nested_agents.scenarios.parts.box", "from ...studies import cli"),
    ],
)
def test_a_forbidden_import_is_found(module: str, source: str) -> None:
    assert len(forbidden_imports(source, module)) == 1


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("nested_agents.core.team", "import numpy as np\nfrom .rules import RuleBase"),
        ("nested_agents.topologies.chain", "from ..core.hierarchy import Hierarchy"),
        ("nested_agents.topologies.chain", "from ..core import Hierarchy\nfrom . import tree"),
        (
            "nested_agents.studies.cli.main",
            "from ..scenarios import Box\nfrom ..topologies import tree",
        ),
    ],
)
def test_an_allowed_import_is_not(module: str, source: str) -> None:
    assert forbidden_imports(source, module) == []


def imports_between(sources: dict[str, tuple[str, bool]]) -> nx.DiGraph:
    """Which module imports which, of modules by name: their source, and whether packages.

    Imports inside functions and for type checking count like all others.
    """
    graph = nx.DiGraph()
    for module, (source, is_package) in sources.items():
        graph.add_node(module)
        for line, name in imported_modules(source, module, is_package=is_package):
            stem = name if name in sources else name.rpartition(".")[0]
            if stem in sources and stem != module:
                graph.add_edge(module, stem, line=line)
    return graph


def folders_of(graph: nx.DiGraph, packages: set[str]) -> nx.DiGraph:
    """Which folder imports which; a package's own module counts as its folder."""
    folders = nx.DiGraph()
    for edge in graph.edges:
        place, target = (m if m in packages else m.rpartition(".")[0] for m in edge)
        if place != target:
            folders.add_edge(place, target)
    return folders


def circles(graph: nx.DiGraph) -> list[str]:
    """The circles of imports, each as one line."""
    return [
        " <-> ".join(sorted(circle))
        for circle in nx.strongly_connected_components(graph)
        if len(circle) > 1
    ]


def wrong_arrows(graph: nx.DiGraph) -> list[str]:
    """The imports inside studies/ that point from a room to a later one."""
    found = []
    for module, imported, line in graph.edges(data="line"):
        rooms = [name.split(".")[2] for name in (module, imported) if name.count(".") > 1]
        inside = [n.startswith("nested_agents.studies.") for n in (module, imported)]
        if len(rooms) == 2 and all(inside):
            place, target = map(STUDIES.index, rooms)
            if target > place:
                found.append(f"{module}:{line} imports {imported}; {rooms[0]} is below {rooms[1]}")
    return found


@pytest.fixture(scope="module")
def graph() -> nx.DiGraph:
    return imports_between(
        {
            module: (path.read_text(encoding="utf-8"), path.name == "__init__.py")
            for package in ALLOWED
            for path, module in modules_of(package)
        }
    )


def test_no_files_import_each_other_in_a_circle(graph: nx.DiGraph) -> None:
    assert graph.number_of_edges() > 100
    assert circles(graph) == []


def test_no_folders_import_each_other_in_a_circle(graph: nx.DiGraph) -> None:
    folders = folders_of(
        graph,
        {
            module
            for package in ALLOWED
            for path, module in modules_of(package)
            if path.name == "__init__.py"
        },
    )
    assert folders.number_of_edges() > 50
    assert circles(folders) == []


def test_a_circle_of_folders_is_named() -> None:
    roof_and_ground = {
        "nested_agents.core": ("from .values import base", True),
        "nested_agents.core.values": ("", True),
        "nested_agents.core.values.base": ("def f():\n    from ..spaces import S", False),
        "nested_agents.core.spaces": ("", False),
    }
    graph = imports_between(roof_and_ground)
    packages = {module for module, (_, is_package) in roof_and_ground.items() if is_package}
    assert circles(graph) == []
    assert circles(folders_of(graph, packages)) == [
        "nested_agents.core <-> nested_agents.core.values"
    ]


def test_imports_inside_studies_point_one_way(graph: nx.DiGraph) -> None:
    assert wrong_arrows(graph) == []


def test_the_store_knows_neither_specs_nor_trials_nor_the_files_of_users(graph: nx.DiGraph) -> None:
    others = ("nested_agents.studies.", "nested_agents.core.plugins.")
    own = ("nested_agents.studies.store.", "nested_agents.studies.errors")
    found = {
        imported
        for module, imported in graph.edges()
        if module.startswith("nested_agents.studies.store.") and imported.startswith(others)
    }
    assert [name for name in found if not name.startswith(own)] == []


def test_a_circle_and_a_wrong_arrow_are_named() -> None:
    at_type_checking = "if TYPE_CHECKING:\n    from ..report.page import Page"
    graph = imports_between(
        {
            "nested_agents.studies.store.store": (at_type_checking, False),
            "nested_agents.studies.report.page": ("def f():\n    from ..store import store", False),
        }
    )
    assert circles(graph) == [
        "nested_agents.studies.report.page <-> nested_agents.studies.store.store"
    ]
    assert wrong_arrows(graph) == [
        "nested_agents.studies.store.store:2 imports nested_agents.studies.report.page; "
        "store is below report"
    ]


PRIVATE_WORDS = {
    "found", "said", "meant", "doubts", "suited", "slip", "deaf", "bereft", "take_over",
    "elsewhere", "arena", "foresee", "conduct", "hire",
}  # fmt: skip
"""What nothing is called; a method ``slips`` is of friction, ``told`` of messages."""


def definitions(folder: str) -> Iterator[tuple[str, str, bool]]:
    """Yield place and name of what is defined or assigned below a folder, and whether a class."""
    for path in sorted((ROOT / folder).rglob("*.py")):
        if path.is_relative_to(ROOT / "docs/_build") or path.is_relative_to(ROOT / "docs/gallery"):
            continue  # made by ./dev docs
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef | ast.FunctionDef):
                name, is_class = node.name, isinstance(node, ast.ClassDef)
            elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                name, is_class = node.id, False
            elif isinstance(node, ast.arg):
                name, is_class = node.arg, False
            else:
                continue
            yield f"{path.relative_to(ROOT)}:{node.lineno}", name, is_class


def test_words_are_the_fields_and_a_class_name_has_one_meaning() -> None:
    classes: dict[str, list[str]] = {}
    private = []
    for folder in (*ALLOWED, "research", "benchmarks", "examples", "docs"):
        for place, name, is_class in definitions(folder):
            if is_class and name != "Settings":  # that of a part, nested in its class
                classes.setdefault(name, []).append(place)
            if name.strip("_").lower() in PRIVATE_WORDS:
                private.append(f"{place} {name}")
    assert {name: places for name, places in classes.items() if len(places) > 1} == {}
    assert private == []


@pytest.mark.parametrize("package", ALLOWED)
def test_the_folders_at_the_top_are_those_of_the_package(package: str) -> None:
    module = import_module(f"nested_agents.{package}")
    assert module.__file__ == str(ROOT / package / "__init__.py")


@pytest.fixture(scope="module")
def tracked() -> list[Path]:
    git = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if git.returncode:
        pytest.skip("not a git checkout")
    paths = [ROOT / name for name in git.stdout.split("\0") if name]
    return [path for path in paths if path.is_file()]


def test_no_tracked_file_is_a_link(tracked: list[Path]) -> None:
    # An archive that is unpacked without links would lack what they point to.
    assert [path for path in tracked if path.is_symlink()] == []


def test_tracked_files_are_small(tracked: list[Path]) -> None:
    large = {str(p.relative_to(ROOT)): p.stat().st_size for p in tracked}
    assert {name: size for name, size in large.items() if size > MAX_BYTES} == {}


def test_tracked_files_name_no_place_of_the_machine(tracked: list[Path]) -> None:
    # Written in pieces, so that this file passes its own test.
    absolute = re.compile("|".join(re.escape("/" + top + "/") for top in ("work", "root")).encode())
    found = [str(p.relative_to(ROOT)) for p in tracked if absolute.search(p.read_bytes())]
    assert found == []


def test_tracked_files_configure_no_index(tracked: list[Path]) -> None:
    option = re.compile(r"(--|\[tool\.uv\.|^|\s)(extra-)?index(-url)?[ =\]]+\S*://", re.MULTILINE)
    found = []
    for path in tracked:
        if path.suffix in {".toml", ".lock", ".txt", ".cfg", ".sh", ".yml", ""}:
            text = path.read_text(encoding="utf-8", errors="ignore")
            found += [str(path.relative_to(ROOT))] if option.search(text) else []
    assert found == []


@pytest.mark.parametrize("name", ["requirements.lock", "box2d.lock"])
def test_the_locks_have_hashes_and_no_host(name: str) -> None:
    lock = (ROOT / name).read_text(encoding="utf-8")
    assert "://" not in lock
    pinned = re.findall(r"^[a-z0-9][\w.-]*==\S+.*(?:\n    --hash=.*)*", lock, re.MULTILINE)
    assert pinned
    assert [entry for entry in pinned if "--hash=sha256:" not in entry] == []


def test_host_naming_locks_are_not_tracked(tracked: list[Path]) -> None:
    assert [p.name for p in tracked if p.name == "uv.lock" or p.name.startswith("pylock")] == []


CHEAP = "tests/test_house.py tests/test_hygiene.py"


def function_of_dev(name: str) -> str:
    """Return the text of a shell function in dev."""
    text = (ROOT / "dev").read_text("utf-8")
    (function,) = re.findall(rf"^{name}\(\) {{.*?^}}", text, re.DOTALL | re.MULTILINE)
    return function


def test_dev_says_in_one_line_what_the_machine_lacks(tmp_path: Path) -> None:
    for name in ("dev", "pyproject.toml", "requirements.lock", "box2d.lock"):
        shutil.copy(ROOT / name, tmp_path)
    run = subprocess.run(
        [tmp_path / "dev", "setup"],
        env={**os.environ, "PYTHON": "no-such-python"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (run.returncode, run.stdout) == (2, "")
    assert run.stderr.startswith("dev: needs python3 >= 3.11, found none")
    assert run.stderr.count("\n") == 1
    assert not (tmp_path / ".venv").exists()


@pytest.mark.parametrize(
    ("compiler", "python", "missing"),
    [
        ("true", sys.executable, ""),
        ("no-such-compiler", sys.executable, "C++ compiler (no-such-compiler)"),
        ("true", "false", "Python headers (Python.h; Debian has them in python3-dev)"),
    ],
)
def test_dev_knows_what_it_takes_to_build_box2d(compiler: str, python: str, missing: str) -> None:
    line = ["sh", "-c", f'{function_of_dev("lacking")}\nlacking "$1"', "sh", python]
    environment = {**os.environ, "CXX": compiler}
    run = subprocess.run(line, env=environment, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == missing


def test_dev_refuses_an_unknown_command() -> None:
    run = subprocess.run([ROOT / "dev", "tset"], capture_output=True, text=True, check=False)
    assert run.returncode == 2
    assert run.stderr.splitlines()[-1] == "dev: unknown command 'tset'"


@pytest.mark.parametrize(
    ("arguments", "added"),
    [
        (["tests/core", "-x"], CHEAP),
        (["dev::test_of_a_file"], CHEAP),
        (["-k", "core_"], ""),
        ([], ""),
    ],
)
def test_dev_adds_the_cheap_tests_to_those_of_a_path(arguments: list[str], added: str) -> None:
    line = f'{function_of_dev("whole_repository")}\nwhole_repository "$@"'
    command = ["sh", "-c", line, "sh", *arguments]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == added


def test_dev_generate_refuses_without_a_package_and_writes_nothing(tmp_path: Path) -> None:
    line = f"fail() {{ echo dev: $* >&2; exit 2; }}\n{function_of_dev('generate')}\ngenerate"
    python = tmp_path / "python"
    python.write_text("#!/bin/sh\nexit 1\n")
    python.chmod(0o755)
    environment = {"PATH": f"{tmp_path}:/usr/bin:/bin", "venv": str(tmp_path / "venv")}
    run = subprocess.run(
        ["sh", "-c", line], env=environment, capture_output=True, text=True, check=False
    )
    assert (run.returncode, run.stdout) == (2, "")
    assert run.stderr.startswith("dev: generate needs Box2D")
    assert not (tmp_path / "venv").exists()
