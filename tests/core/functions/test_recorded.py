"""Recorded answers: kept by content, checked, taken over, never invented."""

import sqlite3
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from acting import look

from nested_agents.core.agents.loop import policy_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.functions.plain import CallError
from nested_agents.core.functions.recorded import AnswersError, RecordedAnswers
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.learners import LEARNERS
from nested_agents.core.plugins.sources import Answers, Sources
from nested_agents.scenarios.line_up import LineUpSettings

SOURCE = """
CALLS = []
def draws(observation, told, rng, agent):
    CALLS.append(agent)
    return {"action": int(rng.integers(4)), "message": [agent, 0.1], "costs": {"tokens": 0.5}}
def same(observation):
    CALLS.append(observation["distance"])
    return len(CALLS) % 4
def many(observations, rngs):
    CALLS.append(len(observations))
    return [int(rng.integers(4)) for rng in rngs]
class Remembers:
    def __init__(self):
        self.seen = []
    def decide(self, observation):
        CALLS.append(list(self.seen))
        self.seen.append(observation["distance"])
        return len(self.seen) % 4
    def memory(self):
        return self.seen
    def restore(self, memory):
        self.seen = list(memory)
class Forgets:
    def decide(self, observation):
        return 0
def second_fails(observation, agent):
    CALLS.append(agent)
    return "jump" if agent == "cart2" else 0
"""


class Study:
    """Runs episodes of three carts that decide by a function of `SOURCE`."""

    def __init__(self, name: str, path: Path, **more) -> None:
        self.sources = Sources(texts={"f.py": SOURCE})
        self.name, self.path, self.more = name, path, {"recorded": True, **more}
        with self.sources.active():
            self.calls = self.sources.load("f.py:CALLS")
        self.calls.clear()

    def run(self, *, calls: bool = True, seed: int = 3, steps: int = 3, **more) -> list[list[int]]:
        self.sources.answers = Answers(self.path, calls)
        world = LineUpSettings(carts=3).build()
        with self.sources.active():
            settings = LEARNERS.parsed(f"f.py:{self.name}", **self.more, **more)
            team = Team(settings, world, Hierarchy(world.agents, []), policy_seed(seed))
        joint = []
        for episode in range(2):
            states = world.reset(episode)
            team.begin_world(0, episode)
            for _ in range(steps):
                joint.append(team.act(look(world, states)).joint_action)
                states = world.step(joint[-1]).states
        self.spent = team.spent
        return [actions.tolist() for actions in joint]


@pytest.fixture
def path(tmp_path: Path) -> Iterator[Path]:
    return tmp_path / "answers.db"


@pytest.mark.parametrize(
    ("name", "more", "calls"),
    [
        ("draws", {"costs": {"tokens": "1"}}, 18),
        ("many", {}, 6),
        ("Remembers", {}, 18),
    ],
)
def test_nobody_is_asked_twice(name: str, more: dict, calls: int, path: Path) -> None:
    study = Study(name, path, **more)
    first = study.run()
    spent = study.spent
    assert len(study.calls) == calls == len(RecordedAnswers(path))
    assert study.run(calls=False) == first
    assert (study.spent, len(study.calls)) == (spent, calls)


def test_another_seed_settings_or_code_are_other_questions(path: Path) -> None:
    study = Study("draws", path, costs={"tokens": "1"})
    study.run()
    study.run(seed=4)
    assert len(study.calls) == 36
    study.sources = Sources(texts={"f.py": SOURCE.replace("0.1", "0.2")})
    study.run()
    assert len(RecordedAnswers(path)) == 54


def test_who_draws_nothing_is_asked_once_for_all_seeds(path: Path) -> None:
    study = Study("same", path)
    first = study.run(steps=1)
    assert study.run(seed=4, steps=1) == first
    assert len(study.calls) == 6


def test_an_object_goes_on_where_its_recorded_answers_end(path: Path) -> None:
    study = Study("Remembers", path)
    whole = Study("Remembers", path.with_name("whole.db")).run(steps=3)
    study.run(steps=2)
    study.calls.clear()
    assert study.run(steps=3) == whole
    assert [len(seen) for seen in study.calls] == [2] * 6


def test_a_missing_answer_is_told_and_never_invented(path: Path) -> None:
    study = Study("draws", path, costs={"tokens": "1"})
    study.run(steps=1)
    with pytest.raises(CallError, match=r"agent 'cart1': .*answers\.db has no answer, and no call"):
        study.run(steps=2, calls=False)


def test_what_was_answered_before_a_failure_is_kept(path: Path) -> None:
    study = Study("second_fails", path)
    for _ in range(2):
        with pytest.raises(CallError, match="agent 'cart2'"):
            study.run()
    assert study.calls == ["cart1", "cart2", "cart2"]


def test_a_changed_answer_is_damage(path: Path) -> None:
    study = Study("draws", path, costs={"tokens": "1"})
    study.run()
    with sqlite3.connect(path) as db:
        db.execute("UPDATE answers SET answer = replace(answer, '0.5', '0.6')")
    with pytest.raises(AnswersError, match=r"answers\.db: is damaged, an answer is not what was k"):
        study.run()
    with pytest.raises(AnswersError, match="is damaged"):
        RecordedAnswers(path.with_name("other.db")).merge(path)
    path.write_bytes(b"no database at all" * 100)
    with pytest.raises(AnswersError, match="answers cannot be read or kept: file is not a dat"):
        study.run()


def test_an_object_that_cannot_be_restored_is_refused(path: Path) -> None:
    with pytest.raises(ValueError, match=r"learner\.recorded = true: f\.py:Forgets remembers, an"):
        Study("Forgets", path).run()


def test_answers_are_taken_over_and_the_first_one_counts(tmp_path: Path) -> None:
    here, there = (RecordedAnswers(tmp_path / name) for name in ("here.db", "there.db"))
    for answers, known in ((here, {"a": 1, "b": 2}), (there, {"b": 3, "c": 4, "a": 1})):
        for question, answer in known.items():
            answers.keep(question, answer)
    assert here.merge(there.path) == (1, 2, 1)
    assert [here.find(q) for q in "abc"] == [1, 2, 4]
    with pytest.raises(AnswersError, match="no such file"):
        here.merge(tmp_path / "nowhere.db")


def test_two_processes_go_on_with_the_same_answer(path: Path) -> None:
    one, other = RecordedAnswers(path), RecordedAnswers(path)
    assert one.find("q") is other.find("q") is None
    assert one.keep("q", [1]) == other.keep("q", [2]) == [1]
    one.close()
    assert np.array_equal(RecordedAnswers(path).find("q"), [1])
