import re
import tomllib

import networkx as nx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.learners.td import FrozenSettings
from nested_agents.scenarios.line_up import LineUp
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.objects import plain
from nested_agents.studies.spec.presets import PRESETS
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.spec.tables import dumps
from nested_agents.topologies import build

BAD = {
    "": [],
    "stepz = 3": ["stepz = 3", "did you mean 'steps'"],
    "study = 'lerning-curve'": ["study", "did you mean 'learning-curve'"],
    "preset = 'papr'": ["preset = 'papr'", "did you mean 'paper'"],
    "preset = 3": ["preset = 3", "string"],
    "seeds = -1": ["seeds = -1", "between 1 and"],
    "seeds = 0": ["seeds = 0", "between 1 and"],
    "seeds = true": ["seeds = true", "whole number"],
    "seeds = 'eight'": ["seeds = 'eight'", "whole number"],
    "seeds = []": ["seeds = []"],
    "seeds = [1, 1]": ["seeds = [1, 1]", "distinct"],
    "seeds = [1, -2]": ["seeds[1] = -2", "at least 0"],
    "seeds = [1, 'x']": ["seeds[1] = 'x'", "whole number"],
    "seeds = 1000000000000": ["seeds = 1000000000000", "between 1 and"],
    "episodes = 0": ["episodes = 0", "at least 1"],
    "episodes = '20'": ["episodes = '20'", "whole number"],
    "episodes = 2.0": ["episodes = 2.0", "whole number"],
    "steps = -450": ["steps = -450", "at least 1"],
    "evaluation = -1": ["evaluation = -1", "at least 0"],
    "scenario = 3": ["scenario = 3", "table"],
    "scenario.robots = 0": ["scenario.robots = 0", "at least 1"],
    "scenario.robots = true": ["scenario.robots = true"],
    "scenario.start = 'medum'": ["scenario.start = 'medum'", "'easy', 'medium' or 'hard'"],
    "scenario.reward = 3": ["scenario.reward = 3", "table"],
    "scenario.reward.c1 = nan": ["scenario.reward.c1 = nan", "finite"],
    "scenario.reward.receding = inf": ["scenario.reward.receding = inf", "finite"],
    "scenario.box.vertices = [[0, 0], [inf, 0], [1, 1]]": ["vertices[1][0] = inf", "finite"],
    "scenario.reward.c9 = 1": ["scenario.reward.c9 = 1", "unknown key"],
    "topology = 'chan'": ["'chan'", "chain"],
    "topology = 3": ["topology = 3", "table"],
    "topology.kind = 'tems'": ["topology.kind = 'tems'", "did you mean 'teams'"],
    "topology.kind = 3": ["topology.kind = 3"],
    "learner.kind = ['frozen']": ["learner.kind = ['frozen']"],
    "learner.rigde = 3": ["learner.rigde = 3", "did you mean 'ridge'", "batch-td"],
    "learner.ridge = -1": ["learner.ridge = -1", "greater than 0"],
    "learner = {kind = 'frozen', ridge = 3}": ["learner.ridge = 3", "unknown key", "frozen"],
    "learner.exploration = 3": ["learner.exploration = 3", "table"],
    "learner.sweeps = 3": ["learner.sweeps = 3", "regression_iterations"],
    "learner.rule_base.order = 1.5": ["learner.rule_base.order = 1.5", "whole number"],
    "sweep = 3": ["sweep = 3", "table"],
    "sweep.preset = 'paper'": ["sweep.preset = 'paper'", "list"],
    "sweep.preset = []": ["sweep.preset = []", "list"],
    "sweep.presett = ['paper']": ["sweep.presett", "did you mean 'preset'"],
    "sweep.episodes = [1, 2]": ["sweep.episodes", "unknown key"],
    "sweep.robots = [1, 2]": ["sweep.robots", "unknown key", "did you mean 'scenario.robots'?"],
    "scenario.discount = 0.9": ["scenario.discount", "did you mean 'learner.discount'?"],
    "sweep.preset = ['default', 'papr']": ["preset = 'papr'", "did you mean 'paper'"],
    "sweep.preset = ['paper', 'paper']": ["sweep", "the same"],
    "sweep.learner.kind = ['batch-td']\nsweep.preset = [1]": ["preset = 1"],
    "sweep.topology = ['chain', 'chain:listed']": ["'chain' and 'chain:listed' are the same"],
    "sweep.learner.ridge = [1, -1]": ["learner.ridge = -1", "condition '-1'"],
    "seeds = 50000\nsweep.scenario.robots = [1, 2, 3]": ["3 conditions x 50000 seeds"],
    "overrides = 3": ["overrides = 3", "list"],
    "overrides = [3]": ["overrides[0] = 3", "table"],
    "[[overrides]]\npreset = 'paper'": ["overrides[0].name: missing"],
    "overrides = [{name = ''}]": ["overrides[0].name = ''", "can be printed"],
    'overrides = [{name = "a\\nb"}]': ["overrides[0].name = 'a\\nb'", "can be printed"],
    "scenario.action_repeat = 99999999999": [
        "scenario.action_repeat = 99999999999",
        "at most 10000",
    ],
    "learner.regression_iterations = 99999999999": ["iterations = 99999999999", "at most 10000"],
    "overrides = [{name = 'a', larner = {}}]": ["overrides[0].larner", "did you mean 'learner'"],
    "overrides = [{name = 'a', learner = 3}]": ["overrides[0].learner = 3", "table"],
    "overrides = [{name = 'a', topology = 'chan'}]": ["'chan'", "overrides[0]", "'chain'"],
    "overrides = [{name = 'a', preset = 'papr'}]": ["preset = 'papr'", "'paper'", "'a'"],
    "overrides = [{name = 'a', learner = {ridge = -1}}]": ["learner.ridge = -1", "condition 'a'"],
    "overrides = [{name = 'a', sweep = {steps = [1]}}]": ["overrides[0].sweep.steps", "unknown"],
    "overrides = [{name = 'a'}, {name = 'b'}]": ["overrides", "'a' and 'b' are the same"],
    "overrides = [{name = 'a'}, {name = 'a', learner = {ridge = 1}}]": ["overrides", "the same"],
    "evaluations = 3": ["evaluations = 3", "table"],
    "evaluations.' ' = {}": ["evaluations", "can be printed"],
    "evaluations.a = 3": ["evaluations.a = 3", "table"],
    "evaluations.'sampled actions' = {}": ["evaluations", "sampled actions", "another name"],
    "evaluations.a.boxx = 'circle'": ["scenario.boxx = 'circle'", "unknown", "evaluation 'a'"],
    "seeds =": ["not valid TOML"],
    "episodes = 1979-05-27": ["episodes = 1979-05-27"],
}  # fmt: skip


