"""The benchmark push-n: its worlds, its rules, its entries."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from programs import main

import nested_agents as na
from nested_agents.core.agents.loop import world_seed
from nested_agents.environments import joint
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.environments import observed_places
from nested_agents.studies.trials.session import EVALUATION_WORLDS
from research import push_n

pytestmark = pytest.mark.usefixtures("entries_read_once")
ROOT = Path(__file__).resolve().parents[2]
TEAM = {"robots": 2, "success": ["1" * 10] * 5, "steps": [[9] * 10] * 5, "decisions": [90] * 5}
ENTRY = {"name": "mine", "about": "by hand", "given": "nothing", "teams": [TEAM]}


@pytest.fixture
def entry(tmp_path: Path) -> Any:
    """Writes an entry and returns its path."""

    def write(**changes: Any) -> str:
        path = tmp_path / "entry.json"
        path.write_text(json.dumps({**ENTRY, **changes}))
        return str(path)

    return write


def test_entries_by_number_of_robots(entry: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["push_n", "table", entry(), "--format", "csv"]) == 0
    lines = [line.split(",") for line in capsys.readouterr().out.splitlines()]
    assert [n for n in lines[0] if n.endswith("robots")] == [f"{n} robots" for n in push_n.SIZES]
    assert lines[-1][:3] == ["mine", "5", "1.0"]
    assert main(["push_n", "table", entry(), "--measure", "decisions"]) == 0
    assert "mine: by hand; is given nothing" in capsys.readouterr().out


def test_published_rows_are_entries() -> None:
    ours = push_n.committed_entries()[0]
    published = na.load(ROOT / "research/results/scaling.json").results
    assert [team.robots for team in ours.teams] == list(push_n.SIZES)
    assert ours.teams[0].success[0] == "".join(
        str(int(reached)) for reached in published.success("2", "evaluation")[0]
    )
    assert ours.teams[0].decisions[3] == published.values("2", "steps")[3].sum()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"given": "all"}, "given = 'all': must be 'nothing', 'predictor'"),
        ({"teams": [{**TEAM, "robots": 3}]}, "robots = 3"),
        ({"teams": [{**TEAM, "success": ["1" * 10] * 4}]}, "success"),
        ({"teams": [{**TEAM, "success": ["1" * 9] * 5}]}, "success[0] = '111111111'"),
        ({"teams": [{**TEAM, "steps": [[451] * 10] * 5}]}, "451"),
        ({"teams": [{**TEAM, "steps": [[9] * 9] * 5}]}, "steps of 10 episodes"),
        ({"teams": [{**TEAM, "decisions": [1] * 6}]}, "of (5, 5, 6) seeds"),
        ({"speed": 1}, "speed = 1: unknown key"),
    ],
)
def test_what_breaks_a_rule(
    entry: Any, changes: Any, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = entry(**changes)
    assert main(["push_n", "check", path]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert path in error


def test_a_file_that_is_no_entry(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for text, message in (
        ("[]", "entry.json: must be one table with the keys of an entry"),
        ("{", "entry.json: Expecting"),
        ('{"name": "mine"}', "missing"),
    ):
        (tmp_path / "entry.json").write_text(text)
        assert main(["push_n", "check", str(tmp_path / "entry.json")]) == 2
        error = capsys.readouterr().err
        assert (error.count("\n"), message in error) == (1, True)


def test_the_schema_of_the_docs(entry: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["push_n", "check", "--schema"]) == 0
    schema = (ROOT / "docs" / "_static" / "push-n.schema.json").read_text()
    assert capsys.readouterr().out == schema
    assert main(["push_n", "check", entry()]) == 0
    assert "mine, 2 robots x 5 seeds" in capsys.readouterr().out


def test_worlds_are_those_of_evaluations_in_studies() -> None:
    env = joint("box-pushing", 2, robots=2)
    worlds = []

    def maintain(observation: Any) -> list[int]:
        worlds.append(observation)
        return [1, 1, 1, 1]

    success, steps = push_n.evaluate(maintain, env, seed=3)
    assert success == "0" * 10
    assert steps == (2,) * 10
    scenario = BoxPushingSettings(robots=2).build()
    states = scenario.reset(world_seed(3, EVALUATION_WORLDS + 9), 0)
    places = observed_places(scenario, range(4), by_agent=False)
    np.testing.assert_array_equal(worlds[18], states.astype(np.float32).ravel()[places])


@pytest.mark.slow
def test_a_spec_is_entered(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine.toml").write_text('preset = "random"\nepisodes = 1\n')
    told = ["--name", "r", "--about", "by chance", "--given", "nothing", "--robots", "2"]
    out = tmp_path / "out"
    assert main(["push_n", "run", str(tmp_path / "mine.toml"), "--out", str(out), *told]) == 0
    entered = push_n.load_entry(out / "entry.json")
    controls = next(e for e in push_n.committed_entries() if e.name == "random")
    assert entered.teams[0].steps == controls.teams[0].steps[:5]
    capsys.readouterr()


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("scenario.box = 'circle'", "scenario.box = 'circle': push-n has 'square'"),
        ("scenario.kind = 'line-up'", "scenario."),
        ("sweep.preset = ['default', 'random']", "must have one condition"),
    ],
)
def test_specs_that_break_a_rule(
    tmp_path: Path, spec: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mine.toml").write_text(spec)
    told = ["--name", "r", "--about", "a", "--robots", "2", "4", "--out", str(tmp_path / "out")]
    assert main(["push_n", "run", str(tmp_path / "mine.toml"), *told]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()
