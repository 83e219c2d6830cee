"""Tests of the program that reruns published conditions."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from nested_agents import Spec
from nested_agents.analysis import Estimate
from research import FOLDER, RESULTS, SPECS, check

TABLES = sorted(path.stem for path in RESULTS.glob("*.json"))


@pytest.mark.parametrize("name", TABLES)
def test_every_published_condition_can_be_selected_as_a_spec(name):
    published = json.loads((RESULTS / f"{name}.json").read_text())
    for condition in list(published["columns"])[:2]:
        spec = check.select_condition(published["spec"], published["columns"][condition])
        assert "sweep" not in spec or all(len(values) == 1 for values in spec["sweep"].values())
        assert len(spec.get("overrides", [1])) == 1


LEFT = ("swimmer-n", "swimmer-transfer", "peers-one-robot")
"""Tables whose specs cannot be read here: MuJoCo is not installed, and DQN is gone."""
WITH_FILES = [name for name in TABLES if (SPECS / f"{name}.toml").exists() and name not in LEFT]


def settings_of(spec):
    """Return the settings of each condition as text, with paths from the folder of specs."""
    return {
        c.label: c.settings.model_dump_json().replace(str(FOLDER.parent), "../..")
        for c in spec.conditions()
    }


@pytest.mark.parametrize("name", WITH_FILES)
def test_the_spec_of_a_table_means_what_its_file_does(name):
    published = json.loads((RESULTS / f"{name}.json").read_text())["spec"]
    own = settings_of(Spec.read(check.with_full_paths(published)))
    in_file = settings_of(Spec.load(SPECS / f"{name}.toml"))
    common = own.keys() & in_file.keys()
    assert common
    assert [label for label in common if own[label] != in_file[label]] == []


@pytest.mark.parametrize("name", ["equal-computing-arms", "hierarchies", "own-relation-games"])
def test_a_condition_of_hierarchies_and_of_swept_lists_can_be_run_alone(name):
    found = check.find_condition(name, 1e6)
    assert found is not None
    assert len(Spec.read(dict(found.spec)).conditions()) == 1


@pytest.mark.parametrize("name", ["ablation", "arms", "climbing", "learning-curve", "transfer"])
def test_the_selected_spec_has_one_condition_with_the_seeds_that_fit(name):
    found = check.find_condition(name, 1e6)
    assert found is not None
    spec = Spec.read(dict(found.spec))
    assert len(spec.conditions()) == 1
    assert tuple(spec.seeds) == found.seeds
    published = json.loads((RESULTS / f"{name}.json").read_text())
    seeds = published["seeds"][found.condition]
    assert list(found.seeds) == (list(range(seeds)) if isinstance(seeds, int) else seeds)


@pytest.mark.parametrize("name", TABLES)
def test_a_condition_of_every_table_is_found_or_none(name):
    found = check.find_condition(name, 1.0)
    assert found is None or len(found.seeds) >= check.MIN_SEEDS


def test_no_condition_is_found_if_too_few_seeds_fit_into_the_time():
    assert check.find_condition("learning-curve", 1e-6) is None


def test_the_first_condition_with_enough_seeds_is_preferred():
    published = json.loads((RESULTS / "learning-curve.json").read_text())
    minutes = float(np.sum(published["usage"]["own-value"]["total"])) / 60.0
    found = check.find_condition("learning-curve", minutes + 0.01)
    assert found is not None
    assert found.condition == "own-value"


def test_estimates_agree_if_each_lies_in_the_interval_of_the_other():
    wide, narrow = Estimate(0.5, 0.2, 0.8), Estimate(0.7, 0.6, 0.75)
    assert check.agree(wide, Estimate(0.6, 0.4, 0.9))
    assert not check.agree(wide, narrow)
    assert not check.agree(narrow, wide)
    assert check.agree(Estimate(0.983, 0.661, 0.996), Estimate(1.0, 0.6, 1.0))  # printed as 1.00


@pytest.mark.parametrize("name", ["aloha", "edges", "related-boxes"])
def test_files_that_a_table_names_are_found(name):
    published = json.loads((RESULTS / f"{name}.json").read_text())
    for condition, column in published["columns"].items():
        text = json.dumps(check.select_condition(published["spec"], column))
        for path in re.findall(r'"([^"]*\.py):', text):
            assert Path(path).is_file(), condition