@pytest.mark.parametrize("text", [text for text in BAD if text])
def test_what_is_wrong_is_said_in_one_line(text):
    with pytest.raises(SpecError) as caught:
        Spec.parse(text)
    message = str(caught.value)
    assert "\n" not in message
    for part in BAD[text]:
        assert part in message


def test_defaults():
    spec = Spec.parse("")
    assert (spec.study, spec.preset, spec.seeds) == ("learning-curve", "default", tuple(range(8)))
    assert [c.label for c in spec.conditions()] == ["default"]
    assert spec.conditions()[0].columns == {"preset": "default"}


@pytest.mark.parametrize("preset", PRESETS)
def test_every_preset_is_a_valid_condition(preset):
    (condition,) = Spec.of({"preset": preset}).conditions()
    assert condition.label == preset


def test_the_paper_preset_holds_the_printed_constants():
    settings = Spec.of({"preset": "paper"}).conditions()[0].settings
    learner = settings.learner
    assert (learner.kind, learner.step_size, learner.trace_decay) == ("td-lambda", 0.00012, 0.4)
    assert (learner.discount, learner.exploration.decay) == (0.999, 0.005)
    assert (learner.rule_base.order, learner.rule_base.memberships) == (7, 5)


def test_controls_differ_from_the_default_in_the_learner_and_planner_in_what_it_plans_by():
    conditions = Spec.of({"sweep": {"preset": ["default", "frozen", "random", "planner"]}})
    default, *controls = [c.settings for c in conditions.conditions()]
    own = Spec.of({"preset": "own-value"}).conditions()[0].settings.scenario
    reward = own.reward.model_copy(update={"attraction_without_contact": True})
    planned = own.model_copy(update={"prediction_horizon": 48, "reward": reward})
    for control, scenario in zip(controls, [default.scenario] * 2 + [planned], strict=True):
        assert control.scenario == scenario
        assert control.topology == default.topology
        assert control.learner.kind == "frozen"
        assert control.learner.rule_base == default.learner.rule_base


