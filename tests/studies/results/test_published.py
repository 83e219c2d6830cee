"""Published results are read as they were written, and others refused by their key."""

import json
import math
import subprocess
import sys
from dataclasses import replace

import pytest

from nested_agents.studies.cli.main import main
from nested_agents.studies.results import published
from nested_agents.studies.results.results_file import MAX_VALUES
from nested_agents.studies.store.database import RESULTS_VERSION

SPEC = {
    "study": "learning-curve",
    "seeds": [7, 61, 9001],
    "episodes": 2,
    "steps": 30,
    "evaluation": 0,
    "scenario": {"kind": "line-up", "carts": 2},
    "sweep": {"preset": ["default", "random"]},
}
MEASURES = [
    {
        "name": "success",
        "title": "success",
        "source": "terminated",
        "better": "higher",
        "is_rate": True,
    },
    {"name": "spread_m", "title": "spread", "unit": "m", "better": "lower", "least": 0.0},
]
ARRAYS = {
    "steps": [[30, 6], [30, 30], [30, 30]],
    "success": ["01", "00", "00"],
    "spread_m": [[0.1, 0.2], [0.3, 0.4], [0.5, 1]],
}
SOUND = {
    "results_version": RESULTS_VERSION,
    "spec": SPEC,
    "columns": {"default": {"preset": "default"}, "random": {"preset": "random"}},
    "measures": MEASURES,
    "seeds": {"default": [7, 61, 9001], "random": [7, 61, 9001]},
    "phases": {"training": {"default": ARRAYS, "random": ARRAYS}},
    "numbers": {"default": {"agents": [2, 2, 2]}, "random": {"agents": {"all": 2, "shape": [3]}}},
    "usage": {"default": {"total": [1.5, 1.5, 2]}},
}


def change(path, value):
    """Return sound results in which the value at a path is another one, or absent if None."""
    copy = json.loads(json.dumps(SOUND))
    *way, last = path.split("/")
    place = copy
    for key in way:
        place = place[int(key) if isinstance(place, list) else key]
    if value is ABSENT:
        del place[last]
    else:
        place[int(last) if isinstance(place, list) else last] = value
    return copy


ABSENT = object()
STEPS = "phases/training/default/steps"
SUCCESS = "phases/training/default/success"
NAN = math.nan
INF = math.inf

