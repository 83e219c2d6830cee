"""How tests let a team decide and learn outside of the control loop."""

from typing import Any

import numpy as np

from nested_agents.core.agents.fuzzy import FuzzyAgents
from nested_agents.core.agents.team import Team
from nested_agents.core.interface.experience import Decision, Experience, Observation
from nested_agents.core.interface.prediction import Prediction
from nested_agents.core.interface.scenario import Transition, checked_scenario, prediction_of


def fuzzy(team: Team) -> FuzzyAgents:
    """The fuzzy agents that a team is made of."""
    return team.only(FuzzyAgents)


def look(
    world: Any,
    states: Any = None,
    prediction: Prediction | None = None,
    previous: Any = None,
) -> Observation:
    """What is seen in a world; without states, those of nobody."""
    scenario = checked_scenario(world)
    if states is None:
        states = np.zeros((len(scenario.agents), scenario.state_space.n_variables))
    return Observation(states, prediction or prediction_of(scenario), previous)


def joint_of(team: Team, world: Any, states: Any = None, *, explore: bool = True, **more: Any):
    """The joint action that a team takes."""
    return team.act(look(world, states, **more), explore=explore).joint_action


def experience(
    team: Team, world: Any, transition: Transition, decision: Decision | None = None, **more: Any
) -> Experience:
    """What a decision led to; without one, that of a team that sees nothing."""
    seen = look(world)
    return Experience(seen, decision or team.act(seen), transition, more.get("last", False))