def test_the_spec_is_laid_over_the_preset_and_the_sweep_over_the_spec():
    spec = Spec.parse(
        "preset = 'paper'\nlearner.discount = 0.5\nlearner.step_size = 0.1\n"
        "sweep.learner.step_size = [0.2, 0.3]"
    )
    learners = [c.settings.learner for c in spec.conditions()]
    assert [(x.discount, x.step_size, x.trace_decay) for x in learners] == [
        (0.5, 0.2, 0.4), (0.5, 0.3, 0.4),
    ]  # fmt: skip


def test_another_kind_replaces_the_table_of_the_preset():
    (condition,) = Spec.parse("preset = 'paper'\nlearner.kind = 'frozen'").conditions()
    assert condition.settings.learner == FrozenSettings()


def test_the_grid_varies_the_last_key_fastest_and_labels_are_short():
    spec = Spec.parse(
        "sweep.preset = ['default', 'frozen']\nsweep.topology = ['chain', 'chain:reversed']\n"
        "sweep.learner.rule_base.order = [1, 2]"
    )
    labels = [c.label for c in spec.conditions()]
    assert labels[:3] == [
        "default, topology=chain, order=1",
        "default, topology=chain, order=2",
        "default, topology=chain:reversed, order=1",
    ]
    assert len(labels) == 8
    assert spec.conditions()[1].columns == {
        "preset": "default", "topology": "chain", "learner.rule_base.order": 2,
    }  # fmt: skip


def test_a_topology_may_be_a_string_and_changed_by_key():
    spec = Spec.parse("topology = 'chain'", ["topology.order = reversed"])
    assert spec.conditions()[0].settings.topology.order == "reversed"


def test_changes_are_laid_over_the_file_in_order(tmp_path):
    path = tmp_path / "spec.toml"
    path.write_text("episodes = 3\nlearner.ridge = 2")
    spec = Spec.load(path, ["episodes=4", "learner.regression_iterations=5", "episodes=6"])
    assert (spec.episodes, dict(spec.learner)) == (6, {"ridge": 2, "regression_iterations": 5})


def test_a_change_that_is_none_is_named():
    with pytest.raises(SpecError, match="--set episodes: expected key=value"):
        Spec.parse("", ["episodes"])


def test_a_missing_a_binary_and_a_directory_for_a_file(tmp_path):
    (tmp_path / "binary").write_bytes(b"\xff\xfe")
    for name, reason in [("missing", "No such file"), ("binary", "UTF-8"), (".", "directory")]:
        with pytest.raises(SpecError, match=reason):
            Spec.load(tmp_path / name)


def test_equal_content_is_an_equal_spec_however_it_is_written():
    one = Spec.parse("seeds = 2\ntopology = 'chain:reversed'\nlearner.ridge = 1")
    two = Spec.parse("seeds = [0, 1]\n[topology]\nkind = 'chain'\norder = 'reversed'")
    two = two.model_copy(update={"learner": {"ridge": 1.0}})
    assert [c.settings for c in one.conditions()] == [c.settings for c in two.conditions()]
    assert one.conditions()[0].settings.canonical() == two.conditions()[0].settings.canonical()


