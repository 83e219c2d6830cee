"""A trained team, explained in numbers: its value functions, policy and self-model.

A study keeps its trained teams if its spec says so. Otherwise the training is repeated and compared
with the kept episodes. Either way, the explained team is the one that was measured.
"""

import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from ...core.agents.fuzzy import FuzzyAgents
from ...core.agents.loop import world_seed
from ...core.agents.team import Team
from ...core.interface.abilities import PolicyMap, ShowsPolicy, horizon_of
from ...core.interface.experience import Observation
from ...core.interface.prediction import Prediction
from ...core.interface.scenario import Scenario
from ...core.interface.spaces import Variable
from ...core.models.learned_predictor import LearnedPredictor
from ...core.models.pose_model import PoseModel
from ...core.numerics import FloatArray, IntArray
from ...core.values.rule_base import RuleBase
from ...scenarios.checking.predictions import state_differences
from ..errors import SpecError, refused
from ..store.database import STAGE, columns
from ..store.durable import TEAM
from ..store.store import Store
from ..trials.session import EVALUATION_WORLDS, Session
from ..trials.trial import Trial
from .functions import Parts, decompose


class WheelEffects(NamedTuple):
    """Effects of the actuators of one body ``(3, w + 1)`` in its self-model."""

    nominal: FloatArray
    """Effects of its geometry, before training."""
    learned: FloatArray
    """Effects after training."""
    deviations: FloatArray
    """Standard deviations of the learned effects."""


@dataclass(frozen=True)
class Explanation:
    """Explanation of a trained team as numbers."""

    trial: Trial
    """Trial of the team."""
    agents: tuple[str, ...]
    """Names of the agents."""
    actuators: tuple[str, ...]
    """Names of the actuators, which usually are the agents."""
    rules: RuleBase
    """Rule base of all agents."""
    variables: tuple[Variable, ...]
    """State variables of the rule base."""
    parts: tuple[Parts, ...]
    """Decomposition of the value function of each agent."""
    policy: PolicyMap | str
    """Policy map of the scenario with ``lines()`` and ``figure()``, or the reason why there is
    none."""
    effects: tuple[WheelEffects, ...]
    """Effects by body as the self-model estimates them; empty without one."""
    errors: pd.DataFrame | None
    """Errors of the learned predictor, see `errors_of`; None without one."""

    @property
    def roles(self) -> dict[str, Parts]:
        """Value functions by the agents that share them, such as ``"agent1 = agent2"``."""
        names: dict[bytes, list[str]] = {}
        for name, part in zip(self.agents, self.parts, strict=True):
            names.setdefault(np.concatenate(part.singles).tobytes(), []).append(name)
        return {" = ".join(own): self.parts[self.agents.index(own[0])] for own in names.values()}


def explain(store: Store, trial: Trial) -> Explanation:
    """Explain the team of a trial: the one that is kept, else it is trained again.

    Raises
    ------
    SpecError
        If the trial cannot be built, its team cannot be read, or an episode of the training is not,
        to the last bit, the one that is kept.
    """
    arrays = store.recording(trial.identity, TEAM) if trial.keep_teams else None
    with trial.sources.active():
        with refused(f"{store.directory}: "):  # a file that settings name may not be what it was
            session = Session(trial)
            if not all(isinstance(part, FuzzyAgents) for part in session.team.parts):
                kind = trial.settings.learner.kind
                raise ValueError(f"learner.kind = {kind!r}: explain needs agents with rule bases")
        agents = session.team.only(FuzzyAgents)
        model = agents.model.self_model
        nominal = [effect.copy() for effect in model.effects] if model else []
        if arrays is None:
            _train(store, session)
        else:
            session.team.load_state_dict(arrays)
        effects = zip(nominal, model.effects, model.deviations, strict=True) if model else ()
        taken = [decompose(agents.rules, theta) for theta in agents.learner.theta]
        return Explanation(
            trial=trial,
            agents=session.scenario.agents,
            actuators=session.world.agents,
            rules=agents.rules,
            variables=agents.space.variables,
            parts=tuple(taken[row] for row in agents.rows),
            policy=_policy(session),
            effects=tuple(WheelEffects(*own) for own in effects),
            errors=errors_of(session.team, session.scenario, trial.seed),
        )


def _train(store: Store, session: Session) -> None:
    """Repeat the training of a trial; refuse a team that differs from the measured one."""
    trial = session.trial
    if trial.decisions is not None:
        session.train_until(trial.decisions)
    else:
        session.train(trial.episodes)
    measured = [measure.name for measure in store.measures()]
    kept = _kept_rows(store, trial)
    again = [row.flat(measured) for row in session.result().rows]
    if kept != again:
        pairs = zip(kept, again, strict=False)
        other = next((ours for theirs, ours in pairs if theirs != ours), again[-1])
        stage = "" if other[0] == "training" else f" of {other[0]}"
        raise SpecError(
            f"{store.directory}: training {trial.condition}, seed {trial.seed} again gives another "
            f"episode {other[1]}{stage} than the one that is kept; this is not the software, or "
            "not the kind of machine, that ran the study"
        )


