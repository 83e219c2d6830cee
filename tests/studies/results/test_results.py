"""Numbers of whole trials and phases of a study's own, from the store to arrays."""

from dataclasses import replace
from pathlib import Path

import made_up
from made_up import MEASURES, SPEC, TRIALS, measure

from nested_agents.studies.results.results import read
from nested_agents.studies.workers.runner import save


def test_phases_numbers_and_usage_are_read_by_condition(tmp_path: Path) -> None:
    with made_up.opened(tmp_path / "study", SPEC, MEASURES) as store:
        for trial in TRIALS[:-1]:
            result = measure(trial)
            further = tuple(
                r._replace(phase="evaluation:circle") for r in result.rows if r.phase != "training"
            )
            result = replace(
                result,
                rows=(*result.rows, *further),
                numbers={"messages": 6.0 + trial.seed},
                usage={"peak_bytes": 10.0 * trial.seed},
            )
            save(store, trial, result, 2.0)
        results = read(store)
    assert {c: results.seeds(c) for c in results.conditions} == {
        "default": (0, 1, 2), "frozen": (0, 1),
    }  # fmt: skip
    assert results.phases == ("training", "evaluation", "evaluation:circle")
    assert results.other_evaluations("default") == {"circle": "evaluation:circle"}
    circle = results.success("default", "evaluation:circle")
    assert (circle == results.success("default", "evaluation")).all()
    assert results.numbers("default")["messages"].tolist() == [6.0, 7.0, 8.0]
    assert results.numbers("frozen")["peak_bytes"].tolist() == [0.0, 10.0]
    assert results.numbers("frozen")["seconds.total"].tolist() == [2.0, 2.0]
    assert len(results.numbers("default")["seconds.decision"]) == 3
    assert "peak_bytes" in results.usage
    assert "messages" not in results.usage
