"""The JSON of marl-eval: written, read back, and read as BenchMARL writes it."""

import json
from pathlib import Path

import numpy as np
import pytest
from made_up_results import ablation

import nested_agents as na
from nested_agents.studies.api.comparison import Comparison
from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import SpecError
from nested_agents.studies.results import marl_eval

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
    assert study.results.means("mappo", "last step", "return").tolist() == [3.0] * 3
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
    (_, line) = study.compare("algorithm", "return").aggregated[0].lines
    assert (line.condition, line.seeds) == ("mappo", 6)


def test_what_is_exported_is_read_back(tmp_path, capsys) -> None:
    spec = {
        "seeds": 2, "episodes": 3, "steps": 4, "evaluation": 2, "scenario": {"kind": "line-up"},
        "sweep": {"preset": ["default", "frozen"], "scenario.carts": [2]},
    }  # fmt: skip
    study = na.run(spec, tmp_path, jobs=1, progress=False)
    assert main(["export", str(tmp_path), "--format", "marl-eval"]) == 0
    path = tmp_path / "export" / "marl-eval.json"
    assert capsys.readouterr().out.splitlines()[0] == str(path)
    table = json.loads(path.read_text())
    # Names as marl-eval 0.0.4 accepts them: it refuses commas.
    (run, _) = table["line-up"]["learning-curve"]["frozen; carts=2"].values()
    assert list(run) == ["step_0", "step_1", "step_2", "absolute_metrics"]
    back = na.load(path)
    for phase in ("training", "evaluation"):
        for name in ("success", "return", "steps"):
            own = study.results.values("frozen, carts=2", name, phase)
            read = back.results.values("frozen, carts=2", name, phase)
            np.testing.assert_array_equal(own, read)
    own, read = (s.table(["evaluation success"]).markdown for s in (study, back))
    assert read == own


SERIES = {f"step_{k}": {"step_count": 100 * k, "return": [float(k)]} for k in range(1, 5)}


def compare(tmp_path: Path, runs: dict, **options: str) -> Comparison:
    """Return the comparison of runs by algorithm, of one task."""
    path = tmp_path / "runs.json"
    path.write_text(json.dumps({"env": {"task": runs}}))
    return na.load(path).compare(**options)


def test_runs_are_paired_by_name(tmp_path: Path) -> None:
    scores = np.random.default_rng(0).normal(size=10)
    runs = {
        name: {f"run_{k}": {"absolute_metrics": {"return": [s + shift]}} for k, s in own}
        for name, shift, own in (
            ("A", 0.0, list(enumerate(scores))),
            ("B", 0.5, list(enumerate(scores))[:0:-1]),
        )
    }
    comparison = compare(tmp_path, runs)
    (found,) = comparison.differences
    assert (found.seeds, found.sample.tolist()) == (9, pytest.approx([0.5] * 9))
    assert "1 of 19 runs of A and B" in " ".join(comparison.notes)


@pytest.mark.parametrize("name", ["condition", "phase", "seed", "episode"])
def test_metrics_may_be_named_as_columns_of_results(name: str, tmp_path: Path) -> None:
    runs = {
        algorithm: {f"seed_{k}": {"absolute_metrics": {name: [k + shift]}} for k in range(4)}
        for algorithm, shift in (("A", 0.0), ("B", 0.5))
    }
    (found,) = compare(tmp_path, runs, measure=f"{name} (own)").differences
    assert found.sample.tolist() == [0.5] * 4


def test_a_run_that_was_killed_is_left_out_and_counted(tmp_path: Path) -> None:
    short = {"step_1": SERIES["step_1"]}
    runs = {
        "A": {f"seed_{k}": SERIES for k in range(4)},
        "B": {f"seed_{k}": SERIES if k else short for k in range(4)},
    }
    comparison = compare(tmp_path, runs)
    (found,) = comparison.differences
    assert comparison.analysis.title == "last step return"
    assert (found.seeds, float(found.estimate.value)) == (3, 0.0)
    said = " ".join(comparison.notes)
    assert "step_count 400" in said
    assert "1 of 8 runs" in said
    assert "B, seed_0" in said


def test_series_are_aligned_by_step_count_whatever_their_keys(tmp_path: Path) -> None:
    other = {
        f"STEP_{k}": {"step_count": 50 * k, "return": [k / 2.0], "rare": [1.0]}
        for k in range(1, 10)
    }
    runs = {name: {str(k): own for k in range(4)} for name, own in (("A", SERIES), ("B", other))}
    for k in (2, 3):  # a metric that is measured rarely shortens no other
        runs["A"]["0"] = SERIES | {"step_1": SERIES["step_1"] | {"rare": [0.0]}}
        comparison = compare(tmp_path, runs)
        assert comparison.analysis.measure.name == "return"
        assert float(comparison.differences[0].estimate.value) == 0.0, k
        assert "step_count 400" in " ".join(comparison.notes)


