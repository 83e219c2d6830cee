"""docs/reproduce.md names every published table, and the spec that it came from."""

import re
from pathlib import Path

import pytest
from programs import main

from nested_agents.studies.results import published
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.store.database import RESULTS_VERSION, SPEC_FILE
from research import RESULTS, SPECS
from research.claims import CATALOG

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOKS = ROOT / "research" / "notebooks"
FOLDERS = (ROOT, SPECS, CATALOG)
"""Folders of specs, from which a notebook names one."""
TEXT = (ROOT / "docs" / "reproduce.md").read_text(encoding="utf-8")
LINES = re.findall(
    r"^\| `([\w-]+)` \| `([\w/-]+\.toml)` \| ([\d,]+) \| ([\d,]*) ?\|", TEXT, re.MULTILINE
)


@pytest.mark.parametrize("notebook", sorted(NOTEBOOKS.glob("*.md")), ids=lambda page: page.stem)
def test_specs_that_a_notebook_names_exist(notebook: Path) -> None:
    named = set(re.findall(r"`([\w/*-]+\.toml)`", notebook.read_text(encoding="utf-8")))
    found = {name for name in named for folder in FOLDERS if any(folder.glob(name))}
    assert named - found - {SPEC_FILE} == set()


def test_every_published_table_has_its_row() -> None:
    committed = sorted(path.stem for path in RESULTS.glob("*.json"))
    assert sorted(name for name, *_ in LINES) == committed


@pytest.fixture(scope="module", params=LINES, ids=lambda row: row[0])
def row(request: pytest.FixtureRequest) -> tuple[Path, published.Published, str, str, str]:
    """A published file, what it holds, and what the page says of it."""
    name, *said = request.param
    path = RESULTS / f"{name}.json"
    return path, published.load(path), *said


def test_the_spec_gives_the_table(row: tuple[Path, published.Published, str, str, str]) -> None:
    _, rows, spec, trials, minutes = row
    if "swimmer" in spec:
        pytest.importorskip("mujoco", reason="extra [mujoco]")
    source = Spec.load(ROOT / spec)
    assert source.study == rows.outline.study
    table = source.table()
    same = ("episodes", "steps", "evaluation")
    assert all(rows.outline.table.get(k) == table.get(k) for k in same)
    gone = {"DQN"}  # a learner of 0.4.0
    assert set(rows.results.conditions) - gone <= {c.label for c in source.conditions()}
    seeds = [rows.results.seeds(c) for c in rows.results.conditions]
    assert all(set(some) <= set(source.seeds) for some in seeds)
    assert int(trials.replace(",", "")) == sum(map(len, seeds))
    total = rows.results.trials.get("seconds.total")
    if total is not None and total.notna().any():
        assert float(minutes.replace(",", "")) == pytest.approx(total.sum() / 60, abs=0.51)


def test_every_committed_file_has_a_table(
    row: tuple[Path, published.Published, str, str, str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path, rows, *_ = row
    monkeypatch.setattr(published, "load", {path: rows}.__getitem__)  # it is read once
    assert main(["table", str(path), "--format", "markdown"]) == 0
    out, err = capsys.readouterr()
    assert out.count("\n") > 2
    expected = ("is trusted from now on", f"this is version {RESULTS_VERSION}")
    assert [line for line in err.splitlines() if not line.endswith(expected)] == []
