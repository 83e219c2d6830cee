"""Slow calls: concurrent, limited, recorded, and named when they fail."""

import asyncio
import sqlite3
import threading
from pathlib import Path

import numpy as np
import pytest
from nested_agents_language import CallError, RecordedAnswers, RecordError, slow_calls

import nested_agents as na


def given(n=3, seed=0, **more):
    return {
        "observations": [{"x": float(k)} for k in range(n)],
        "agents": [f"a{k}" for k in range(n)],
        "received": [{} for _ in range(n)],
        "rngs": [np.random.Generator(np.random.Philox(key=seed + k)) for k in range(n)],
        "actions": ("left", "right"),
        "step": 0,
        **more,
    }


def chosen(decide, **arguments):
    """Call a decorated function with the arguments that it takes."""
    names = decide.__signature__.parameters
    return decide(**{name: value for name, value in arguments.items() if name in names})


@pytest.mark.parametrize("limit", [1, 2, 8])
def test_calls_run_at_once_up_to_the_limit(limit):
    under_way = []
    most = []

    @slow_calls(max_concurrent=limit)
    async def decide(observation):
        under_way.append(1)
        most.append(len(under_way))
        await asyncio.sleep(0)
        under_way.pop()
        return int(observation["x"])

    assert chosen(decide, **given(6)) == list(range(6))
    assert max(most) == min(limit, 6)


def test_an_ordinary_function_runs_in_threads():
    both = threading.Barrier(2)

    @slow_calls()
    def decide(agent):
        both.wait(60)  # passes only if two calls run at once
        return agent

    assert chosen(decide, **given(2)) == ["a0", "a1"]


def test_a_call_that_fails_or_takes_too_long_names_the_agent():
    @slow_calls(timeout_s=0.01)
    async def hangs(agent):
        if agent == "a1":
            await asyncio.Event().wait()
        return 0

    @slow_calls()
    async def fails(agent):
        raise TimeoutError("of its own")

    with pytest.raises(CallError, match=r"agent 'a1': .*no answer within timeout_s = 0\.01"):
        chosen(hangs, **given())
    with pytest.raises(CallError, match="agent 'a0': TimeoutError: of its own"):
        chosen(fails, **given())


def recorded(path, log, **options):
    @slow_calls(record=path, **options)
    def decide(observation, rng, *, bias: float = 0.0):
        log.append(observation)
        return {"action": int(rng.integers(2)), "message": bias}

    return decide


def test_a_question_is_asked_once(tmp_path: Path):
    path, log = tmp_path / "answers.db", []
    first = chosen(recorded(path, log), **given())
    assert chosen(recorded(path, log), **given()) == first
    assert len(log) == len(RecordedAnswers(path)) == 3
    chosen(recorded(path, log), **given(seed=10))  # other random numbers
    chosen(recorded(path, log), **given(), bias=1.0)  # other settings
    assert len(log) == 9
    assert chosen(recorded(path, log, offline=True), **given()) == first
    with pytest.raises(CallError, match="has no answer to"):
        chosen(recorded(path, log, offline=True), **given(seed=99))


def test_answers_that_arrived_before_a_failure_are_kept(tmp_path: Path):
    path = tmp_path / "answers.db"

    @slow_calls(record=path)
    def decide(agent):
        if agent == "a2":
            raise ValueError("so")
        return 0

    with pytest.raises(CallError, match="agent 'a2': ValueError: so"):
        chosen(decide, **given())
    assert len(RecordedAnswers(path)) == 2


def test_a_damaged_answer_or_file_is_refused(tmp_path: Path):
    path = tmp_path / "answers.db"
    RecordedAnswers(path).store("q", 1)
    with sqlite3.connect(path) as db:
        db.execute("UPDATE answers SET answer = '2'")
    with pytest.raises(RecordError, match="a recorded answer is damaged: q"):
        RecordedAnswers(path).find("q")
    path.write_text("no database at all" * 100)
    with pytest.raises(RecordError, match="cannot be read or stored"):
        RecordedAnswers(path).find("q")


def test_wrong_parameters_are_refused():
    with pytest.raises(ValueError, match="parameter 'goal', allowed: observation"):
        slow_calls()(lambda goal: 0)
    with pytest.raises(ValueError, match="offline = True: needs record"):
        slow_calls(offline=True)


PROGRAM = """
import nested_agents_language as language


@language.slow_calls(record={record!r})
async def decide(observation, received, rng, *, log: str, weight: float = 1.0):
    with open(log, "a") as file:
        file.write("called\\n")
    return {{"action": int(rng.integers(4)), "message": len(received), "costs": {{"tokens": 7}}}}
"""


def test_a_study_that_is_repeated_calls_nobody(tmp_path: Path):
    (tmp_path / "f.py").write_text(PROGRAM.format(record=str(tmp_path / "answers.db")))
    log = tmp_path / "log"
    learner = {"kind": str(tmp_path / "f.py:decide"), "costs": {"tokens": "1"}, "log": str(log)}
    spec = {
        "seeds": 2, "episodes": 1, "steps": 4, "evaluation": 1,
        "scenario": {"kind": "line-up", "carts": 3}, "learner": learner,
    }  # fmt: skip
    study = na.run(spec, tmp_path / "out", jobs=2, progress=False)
    assert len(log.read_text().splitlines()) == 2 * 8 * 3
    assert study.episodes["tokens"].sum() == 7 * 48
    again = na.run(spec, tmp_path / "again", jobs=1, progress=False)
    assert len(log.read_text().splitlines()) == 48
    assert again.episodes.equals(study.episodes)


def test_an_async_function_without_the_decorator_is_refused(tmp_path: Path):
    (tmp_path / "g.py").write_text("async def decide(observation): return 0\n")
    spec = {"scenario": {"kind": "line-up"}, "learner": {"kind": str(tmp_path / "g.py:decide")}}
    with pytest.raises(na.SpecError, match=r"the function is async; decorate it with slow_calls"):
        na.run(spec, tmp_path / "out", jobs=1, progress=False)
