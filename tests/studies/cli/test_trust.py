"""Code that came with a study is run only for who has run it from a spec, or says --trust."""

import json
import shutil
import sys
from pathlib import Path

import pytest
from joblib.externals.loky import get_reusable_executor

from nested_agents.core.plugins import trust
from nested_agents.core.plugins.sources import Sources
from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import SpecError
from nested_agents.studies.results.json_files import in_lines
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.store.database import SPEC_FILE

SPEC = """
study = "mine.py:STUDY"
seeds = 1
episodes = 1
steps = 2
evaluation = 0
topology = "mine.py:ring"
[learner]
kind = "frozen"
[scenario]
kind = "line-up"
"""
MINE = """
from pathlib import Path
from types import SimpleNamespace

from nested_agents.studies.catalogue import learning_curve

Path({mark!r}).touch()


def ring(agents, groups):
    return list(zip(agents, agents[1:]))


STUDY = learning_curve
"""
RUNNING = ("explain", "retry", "report", "table")
HARMLESS = ("status", "results", "export")


@pytest.fixture(scope="module")
def theirs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Who has run a study: a folder with what they have written, trusted and made."""
    folder = tmp_path_factory.mktemp("theirs")
    (folder / "mine.py").write_text(MINE.format(mark=str(folder / "mark")))
    (folder / "spec.toml").write_text(SPEC)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(folder / "state"))
        line = ["run", str(folder / "spec.toml"), "--out", str(folder / "study"), "--jobs", "1"]
        assert main(line) == 0
    return folder


@pytest.fixture
def mark(theirs: Path) -> Path:
    """Exists once the file has been run."""
    mark = theirs / "mark"
    mark.unlink(missing_ok=True)
    return mark


@pytest.fixture
def foreign(theirs: Path, mark: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A study that somebody else has run."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "ours"))
    monkeypatch.setattr(trust, "_noted", set())
    forget_modules()
    return shutil.copytree(theirs / "study", tmp_path / "study")


def forget_modules() -> None:
    for name in [name for name in sys.modules if name.startswith("_nested_agents_")]:
        del sys.modules[name]


def test_nothing_that_came_with_a_study_is_run_unasked(
    foreign: Path, mark: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for command in HARMLESS:
        assert main([command, str(foreign)]) == 0
    again = ["run", str(foreign / SPEC_FILE), "--out", str(foreign)]
    capsys.readouterr()
    for line in (*([command, str(foreign)] for command in RUNNING), again):
        assert main(line) == 2, line
        _, error = capsys.readouterr()
        assert error.count("\n") == 1
        assert "mine.py: came with" in error
        assert "--trust" in error
    # A spec of one's own that names another file of that name.
    (tmp_path / "mine.py").write_text("def ring(agents, groups): return []\n")
    (tmp_path / "spec.toml").write_text(SPEC.replace('"mine.py:STUDY"', '"learning-curve"'))
    assert main(["run", str(tmp_path / "spec.toml"), "--out", str(foreign)]) == 2
    error = capsys.readouterr().err
    assert "mine.py has changed since" in error
    assert "sources/mine.py" in error
    assert "--out" in error
    assert not mark.exists()


def test_trust_is_said_once_and_kept(
    foreign: Path, mark: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["explain", str(foreign), "--trust"]) == 0
    assert f"mine.py, which came with {foreign}, is trusted" in capsys.readouterr().err
    assert mark.exists()
    monkeypatch.setattr(trust, "_noted", set())  # as in another process
    forget_modules()
    for command in RUNNING:
        assert main([command, str(foreign)]) == 0, command
    assert main(["run", str(foreign / SPEC_FILE), "--out", str(foreign)]) == 0
    assert "is trusted" not in capsys.readouterr().err


def test_who_has_run_a_file_trusts_it_wherever_it_is(
    foreign: Path, theirs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(theirs / "state"))
    foreign.rename(tmp_path / "elsewhere")
    assert main(["table", str(tmp_path / "elsewhere")]) == 0


def test_without_a_list_trust_lasts_as_long_as_the_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    assert not trust.is_trusted("x = 8")
    assert [trust.trust("x = 8") for _ in range(2)] == [False, False]
    assert trust.is_trusted("x = 8")
    assert not trust.is_trusted("x = 9")


def test_the_kept_spec_runs_elsewhere_with_the_copies_beside_it(
    foreign: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    again = ["run", str(foreign / SPEC_FILE), "--out", str(tmp_path / "again"), "--jobs", "1"]
    assert main(again) == 2
    assert f"mine.py: came with {foreign}" in capsys.readouterr().err
    assert main([*again, "--trust"]) == 0


@pytest.mark.parametrize("command", ["check", "plan"])
def test_a_spec_kept_with_a_study_is_looked_at_by_trust_alone(
    command: str, foreign: Path, mark: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = [command, str(foreign / SPEC_FILE), "--set", "study=learning-curve"]
    assert main(line) == 2
    assert "--trust runs it" in capsys.readouterr().err
    assert not mark.exists()
    assert main([*line, "--trust"]) == 0
    assert mark.exists()


@pytest.mark.parametrize(("command", "place"), [("check", "."), ("plan", ".."), ("run", ".")])
def test_files_beside_a_kept_spec_are_somebody_elses_too(
    command: str, place: str, foreign: Path, mark: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (foreign / place / "evil.py").write_text(f"# evil\n{MINE.format(mark=str(mark))}")
    table = SPEC.replace('"mine.py:STUDY"', '"learning-curve"')
    table = table.replace('"mine.py:ring"', f'"{place}/evil.py:ring"')
    (foreign / SPEC_FILE).write_text(table)
    out = ["--out", str(foreign.parent / "out")] if command == "run" else []
    line = [command, str(foreign / SPEC_FILE), *out]
    assert main(line) == 2
    error = capsys.readouterr().err
    assert f"{place}/evil.py: came with {foreign}" in error
    assert error.count("\n") == 1
    assert not mark.exists()
    main([*line, "--trust"])
    assert f"{place}/evil.py, which came with {foreign}, is trusted" in capsys.readouterr().err
    assert mark.exists()


def test_a_report_says_what_it_leaves_out(
    theirs: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    spec = tmp_path / "spec.toml"
    spec.write_text(SPEC.replace('"mine.py:STUDY"', '"learning-curve"'))
    shutil.copy(theirs / "mine.py", tmp_path)
    assert main(["run", str(spec), "--out", str(tmp_path / "study"), "--jobs", "1"]) == 0
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "ours"))
    monkeypatch.setattr(trust, "_noted", set())
    forget_modules()
    capsys.readouterr()
    assert main(["report", str(tmp_path / "study")]) == 0
    assert "is not trusted: hierarchies and films" in capsys.readouterr().err
    assert main(["report", str(tmp_path / "study"), "--trust"]) == 0
    assert "left out" not in capsys.readouterr().err


PAYLOAD = """
from networkx import DiGraph
from nested_agents.core.search.exploration import BurstExploration
from nested_agents.scenarios.line_up import LineUp, LineUpSettings


