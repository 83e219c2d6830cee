from pathlib import Path
from typing import Any

import pytest
from made_up_results import NOTHING, Arrays, scaling

from nested_agents.studies.catalogue import scaling as module
from nested_agents.studies.catalogue.scaling import analyse, draw, measure
from nested_agents.studies.catalogue.study import draw_figures, load_study
from nested_agents.studies.presentation.figures import save
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import arrange, check_conditions
from nested_agents.studies.trials.session import run_trial
from nested_agents.studies.trials.trial import trials_of
from research import SPECS

SIZES = {2: 0.9, 8: 0.9, 64: 0.5}


def test_messages_by_search_method_and_size() -> None:
    analysis = analyse(scaling(SIZES).frames())
    assert [case.name for case in analysis.cases] == ["sums"] * 3 + ["sampling"] * 3
    assert [line.estimates["messages"].value for line in analysis.table[:3]] == [6, 120, 8128]


def by_topology(passed: dict[str, dict[int, int]], first: str = "topology") -> Arrays:
    """Results of topologies that pass so many messages, by number of robots."""
    base = Arrays()
    for name, counts in passed.items():
        made = scaling(dict.fromkeys(counts, 0.9))
        for robots, count in counts.items():
            old, parts = f"sums, robots={robots}", [f"topology={name}", f"robots={robots}"]
            new = ", ".join(parts if first == "topology" else parts[::-1])
            for kept, found in (
                (base.training, made.training),
                (base.evaluation, made.evaluation),
                (base.numbers, made.numbers),
                (base.usage, made.usage),
            ):
                kept[new] = found[old]
            base.numbers[new]["messages"][:] = count
            base.columns[new] = {"topology": name, "scenario.robots": robots}
    return base


PASSED = {"chain": {2: 6, 4: 28}, "star": {2: 3, 4: 7}, "independent": {2: 0, 4: 0}}


@pytest.mark.parametrize("first", ["topology", "robots"])
def test_messages_are_told_by_topology_where_they_differ(first: str) -> None:
    analysis = analyse(by_topology(PASSED, first).frames())
    assert list(dict.fromkeys(p.name for p in analysis.cases)) == [*PASSED]
    told = [line.estimates["messages"].value for line in analysis.table]
    assert told == [6, 28, 3, 7, 0, 0]


def test_who_is_no_robot_is_called_none() -> None:
    results = by_topology({"chain": {3: 6}, "star": {3: 3}})
    for columns in results.columns.values():
        del columns["scenario.robots"]
    assert {case.sizes.word for case in analyse(results.frames()).cases} == {"agent groups"}


def test_robots_alone_make_one_line() -> None:
    made = scaling(SIZES)
    parts = [made.training, made.evaluation, made.numbers, made.usage]
    own = [{str(n): part[f"sums, robots={n}"] for n in SIZES} for part in parts]
    analysis = analyse(Arrays(*own[:2], numbers=own[2], usage=own[3]).frames())
    assert {p.name for p in analysis.cases} == {"default"}


def test_the_figure_has_a_line_of_messages_by_topology() -> None:
    axes = draw(analyse(by_topology(PASSED).frames()))["scaling"].get_axes()[4]
    lines = [line.get_ydata() for line in axes.get_lines()]
    assert [list(line) for line in lines] == [list(c.values()) for c in PASSED.values()]


def test_the_figure_is_drawn_or_left_out(tmp_path: Path) -> None:
    paths = save(draw(analyse(scaling(SIZES).frames())), tmp_path)
    assert [path.name for path in paths] == ["scaling.png", "scaling.svg"]
    assert draw_figures(module, analyse(NOTHING)) == {}


@pytest.mark.parametrize(("topology", "count"), [("chain", 6), ("star", 3), ("independent", 0)])
def test_messages_are_the_edges_of_the_transitive_closure(topology: str, count: int) -> None:
    (condition,) = Spec.of({"topology": topology}).conditions()
    hierarchy = arrange(condition.settings, 0).team.hierarchy
    assert hierarchy.n_messages == count


