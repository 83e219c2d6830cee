"""The JSON of marl-eval: written, read back, and read as BenchMARL writes it."""

import json

import numpy as np
import pytest

import nested_agents as na
from nested_agents.studies.cli.main import main

BENCHMARL = {
    "vmas": {
        "balance": {
            algorithm: {
                f"seed_{seed}": {
                    "step_0": {"step_count": 60, "elapsed_time": 2, "return": [0.0, shift]},
                    "step_1": {"step_count": 120, "elapsed_time": 4, "return": [2.0, 4.0]},
                    "absolute_metrics": {"return": [3.0 + shift]},
                }
                for seed in range(3)
            }
            for algorithm, shift in (("ippo", 0.0), ("mappo", 1.0))
        }
    }
}


def test_results_of_benchmarl_stand_beside_ours(tmp_path, capsys) -> None:
    path = tmp_path / "benchmarl.json"
    path.write_text(json.dumps(BENCHMARL))
    study = na.load(path)
    assert study.conditions == ("ippo", "mappo")
    assert study.results.values("mappo", "return").tolist() == [[0.5, 3.0]] * 3
    assert study.results.values("mappo", "steps").tolist() == [[60.0, 60.0]] * 3
    assert study.results.values("mappo", "return", "evaluation").tolist() == [[4.0]] * 3
    assert "evaluation steps" not in study.table().titles
    compare = ["compare", str(path), "--measure", "return", "--statistics"]
    plot = tmp_path / "profiles.png"
    assert main([*compare, "--plot", str(plot)]) == 0
    out = capsys.readouterr().out
    assert "P(improvement)" in out
    assert plot.stat().st_size > 10_000
    assert main([*compare, "--plot", str(tmp_path / "profiles.doc")]) == 2
    assert "suffix must be" in capsys.readouterr().err


def test_several_tasks_are_told_apart(tmp_path) -> None:
    runs = BENCHMARL["vmas"]["balance"]
    path = tmp_path / "two.json"
    path.write_text(json.dumps({"vmas": {"balance": runs, "wheel": runs}}))
    study = na.load(path)
    assert study.conditions[0] == "ippo, vmas/balance"
    (_, line) = study.compare("algorithm", "return").statistics.table
    assert (line.condition, line.seeds) == ("mappo", 6)


def test_what_is_exported_is_read_back(tmp_path, capsys) -> None:
    spec = {
        "seeds": 2, "episodes": 3, "steps": 4, "evaluation": 2, "scenario": {"kind": "line-up"},
        "sweep": {"preset": ["default", "frozen"], "scenario.carts": [2]},
    }  # fmt: skip
    study = na.run(spec, tmp_path, jobs=1, progress=False)
    assert main(["export", str(tmp_path), "--format", "marl-eval"]) == 0
    path = tmp_path / "export" / "marl-eval.json"
    assert capsys.readouterr().out.strip() == str(path)
    table = json.loads(path.read_text())
    # Names as marl-eval 0.0.4 accepts them: it refuses commas.
    (run, _) = table["line-up"]["learning-curve"]["frozen; carts=2"].values()
    assert list(run) == ["step_0", "step_1", "step_2", "absolute_metrics"]
    back = na.load(path)
    for phase in ("training", "evaluation"):
        for name in ("success", "return", "steps"):
            own = study.results.values("frozen, carts=2", name, phase)
            read = back.results.values("frozen; carts=2", name, phase)
            np.testing.assert_array_equal(own, read)
    own, read = (s.table(["evaluation success"]).markdown for s in (study, back))
    assert read.replace(";", ",") == own


def change(table, path, value):
    """Return a copy of a table in which the value at a path is another one."""
    copy = json.loads(json.dumps(table))
    *way, last = path
    place = copy
    for key in way:
        place = place[key]
    place[last] = value
    return copy


RUN = ("vmas", "balance", "ippo", "seed_1")


@pytest.mark.parametrize(
    ("path", "value", "key"),
    [
        ((*RUN, "step_0", "return"), ["1.0"], "seed_1.step_0.return[0] = '1.0'"),
        ((*RUN, "step_0", "return"), "1.0", "seed_1.step_0.return = '1.0'"),
        ((*RUN, "step_1", "return"), [float("nan")], "seed_1.step_1.return[0] = nan"),
        ((*RUN, "step_1", "return"), [1.0, float("inf")], "seed_1.step_1.return[1] = inf"),
        ((*RUN, "step_1", "step_count"), 10**400, "seed_1.step_1.step_count = 1.000e+400"),
        ((*RUN, "step_1", "step_count"), -1, "seed_1.step_1.step_count = -1"),
        ((*RUN, "step_1", "step_count"), "60", "seed_1.step_1.step_count = '60'"),
        ((*RUN, "step_1", "step_count"), True, "seed_1.step_1.step_count = true"),
        ((*RUN, "step_7"), {"step_count": 1}, "seed_1.step_2: is missing"),
        ((*RUN, "absolute_metrics", "return"), [10**30], "absolute_metrics.return[0] = 1000"),
        ((*RUN, "absolute_metrics"), [1.0], "seed_1.absolute_metrics = [1.0]"),
        (RUN, 3, "ippo.seed_1 = 3: must be a table"),
        (RUN[:3], {}, "vmas.balance.ippo = {}"),
        (RUN[:2], ["ippo"], "vmas.balance = ['ippo']"),
    ],
)
def test_what_is_none_is_refused_by_its_key(path, value, key, tmp_path, capsys) -> None:
    file = tmp_path / "other.json"
    file.write_text(json.dumps(change(BENCHMARL, path, value)))
    assert main(["table", str(file)]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert key in err
