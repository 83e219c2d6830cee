"""Every combination runs or says in one sentence why not; the page says what comes of trying."""

import pytest

from nested_agents.core.learners import LEARNERS
from nested_agents.studies.errors import SpecError
from research.combinations import (
    AXES,
    MARK,
    PAGE,
    attempt,
    cells,
    exceptions,
    spec_of,
)


@pytest.mark.slow
def test_every_cell_runs_or_says_why_not_as_the_page_does() -> None:
    every = list(cells())
    count = sum(map(len, AXES.values())) * len(LEARNERS.built_in)
    assert len({cell[:3] for cell in every}) == len(every) == count
    for cell in every:
        assert bool(cell.outcome.sentence) == (cell.outcome.verdict != "yes"), cell
        assert "\n" not in cell.outcome.sentence
        assert str(PAGE.parents[1]) not in cell.outcome.sentence
    generated = PAGE.read_text(encoding="utf-8").partition(MARK)[2]
    assert "".join(f"{line}\n" for line in exceptions(every)) == generated


@pytest.mark.parametrize(
    ("axis", "case", "learner", "verdict"),
    [
        ("messages", "absent", "fitted-q", "yes"),
        ("messages", "lost", "mappo", "left out"),
        ("lookahead", "none", "mixed", "yes"),
        ("further", "kept team", "td-lambda", "yes"),
        ("neighbors", "simultaneous", "fitted-q", "no"),
    ],
)
def test_cells_of_each_verdict(axis: str, case: str, learner: str, verdict: str) -> None:
    assert attempt(spec_of(learner, AXES[axis][case])).verdict == verdict


def test_a_team_that_is_not_restored_is_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    from nested_agents.core.agents.team import Team

    monkeypatch.setattr(Team, "load_state_dict", lambda self, state: None)
    with pytest.raises(RuntimeError, match="td-lambda: the kept team acts otherwise"):
        attempt(spec_of("td-lambda", AXES["further"]["kept team"]))


def test_unknown_learners_are_refused_before_anything_is_run() -> None:
    with pytest.raises(SpecError, match="unknown learner"):
        next(cells(["nobody"]))