OVERRIDES = """
learner.discount = 0.9
[[overrides]]
name = "default"
[[overrides]]
name = "no replay"
learner = {kind = "td-lambda", step_size = 0.1}
topology = "chain:reversed"
[overrides.sweep]
"learner.trace_decay" = [0.0, 0.9]
[[overrides]]
name = "paper"
preset = "paper"
learner.ridge = 1.0
[sweep]
"scenario.robots" = [1, 2]
"""


def test_overrides_are_laid_over_the_spec_and_crossed_with_both_sweeps():
    text = OVERRIDES.replace("learner.ridge = 1.0", "")
    found = {c.label: c for c in Spec.parse(text).conditions()}
    assert list(found) == [
        "default, robots=1",
        "default, robots=2",
        "no replay, trace_decay=0.0, robots=1",
        "no replay, trace_decay=0.0, robots=2",
        "no replay, trace_decay=0.9, robots=1",
        "no replay, trace_decay=0.9, robots=2",
        "paper, robots=1",
        "paper, robots=2",
    ]
    online = found["no replay, trace_decay=0.9, robots=2"]
    assert online.settings.learner.trace_decay == 0.9
    assert online.settings.topology.order == "reversed"
    assert online.settings.learner.discount == 0.9
    assert found["paper, robots=1"].settings.learner.rule_base.order == 7
    assert found["paper, robots=1"].settings.learner.discount == 0.9
    assert found["default, robots=1"].columns == {
        "name": "default", "learner.trace_decay": "", "scenario.robots": 1,
    }  # fmt: skip


def test_an_override_of_another_kind_may_not_bring_the_keys_of_the_old_one():
    with pytest.raises(SpecError, match=r"learner.ridge = 1.0: unknown key for kind 'td-lambda'"):
        Spec.parse(OVERRIDES)


def test_the_trials_of_all_overrides_are_counted_before_they_are_made():
    overrides = [{"name": "a", "sweep": {"scenario.robots": [1, 2]}}, {"name": "b"}]
    table = {"seeds": 50_000, "overrides": overrides}
    with pytest.raises(SpecError, match="3 conditions x 50000 seeds"):
        Spec.of(table)


def test_evaluations_may_change_the_hierarchy_and_the_decision():
    spec = Spec.parse(
        """
        topology.communication = "parents"
        [evaluations]
        circle.box = "circle"
        silent = { topology.communication = "none", learner.decision.unseen = "last" }
        tree.topology = "tree:2"
        """
    )
    (condition,) = spec.conditions()
    circle, silent, tree = (settings for _, settings in condition.evaluations)
    assert circle.acts_as(condition.settings)
    assert not silent.acts_as(condition.settings)
    assert (silent.topology.kind, silent.topology.communication) == ("chain", "none")
    assert (silent.learner.decision.unseen, tree.learner.decision.unseen) == ("last", "maintain")
    assert (tree.topology.kind, tree.topology.communication) == ("tree", "ancestors")
    assert silent.scenario == condition.settings.scenario


@pytest.mark.parametrize(
    ("table", "complaint"),
    [
        ({"learner": {"kind": "frozen"}}, "learner.kind: a trained team may change its decision"),
        (
            {"topology": {"communication": "all"}},
            "topology.communication = 'all': must be 'ancestors', 'parents'",
        ),
        ({"topology": {"lookahead": 1}}, "topology.lookahead = 1: must be"),
        (
            {"topology": {"communication": "none", "failures": [{"kind": "lost", "agents": "*"}]}},
            "communication = 'none': there are no messages to fail",
        ),
        (
            {"topology": {"communication": ["own"]}},
            "must be a list of one or two of body, next, farther",
        ),
        ({"topology": {"failures": [{"kind": "lots"}]}}, "topology.failures"),
        (
            {"topology": {"failures": [{"kind": "lost", "agents": "*", "probability": 2}]}},
            "probability = 2: must be",
        ),
    ],
)
def test_what_an_evaluation_cannot_change_is_told(table, complaint):
    with pytest.raises(SpecError, match=complaint) as error:
        Spec.of({"evaluations": {"other": table}})
    assert "\n" not in str(error.value)


