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


@pytest.mark.parametrize(
    "content", ["[]", "{}", '{"a": 1}', '{"a": {"b": {"c": {"d": {}}}}}', "[" * 100_000]
)
def test_other_files_are_refused(content, tmp_path, capsys) -> None:
    path = tmp_path / "other.json"
    path.write_text(content)
    assert main(["table", str(path)]) == 2
    err = capsys.readouterr().err
    assert "other.json: holds no published results" in err
    assert err.count("\n") == 1
