import tomllib

import pytest

import nested_agents as na
from nested_agents.studies.api import tuning
from nested_agents.studies.cli.main import main
from nested_agents.studies.store.store import Store
from nested_agents.studies.workers.runner import Observer

SPEC = {
    "seeds": 2, "episodes": 2, "steps": 4, "evaluation": 2,
    "scenario": {"kind": "line-up"}, "tune": {"learner.ridge": [0.1, 1.0, 10.0, 100.0]},
}  # fmt: skip
BUDGET = {"trials": 4, "seeds": 3, "jobs": 1, "progress": False}


@pytest.fixture(scope="module")
def tuned(tmp_path_factory):
    out = tmp_path_factory.mktemp("tuned")
    return na.tune(SPEC, out, **BUDGET), out


def test_the_better_half_goes_on_and_the_controls_are_beside_it(tuned) -> None:
    found, out = tuned
    results = na.load(out).results
    seeds = {c: sorted(results.seeds(c)) for c in results.conditions}
    both, all_ = [10_000, 10_001], [10_000, 10_001, 10_002]
    assert sorted(seeds.values()) in (
        [both, both, all_, all_, all_, all_],  # the spec's own is always compared with the best
        [both, all_, all_, all_, all_, all_],
    )
    assert seeds["given"] == seeds["frozen"] == seeds["planner"] == all_
    assert {"given", "frozen", "planner"} < set(found.study.conditions)
    ridges = found.configurations["learner.ridge"].dropna()
    assert sorted(ridges) == [0.1, 1.0, 100.0], "10 is the spec's own"


def test_the_best_is_a_spec_with_seeds_of_its_own(tuned) -> None:
    found, out = tuned
    table = tomllib.loads((out / "best.toml").read_text())
    assert "tune" not in table
    assert table["seeds"] == 2
    best = found.configurations.iloc[0]
    assert table.get("learner", {}) == {k[8:]: v for k, v in found.changes.items()}
    assert best["success"] == found.configurations.query("seeds == 3")["success"].max()
    assert na.Spec.load(out / "best.toml") == found.best
    assert f"Best of 4 configurations: {best['name']}" in str(found)


def test_what_was_interrupted_goes_on_and_runs_nothing_twice(tuned, tmp_path, monkeypatch) -> None:
    former, out = tuned
    ran = []

    class Interrupting(Observer):
        def follow(self, outcomes, total, done):
            for outcome in outcomes:
                ran.append(outcome.trial.identity)
                if len(ran) in (3, 9):  # in the first rung, and in the last
                    raise KeyboardInterrupt

    monkeypatch.setattr(tuning, "Terminal", Interrupting)
    budget = {**BUDGET, "progress": True}
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            na.tune(SPEC, tmp_path, **budget)
    assert na.tune(SPEC, tmp_path, **budget).changes == former.changes
    with Store.open(out) as store:
        assert sorted(ran) == sorted(store.states())
    for name in (tuning.BEST_FILE, tuning.TABLE_FILE):
        assert (tmp_path / name).read_bytes() == (out / name).read_bytes()
    na.tune(SPEC, tmp_path, **budget)
    assert len(ran) == len(set(ran))


def test_the_same_draw_gives_the_same_configurations() -> None:
    spec = na.Spec.of({key: value for key, value in SPEC.items() if key != "tune"})
    first, again, other = (tuning._sample(spec, 5, draw) for draw in (0, 0, 1))
    assert list(first) == ["given", "c01", "c02", "c03", "c04"]
    assert first == again != other
    keys = set(first["c01"])
    assert "learner.decision.value_of" in keys
    assert "scenario.prediction_horizon" not in keys, "carts have none"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (["--trials", "1"], "--trials 1: allowed 2 to 10,000"),
        (["--draw", "-1"], "--draw -1: allowed 0 to"),
        (["--seeds", "1"], "--seeds 1: allowed 2 to 10,000"),
        (["--first-seed", "9999"], "--first-seed 9999: allowed 10,000 to"),
        (["--set", "evaluation=0"], "evaluation = 0: tune compares evaluation success"),
        (["--set", "seeds=[10003]"], "seeds: 10003 would be tuned on and reported"),
        (["--set", "tune.'learner.rigde'=[1]"], "learner.rigde = 1: unknown key"),
        (["--set", "tune.'rigde'=[1]"], "tune.rigde: unknown key"),
        (["--set", "tune.'learner.ridge'=[10.0]"], "tune: there is nothing to try: all are"),
        (["--set", "sweep.'learner.ridge'=[1.0, 2.0]"], "sweep, overrides: must be absent"),
        (["--address", "tcp://localhost:8786"], "address"),
    ],
)
def test_what_cannot_be_tuned_is_refused_in_a_line(changes, message, tmp_path, capsys) -> None:
    path = tmp_path / "spec.toml"
    path.write_text('scenario.kind = "line-up"\n')
    assert main(["tune", str(path), "--out", str(tmp_path / "out"), *changes]) == 2
    err = capsys.readouterr().err
    assert message in err
    assert err.count("\n") == 1
    assert not (tmp_path / "out").exists()