def test_evaluations_are_laid_over_the_scenario_of_every_condition():
    spec = Spec.parse(
        "evaluations.circle.box = 'circle'\nevaluations.hard.start = 'hard'\n"
        "sweep.scenario.action_repeat = [8, 4]"
    )
    found = [
        (name, settings.scenario.box, settings.scenario.start, settings.scenario.action_repeat)
        for condition in spec.conditions()
        for name, settings in condition.evaluations
    ]
    assert found == [
        ("circle", "circle", "medium", 8), ("hard", "square", "hard", 8),
        ("circle", "circle", "medium", 4), ("hard", "square", "hard", 4),
    ]  # fmt: skip


def test_a_section_may_be_a_settings_model():
    from nested_agents.core.learners.td import TDLambdaSettings

    named = {"name": "online", "learner": TDLambdaSettings(step_size=0.1)}
    spec = Spec.of({"preset": "own-value", "overrides": [named]})
    assert spec.conditions()[0].settings.learner == TDLambdaSettings(step_size=0.1)
    assert Spec.parse(dumps(spec.table())) == spec


SPECS = [
    "",
    OVERRIDES.replace("learner.ridge = 1.0", ""),
    "overrides = [{name = 'ä \"b\"', scenario = {failures = [{kind = 'seized', wheels = '*'}]}}]",
    "evaluations.a = {}\nevaluations.'b c' = {box = 'circle', reward = {c1 = 1.0}}",
    "seeds = [3, 5]\ntopology = 'chain:reversed'\nlearner.ridge = 1",
    "sweep.preset = ['default', 'frozen']\nsweep.scenario.box = ['square', 'circle']",
    "sweep.topology = ['chain', {kind = 'chain', order = ['a \\\\ \"b', 'c']}]",
    "topology.order = ['ä\\u007f', 'b']",
]


@pytest.mark.parametrize("text", SPECS)
def test_a_spec_survives_being_written_and_read(text):
    spec = Spec.parse(text)
    again = Spec.parse(dumps(spec.table()))
    assert again == spec
    assert again.conditions() == spec.conditions()


KEYS = st.sampled_from(
    ["study", "preset", "seeds", "episodes", "steps", "evaluation", "scenario", "topology",
     "learner", "sweep", "kind", "robots", "box", "reward", "c1", "rule_base", "order", "ridge",
     "exploration", "decision", "rule", "centers", "members", "edges", "a", "", "x.y", "'\n",
     "learner.kind", "scenario.robots", "topology.order", "overrides", "evaluations", "name",
     "curriculum"]
)  # fmt: skip
WORDS = st.sampled_from(
    ["default", "paper", "frozen", "chain", "chain:reversed", "teams", "edges", "random", "file",
     "td-lambda", "batch-td", "burst", "square", "learning-curve", "x\ny", ""]
)  # fmt: skip
LEAVES = st.one_of(
    st.booleans(), st.integers(-3, 9), st.integers(), st.floats(), st.text(max_size=5), WORDS
)
VALUES = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=4),
    max_leaves=12,
)


def is_spec_or_one_line(make):
    try:
        return len(make().conditions()) > 0
    except SpecError as error:
        message = str(error)
    return message and "\n" not in message


@settings(max_examples=400)
@given(st.dictionaries(KEYS, VALUES, max_size=5))
def test_any_table_is_a_spec_or_one_line(table):
    assert is_spec_or_one_line(lambda: Spec.of(table))


@settings(max_examples=100)
@given(st.text(max_size=60), st.lists(st.text(max_size=20), max_size=2))
def test_any_text_is_a_spec_or_one_line(text, changes):
    assert is_spec_or_one_line(lambda: Spec.parse(text, changes))


@settings(max_examples=200)
@given(st.dictionaries(st.text(max_size=4), VALUES, max_size=4))
def test_written_tables_are_read_back(table):
    def same(a, b):
        if isinstance(a, dict):
            return a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
        if isinstance(a, list):
            return len(a) == len(b) and all(map(same, a, b))
        return type(a) is type(b) and repr(a) == repr(b)

    assert same(tomllib.loads(dumps(table)), table)


