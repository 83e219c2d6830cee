"""Tables of what goes with what."""

import re

import pytest

from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import WIDTH
from nested_agents.studies.explain.combination_tables import write
from nested_agents.studies.explain.combinations import AXES, Combination, Trying


def test_sentences_are_numbered_once_for_all_learners() -> None:
    left_out = [f"topology: left out, learner.kind = {name!r} tells nobody" for name in "ab"]
    made = [
        Combination("predictor", "given", "a", Trying("yes")),
        Combination("predictor", "static", "a", Trying("left out", left_out[0])),
        Combination("predictor", "given", "b", Trying("left out", left_out[1])),
        Combination("predictor", "static", "b", Trying("no", "other")),
    ]
    cases = list(AXES["predictor"])
    made = [
        *made[:2],
        *(Combination("predictor", case, "a", Trying("yes")) for case in cases[2:]),
        *made[2:],
        *(Combination("predictor", case, "b", Trying("yes")) for case in cases[2:]),
    ]
    lines = list(write(made))
    assert lines[0].split() == " ".join(["predictor", *cases]).split()
    assert [line.split()[:5] for line in lines[1:3]] == [
        ["a", "yes", "out", "1", "yes"],
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