class Carts(LineUp):
    class Settings(LineUpSettings):
        pass


class Bursts(BurstExploration):
    pass


def ring(agents, bodies):
    return list(zip(agents, agents[1:]))


def graph(agents, bodies):
    return DiGraph(ring(agents, bodies))
"""
SMALL = """
seeds = 2
episodes = 1
steps = 2
evaluation = 1
sweep.preset = ["frozen", "random"]
"""
NAMING = {
    "scenario.kind": '[scenario]\nkind = "payload.parts:Carts"\n',
    "topology.kind": '[topology]\nkind = "payload.parts:ring"\n[scenario]\nkind = "line-up"\n',
    "learner.exploration.kind": '[learner.exploration]\nkind = "payload.parts:Bursts"\n'
    '[scenario]\nkind = "line-up"\n',
}
"""Tables that name a module, by the key that does."""
READING = {
    "status": ["status"],
    "results": ["results"],
    "table": ["table"],
    "compare": ["compare"],
    "export csv": ["export", "--format", "csv"],
    "export json": ["export", "--format", "json"],
    "export marl-eval": ["export", "--format", "marl-eval"],
    "report": ["report"],
    "explain": ["explain"],
    "retry": ["retry", "--jobs", "1"],
}
BUILDING = ("explain", "retry")
"""Those that need what the spec names."""


def forget_payload() -> None:
    """Let this process and its workers find the package anew."""
    get_reusable_executor().shutdown(wait=True, kill_workers=True)
    for name in [name for name in sys.modules if name.partition(".")[0] == "payload"]:
        del sys.modules[name]


@pytest.fixture(scope="module", params=NAMING)
def naming(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, Path]:
    """A key that names a module, and a folder with the study of who has written the module."""
    folder = tmp_path_factory.mktemp("naming")
    (folder / "payload").mkdir()
    (folder / "payload" / "__init__.py").touch()
    (folder / "payload" / "parts.py").write_text(PAYLOAD)
    (folder / "spec.toml").write_text(SMALL + NAMING[request.param])
    forget_payload()
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        patch.setenv("PYTHONPATH", str(folder))  # of workers
        patch.setenv("XDG_STATE_HOME", str(folder / "state"))
        line = ["run", str(folder / "spec.toml"), "--out", str(folder / "study"), "--jobs", "1"]
        assert main(line) == 0
        assert main(["table", str(folder / "study")]) == 0
        forget_payload()
        assert main(["explain", str(folder / "study")]) == 0  # one has run it oneself
    return request.param, folder


@pytest.fixture
def reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of somebody who has run nothing yet."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "ours"))
    monkeypatch.setattr(trust, "_noted", set())
    forget_payload()
    return tmp_path


@pytest.mark.parametrize("command", READING)
def test_no_command_imports_what_somebody_elses_study_names(
    command: str,
    naming: tuple[str, Path],
    reader: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    key, folder = naming
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setenv("PYTHONPATH", str(folder))
    study = shutil.copytree(folder / "study", reader / "study")
    shutil.rmtree(study / "explain", ignore_errors=True)
    name, *options = READING[command]
    status = main([name, str(study), *options])
    _, error = capsys.readouterr()
    assert status == (2 if command in BUILDING else 0)
    assert "payload.parts" not in sys.modules
    if status:
        assert error.count("\n") == 1
        assert f"{key} = 'payload.parts:" in error
        assert "--trust" in error
        assert main([name, str(study), *options, "--trust"]) == 0
        assert f"payload.parts, which {study} names, is trusted" in capsys.readouterr().err
        assert main([name, str(study), *options]) == 0


def test_a_module_that_a_file_of_a_hierarchy_names_is_trusted_with_the_study(
    naming: tuple[str, Path],
    reader: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    _, folder = naming
    monkeypatch.syspath_prepend(folder)
    (reader / "teams.toml").write_text('kind = "payload.parts:graph"\n')
    (reader / "spec.toml").write_text(f"topology = 'teams.toml'\n{SMALL}scenario.kind='line-up'")
    study = reader / "study"
    line = ["run", str(reader / "spec.toml"), "--out", str(study), "--jobs", "1"]
    with monkeypatch.context() as patch:
        patch.setenv("PYTHONPATH", str(folder))
        patch.setenv("XDG_STATE_HOME", str(folder / "state"))
        assert main(line) == 0
    monkeypatch.setattr(trust, "_noted", set())
    forget_payload()
    assert main(["explain", str(study)]) == 2
    assert "--trust imports it" in capsys.readouterr().err
    assert "payload.parts" not in sys.modules
    assert main(["explain", str(study), "--trust"]) == 0


@pytest.mark.parametrize("command", ["table", "compare"])
def test_a_file_of_results_that_names_a_module_is_refused(
    command: str, reader: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    spec, out = reader / "spec.toml", reader / "study"
    spec.write_text(SMALL + "scenario.kind = 'line-up'\n")
    assert main(["run", str(spec), "--out", str(out), "--jobs", "1"]) == 0
    assert main(["export", str(out), "--format", "json", "--out", str(reader)]) == 0
    (reader / "payload").mkdir()
    (reader / "payload" / "__init__.py").touch()
    (reader / "payload" / "study.py").write_text(
        "from nested_agents.studies.catalogue import learning_curve as PART\n"
    )
    table = json.loads((reader / "results.json").read_text())
    table["spec"]["study"] = "payload.study:PART"
    (reader / "results.json").write_text(in_lines(table))
    monkeypatch.syspath_prepend(reader)
    capsys.readouterr()
    assert main([command, str(reader / "results.json")]) == (2 if command == "table" else 0)
    assert "payload.study" not in sys.modules
    if command == "table":
        _, error = capsys.readouterr()
        assert error.count("\n") == 1
        assert "study = 'payload.study:PART': payload.study: " in error
        assert "--trust" in error
        assert main([command, str(reader / "results.json"), "--trust"]) == 0


def test_an_environment_of_somebody_elses_module_is_refused() -> None:
    table = {"scenario": {"kind": "gymnasium", "id": "payload.worlds:World-v0"}}
    with pytest.raises(SpecError, match=r"^scenario\.id: payload\.worlds: named by theirs"):
        Spec.of(table, Sources(None, brought_by="theirs"))
    Spec.of(
        {"scenario": {"kind": "pettingzoo", "id": "mpe2/simple_spread_v3"}},
        Sources(None, brought_by="theirs"),
    )


def test_a_module_of_ones_own_spec_is_trusted_where_it_is(
    reader: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for folder in ("one", "other"):
        (reader / folder / "payload").mkdir(parents=True)
        (reader / folder / "payload" / "__init__.py").touch()
    with monkeypatch.context() as patch:
        patch.syspath_prepend(reader / "one")
        Sources(reader).permit("payload.parts")
        Sources(None, brought_by="theirs").permit("payload.parts")
    monkeypatch.syspath_prepend(reader / "other")
    with pytest.raises(ValueError, match=r"payload\.parts: named by theirs"):
        Sources(None, brought_by="theirs").permit("payload.parts")
