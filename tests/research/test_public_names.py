"""Programs and studies of research/ use public names of the toolkit only."""

import ast
import re
import sys
import tomllib
from pathlib import Path

import pytest
from programs import main

import nested_agents as na
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.spec.studies import MOVED
from research import FOLDER
from research.studies import __path__ as studies

ROOT = FOLDER.parent
PROGRAMS = sorted(FOLDER.rglob("*.py"))
PUBLIC = {path.stem for path in (ROOT / "nested_agents").glob("[a-z]*.py")}
"""Public modules of the package."""
DEPENDENCIES = {
    "gymnasium",
    "matplotlib",
    "networkx",
    "numpy",
    "pandas",
    "pydantic",
    "rich",
    "scipy",
    "shapely",
    "tomli_w",
}
OTHERS = {"jinja2", "nested_agents_signals", "pytest", "stable_baselines3"}
OWN = {"research", "grade", "labs", "questions"}
"""Modules of the folder itself."""


def private_imports(source: str) -> list[str]:
    """Return the imports that are neither public, nor of libraries, nor of this folder."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names = [(alias.name, "") for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names = [(str(node.module), alias.name) for alias in node.names]
        else:
            continue
        for module, name in names:
            first, _, rest = module.partition(".")
            if first == "nested_agents":
                is_public = rest in PUBLIC or (
                    not rest and (not name or name in PUBLIC.union(na.__all__))
                )
            else:
                is_public = first in sys.stdlib_module_names | DEPENDENCIES | OTHERS | OWN
            if not is_public:
                found.append(f"{module} {name}".strip())
    return found


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: str(path.relative_to(FOLDER)))
def test_imports_are_public(path: Path) -> None:
    source = path.read_text(encoding="utf-8")
    assert private_imports(source) == []
    assert re.findall(r"nested_agents\.(?:core|studies|scenarios|topologies)\b", source) == []


@pytest.mark.parametrize(
    "source",
    [
        "from nested_agents.core.team import Team",
        "from nested_agents import core",
        "import nested_agents.studies.api",
        "from benchmarks.timing import paired",
        "from nested_agents.studies import errors",
    ],
)
def test_a_private_import_is_found(source: str) -> None:
    assert len(private_imports(source)) == 1


@pytest.mark.parametrize("path", sorted(Path(studies[0]).glob("*.py")), ids=lambda path: path.stem)
def test_a_study_is_one_file_that_needs_no_other(path: Path) -> None:
    imports = [n for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.ImportFrom)]
    assert [n.module for n in imports if n.level or str(n.module).startswith("research")] == []


@pytest.mark.parametrize(("name", "place"), MOVED.items())
def test_a_spec_of_a_moved_study_is_told_its_place(name: str, place: str) -> None:
    with pytest.raises(na.SpecError, match=rf"study = '{name}'.*research/studies/{place}") as error:
        Spec.of({"study": name})
    assert "\n" not in str(error.value)
    file, _, attribute = place.partition(":")
    assert f"class {attribute}(Study)" in (FOLDER / "studies" / file).read_text(encoding="utf-8")


def test_published_results_run_their_study_only_if_it_is_trusted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    import nested_agents.studies.cli.main as command_line

    (tmp_path / "results").mkdir()
    (tmp_path / "studies").mkdir()
    text = (FOLDER / "results" / "shapes.json").read_text(encoding="utf-8")
    path = tmp_path / "results" / "shapes.json"
    path.write_text(text)
    study = (FOLDER / "studies" / "shapes.py").read_text(encoding="utf-8")
    (tmp_path / "studies" / "shapes.py").write_text(f"{study}\nMINE = 1\n")
    assert command_line.main(["table", str(path)]) == 2
    assert "--trust" in capsys.readouterr().err
    assert main(["table", str(path)]) == 0
    assert "trained on" in capsys.readouterr().out
    (tmp_path / "studies" / "shapes.py").unlink()
    assert main(["table", str(path)]) == 2
    assert "../studies/shapes.py" in capsys.readouterr().err


def test_specs_and_results_have_the_same_names() -> None:
    unpublished = {
        path.stem
        for path in (FOLDER / "results").glob("*.json")
        if not (FOLDER / "specs" / f"{path.stem}.toml").exists()
    }
    catalog = ROOT / "studies" / "catalogue"
    kept = {path.stem.replace("_", "-") for path in catalog.rglob("*.toml")}
    assert unpublished <= kept


def test_no_spec_names_a_study_that_is_not_there() -> None:
    for path in FOLDER.rglob("*.toml"):
        study = tomllib.loads(path.read_text(encoding="utf-8")).get("study", "scaling")
        assert study not in MOVED, path
