"""What a new user stumbled over, each mended thing once."""

from pathlib import Path

import numpy as np
import pytest
from made_up_results import hierarchies, wheel_failure
from matplotlib.figure import Figure

import nested_agents as na
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.interface.measures import SUCCESS
from nested_agents.studies.catalogue.learning_curve import metrics_of
from nested_agents.studies.catalogue.wheel_failure import analyse as analyse_failures
from nested_agents.studies.catalogue.wheel_failure import draw as draw_failures
from nested_agents.studies.cli.main import main
from nested_agents.studies.presentation.figures import log_axis
from nested_agents.studies.results.results import STEPS
from nested_agents.topologies.drawing import draw


def test_every_failure_is_marked() -> None:
    results = wheel_failure({"seized": {"weights": 0.8, "nothing": 0.4, "both": 0.9,
                                        "self-model": 0.6}})  # fmt: skip
    for numbers in results.numbers.values():
        numbers["onset.2"] = np.full(20, 30.0)
    axes = draw_failures(analyse_failures(results.frames()))["wheel-failure"].axes[0]
    marks = {line.get_xdata()[0] for line in axes.lines if len(set(line.get_xdata())) == 1}
    assert marks == {19.5, 29.5}


def test_short_training_has_no_identical_columns() -> None:
    assert [title for title, *_ in metrics_of((SUCCESS,), SUCCESS, STEPS, 4)][:2] == [
        "training success", "evaluation success",
    ]  # fmt: skip
    assert metrics_of((SUCCESS,), SUCCESS, STEPS, 6)[0][0] == "success first 5"


@pytest.mark.parametrize("values", [[0.6, 0.7], [0.3, 4.0], [1.0, 2e5]])
def test_ticks_of_logarithmic_axes_are_plain_numbers(values: list[float]) -> None:
    figure = Figure()
    axes = figure.subplots()
    axes.plot([1, 2], values)
    log_axis(axes)
    figure.draw_without_rendering()
    shown = [t.get_text() for t in axes.get_yticklabels(which="both") if t.get_text()]
    assert shown
    assert not any("times" in text or "^" in text for text in shown)


def test_the_legend_of_a_cost_figure_is_not_cut(tmp_path, monkeypatch) -> None:
    from nested_agents.studies.cost import figure as module

    kept: list[Figure] = []
    monkeypatch.setattr(module.figures, "write", lambda figure, path: kept.append(figure))
    topologies = ["chain", "tree:2", "teams", "chain:interleaved"]
    module.draw(na.cost_table(topologies, [2, 4]).rows, tmp_path / "cost.png")
    (figure,) = kept
    figure.draw_without_rendering()
    extent = figure.legends[0].get_window_extent()
    assert extent.x0 >= 0.0
    assert extent.x1 <= figure.bbox.width


def test_the_paper_s_numbers_stand_beside_ours(capsys) -> None:
    assert main(["cost"]) == 0
    assert "The paper prints 2.45e12 (nested) and 1.1e27 (single" in capsys.readouterr().out
    assert main(["cost", "--agents", "6"]) == 0
    assert "The paper prints" not in capsys.readouterr().out
    assert main(["cost", "--format", "latex"]) == 0
    assert capsys.readouterr().out.startswith("% needs \\usepackage{booktabs}")


def test_colors_of_a_drawn_hierarchy_are_explained(tmp_path) -> None:
    path = tmp_path / "teams.svg"
    draw(Hierarchy("abcd", [("a", "b"), ("a", "c"), ("c", "d")]), path, bodies=[(0, 1), (2, 3)])
    assert "colors: bodies" in path.read_text()


def test_a_failure_after_the_last_episode_is_refused(tmp_path, capsys) -> None:
    path = tmp_path / "spec.toml"
    path.write_text('episodes = 5\n[[scenario.failures]]\nkind = "seized"\nepisode = 5\n'
                    'wheels = "robot1.left"\n')  # fmt: skip
    assert main(["plan", str(path), "--no-timed"]) == 2
    assert "one begins in episode 5, allowed 0 to 4 of 5 episodes" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda: na.BoxPushingSettings(robot=4), "robot = 4: .*; did you mean 'robots'"),
        (lambda: na.BoxPushingSettings(box="hexagn").build(), "did you mean 'hexagon'"),
        (lambda: na.parse_topology(None), "topology None: must be a name, a file or a table"),
        (lambda: na.build_hierarchy(na.TopologySettings(), "ab"), "no factory"),
        (lambda: na.parse_topology({"kind": "tems"}), "did you mean 'teams'"),
        (lambda: na.parse_topology({"members": 3}), "topology.members = 3: must be a list"),
    ],
)
def test_errors_in_python_are_one_line_that_names_the_field(make, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint) as refusal:
        make()
    assert "\n" not in str(refusal.value)
    assert "pydantic" not in str(refusal.value)


