"""Intervals of published results are those that version 0.4.0 (commit 8a15e989) computed."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import nested_agents as na
from nested_agents.studies.results.published import load
from nested_agents.studies.results.results import Results
from nested_agents.studies.results.statistics import FEW, NOT_NEGATIVE, bootstrap, rate

PUBLISHED = Path(na.__file__).parents[1] / "research/results"
INTERVALS = json.loads(Path(__file__).with_name("intervals_of_0_4.json").read_text("utf-8"))
"""Study, condition, measure; value, low and high in evaluation."""


@cache
def results(study: str) -> Results:
    return load(PUBLISHED / f"{study}.json").results


def test_intervals_are_those_of_version_0_4() -> None:
    for study, condition, measure, *expected in INTERVALS:
        values = results(study).values(condition, measure, "evaluation").astype(float)
        is_rate = measure == "success"
        means = values.mean(axis=1)
        estimate = rate(values) if is_rate else bootstrap(means, bounds=NOT_NEGATIVE)
        if np.ptp(means) == 0.0 and len(means) < FEW and not is_rate:
            expected = [means[0], np.nan, np.nan]  # equal values of few seeds have no interval
        shown = [float(end) for end in estimate]
        assert shown == pytest.approx(expected, rel=1e-10, nan_ok=True), (study, condition, measure)
