"""A trained team explained: its rules taken apart, in words and figures."""

import sqlite3
from itertools import combinations, product

import made_up
import numpy as np
import pytest

import nested_agents as na
from nested_agents.core.interface.spaces import Variable
from nested_agents.core.values.partitions import Partition
from nested_agents.core.values.rule_base import RuleBase
from nested_agents.scenarios.box_pushing.scenario import MEASURES
from nested_agents.studies.cli.main import main
from nested_agents.studies.explain import team as explain
from nested_agents.studies.explain.functions import decompose, labels
from nested_agents.studies.explain.text import _table
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.store.database import DATABASE, RESULTS_VERSION
from nested_agents.studies.store.store import Store
from nested_agents.studies.trials.keeping import finished_trial
from nested_agents.studies.trials.session import run_trial
from nested_agents.studies.trials.trial import trials_of
from nested_agents.studies.workers.runner import save

SPEC = Spec.of(
    {
        "seeds": [3],
        "episodes": 3,
        "steps": 15,
        "evaluation": 1,
        "scenario": {
            "start": "easy",
            "failures": [{"kind": "seized", "wheels": "robot1.left", "episode": 1}],
        },
        "learner": {"self_model": {"enabled": True}},
        "overrides": [
            {"name": "order 1"},
            {"name": "a pair", "learner": {"rule_base": {"order": 2}}},
            {"name": "random", "learner": {"kind": "frozen", "decision": {"rule": "random"}}},
            {
                "name": "learned",
                "learner": {"self_model": {"enabled": False}, "predictor": {"kind": "learned"}},
            },
            {"name": "unfinished", "learner": {"kind": "frozen"}},
        ],
    }
)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Finished are all conditions but the last."""
    directory = tmp_path_factory.mktemp("study") / "out"
    with made_up.opened(directory, SPEC, MEASURES) as store:
        for trial in trials_of(SPEC)[:4]:
            save(store, trial, run_trial(trial), 1.0)
    return directory


def run(capsys, *arguments):
    status = main(["explain", *map(str, arguments), "--full"])
    return status, capsys.readouterr()


@pytest.mark.slow
def test_the_first_trial_in_words_and_figures(study, capsys):
    status, said = run(capsys, study)
    assert status == 0
    out = said.out
    assert out.startswith("order 1, seed 3: the team after 3 episodes\n")
    assert "Interactions of variables" not in out
    assert "IF gap is touching (0 m):" in out
    assert "SELF-MODEL" in out
    folder = study / "explain" / "order-1-seed3"
    assert {path.name for path in folder.iterdir()} == {
        "explanation.txt",
        "functions.png",
        "functions.svg",
    }
    lines = [line for line in out.splitlines() if str(study) not in line]
    assert [line for line in lines if len(line) > 80] == []
    assert not [line for line in lines if line != line.rstrip()]


@pytest.mark.slow
def test_the_summary_fits_a_screen(study, capsys):
    assert main(["explain", str(study)]) == 0
    lines = capsys.readouterr().out.splitlines()
    text = [line for line in lines if str(study) not in line]
    assert text[0].startswith("order 1, seed 3: 4 agents with 47 rules each.")
    assert len(text) <= 12
    assert max(map(len, text)) <= 80
    assert main(["explain", str(study), "--condition", "random"]) == 0
    assert "the team has learned nothing" in capsys.readouterr().out


@pytest.mark.slow
def test_several_variables_together_and_nothing_learned(study, capsys):
    status, said = run(capsys, study, "--condition", "a pair", "--seed", 3)
    assert status == 0
    assert "Interactions of variables have a share of " in " ".join(said.out.split())
    status, said = run(capsys, study, "--condition", "random")
    assert status == 0
    assert "the agents have learned nothing" in said.out


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--condition", "oder 1"], "did you mean 'order 1'"),
        (["--seed", "4"], "seed = 4: known: 3"),
        (["--condition", "unfinished"], "unfinished, seed 3: has not finished"),
    ],
)
def test_what_the_user_can_mend(arguments, complaint, study, capsys):
    status, said = run(capsys, study, *arguments)
    assert (status, said.out) == (2, "")
    assert complaint in said.err.splitlines()[-1]


def test_no_study(tmp_path, capsys):
    status, said = run(capsys, tmp_path)
    assert status == 2
    assert said.err.count("\n") == 1


def changed(study, tmp_path, statement):
    """Return a copy of the study in which a statement has changed the database."""
    import shutil

    copy = shutil.copytree(study, tmp_path / "copy")
    connection = sqlite3.connect(copy / DATABASE)
    connection.execute(statement)
    connection.commit()
    connection.close()
    return copy


def test_results_of_an_older_version_are_refused(study, tmp_path, capsys):
    statement = "UPDATE meta SET value = '1' WHERE key = 'results_version'"
    status, said = run(capsys, changed(study, tmp_path, statement))
    assert status == 2
    assert f"holds results of version 1, this is version {RESULTS_VERSION}" in said.err


def test_another_team_than_the_one_that_was_measured_is_not_explained(study, monkeypatch):
    with Store.open(study) as store:
        trial = finished_trial(store, None, None)
        kept = explain._kept_rows(store, trial)
        monkeypatch.setattr(explain, "_kept_rows", lambda *_: [*kept[:2], (*kept[2][:-1], 0.0)])
        with pytest.raises(ValueError, match="again gives other episodes"):
            explain.explain(store, trial)


def test_a_topology_file_that_has_changed_since(tmp_path, capsys):
    file = tmp_path / "mine.py"
    file.write_text("def mine(agents, groups): return list(zip(agents, agents[1:]))")
    spec = Spec.of({"seeds": [3], "episodes": 1, "steps": 1, "topology": f"{file}:mine"})
    (trial,) = trials_of(spec)
    with made_up.opened(tmp_path / "out", spec, MEASURES) as store:
        save(store, trial, run_trial(trial), 1.0)
    file.write_text("def mine(agents, groups): return []")
    status, _ = run(capsys, tmp_path / "out")
    assert status == 0  # by the study's own copy


@pytest.mark.slow
def test_an_agent_for_each_robot(tmp_path, capsys):
    one = {"overrides": (), "agents": "body", "evaluation": 0, "episodes": 2}
    spec = Spec.of({**SPEC.table(), **one})
    (trial,) = trials_of(spec)
    with made_up.opened(tmp_path, spec, MEASURES) as store:
        save(store, trial, run_trial(trial), 1.0)
    status, said = run(capsys, tmp_path)
    assert status == 0
    assert "SELF-MODEL" in said.out


def test_folders_of_conditions_differ(tmp_path):
    from types import SimpleNamespace

    names = ["a/b", "a b", "x", "§"]
    folders = [
        explain.folder_of(tmp_path, SimpleNamespace(condition=name, seed=0), names).name
        for name in names
    ]
    assert folders == ["a-b-seed0", "a-b-2-seed0", "x-seed0", "figure-seed0"]


PARTITIONS = [
    Partition((0.0, 1.0), "triangular"),
    Partition((0.0, 0.3, 1.0), "triangular"),
    Partition((-2.0, 0.0, 2.0), "triangular", period=2 * np.pi),
    Partition((0.0, 0.5, 0.7, 1.0), "triangular"),
]
VARIABLES = [
    Variable("lamp", "1", 0.0, 1.0),
    Variable("gap", "m", 0.0, 1.0, centers=(0.0, 0.3, 1.0), labels=("touching", "near", "far")),
    Variable("turn", "rad", -np.pi, np.pi, periodic=True),
    Variable("speed", "m/s", 0.0, 1.0),
]


def base(*orders):
    return RuleBase(PARTITIONS, [t for order in orders for t in combinations(range(4), order)])


def theta_for(rules):
    return np.random.default_rng(0).normal(size=rules.n_rules)


def corners():
    return np.array(list(product(*(p.centers for p in PARTITIONS))))


def test_the_parts_add_up_to_f():
    rules = base(1)
    theta = theta_for(rules)
    parts = decompose(rules, theta)
    states = np.random.default_rng(1).uniform(-1, 2, size=(50, 4))
    strengths = [p.strengths(states[:, j]) for j, p in enumerate(PARTITIONS)]
    f = parts.constant + sum(s @ g for s, g in zip(strengths, parts.singles, strict=True))
    assert np.allclose(f, rules.values(theta, states), atol=1e-12)
    assert parts.rest == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("orders", [(1,), (2,), (3,), (4,), (1, 3), (2, 3)])
def test_variance_and_functions_of_one_variable_are_those_of_all_rules(orders):
    rules = base(*orders)
    theta = theta_for(rules)
    parts = decompose(rules, theta)
    f = rules.values(theta, corners()).reshape([p.size for p in PARTITIONS])
    assert parts.variance == pytest.approx(f.var(), rel=1e-12)
    assert parts.constant == pytest.approx(f.mean(), rel=1e-9)
    for j, single in enumerate(parts.singles):
        others = tuple(i for i in range(4) if i != j)
        assert np.allclose(single, f.mean(axis=others) - f.mean(), atol=1e-12)
    assert (parts.rest > 0.05) == (max(orders) > 1)


def test_words_for_membership_functions():
    words = [labels(v, p) for v, p in zip(VARIABLES, PARTITIONS, strict=True)]
    assert words == [
        ("low", "high"),
        ("touching", "near", "far"),
        ("about -115°", "about 0°", "about 115°"),
        ("about 0 m/s", "about 0.5 m/s", "about 0.7 m/s", "about 1 m/s"),
    ]
    even = Partition.of(VARIABLES[1], count=3)
    assert labels(VARIABLES[1], even) == ("low", "medium", "high")


def test_columns_that_do_not_fit_follow_below():
    names = [f"robot{i}.middle-right" for i in range(12)]
    table = _table([["+1.25"] * 12] * 2, ["IF gap is near:", "IF gap is far:"], names)
    assert max(len(line.rstrip()) for line in table.splitlines()) <= 80
    assert table.count("robot") == 12
    assert table.count("IF gap is near:") > 1


def test_agents_of_the_same_rules_have_one_column(tmp_path) -> None:
    table = {"seeds": 1, "episodes": 3, "steps": 10, "scenario": {"kind": "spread"}}
    texts = []
    for weights in ("role", "own"):
        learner = {"kind": "fitted-q", "weights": weights}
        kept = na.run(table | {"learner": learner}, tmp_path / weights, jobs=1)
        texts.append(" ".join(kept.explain().text.split()))
    assert "have one column: agent1 = agent2 = agent3." in texts[0]
    assert "one column" not in texts[1]


@pytest.mark.parametrize("condition", ["fitted-q", "random"])
def test_a_team_of_a_budget_of_decisions_is_trained_again(condition, tmp_path, capsys) -> None:
    table = {"study": "experience", "seeds": 1, "decisions": 40, "steps": 5, "evaluation": 1}
    table |= {"scenario": {"kind": "spread"}}
    own = {"learner": {"kind": "fitted-q"}} if condition == "fitted-q" else {"preset": "random"}
    kept = na.run(table | {"overrides": [{"name": condition, **own}]}, tmp_path, jobs=1)
    assert f"{condition}, seed 0: the team after 40 decisions" in kept.explain().text


def test_networks_are_not_explained(tmp_path, capsys) -> None:
    table = {"study": "experience", "seeds": 1, "decisions": 40, "steps": 5, "evaluation": 1}
    learner = {"kind": "ippo", "environments": 2, "rollout": 10, "batch_size": 20}
    na.run(table | {"scenario": {"kind": "spread"}, "learner": learner}, tmp_path, jobs=1)
    assert main(["explain", str(tmp_path)]) == 2
    needed = "learner.kind = 'ippo': explain needs agents with rule bases"
    assert needed in capsys.readouterr().err