def test_a_missing_agent_is_named() -> None:
    from nested_agents.environments import parallel

    env = parallel("box-pushing", 3, robots=1)
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"step: .*'robot1.right' is missing"):
        env.step({"robot1.left": 0})


def test_files_of_teams_are_topologies(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "teams.json").write_text('{"members": [["a", "b"], ["c", ["d", "e"]]]}')
    (tmp_path / "teams.toml").write_text('link = "star"\nmembers = [["a", "b"], ["c", "d"]]\n')
    (tmp_path / "spec.toml").write_text(
        '[sweep]\nagents = ["actuator", "body"]\ntopology = ["chain", "teams"]\n'
    )
    hierarchy = na.build_hierarchy("teams.json", list("abcde"))
    assert hierarchy.edges == ((0, 1), (0, 2), (2, 3), (3, 4))
    for name, shown in (("teams.json", "5 agents, depth 4"), ("teams.toml", "4 agents, depth 3")):
        assert main(["topology", "show", name, "--plot", f"{name}.svg"]) == 0
        assert shown in capsys.readouterr().out
        assert (tmp_path / f"{name}.svg").exists()
    assert main(["topology", "show", "spec.toml", "--plot", "all.svg"]) == 0
    out = capsys.readouterr().out
    assert [line.partition(", depth")[0] for line in out.splitlines() if "depth" in line] == [
        "agents=actuator, topology=chain: 4 agents", "agents=actuator, topology=teams: 4 agents",
        "agents=body, topology=chain: 2 agents",
    ]  # fmt: skip
    assert {path.name for path in tmp_path.glob("all*")} == {f"all-{k}.svg" for k in (1, 2, 3)}
    assert main(["topology", "show", "spec.toml", "--agents", "4"]) == 2


@pytest.mark.parametrize("text", ['{"members": 3}', '{"members": [["a", 3]]}', '{"members": []}'])
def test_what_is_no_file_of_teams_is_refused(tmp_path, monkeypatch, capsys, text) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "teams.json").write_text(text)
    assert main(["topology", "show", "teams.json"]) == 2
    err = capsys.readouterr().err
    assert "teams.json" in err
    assert "members" in err
    assert err.count("\n") == 1


def test_hierarchies_say_how_small_a_difference_they_could_find() -> None:
    from nested_agents.studies.catalogue.hierarchies import analyse

    chances = {("chain", "team", 2): 0.9, ("star", "team", 2): 0.8}
    assert any("Power: 20 seeds" in note for note in analyse(hierarchies(chances).frames()).notes)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (
            "learner.predictor = { ridge = 1 }",
            "learner.predictor.ridge = 1: unknown key for kind 'given'",
        ),
        (
            'learner.predictor.kind = "push"',
            "learner.predictor.kind = 'push': known: given, learned, poses, static; did you mean "
            "scenario.predictor = 'push'?",
        ),
        (
            'learner.predictor = "copy"\nscenario.kind = "gymnasium"\nscenario.id = "CartPole-v1"',
            "learner.predictor = 'copy': must be a table; did you mean scenario.predictor = "
            "'copy'?",
        ),
        (
            'learner.predictor.kind = "copy"',
            "kind = 'copy': known: given, learned, poses, static\n",
        ),
    ],
)
def test_a_predictor_of_the_wrong_table_is_pointed_to_the_right_one(
    keys: str, message: str, tmp_path, capsys
) -> None:
    (tmp_path / "spec.toml").write_text(keys)
    assert main(["plan", str(tmp_path / "spec.toml"), "--no-timed"]) == 2
    assert message in capsys.readouterr().err


def test_a_team_that_no_memory_holds_is_refused_in_a_world_of_ones_own(
    tmp_path, monkeypatch, capsys
) -> None:
    monkeypatch.chdir(tmp_path)
    tank = Path(__file__).resolve().parents[2] / "examples" / "tank.py"
    (tmp_path / "tank.py").write_text(tank.read_text(encoding="utf-8"))
    (tmp_path / "spec.toml").write_text('scenario = { kind = "tank.py:Tank", pumps = 100_000 }')
    assert main(["plan", "spec.toml", "--no-timed"]) == 2
    assert "scenario: has 100000 agents: needs an estimated 2.8" in capsys.readouterr().err


def test_a_file_that_cannot_be_written_is_called_by_its_own_name(
    tmp_path, monkeypatch, capsys
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    (tmp_path / "folder.svg").mkdir()
    reasons = {"nowhere/a.svg": "No such file or directory", "file/a.svg": "Not a directory",
               "folder.svg": "Is a directory"}  # fmt: skip
    for path, reason in reasons.items():
        assert main(["cost", "--plot", path]) == 2
        assert capsys.readouterr().err == f"nested-agents: error: {path}: {reason}\n"