def _kept_rows(store: Store, trial: Trial) -> list[tuple[object, ...]]:
    """Return the training episodes of a trial as they are kept, those of a curriculum first."""
    names, every = store.episodes()
    at = [names.index(name) for name in columns(store.measures())]
    condition, seed, phase = (names.index(name) for name in ("condition", "seed", "phase"))
    own = (row for row in every if (row[condition], row[seed]) == (trial.condition, trial.seed))
    trained = (row for row in own if row[phase] == "training" or str(row[phase]).startswith(STAGE))
    return [tuple(row[i] for i in at) for row in trained]


def _policy(session: Session) -> PolicyMap | str:
    """Return what a scenario shows of what a team does, or why it does not."""
    agents = session.team.only(FuzzyAgents)
    scenario = session.scenario
    if agents.evaluator is None:
        return "actions are drawn at random"
    if not session.trial.settings.learner.needs_prediction:
        return "the agents value their actions where they are, and predict nothing elsewhere"
    nowhere: FloatArray = np.zeros((len(scenario.agents), scenario.state_space.n_variables))

    def choose(prediction: Prediction) -> IntArray:
        return session.team.act(Observation(nowhere, prediction), explore=False).joint_action

    def predict() -> Prediction:
        return agents.model.predict(session.team.observe(scenario, nowhere))

    if not isinstance(scenario, ShowsPolicy):
        return "the scenario has no method show_policy for agents such as these"
    try:
        return scenario.show_policy(choose, predict)
    except ValueError as error:
        return str(error)


def folder_of(directory: Path, trial: Trial, conditions: Sequence[str]) -> Path:
    """Return where the explanation of a trial is kept: one folder for each condition and seed."""
    names = [re.sub(r"[^\w.=+-]+", "-", c)[:60].strip("-.") for c in conditions]
    at = list(conditions).index(trial.condition)
    name = names[at] if names.count(names[at]) == 1 and names[at] else f"condition{at + 1}"
    return directory / "explain" / f"{name}-seed{trial.seed}"


EPISODES = 10
"""Worlds of the evaluation that are played."""
DECISIONS = 30
"""Predictions that are made in each."""


def errors_of(team: Team, scenario: Scenario, seed: int) -> pd.DataFrame | None:
    """Return root mean square errors by variable, or None if nothing is predicted by experience.

    The team acts by what it has learned. Each decision is held for as long as predictions look
    ahead. The given predictor is compared if it has the same horizon.

    Parameters
    ----------
    team, scenario
        Trained; both are modified.
    seed
        Of the trial.
    """
    agents = team.parts[0]
    model = agents.model if isinstance(agents, FuzzyAgents) else None
    if model is None or not isinstance(model.predictor, LearnedPredictor | PoseModel):
        return None
    horizon = model.predictor.horizon
    errors: defaultdict[str, list[FloatArray]] = defaultdict(list)
    for episode in range(EVALUATION_WORLDS, EVALUATION_WORLDS + EPISODES):
        world = world_seed(seed, episode)
        states = scenario.reset(world, episode)
        team.reset(world, episode)
        for _ in range(DECISIONS):
            seen = team.observe(scenario, states)
            joint = team.act(seen, explore=False).joint_action
            learned = _states(model.predict(seen), joint)
            guesses = {"learned": learned, "persistence": states}
            given = scenario.predict() if horizon_of(scenario) == horizon else None
            if given is not None:
                guesses["given"] = _states(given, joint)
            reached = _held(scenario, joint, horizon)
            if reached is None:
                break
            states = reached
            for name, guess in guesses.items():
                errors[name].append(state_differences(scenario, states, guess))
    index = [variable.name for variable in scenario.state_space.variables]
    roots = {name: np.sqrt(np.square(e).mean(axis=(0, 1))) for name, e in errors.items()}
    return pd.DataFrame(roots, index=index)


def _held(scenario: Scenario, joint_action: IntArray, horizon: int) -> FloatArray | None:
    """Return the states after a joint action and as long as it lasts; None if the episode ends."""
    after = joint_action
    if scenario.state_space.n_own:
        after = np.full_like(joint_action, scenario.action_set.neutral)
    for action in [joint_action, *[after] * (horizon - 1)]:
        transition = scenario.step(action)
        if transition.terminated or transition.truncated:
            return None
    return np.array(transition.states)


def _states(prediction: Prediction, joint_action: IntArray) -> FloatArray:
    """Return the states ``(n, d)`` that a joint action is predicted to lead to."""
    each = range(len(joint_action))
    return np.array([prediction.states(i, joint_action[None])[0] for i in each])
