"""Levers: what agents did is part of their state, by which Q-learning learns."""

from pathlib import Path

import numpy as np
import pytest

from nested_agents.studies.cli.main import main
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import run_trial
from nested_agents.studies.trials.trial import trials_of

KIND = f"{Path(__file__).resolve().parents[3] / 'examples/worlds/levers.py'}:Levers"


def test_it_keeps_its_promises(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", KIND]) == 0
    assert "passed  Levers" in capsys.readouterr().out


@pytest.mark.parametrize(("order", "least"), [("full", 0.95), (1, 0.0)])
def test_q_learning_pulls_what_is_lit(order: int | str, least: float) -> None:
    table = {
        "preset": "own-value",
        "seeds": [1],
        "episodes": 10,
        "steps": 60,
        "evaluation": 3,
        "scenario": {"kind": KIND},
        "topology": "independent",
        "learner": {"kind": "q-learning", "discount": 0.0, "rule_base": {"order": order}},
    }
    (trial,) = trials_of(Spec.of(table))
    rows = [row for row in run_trial(trial).rows if row.phase == "evaluation"]
    rewards = [row.measures["reward"] for row in rows]
    assert (np.mean(rewards) > 0.9) == (least > 0), "a sum of levers and lights cannot tell"