REFUSED = {
    "huge shape": (STEPS, {"all": 1, "shape": [3, 10**6 + 1]}, "steps.shape[1] = 1000001"),
    "huge shape of seeds": (
        STEPS,
        {"all": 1, "shape": [10**5, 2]},
        "steps: has the shape (100000, 2)",
    ),
    "endless shape": (STEPS, {"all": 1, "shape": [3, 10**400]}, "steps.shape[1] = 1.000e+400"),
    "negative shape": (STEPS, {"all": 1, "shape": [3, -1]}, "steps.shape[1] = -1"),
    "empty shape": (STEPS, {"all": 1, "shape": []}, "steps.shape = []"),
    "shape of three": (STEPS, {"all": 1, "shape": [3, 2, 1]}, "steps.shape = [3, 2, 1]"),
    "shape as text": (STEPS, {"all": 1, "shape": "3x2"}, "steps.shape = '3x2'"),
    "no shape": (STEPS, {"all": 1}, "steps.shape: is missing"),
    "text for all": (STEPS, {"all": "1", "shape": [3, 2]}, "steps.all = '1'"),
    "nan for all": (STEPS, {"all": NAN, "shape": [3, 2]}, "steps.all = nan"),
    "flags of another shape": (
        SUCCESS,
        {"flags": "01", "shape": [3, 2]},
        "must have the shape of its 2 flags",
    ),
    "flags of other signs": (SUCCESS, {"flags": "01x", "shape": [3, 1]}, "success.flags = '01x'"),
    "flags as a number": (SUCCESS, {"flags": 10, "shape": [1, 2]}, "success.flags = 10"),
    "digits that are no bits": (SUCCESS, ["01", "00", "02"], "success[2] = '02'"),
    "other digits": (SUCCESS, ["01", "00", "0\u0661"], "success[2] = "),
    "rows of bits differ": (
        SUCCESS,
        ["01", "00", "0"],
        "must have as many episodes of every measure",
    ),
    "numbers for bits": (
        SUCCESS,
        [[0, 1], [0, 0], [0, 0]],
        "default.success: must be text of 0 and 1",
    ),
    "text for numbers": (STEPS, [["a", "b"]] * 3, "steps[0][0] = 'a'"),
    "digits in quotes": (STEPS, [[30, 30], [30, "30"], [30, 30]], "steps[1][1] = '30'"),
    "truth for numbers": (STEPS, [[30, True], [1, 1], [1, 1]], "steps[0][1] = true"),
    "nothing for numbers": (STEPS, [[30, None], [1, 1], [1, 1]], "steps[0][1] = None"),
    "parts of steps": (f"{STEPS}/1/0", 6.5, "default.steps: must be whole numbers"),
    "negative steps": (f"{STEPS}/1/0", -6, "default.steps: must be whole numbers"),
    "nan": (f"{STEPS}/1/0", NAN, "steps[1][0] = nan"),
    "infinity": (f"{STEPS}/1/0", INF, "steps[1][0] = inf"),
    "less than all": (f"{STEPS}/1/0", -INF, "steps[1][0] = -inf"),
    "huge integer": (f"{STEPS}/1/0", 10**400, "steps[1][0] = 1.000e+400"),
    "large integer": (f"{STEPS}/1/0", 2**70, "steps[1][0] = 1180591620717411303424"),
    "rows differ": (f"{STEPS}/1", [30], "must have as many episodes of every measure"),
    "row is none": (f"{STEPS}/1", 30, "steps[1] = 30"),
    "rows too deep": (STEPS, [[[1]], [[1]], [[1]]], "steps[0][0] = [1]"),
    "no rows": (STEPS, [], "steps: has the shape (0,)"),
    "a row too few": (STEPS, [[1, 2], [3, 4]], "steps: has the shape (2, 2), must be of 3 seeds"),
    "episodes too few": (STEPS, [[1], [2], [3]], "training.default: must have as many episodes"),
    "unknown measure": ("phases/training/default/height", [[1]] * 3, "default.height: no measure"),
    "unknown condition": ("phases/training/other", ARRAYS, "training.other: is no condition"),
    "duplicate seeds": ("seeds/default", [61, 61, 61], "seeds.default = [61, 61, 61]"),
    "huge seeds": ("seeds/default", 10**9, "seeds.default = 1000000000"),
    "endless seeds": ("seeds/default", 10**400, "seeds.default = 1.000e+400"),
    "no seeds": ("seeds/default", [], "seeds.default = []"),
    "seed as text": ("seeds/default", ["7", 61, 9001], "seeds.default[0] = '7'"),
    "seed of parts": ("seeds/default", [7.5, 61, 9001], "seeds.default[0] = 7.5"),
    "seed as truth": ("seeds/default", [True, 61, 9001], "seeds.default[0] = true"),
    "negative seed": ("seeds/default", [-7, 61, 9001], "seeds.default[0] = -7"),
    "large seed": ("seeds/default", [2**63, 61, 9001], "seeds.default[0] = 9223372036854775808"),
    "seeds of a spec": ("spec/seeds", 10**12, "spec.seeds = 1000000000000"),
    "seeds of a spec again": ("spec/seeds", [1, 1], "spec.seeds = [1, 1]"),
    "episodes of a spec": ("spec/episodes", "2", "spec.episodes = '2'"),
    "steps of a spec": ("spec/steps", INF, "spec.steps = inf"),
    "study of a spec": ("spec/study", 3, "spec.study = 3"),
    "curriculum": ("spec/curriculum", [{"episodes": "x"}], "spec.curriculum[0].episodes = 'x'"),
    "overrides": ("spec/overrides", {"a": 1}, "spec.overrides = {a = 1}"),
    "no spec": ("spec", ABSENT, "spec: is missing"),
    "no column": ("columns/random", ABSENT, "columns.random: is missing"),
    "column of a list": ("columns/random/preset", ["random"], "columns.random.preset = ['random']"),
    "column of nan": ("columns/random/preset", NAN, "columns.random.preset = nan"),
    "measure without name": ("measures/1/name", ABSENT, "measures[1].name: is missing"),
    "measure by number": ("measures/1/title", 3, "measures[1].title = 3"),
    "measure twice": ("measures/1/name", "success", "measures = "),
    "measure called steps": ("measures/1/name", "steps", "measures = "),
    "measure of more": ("measures/1/more", 1, "measures[1].more: is no known key"),
    "gathering": ("measures/1/gathering", "median", "measures[1].gathering = 'median'"),
    "better": ("measures/1/better", "blue", "measures[1].better = 'blue'"),
    "rate": ("measures/1/is_rate", "no", "measures[1].is_rate = 'no'"),
    "bound": ("measures/1/least", NAN, "measures[1].least = nan"),
    "number of a trial": ("numbers/default/agents", [2, 2, "2"], "default.agents[2] = '2'"),
    "numbers too few": (
        "numbers/default/agents",
        [2],
        "default.agents: has the shape (1,), must be of 3 seeds",
    ),
    "numbers of others": ("numbers/other", {"agents": [2]}, "numbers.other: is no condition"),
    "usage": ("usage/default/total", [1, 2, INF], "usage.default.total[2] = inf"),
    "version as text": ("results_version", "4", "results_version = '4'"),
    "version of parts": ("results_version", 4.5, "results_version = 4.5"),
    "phases": ("phases", [], "phases = []"),
    "phase": ("phases/training", [1], "phases.training = [1]"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_is_none_is_refused_in_one_line_by_its_key(kind, tmp_path, capsys) -> None:
    path, value, key = REFUSED[kind]
    file = tmp_path / "results.json"
    file.write_text(json.dumps(change(path, value)))
    for command in ("table", "compare"):
        assert main([command, str(file)]) == 2
        out, err = capsys.readouterr()
        assert (out, err.count("\n")) == ("", 1)
        assert f"{file}: holds no published results: " in err
        assert key in err


def test_what_is_sound_is_read(tmp_path, capsys) -> None:
    file = tmp_path / "results.json"
    file.write_text(json.dumps(SOUND))
    assert main(["table", str(file)]) == 0
    results = published.load(file).results
    assert results.values("random", "spread_m").tolist() == ARRAYS["spread_m"]
    assert results.success("random").tolist() == [[0, 1], [0, 0], [0, 0]]
    assert results.numbers("random")["agents"].tolist() == [2, 2, 2]
    assert published.loads(published.dumps(*published.load(file)[:2])).results.seeds("default") == (
        7,
        61,
        9001,
    )


def test_identical_conditions_are_named_by_published_results(tmp_path, capsys) -> None:
    file = tmp_path / "results.json"
    said = "Identical in every episode, by every measure:\n  default = random\n"
    for identical in ([["default", "random"]], []):
        file.write_text(json.dumps(SOUND | {"identical": identical}))
        for command in ("table", "compare"):
            assert main([command, str(file)]) == 0
            assert (said in capsys.readouterr().out) is bool(identical)
    kept, results, _ = published.load(file)
    again = published.loads(published.dumps(kept, replace(results, same_conditions=None)))
    assert again.results.identical == ()  # because there are no returns
    file.write_text(json.dumps(SOUND | {"identical": [["default", "chain"]]}))
    assert main(["table", str(file)]) == 2
    assert "columns.chain: is missing" in capsys.readouterr().err


def test_a_key_that_stands_twice_is_named(tmp_path, capsys) -> None:
    file = tmp_path / "results.json"
    file.write_text(json.dumps(SOUND).replace('"usage"', '"numbers"'))
    assert main(["table", str(file)]) == 2
    assert "numbers: stands twice in a table" in capsys.readouterr().err


def test_many_small_texts_fill_no_memory(tmp_path) -> None:
    """A hundred arrays that are each allowed, of 400 MB in all, in 12 kB."""
    file = tmp_path / "results.json"
    full = {"all": 1, "shape": [3, MAX_VALUES // 30]}
    table = json.loads(json.dumps(SOUND))
    table["phases"] = {f"phase {i}": {"default": {"steps": full}} for i in range(100)}
    file.write_text(json.dumps(table))
    lines = (
        "import resource",
        "import sys",
        "from pathlib import Path",
        "from nested_agents.studies.results import published",
        "resource.setrlimit(resource.RLIMIT_AS, (4 * 10**9, 4 * 10**9))",
        "published.load(Path(sys.argv[1]))",
    )
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(lines), file], capture_output=True, text=True
    )
    assert "must be small: at most" in done.stderr.splitlines()[-1]


@pytest.mark.parametrize(
    "content", ["[]", "{}", '{"a": 1}', '{"a": {"b": {"c": {"d": {}}}}}', "[" * 100_000]
)
def test_other_files_are_refused(content, tmp_path, capsys) -> None:
    path = tmp_path / "other.json"
    path.write_text(content)
    assert main(["table", str(path)]) == 2
    err = capsys.readouterr().err
    assert "other.json: holds no " in err
    assert err.count("\n") == 1
