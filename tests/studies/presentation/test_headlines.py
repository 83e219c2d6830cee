"""Sentences on what the teams of a study have learned."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nested_agents.core.interface.measures import SUCCESS
from nested_agents.studies.presentation.headlines import below_random, headlines
from nested_agents.studies.results.results import Results, from_arrays
from nested_agents.studies.spec.controls import TROUBLESHOOTING
from nested_agents.studies.spec.spec import Spec

Lines = Callable[[Results, Mapping[str, Mapping[str, Any]]], tuple[str, ...]]
RATES = {"default": 9, "frozen": 0, "random": 0, "planner": 10}


def lines_of(rates: dict[str, int], seeds: int = 8, lines: Lines = headlines) -> str:
    """Return the lines about conditions, given the successes of ten evaluation episodes."""
    spec = Spec.of({"sweep": {"preset": list(rates)}})
    arrays = {c: {"success": np.tile(np.arange(10) < n, (seeds, 1))} for c, n in rates.items()}
    of_seeds = {c: range(seeds) for c in rates}
    columns = {c: {"preset": c} for c in rates}
    results = from_arrays({"evaluation": arrays}, of_seeds, {}, {}, columns, (SUCCESS,))
    settings = {c.label: c.settings.model_dump() for c in spec.conditions()}
    return " ".join(" ".join(lines(results, settings)).split())


def test_a_learner_below_random_actions_is_remarked() -> None:
    text = lines_of({"default": 1, "random": 3}, lines=below_random)
    assert text.startswith("Below random actions in evaluation success: default 0.10 [")
    assert "; random 0.30 [" in text
    assert "docs/troubleshooting.md" in text
    assert lines_of({"default": 3, "random": 3}, lines=below_random) == ""
    assert lines_of({"default": 1, "planner": 9}, lines=below_random) == "", "no random control"
    assert lines_of({"frozen": 1, "random": 3}, lines=below_random) == "", "it does not learn"


def test_the_page_that_the_remark_names_exists() -> None:
    assert (Path(__file__).parents[3] / TROUBLESHOOTING).is_file()


def test_a_team_has_learned_if_it_is_better_than_its_untrained_weights() -> None:
    text = lines_of(RATES)
    assert text.startswith("default learned (8 seeds): evaluation success 0.90 [")
    assert "untrained (frozen) 0 [0, 0.33];" in text
    assert "planner 1.00 [0.67, 1.00], better." in text
    assert "random" not in text, "it is the control by ties"


def test_what_few_seeds_leave_open_is_not_called_learned() -> None:
    assert lines_of(RATES, seeds=4).startswith("default is not seen to learn with 4 seeds:")
    assert lines_of({"default": 0, "frozen": 0}).startswith(
        "default is not seen to learn with 8 seeds:"
    )


@pytest.mark.parametrize("presets", [("frozen", "random"), ("default", "planner"), ("default",)])
def test_without_a_team_or_its_control_nothing_is_said(presets) -> None:
    assert not lines_of({preset: 5 for preset in presets})