def test_long_values_that_begin_alike_are_told_apart():
    members = [["robot1.left", "robot1.right"], ["robot2.left", "robot2.right"]]
    alike = [{"kind": "teams", "members": m} for m in (members, [members[0], members[1][::-1]])]
    first, second = Spec.of({"sweep": {"topology": alike}}).conditions()
    assert first.label != second.label
    assert [c.label[:6] for c in (first, second)] == ["teams "] * 2
    assert max(len(first.label), len(second.label)) <= 60
    assert "robot2.left" in str(first.columns["topology"])
    assert first.columns != second.columns


def test_described_boxes_are_called_by_their_names():
    kite = {"name": "kite", "vertices": [[0, 0], [0.3, 0], [0.3, 0.2], [0.1, 0.3]]}
    nameless = {"vertices": [[0, 0], [0.3, 0], [0.3, 0.2], [0.1, 0.4]]}
    spec = Spec(sweep={"scenario.box": ["square", kite, nameless]})
    labels = [condition.label for condition in spec.conditions()]
    assert labels[:2] == ["square", "kite"]
    assert labels[2].startswith("described ")
    assert spec.conditions()[1].settings.scenario.box.name == "kite"


def test_keywords_make_a_whole_spec_and_objects_stand_for_names():
    from nested_agents.scenarios.box_pushing.config import BoxPushingSettings

    pair = Hierarchy(["robot1.left", "robot1.right"], [("robot1.left", "robot1.right")])
    world = BoxPushingSettings(robots=1).build()
    spec = Spec(seeds=2, scenario=world, topology=pair)
    (condition,) = spec.conditions()
    assert condition.settings.scenario.robots == 1
    assert condition.settings.topology.kind == "edges"
    assert Spec.of(spec.table()) == spec
    with pytest.raises(SpecError, match="seed = 3: unknown key; did you mean 'seeds'"):
        Spec(seed=3)


@pytest.mark.parametrize(
    "topology",
    [
        Hierarchy("abc", [("a", "b")], communication="none", lookahead="children"),
        Hierarchy("abc", [], neighbors=[("a", "b")]),
        nx.path_graph(["a", "b", "c"]),
        nx.DiGraph([("a", "b"), ("b", "c")]),
    ],
)
def test_a_topology_given_as_an_object_keeps_its_relations(topology):
    built = build(plain(topology, "topology"), list("abc"))
    if isinstance(topology, Hierarchy):
        assert (built.edges, built.neighbors) == (topology.edges, topology.neighbors)
        assert built.communication == topology.communication
        assert built.lookahead == topology.lookahead
    else:
        pairs = built.edges if topology.is_directed() else built.neighbors
        assert pairs == ((0, 1), (1, 2))


def test_a_class_stands_for_its_name_as_kind_of_a_table_too() -> None:
    table = plain({"scenario": {"kind": LineUp, "carts": 2}})["scenario"]
    assert table == plain({"scenario": LineUp})["scenario"] | {"carts": 2}


def test_edges_beside_neighbors_have_no_table():
    with pytest.raises(SpecError, match="both edges and neighbors cannot be written in a spec"):
        plain(Hierarchy("abc", [("a", "b")], neighbors=[("a", "c")]), "topology")


@pytest.mark.parametrize(
    "wrong",
    [
        {"scenario": {"robots": [2, 4]}},
        {"learner": {"kind": ["batch-td", "fitted-q"]}},
        {"learner": {"decision": {"value_of": ["team", "own"]}}},
        {"topology": ["chain", "star"]},
        {"topology": {"kind": ["chain", "star"]}},
    ],
)
def test_a_list_where_one_value_stands_is_pointed_to_the_sweep(wrong):
    with pytest.raises(SpecError, match=r"put values to compare in sweep$"):
        Spec.read({"study": "scaling", "seeds": 2, **wrong})


@pytest.mark.parametrize("wrong", [{"episodes": [3, 4]}, {"learner": ["td"]}])
def test_a_list_that_cannot_be_swept_is_not(wrong):
    with pytest.raises(SpecError, match=r"must be a (whole number|table)$"):
        Spec.read({"study": "scaling", "seeds": 2, **wrong})


