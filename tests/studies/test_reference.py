"""The generated pages of the reference tell of everything that there is."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

from nested_agents.studies.api.running import run
from nested_agents.studies.cli.main import COMMANDS
from nested_agents.studies.results.results import NUMBERS
from nested_agents.studies.spec.keys import tables
from nested_agents.studies.store.store import Store

DOCS = Path(__file__).resolve().parents[2] / "docs"
SPEC = {
    "study": "scaling", "seeds": 1, "episodes": 1, "steps": 3, "evaluation": 1,
    "preset": "own-value", "scenario": {"kind": "line-up"}, "sweep": {"scenario.carts": [2]},
}  # fmt: skip


@pytest.fixture(scope="module")
def reference() -> ModuleType:
    spec = importlib.util.spec_from_file_location("reference", DOCS / "reference.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def pages(reference: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("reference")
    reference.write(folder)
    return {path.stem: path.read_text(encoding="utf-8") for path in folder.iterdir()}


def test_every_key_and_command_is_there(pages: dict[str, str]) -> None:
    for table in tables():
        assert not table.name or table.heading in pages["keys"]
        for key in table.keys:
            assert f"\n| `{key.name}` | " in pages["keys"]
    for command in COMMANDS:
        assert f"\n## {command}\n" in pages["commands"]


def test_the_columns_are_those_of_a_study(reference: ModuleType, tmp_path: Path) -> None:
    run(SPEC, tmp_path / "study", jobs=1, progress=False)
    with Store.open(tmp_path / "study") as store:
        episodes, trials = store.episodes()[0], store.trials()[0]
        measures = [measure.name for measure in store.measures()]
    parts = {"*swept keys*": ["scenario.carts"], "*measures*": measures, "*numbers*": []}
    told = [part for row in reference.EPISODES for part in parts.get(row[0], [row[0]])]
    assert episodes == told
    told = [part for row in reference.TRIALS for part in parts.get(row[0], [row[0]])]
    assert trials[: len(told)] == told
    assert set(trials[len(told) :]) <= set(NUMBERS)
