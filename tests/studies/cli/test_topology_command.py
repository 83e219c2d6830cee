"""``nested-agents topology`` as a user meets it."""

import json
from itertools import pairwise
from pathlib import Path

import pytest

from nested_agents.core.agents.joint import join_agents
from nested_agents.studies.cli.main import main
from nested_agents.topologies import TOPOLOGIES, build
from nested_agents.topologies.view import format_count, team_of


@pytest.fixture
def said(capsys: pytest.CaptureFixture[str]):
    """Run a command; return status, output and errors."""

    def run(*arguments: str) -> tuple[int, str, str]:
        status = main(["topology", *arguments])
        return status, *capsys.readouterr()

    return run


def test_list_names_every_kind(said) -> None:
    status, out, _ = said("list")
    assert status == 0
    assert all(
        any(line.startswith(kind) for line in out.splitlines()) for kind in TOPOLOGIES.built_in
    )
    assert max(map(len, out.splitlines())) <= 80


def test_show_as_json(said) -> None:
    status, out, _ = said("show", "teams", "--agents", "4", "--format", "json")
    assert status == 0
    shown = json.loads(out)
    left1, right1, left2, right2 = shown["agents"]
    assert shown["edges"] == [[left1, right1], [left1, left2], [left2, right2]]
    assert shown["order"] == [left1, right1, left2, right2]
    assert shown["lookahead"][left1] == [right1, left2, right2]
    assert shown["joint_actions_per_step"] == 4**4 + 4 + 4**2 + 4
    assert shown["depth"] == 3


def test_show_as_table(said) -> None:
    _, out, _ = said("show", "chain", "--agents", "4")
    assert out.startswith("chain: 4 agents, depth 4, 340 joint actions a step (exhaustive)\n")
    assert "1  robot1.left           3    256  robot1.right" in out
    assert max(map(len, out.splitlines())) <= 80


def test_parted_relations_and_failures_are_shown(said, tmp_path) -> None:
    spec = tmp_path / "study.toml"
    spec.write_text(
        "scenario.robots = 2\n[evaluations]\n"
        "near.topology.communication = ['body', 'next']\n"
        "lost.topology = { lookahead = 'none', failures = [{ kind = 'lost', agents = 'r*t' }] }\n"
    )
    status, out, _ = said("show", str(spec), "--plot", str(tmp_path / "shown.svg"))
    assert status == 0
    assert "communication: body and next; lookahead: descendants; 6 messages a step\n" in out
    assert "communication: ancestors; lookahead: none; 6 messages a step\nfails: lost: r*t\n" in out
    third = (tmp_path / "shown-3.svg").read_text(encoding="utf-8")
    assert "dotted arrows: communication only; dashed frame: messages fail" in third


def test_a_topology_file_cannot_set_relations(said, tmp_path) -> None:
    teams = tmp_path / "teams.toml"
    teams.write_text('members = ["robot1.left", "robot1.right"]\ncommunication = "none"\n')
    status, _, err = said("show", str(teams))
    assert status == 2
    assert "communication belongs in the [topology] table of the spec" in err


@pytest.mark.parametrize(
    ("arguments", "agents"),
    [
        (("chain",), ["robot1.left", "robot1.right", "robot2.left", "robot2.right"]),
        (("chain", "--agents", "3"), ["agent1", "agent2", "agent3"]),
        (("chain", "--robots", "1"), ["robot1.left", "robot1.right"]),
        (("chain", "--robots", "1", "--agents", "3"), [f"robot1.wheel{k}" for k in (1, 2, 3)]),
        (("edges:x>y,z",), ["x", "y", "z"]),
    ],
)
def test_agents_are_those_asked_for(said, arguments: tuple[str, ...], agents: list[str]) -> None:
    assert json.loads(said("show", *arguments, "--format", "json")[1])["agents"] == agents


def test_the_single_agent_is_shown_with_its_joint_actions(said) -> None:
    out = said("show", "chain", "--per", "team", "--agents", "4", "--format", "json")[1]
    assert json.loads(out)["joint_actions_per_step"] == 4**4


