"""The command and the method, on published results and on tables of scores."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import nested_agents as na
from nested_agents.core.interface.measures import SUCCESS
from nested_agents.studies.cli.main import main
from nested_agents.studies.results.comparison import compare_conditions
from nested_agents.studies.results.results import from_arrays
from nested_agents.studies.results.statistics import Estimate
from nested_agents.studies.scalability import analysis as analysis_module
from nested_agents.studies.scalability.figure import MAX_EFFICIENCY, draw
from nested_agents.studies.scalability.report import analyze

RESULTS = Path(__file__).parents[3] / "research" / "results"
SCALING = RESULTS / "scaling.json"


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """A table of scores in which the tree overtakes the chain between 4 and 8 agents."""
    rng = np.random.default_rng(0)
    means = {"chain": [0.9, 0.8, 0.5, 0.2], "tree": [0.7, 0.7, 0.7, 0.7]}
    path = tmp_path_factory.mktemp("scores") / "scores.csv"
    lines = ["hierarchy,agents,seed,score"]
    for name, own in means.items():
        for agents, mean in zip((2, 4, 8, 16), own, strict=True):
            scores = mean + rng.normal(size=12, scale=0.05)
            lines += [f"{name},{agents},{seed},{score:.4f}" for seed, score in enumerate(scores)]
    path.write_text("\n".join(lines))
    return path


def load(path):
    return na.load(path, columns=["condition=hierarchy+agents"])


def test_speed_up_and_law_of_published_results():
    analysis = na.load(SCALING).scalability()
    assert analysis.data.scaling == "weak"  # boxes grow with the number of robots
    assert analysis.data.all_sizes == (2.0, 4.0, 8.0, 16.0)
    (own,) = analysis.speedups.values()
    results = na.load(SCALING).results
    two, sixteen = (
        np.where(
            results.success(size, "evaluation"), results.values(size, "steps", "evaluation"), 450
        ).mean()
        for size in ("2", "16")
    )
    assert own[16.0]["efficiency"].value == pytest.approx(two / sixteen)
    assert set(analysis.data.costs) == {"decision_ms", "messages", "joint_actions", "compute_s"}


def test_the_performance_is_that_of_the_table():
    study = na.load(RESULTS / "arms.json")  # many seeds without a failure: Wilson's intervals
    shown = study.table().lines[0]
    line = study.scalability().summaries[0]
    own = line.estimates["evaluation success"]
    assert tuple(own) == tuple(shown.estimates["evaluation success"])
    assert own.high == 1.0
    assert own.low < 1.0


def test_costs_are_numbers_of_trials_whatever_measures_are_called():
    """A scenario may call its own measures as the toolkit calls costs."""
    sizes = (2, 4)
    measures = (SUCCESS, na.Measure("messages", "total"), na.Measure("total", "total reward"))
    training = {
        str(n): {m.name: np.full((3, 2), 100.0 * n) for m in measures[1:]}
        | {"success": np.ones((3, 2)), "steps": np.full((3, 2), 5)}
        for n in sizes
    }
    numbers = {str(n): {"messages": np.full(3, n - 1.0), "total": np.full(3, 9.0)} for n in sizes}
    columns = {str(n): {"scenario.robots": n} for n in sizes}
    seeds = dict.fromkeys(columns, range(3))
    results = from_arrays({"training": training}, seeds, numbers, {}, columns, measures)
    costs = analyze(results, {}, None, None, None, None, "").data.costs
    assert costs["messages"]["all teams", 4.0].tolist() == [3.0] * 3
    assert costs["compute_s"]["all teams", 4.0].tolist() == [9.0] * 3
    assert compare_conditions(results, "total").title == "training total reward"
    assert compare_conditions(results, "messages").title == "training total"


def test_controls_that_never_succeed_have_no_speed_up():
    analysis = na.load(RESULTS / "controls.json").scalability()
    assert not analysis.speedups  # planners never succeed with 16 robots


def test_arms_have_the_same_task_for_all_sizes():
    assert na.load(RESULTS / "arms.json").scalability().data.scaling == "strong"


def test_a_task_that_grows_out_of_proportion_has_no_speed_up(tmp_path):
    steps = {"steps": 2, "evaluation": 1, "episodes": 1, "preset": "random"}
    spec = steps | {"study": "scaling", "seeds": 2, "sweep": {"scenario.robots": [1, 2, 4]}}
    study = na.run(spec, tmp_path / "out", jobs=1, progress=False)
    report = study.scalability()
    assert report.data.scaling is None  # the box grows from two robots on
    assert not report.speedups
    assert not report.universal_laws
    assert "--where" in " ".join(report.remarks)
    assert draw(report).axes
    assert study.where("robots >= 2").scalability().data.scaling == "weak"


def test_tasks_of_one_size_count_in_every_group_of_conditions(tmp_path):
    corners = [[-0.4, -0.4], [0.4, -0.4], [0.4, 0.4], [-0.4, 0.4]]
    boxes = ["square", {"name": "fixed", "vertices": corners}]  # only the first one grows
    sweep = {"scenario.robots": [2, 4], "scenario.box": boxes}
    steps = {"steps": 2, "evaluation": 1, "episodes": 1, "preset": "random"}
    study = na.run(
        steps | {"study": "scaling", "seeds": 2, "sweep": sweep},
        tmp_path / "out",
        jobs=1,
        progress=False,
    )
    assert study.scalability().data.scaling is None
    assert study.where("box == 'square'").scalability().data.scaling == "weak"


@pytest.mark.parametrize(("sizes", "is_searched"), [((2, 8), False), ((2, 4), True)])
def test_hierarchies_without_two_sizes_in_common_are_named(tmp_path, sizes, is_searched):
    places = [("chain", 2), ("chain", 4), *(("star", n) for n in sizes)]
    rows = [f"{name},{n},{seed},{seed * n / 40}" for name, n in places for seed in range(6)]
    path = tmp_path / "scores.csv"
    path.write_text("\n".join(["hierarchy,agents,seed,score", *rows]))
    paragraph = load(path).scalability().paragraph
    assert ("two sizes and seeds that both have: chain and star" in paragraph) != is_searched
    assert ("There is no crossover" in paragraph) == is_searched


def test_hierarchies_of_different_seeds_are_compared_on_those_they_share(tmp_path):
    path = tmp_path / "scores.csv"
    for chosen, said in (
        (range(2), "0.9 over the 2 seeds that all have"),
        (range(6, 9), "two sizes and seeds that both have"),
    ):
        rows = [f"chain,{n},{seed},{0.9 - seed / 10}" for n in (2, 4) for seed in range(6)]
        rows += [f"star,{n},{seed},0.5" for n in (2, 4) for seed in chosen]
        path.write_text("\n".join(["hierarchy,agents,seed,score", *rows]))
        paragraph = load(path).scalability().paragraph
        assert "Not all teams have the same seeds" in paragraph
        assert said in paragraph or "0.85 over the 2 seeds" in paragraph
        assert ("There is no crossover" in paragraph) == (len(chosen) == 2)


def test_the_scaling_may_be_named():
    assert na.load(SCALING).scalability(scaling="strong").data.scaling == "strong"
    with pytest.raises(na.SpecError, match="scaling = 'other': allowed are strong, weak"):
        na.load(SCALING).scalability(scaling="other")


def test_the_paragraph_says_how_the_task_grows():
    weak, strong = (na.load(SCALING).scalability(scaling=s) for s in ("weak", "strong"))
    assert "grows with the team (weak scaling)" in weak.paragraph
    assert "the same for all sizes (strong scaling)" in strong.paragraph


def test_numbers_of_whole_trials_leave_the_times_of_evaluation():
    study = na.load(SCALING)
    usual, other = (study.scalability(m) for m in (None, "messages"))
    assert other.data.performance.name == "messages"
    assert other.speedups.keys() == usual.speedups.keys()


@pytest.mark.parametrize(
    ("best", "expected"),
    [
        ((20.0, 1.0, 30.0), "no best team size"),
        ((20.0, 1.2, 30.0), "more than 1 robot,"),
        ((20.0, 16.0, 30.0), "more than 16 robots"),
        ((8.0, 2.5, np.inf), "at least 2 robots"),
        ((8.0, 6.0, 10.0), "at its maximum with 8 [6, 10] robots"),
    ],
)
def test_the_place_of_the_maximum_throughput_in_words(best, expected):
    law = SimpleNamespace(best_size=Estimate(*map(np.asarray, best)), is_plausible=True)
    assert expected in analysis_module.place_of_maximum(law, 16.0, "robots")


def test_a_crossover_is_found_with_its_interval(table):
    report = load(table).scalability(size="agents")
    ((better, worse, size),) = report.crossovers
    assert (better, worse) == ("tree", "chain")
    assert 4.0 <= size.low < size.value < size.high <= 8.0
    assert "agents on, tree beats chain." in report.paragraph


def test_the_size_is_what_changes_the_team_and_no_setting_of_the_learner():
    """A swept budget was taken for the size, because the single agent has no swept size."""
    analysis = na.load(RESULTS / "equal-computing-boxes.json").scalability()
    assert analysis.data.size == "robots"
    assert analysis.data.all_sizes == (2.0, 4.0, 8.0)
    assert analysis.data.sizes("single agent, budget=64") == (2.0,)


def test_the_best_hierarchy_at_the_largest_size_comes_first():
    analysis = na.load(RESULTS / "equal-computing-boxes.json").scalability()
    (best,), probability = analysis.best
    assert best == "hierarchy, topology=chain, budget=1024"
    assert probability > 0.95
    assert f"With 8 robots, {best} has the best mean" in analysis.paragraph
    assert len(analysis.named) == 3


def test_a_swept_setting_is_no_size():
    columns = {str(n): {"learner.decision.budget": n} for n in (64, 256, 1024)}
    values = {c: {"steps": np.ones((4, 1)), "success": np.ones((4, 1))} for c in columns}
    of_seeds = {c: range(4) for c in columns}
    results = from_arrays({"evaluation": values}, of_seeds, {}, {}, columns, (SUCCESS,))
    with pytest.raises(na.SpecError, match=r"^size: name the .*: learner.decision.budget"):
        analyze(results, {}, None, None, None, None, "")


def report_of(serial: float):
    """Return the report of times with a serial fraction, and with no failure."""
    columns = {str(n): {"scenario.robots": n} for n in (2, 4, 8, 16)}
    rng = np.random.default_rng(0)
    times = {
        n: 200.0 * (serial + (1.0 - serial) / n) * rng.gamma(900.0, 1 / 900.0, (12, 1))
        for n in (2, 4, 8, 16)
    }
    values = {
        c: {"steps": times[own["scenario.robots"]], "success": np.ones((12, 1))}
        for c, own in columns.items()
    }
    of_seeds = {c: range(12) for c in columns}
    results = from_arrays({"evaluation": values}, of_seeds, {}, {}, columns, (SUCCESS,))
    return analyze(results, {}, None, None, None, None, "")


def test_a_best_size_without_bound_is_said_in_words() -> None:
    """The throughput of a serial fraction has no maximum."""
    report = report_of(0.1)
    assert "inf" not in str(report.laws)
    assert "more than 1" in report.paragraph


def test_results_without_times_and_costs_have_no_speed_up(table):
    report = load(table).scalability(size="agents")
    assert not report.speedups
    assert "strong scaling is assumed" in " ".join(report.remarks)


def test_everything_can_be_written_as_json(table, capsys):
    arguments = ["scalability", str(table), "--columns", "condition=hierarchy+agents"]
    assert main([*arguments, "--size", "agents", "--format", "json"]) == 0
    own = json.loads(capsys.readouterr().out)
    assert own["crossovers"][0]["better"] == "tree"
    assert len(own["rows"]) == 8


@pytest.mark.parametrize("form", ["table", "latex", "csv", "markdown"])
def test_the_table_has_all_forms(form, capsys):
    assert main(["scalability", str(SCALING), "--format", form]) == 0
    output = capsys.readouterr().out
    assert "efficiency" in output
    assert max(map(len, output.splitlines())) <= 80 or form != "table"


def test_the_figure_fills_the_points_on_the_front():
    analysis = na.load(RESULTS / "controls.json").scalability()
    cost, largest = next(iter(analysis.data.costs)), analysis.data.all_sizes[-1]
    points = analysis.fronts.itertuples()
    on_front = [p.on_front for p in points if (p.cost, p.size) == (cost, largest)]
    assert len({*on_front}) == 2
    points = [line for line in draw(analysis).axes[3].lines if line.get_marker() == "o"]
    faces = [point.get_markerfacecolor() for point in points]
    assert [face != "white" for face in faces] == on_front


def test_the_axis_of_efficiencies_reaches_above_one_even_if_all_are_low():
    analysis = report_of(0.9)
    (own,) = analysis.speedups.values()
    assert own[16.0]["efficiency"].value < 0.2
    assert draw(analysis).axes[1].get_ylim()[1] >= MAX_EFFICIENCY


def test_the_figure_is_written(tmp_path, capsys):
    path = tmp_path / "scalability.png"
    assert main(["scalability", str(SCALING), "--plot", str(path)]) == 0
    assert path.stat().st_size > 10_000
    assert len(na.load(SCALING).scalability().figure().axes) == 4


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--budget", "messages <= 1"], "least measured: messages >= 6"),
        (["--budget", "tokens <= 1"], "cost = 'tokens'"),
        (["--budget", "messages"], "must be COST <= NUMBER"),
        (["--where", "robots == 2"], "size"),
        (["--size", "joints"], "size = 'joints'"),
        (["--measure", "sucess"], "did you mean 'success'"),
    ],
)
def test_wrong_arguments_are_refused_in_one_line(arguments, message, capsys):
    assert main(["scalability", str(SCALING), *arguments]) == 2
    output = capsys.readouterr()
    assert output.out == ""
    (line,) = [line for line in output.err.splitlines() if "error" in line]
    assert message in line