def test_a_trial_is_measured_without_being_changed() -> None:
    table = {"study": "scaling", "seeds": [7], "episodes": 1, "steps": 4, "evaluation": 1}
    (trial,) = trials_of(Spec.of(table))
    result = measure(trial)
    assert result.rows == run_trial(trial).rows
    assert (result.numbers["agents"], result.numbers["messages"]) == (4.0, 6.0)
    assert result.numbers["weight_bytes"] == 4 * 47 * 8, "four wheels"
    assert result.numbers["joint_actions"] == pytest.approx(340.0), "4 + 16 + 64 + 256"
    assert 0.0 < result.usage["decision_median"] <= result.usage["decision_99"]


SHORT = {"rollout": 4, "batch_size": 4, "epochs": 1, "hidden": [8]}


@pytest.mark.parametrize(
    ("learner", "agents", "expected"),
    [
        ({}, "actuator", {"messages": 1, "joint_actions": 8}),
        ({"kind": "hierarchy-ppo", **SHORT}, "actuator", {"messages": 1, "joint_actions": 8}),
        ({"kind": "mappo", **SHORT}, "actuator", {"messages": 0, "joint_actions": 8}),
        ({"kind": "ppo", **SHORT}, "actuator", {"messages": 0, "joint_actions": 8}),
    ],
)
def test_agents_of_every_kind_are_counted(
    learner: dict[str, Any], agents: str, expected: dict[str, float]
) -> None:
    table = {
        "study": "scaling",
        "seeds": [7],
        "episodes": 1,
        "steps": 6,
        "evaluation": 1,
        "scenario": {"kind": "line-up", "carts": 2},
        "agents": agents,
        "learner": learner,
        "preset": "default" if learner else "fitted-q",
    }
    spec = Spec.of(table)
    load_study("scaling").check(spec)
    (trial,) = trials_of(spec)
    result = measure(trial)
    assert result.rows == run_trial(trial).rows
    assert {name: result.numbers[name] for name in expected} == expected
    assert 0 < result.numbers["weight_bytes"] <= result.numbers["team_bytes"]


def test_decisions_without_a_search_are_not_averaged_in() -> None:
    """In the first episode all values are zero, so that nothing is searched."""
    table = {
        "study": "scaling",
        "seeds": [7],
        "episodes": 3,
        "steps": 4,
        "evaluation": 1,
        "topology": "independent",
        "scenario": {"kind": "kinematic-chain", "joints": 6},
        "learner": {"decision": {"evaluator": "best-response", "budget": 24}},
    }
    (trial,) = trials_of(Spec.of(table))
    assert measure(trial).numbers["joint_actions"] == 24


def test_weights_of_networks_by_hand() -> None:
    table = {
        "scenario": {"kind": "line-up", "carts": 2},
        "learner": {"kind": "hierarchy-ppo", "critic": "own", **SHORT},
    }
    (condition,) = Spec.of(table).conditions()
    told, own, hidden, actions = 4, 4, 8, 4
    actor = hidden * (told + own + 1) + actions * (hidden + 1)
    critic = hidden * (own + 1) + hidden + 1
    assert arrange(condition.settings, 0).team.weight_bytes == 4 * (actor + critic)


def test_the_spec_reaches_from_2_to_64_robots() -> None:
    own = Path(module.__file__).parent / "scaling.toml"
    paths = (SPECS / "costs.toml", own, SPECS / "crowds.toml")
    specs = list(map(Spec.load, paths))
    for reached, sizes in ((specs[:1], {2, 4, 8, 16}), (specs[1:], {2, 4, 8, 16, 32, 64})):
        conditions = [condition for spec in reached for condition in spec.conditions()]
        assert sizes <= {c.settings.scenario.robots for c in conditions}
    spec = specs[0]
    small = spec.model_copy(update={"overrides": spec.overrides[:1]})
    check_conditions(small)