@pytest.mark.parametrize(
    ("arguments", "robots", "tried"),
    [
        (("--agents", "4"), ["robot1", "robot2"], 256 + 16),
        (("--robots", "2", "--agents", "8", "--actions", "3"), ["robot1", "robot2"], 81**2 + 81),
        (("--agents", "3"), ["agent1", "agent2", "agent3"], 64 + 16 + 4),
    ],
)
def test_robots_are_shown_as_a_chain(
    said, tmp_path: Path, arguments: tuple[str, ...], robots: list[str], tried: int
) -> None:
    plot = tmp_path / "robots.svg"
    status, out, _ = said(
        "show", "chain", "--per", "body", *arguments, "--format", "json", "--plot", str(plot)
    )
    shown = json.loads(out)
    assert (status, shown["agents"]) == (0, robots)
    assert shown["edges"] == [list(pair) for pair in pairwise(robots)]
    assert shown["joint_actions_per_step"] == tried
    assert "<svg" in plot.read_text()


def test_robots_are_shown_as_they_are_arranged(said, line_world) -> None:
    world = line_world(2, 2)
    scenario = join_agents(world, "body")
    hierarchy = build("chain", scenario.agents)
    shown = json.loads(
        said("show", "chain", "--per", "body", "--agents", "4", "--format", "json")[1]
    )
    assert len(shown["agents"]) == len(scenario.agents)
    assert shown["depth"] == hierarchy.depth
    assert shown["joint_actions_per_step"] == hierarchy.count_joint_actions(
        len(scenario.action_set)
    )


def test_it_is_shown_over_the_agents_of_a_scenario(said) -> None:
    status, out, _ = said("show", "tree:2", "--scenario", "spread")
    assert status == 0
    assert out.startswith(
        "tree:2: 3 agents, depth 2, 135 joint actions a step (exhaustive)\n"
    )  # 5^3 + 2 x 5
    status, _, errors = said("show", "chain", "--scenario", "spread", "--agents", "3")
    assert (status, errors.count("\n")) == (2, 1)
    assert "chain: the scenario spread defines the agents" in errors


def test_a_plot_is_written(said, tmp_path: Path) -> None:
    assert said("show", "star", "--plot", str(tmp_path / "star.svg"))[0] == 0
    assert "<svg" in (tmp_path / "star.svg").read_text()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("show",), "Missing argument 'SPEC'; see nested-agents topology show --help"),
        (("draw",), "No such command 'draw'"),
        (("list", "chain"), "unexpected extra argument (chain); see nested-agents topology list"),
        (
            ("list", "--agents", "3"),
            "No such option '--agents'; see nested-agents topology list",
        ),
        (("show", "chain:"), "topology 'chain:': order must be written a,b,c, received ''"),
        (("show", "tree:0"), "topology 'tree:0': branching = 0: must be at least 1"),
        (("show", "tree:2", "--agents", "x"), "'--agents': 'x' is not a valid integer"),
        (("show", "chain", "--plot", ""), "--plot: must not be empty"),
        (("show", "edges:a>b,b>a"), "topology 'edges': cycle a -> b -> a"),
        (("show", "chian"), "did you mean 'chain'?"),
        (("show", "chain", "--agents", "0"), "'--agents': 0 is not in the range x>=1"),
        (("show", "chain", "--agents", "1001"), "agents = 1001, allowed: up to 1,000"),
        (("show", "chain", "--actions", "1"), "'--actions': 1 is not in the range x>=2"),
        (("show", "chain", "--agents", "5", "--robots", "2"), "agents = 5 cannot be divided"),
        (("show", "edges:a>b", "--agents", "4"), "the topology names 2 agents, 4 are asked for"),
        (
            ("show", "chain", "--per", "body", "--agents", "5", "--robots", "1"),
            "agents = 'body': 4 ** 5 actions each, allowed: 256 or fewer",
        ),
        (("show", "chain", "--plot", "chain.txt"), "chain.txt: suffix must be"),
    ],
)
def test_what_the_user_can_mend_is_one_line(said, arguments: tuple[str, ...], message: str) -> None:
    status, out, err = said(*arguments)
    assert (status, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


def test_teams_and_numbers() -> None:
    assert team_of(6, 2)[1] == ((0, 1, 2), (3, 4, 5))
    assert format_count(999_999_999) == "999,999,999"
    assert format_count(10**5000) == "1.000e5000"
