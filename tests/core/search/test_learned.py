"""What agents have learned is looked at once a decision, however many agents and joint actions."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest
from acting import look

from nested_agents.core.agents import fuzzy
from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.learners import LEARNERS


class Watched(Sequence[np.ndarray]):
    """The weights of agents, and whose were looked at."""

    def __init__(self, weights: Sequence[np.ndarray]) -> None:
        self.weights = weights
        self.looked_at: list[int] = []

    def __len__(self) -> int:
        return len(self.weights)

    def __getitem__(self, agent):
        self.looked_at.append(int(agent))
        return self.weights[agent]


@pytest.fixture
def watched(monkeypatch: pytest.MonkeyPatch) -> list[Watched]:
    """The weights by which each decision was made, first to last."""
    decisions: list[Watched] = []
    read = fuzzy.weights_by_agent

    def watch(rows, theta) -> Watched:
        decisions.append(Watched(read(rows, theta)))
        return decisions[-1]

    monkeypatch.setattr(fuzzy, "weights_by_agent", watch)
    return decisions


def chain_of_six(world, evaluator: str, value_of: str) -> Team:
    """A chain whose evaluator is asked agent by agent."""
    decision = {"evaluator": {"kind": evaluator}, "value_of": value_of}
    table = {"kind": "td-lambda", "decision": decision}
    settings = LEARNERS.model("td-lambda").model_validate(table)
    hierarchy = Hierarchy(world.agents, list(pairwise(world.agents)))
    return Team(settings, world, hierarchy, np.random.SeedSequence(1))


@pytest.mark.parametrize("evaluator", ["exact", "sampling", "best-response"])
def test_what_has_been_learned_is_pooled_once(evaluator, line_world, watched) -> None:
    world = line_world(carts=3, wheels=2)
    world.reset(3)
    team = chain_of_six(world, evaluator, "team")
    arrays = team.state_dict()
    team.load_state_dict({**arrays, "learner.theta": np.ones_like(arrays["learner.theta"])})
    for _ in range(2):
        team.act(look(world, world.present()))
    # Each agent sees once that something has been learned; weights are pooled once a decision.
    assert [sorted(weights.looked_at) for weights in watched] == [
        sorted([*[0] * 6, *range(6)]), [*range(6)],
    ]  # fmt: skip