def test_a_run_without_absolute_metrics_does_not_switch_what_is_compared(tmp_path: Path) -> None:
    whole = SERIES | {"absolute_metrics": {"return": [9.0]}}
    runs = {name: {f"seed_{k}": whole for k in range(4)} for name in ("A", "B")}
    runs["B"]["seed_0"] = SERIES
    comparison = compare(tmp_path, runs)
    assert comparison.analysis.title == "evaluation return"
    assert "1 of 8 runs" in " ".join(comparison.notes)
    assert compare(tmp_path, runs, phase="last step").differences[0].seeds == 4


def test_one_file_a_run_is_put_together(tmp_path: Path) -> None:
    runs = BENCHMARL["vmas"]["balance"]
    paths = []
    for algorithm, own in runs.items():
        for name, run in own.items():
            paths.append(tmp_path / f"{algorithm}_{name}.json")
            paths[-1].write_text(json.dumps({"vmas": {"balance": {algorithm: {name: run}}}}))
    study = na.load(*reversed(paths))
    assert study.conditions == ("ippo", "mappo")
    assert study.compare(measure="return").differences[0].sample.tolist() == [1.0] * 3
    again = tmp_path / "again.json"
    again.write_bytes(paths[0].read_bytes())
    assert len(na.load(paths[0], again).conditions) == 2  # equal names are told apart by file


def test_names_without_commas_that_become_equal_are_refused(tmp_path: Path) -> None:
    arrays = ablation({"a, b": 0.5, "a; b": 0.5})
    with pytest.raises(SpecError, match=r"'a, b' and 'a; b'"):
        marl_eval.dumps(arrays.frames(), dict.fromkeys(("a, b", "a; b"), "env"), "task")


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
        ((*RUN, "step_7"), {"return": [1.0]}, "seed_1.step_7.step_count: is missing"),
        ((*RUN, "STEP_01"), {"step_count": 7}, "seed_1.STEP_01: is step_1, too"),
        ((*RUN, "Absolute_Metrics"), {}, "Absolute_Metrics: is absolute_metrics, too"),
        ((*RUN, "step_1", "step_count"), 60, "seed_1.step_1.step_count = 60"),
        ((*RUN, "absolute_metrics", "return"), [10**30], "absolute_metrics.return[0] = 1000"),
        ((*RUN, "absolute_metrics"), [1.0], "seed_1.absolute_metrics = [1.0]"),
        ((*RUN, "step_1", "return"), [1e101], "seed_1.step_1.return[0] = 1e+101"),
        (RUN, 3, "ippo.seed_1 = 3: must be a table"),
        ((*RUN[:3], " "), {}, "vmas.balance.ippo. = ' '"),
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


def test_each_task_has_its_own_last_step(tmp_path: Path) -> None:
    longer = SERIES | {"step_9": {"step_count": 900, "return": [9.0]}}
    path = tmp_path / "tasks.json"
    tasks = {
        task: {name: {f"seed_{k}": own for k in range(3)} for name in ("A", "B")}
        for task, own in (("short", SERIES), ("long", longer))
    }
    path.write_text(json.dumps({"env": tasks}))
    comparison = na.load(path).compare()
    means = {
        line.condition: line.estimates["last step return"].value
        for line in comparison.analysis.table
    }
    assert {name: float(own) for name, own in means.items()} == {
        "env/short, A": 4.0, "env/short, B": 4.0, "env/long, A": 9.0, "env/long, B": 9.0,
    }  # fmt: skip


def test_algorithms_that_share_no_step_are_refused(tmp_path: Path, capsys) -> None:
    other = {"step_0": {"step_count": 50, "return": [1.0]}}
    path = tmp_path / "runs.json"
    path.write_text(json.dumps({"env": {"task": {"A": {"s": SERIES}, "B": {"s": other}}}}))
    assert main(["compare", str(path)]) == 2
    assert "return: most runs of every condition share no step_count" in capsys.readouterr().err


def test_fits_describe_what_is_compared(tmp_path: Path) -> None:
    runs = {
        str(size): {
            f"seed_{seed}": {
                f"step_{k}": {"step_count": 10 * k, "return": [size * k + seed]} for k in range(4)
            }
            for seed in range(3)
        }
        for size in (2, 4, 8, 16)
    }
    path = tmp_path / "sizes.json"
    path.write_text(json.dumps({"vmas": {"balance": runs}}))
    study = na.load(path)
    (law,) = na.scaling_law(study).analysis.laws.values()
    means = [next(iter(line.estimates.values())).value for line in study.compare().analysis.table]
    assert law.sample.means.tolist() == pytest.approx(means)


def test_runs_that_look_alike_are_told(tmp_path: Path) -> None:
    balance = BENCHMARL["vmas"]["balance"]
    zeros = {name.replace("seed_", "seed_0"): run for name, run in balance["mappo"].items()}
    path = tmp_path / "zeros.json"
    path.write_text(json.dumps({"vmas": {"balance": {**balance, "mappo": zeros}}}))
    (remark,) = [line for line in na.load(path).remarks if "look alike" in line]
    assert "'0' and '00'" in remark
