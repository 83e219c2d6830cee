"""Which evaluator a team gets, by its size and by what is expected of teammates."""

import numpy as np
import pytest
from acting import fuzzy

from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.learners.td import FrozenSettings
from nested_agents.core.search.best_response import BestResponse
from nested_agents.core.search.enumeration import ExactEnumeration, Sampling
from nested_agents.core.search.settings import DecisionSettings


@pytest.mark.parametrize("teammates", ["best-response", "uniform"])
@pytest.mark.parametrize("carts", [2, 5, 8])
def test_auto_goes_by_size(carts: int, teammates: str, line_world) -> None:
    world = line_world(carts, 2)
    chain = Hierarchy(world.agents, list(zip(world.agents, world.agents[1:], strict=False)))
    decision = DecisionSettings(teammates=teammates)
    team = Team(FrozenSettings(decision=decision), world, chain, np.random.SeedSequence(1))
    many = BestResponse if teammates == "best-response" else Sampling
    assert type(fuzzy(team).evaluator) is {2: ExactEnumeration, 5: Sampling, 8: many}[carts]


@pytest.mark.parametrize("name", ["moments", "extremes"])
def test_evaluators_that_are_gone_are_refused_in_one_line(name: str) -> None:
    with pytest.raises(ValueError, match=rf"evaluator = '{name}'.*known: ") as refused:
        DecisionSettings(evaluator=name)
    assert "\n" not in str(refused.value)