def test_a_key_that_is_nearly_another_one_is_suggested():
    with pytest.raises(SpecError, match=r"scenario\.robot = 4: .*; did you mean 'robots'\?"):
        Spec.of({"scenario": {"robot": 4}})
    with pytest.raises(SpecError, match=r"scenario\.robots = 0: must be at least 1$"):
        Spec.of({"scenario": {"robots": 0}})
    with pytest.raises(SpecError, match=r"must be a whole number; did you mean 'robot'\?$"):
        Spec.of({"scenario": {"robots": "e-puck"}})


def test_agents_are_laid_over_and_swept_as_topologies_are() -> None:
    spec = Spec.of(
        {
            "agents": "body",
            "topology": "tree:2",
            "overrides": [{"name": "robots"}, {"name": "wheels", "agents": "actuator"}],
        }
    )
    assert [c.settings.agents for c in spec.conditions()] == ["body", "actuator"]
    assert Spec.of(spec.table()) == spec
    swept = Spec.of({"sweep": {"agents": ["actuator", "body", "team"]}}).conditions()
    assert [(c.label, c.columns) for c in swept] == [
        (agents, {"agents": agents}) for agents in ("actuator", "body", "team")
    ]


def test_an_agent_for_every_actuator_is_the_default() -> None:
    plain, robots = Spec.of({"sweep": {"agents": ["actuator", "body"]}}).conditions()
    assert plain.settings.canonical() == Spec().conditions()[0].settings.canonical()
    assert robots.settings.model_dump()["agents"] == "body"


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"agents": "wheel"}, "agents = 'wheel': must be 'actuator', 'body' or 'team'"),
        ({"overrides": [{"name": "a", "agents": 3}]}, "overrides[0].agents = 3: must be"),
        ({"sweep": {"agents": ["bodies"]}}, "agents = 'bodies': must be"),
        ({"topology": "per-robot"}, "a key of its own: agents = 'body', topology = 'chain'"),
        ({"topology": {"kind": "single-agent"}}, "a key of its own: agents = 'team'"),
        ({"sweep": {"topology": ["chain", "per-robot"]}}, "a key of its own: agents = 'body'"),
    ],
)
def test_who_the_agents_are_is_refused_in_one_line(table, message: str) -> None:
    with pytest.raises(SpecError, match=re.escape(message)) as refusal:
        Spec.of(table)
    assert "\n" not in str(refusal.value)


TUNED = {"seeds": 2, "learner": {"ridge": 3.0, "discount": 0.9}}


@pytest.mark.parametrize(
    "how",
    [
        {"sweep": {"preset": ["default", "frozen", "random"]}},
        {"overrides": [{"name": n, "preset": n} for n in ("default", "frozen", "random")]},
    ],
)
def test_what_tunes_learning_is_left_out_for_controls_with_one_remark(how) -> None:
    spec = Spec.of({**TUNED, **how})
    learned, *controls = (condition.settings.learner for condition in spec.conditions())
    assert (learned.ridge, learned.discount) == (3.0, 0.9)
    assert [(c.kind, c.discount) for c in controls] == [("frozen", 0.9)] * 2
    assert spec.warnings() == ("learner.ridge: left out for frozen, random, which learn nothing",)
    assert Spec.of(spec.table()) == spec


@pytest.mark.parametrize(
    "table",
    [
        {**TUNED, "preset": "frozen"},
        {"learner": {"rigde": 3.0}, "sweep": {"preset": ["default", "frozen"]}},
        {"learner": {"step_size": 3.0}, "sweep": {"preset": ["default", "frozen"]}},
    ],
)
def test_keys_that_no_learner_of_the_spec_has_are_refused(table) -> None:
    with pytest.raises(SpecError, match="unknown key"):
        Spec.of(table)


