"""How wrong a learned predictor is, variable by variable, beside persistence and the given one."""

from typing import Any

import numpy as np
import pandas as pd

from ...core.adaptation.learned_predictor import LearnedPredictor
from ...core.agents.loop import world_seed
from ...core.agents.team import Team
from ...scenarios.checking.predictions import apart
from ..trials.session import EVALUATION_WORLDS

EPISODES, DECISIONS = 10, 30
"""What is played: worlds of the evaluation, and predictions of each."""


def errors_of(team: Team, scenario: Any, seed: int) -> pd.DataFrame | None:
    """Return root mean square errors by variable, or None if nothing is predicted by experience.

    The team acts by what it has learned. Each decision is held for as long as predictions look
    ahead. The given predictor stands beside, if there is one that looks as far.

    Parameters
    ----------
    team, scenario
        Trained; both are modified.
    seed
        Of the trial.
    """
    predictor = team.predictor
    if not isinstance(predictor, LearnedPredictor):
        return None
    horizon, neutral = predictor.horizon, scenario.action_set.neutral
    given = hasattr(scenario, "predict") and getattr(scenario, "horizon", 1) == horizon
    errors: dict[str, list[Any]] = {
        "learned": [],
        "as it is": [],
        **({"given": []} if given else {}),
    }
    for episode in range(EVALUATION_WORLDS, EVALUATION_WORLDS + EPISODES):
        world = world_seed(seed, episode)
        states, over = scenario.reset(world, episode), False
        team.begin_world(world, episode)
        for _ in range(DECISIONS):
            prediction = team.predict(scenario, states)
            joint = team.act(prediction, explore=False)
            guesses = {"as it is": states, "learned": _states(prediction, joint)}
            if given:
                guesses["given"] = _states(scenario.predict(), joint)
            held = np.full_like(joint, neutral) if scenario.state_space.n_own else joint
            for action in [joint, *[held] * (horizon - 1)]:
                transition = scenario.step(action)
                over = transition.terminated or transition.truncated
                if over:
                    break
            states = np.array(transition.states)
            if over:
                break
            for name in errors:
                errors[name].append(apart(scenario, states, guesses[name]))
    index = [variable.name for variable in scenario.state_space.variables]
    roots = {name: np.sqrt(np.square(e).mean(axis=(0, 1))) for name, e in errors.items() if e}
    return pd.DataFrame(roots, index=index)


def _states(prediction: Any, joint_action: Any) -> Any:
    """Return the states ``(n, d)`` that a joint action is predicted to lead to."""
    each = range(len(joint_action))
    return np.array([prediction.states(i, joint_action[None])[0] for i in each])
