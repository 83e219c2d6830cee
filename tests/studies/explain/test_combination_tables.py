"""Tables of what goes with what."""

import re

import pytest

from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import WIDTH
from nested_agents.studies.explain.combination_tables import write
from nested_agents.studies.explain.combinations import AXES, Combination, Found


def test_sentences_are_numbered_once_for_all_learners() -> None:
    left_out = [f"topology: left out, learner.kind = {name!r} tells nobody" for name in "ab"]
    made = [
        Combination("predictor", "given", "a", Found("yes")),
        Combination("predictor", "static", "a", Found("left out", left_out[0])),
        Combination("predictor", "given", "b", Found("left out", left_out[1])),
        Combination("predictor", "static", "b", Found("no", "other")),
    ]
    lines = list(write(made))
    assert [line.split() for line in lines[:3]] == [
        ["predictor", "given", "static"],
        ["a", "yes", "out", "1"],
        ["b", "out", "1", "no", "2"],
    ]
    assert lines[-2:] == [
        "1. topology: left out, learner.kind = ... tells nobody",
        "2. other",
    ]
    assert all(len(part) <= WIDTH for line in lines for part in line.splitlines())


def test_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["combine", "td-lambda", "fitted-q"]) == 0
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= WIDTH
    assert len(re.findall(r"^td-lambda ", out, re.MULTILINE)) == len(AXES)
    assert main(["combine", "td-lamda"]) == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert "td-lamda: unknown learner; did you mean 'td-lambda'?" in error