@pytest.mark.parametrize(
    ("table", "hint"),
    [
        ({"robots": 3}, "did you mean 'scenario.robots'?"),
        ({"joints": 3, "scenario": {"kind": "kinematic-chain"}}, "mean 'scenario.joints'?"),
        ({"sweep": {"robots": [2, 3]}}, "did you mean 'scenario.robots'?"),
        ({"scenario": {"ridge": 3.0}}, "did you mean 'learner.ridge'?"),
        ({"preset": "paper", "trace_decay": 0.3}, "did you mean 'learner.trace_decay'?"),
    ],
)
def test_a_misplaced_key_is_told_its_place(table, hint: str) -> None:
    with pytest.raises(SpecError, match=re.escape(hint)):
        Spec.of(table)


@pytest.mark.parametrize(
    "table",
    [
        {"joints": 3},
        {"robots": 3, "scenario": {"kind": "kinematic-chain"}},
        {"step_size": 0.3},
        {"sweep": {"joints": [2, 3]}},
        {"scenario": {"joints": 3}},
    ],
)
def test_no_key_is_proposed_that_the_kinds_of_the_spec_have_not(table) -> None:
    with pytest.raises(SpecError, match="unknown key") as refusal:
        Spec.of(table)
    assert "did you mean 'scenario." not in str(refusal.value)
    assert "did you mean 'learner." not in str(refusal.value)


HUGE = f"0x{'f' * 5000}"


@pytest.mark.parametrize(
    "text",
    [
        f"seeds = {'1' * 5000}",
        f"seeds = {HUGE}",
        f"seeds = [{HUGE}]",
        f"episodes = {HUGE}",
        f'sweep."scenario.robots" = [{HUGE}]',
    ],
)
def test_numbers_of_thousands_of_digits_are_refused_in_one_line(text: str) -> None:
    with pytest.raises(SpecError, match=r"digits|must be|e\+6020") as refusal:
        Spec.parse(text)
    assert len(str(refusal.value)) < 300


def test_seeds_may_be_a_range() -> None:
    assert Spec.of({"seeds": range(10, 13)}).seeds == (10, 11, 12)


def test_a_value_out_of_range_is_not_taken_for_that_of_another_key() -> None:
    with pytest.raises(SpecError, match=r"robots = 0: must be at least 1$"):
        Spec.of({"scenario": {"robots": 0}})


@pytest.mark.parametrize(
    ("scenario", "estimate"),
    [
        (
            {"robots": 3000},
            "robots = 3000: needs an estimated 1.2 GB per worker and 27 s per decision",
        ),
        ({"robots": 10**999}, r": needs an estimated 1.1e\+1991 GB per worker and 3.0e"),
        (
            {"kind": "kinematic-chain", "joints": 6000},
            "joints = 6000: needs an estimated 1.2 GB per worker and 0.36 s per decision",
        ),
    ],
)
def test_a_team_too_large_for_a_worker_is_refused_by_an_estimate(scenario, estimate) -> None:
    allowed = ", allowed: up to 1 GB and 5 s$"
    with pytest.raises(SpecError, match=estimate + ".*" + allowed):
        Spec.of({"scenario": scenario})
    assert Spec.of({"scenario": {"robots": 512}})


@pytest.mark.parametrize("key", ["scenario.robots", '"scenario.robots"', 'scenario."robots"'])
@pytest.mark.parametrize("changed", ["scenario.robots", '"scenario.robots"'])
def test_set_replaces_a_swept_key_however_it_is_quoted(key: str, changed: str) -> None:
    text = f"sweep.{key} = [2, 4]\nsweep.topology.kind = ['chain', 'star']"
    spec = Spec.parse(text, [f"sweep.{changed}=[8, 16]"])
    assert list(spec.sweep["scenario.robots"]) == [8, 16]
    assert len(spec.conditions()) == 4


def test_a_change_of_a_sweep_hides_no_key_that_stands_twice() -> None:
    text = '[sweep]\n"learner.ridge" = [1.0, 2.0]\nlearner.ridge = [3.0, 4.0]\n'
    with pytest.raises(SpecError, match=r"sweep\.learner\.ridge .* stands twice"):
        Spec.parse(text, ["sweep.scenario.robots=[2, 4]"])
