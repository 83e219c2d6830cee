"""Pictures of environments before anything runs."""

from pathlib import Path

import pytest

from nested_agents.scenarios import SCENARIOS
from nested_agents.studies.cli.main import main

BOX = "box = { vertices = 'outline.csv', center_of_mass = [0.1, 0.1] }"


@pytest.mark.parametrize(
    "table",
    [
        {"kind": "box-pushing", "robots": 3, "box": "L"},
        {"kind": "kinematic-chain", "joints": 5},
        {"kind": "line-up", "carts": 3},
        {"kind": "matrix-game", "game": "penalty:-10"},
        {"kind": "matrix-game", "game": "three-agents"},
        {"kind": "team-game", "players": 5},
        {"kind": "gymnasium", "id": "CartPole-v1"},
    ],
    ids=lambda table: "-".join(map(str, table.values())),
)
def test_every_environment_can_be_drawn(table, tmp_path: Path) -> None:
    scenario = SCENARIOS.parsed(table["kind"], **table).build()
    for seed, name in ((0, "a.png"), (0, "b.png"), (0, "c.svg")):
        scenario.reset(seed)
        scenario.draw(tmp_path / name)
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert "<svg" in (tmp_path / "c.svg").read_text()
    with pytest.raises(ValueError, match=r"suffix '\.txt'"):
        scenario.draw(tmp_path / "d.txt")


def test_the_command_draws_each_scenario_of_a_spec_once(tmp_path: Path, capsys) -> None:
    (tmp_path / "outline.csv").write_text("0,0\n0.3,0\n0.3,0.2\n0,0.2\n")
    spec = tmp_path / "spec.toml"
    sweep = "sweep = { 'scenario.robots' = [1, 2], 'learner.discount' = [0.9, 0.95] }"
    spec.write_text(f"seeds = 1\n{sweep}\n[scenario]\n{BOX}\n")
    assert main(["draw", str(spec), "--plot", str(tmp_path / "start.png")]) == 0
    assert sorted(path.name for path in tmp_path.glob("*.png")) == ["start-1.png", "start-2.png"]
    assert "start-2.png" in capsys.readouterr().out


def test_the_command_draws_a_kind_and_refuses_in_one_line(tmp_path: Path, capsys) -> None:
    path = tmp_path / "carts.svg"
    assert main(["draw", "line-up", "--plot", str(path)]) == 0
    assert path.exists()
    for line in (
        ["draw", "line-up", "--plot", str(tmp_path / "carts.txt")],
        ["draw", "line-up", "--plot", str(tmp_path / "nowhere" / "carts.png")],
        ["draw", "lineup"],
    ):
        capsys.readouterr()
        assert main(line) == 2
        assert len(capsys.readouterr().err.strip().splitlines()) == 1
