"""Explains a trained team: its functions with their rules in words, its policy, its self-model.

A study keeps its trained teams if its spec says so. Else, a trial being a pure function of its
content, its training is run again, in seconds, and held against the episodes that are kept. Either
way the team explained is the team that was measured, or nothing is explained.
"""

import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from rich.console import Console
from rich.progress import track

from ...core.adaptation.learned_predictor import LearnedPredictor
from ...core.adaptation.self_model import SelfModel
from ...core.agents.loop import world_seed
from ...core.agents.team import Team, of_fuzzy_agents
from ...core.interface.scenario import Scenario
from ...core.interface.spaces import Variable
from ...core.numerics import FloatArray
from ...core.rules.rule_base import RuleBase
from ...scenarios.checking.predictions import apart
from ..errors import SpecError, refused
from ..store.durable import TEAM
from ..store.schema import STAGE, columns
from ..store.store import Store
from ..trials.session import EVALUATION_WORLDS, Session
from ..trials.trial import Trial
from . import rules as explain_rules
from .rules import Parts

Effects = tuple[FloatArray, ...]


@dataclass
class Bodies:
    """What the bodies were believed to be at some moments."""

    moments: dict[str, Effects]
    """Effects of all bodies by moment: ``built``, perhaps ``before`` the first failure, ``after``
    all training."""
    deviations: Effects
    """Standard deviations of the last of them, as the self-model has them."""

    def note(self, moment: str, model: SelfModel) -> None:
        """Note what is believed now."""
        self.moments[moment] = tuple(effect.copy() for effect in model.effects)
        self.deviations = model.deviations


@dataclass(frozen=True)
class Explanation:
    """What is known of a trained team."""

    trial: Trial
    """The trial that it was trained in."""
    agents: tuple[str, ...]
    """Its agents, by name."""
    actuators: tuple[str, ...]
    """What moves the bodies, by name; mostly the agents themselves."""
    rules: RuleBase
    """The rule base that all of them have."""
    variables: tuple[Variable, ...]
    """Its state variables."""
    parts: tuple[Parts, ...]
    """What each agent's f consists of."""
    policy: Any
    """What its scenario shows of what it does: text by ``lines()``, a drawing by ``figure()``; or
    why there is none."""
    bodies: Bodies | None
    """What bodies believed their actuators to do; none: they have no self-model."""
    errors: pd.DataFrame | None
    """By how much predictions are wrong, see `errors_of`; none: the team has not learned them."""


def explain(store: Store, trial: Trial) -> Explanation:
    """Explain the team of a trial: the one that is kept, else it is trained again.

    Raises
    ------
    SpecError
        If the trial cannot be built, its team cannot be read, or an episode of the training is not,
        to the last bit, the one that is kept.
    """
    with trial.sources.active():
        team, scenario, bodies = _trained(store, trial)
        taken = [explain_rules.take_apart(team.rules, theta) for theta in team.learner.theta]
        return Explanation(
            trial=trial,
            agents=scenario.agents,
            actuators=trial.settings.scenario.build().agents,
            rules=team.rules,
            variables=team.space.variables,
            parts=tuple(taken[row] for row in team.rows),
            policy=_policy(trial, team, scenario),
            bodies=bodies,
            errors=errors_of(team, scenario, trial.seed),
        )


def _policy(trial: Trial, team: Team, scenario: Any) -> Any:
    """Return what a scenario shows of what a team does, or why it does not."""
    if not hasattr(scenario, "show_policy"):
        return "the scenario has no method show_policy for agents such as these"
    if team.evaluator is None:
        return "actions are drawn at random"
    if not trial.settings.learner.needs_prediction:
        return "the agents value their actions where they are, and predict nothing elsewhere"
    try:
        return scenario.show_policy(team)
    except ValueError as error:
        return str(error)


def _trained(store: Store, trial: Trial) -> tuple[Team, Scenario, Bodies | None]:
    arrays = store.recording(trial.identity, TEAM) if trial.keep_teams else None
    with refused(f"{store.directory}: "):  # a file that settings name may not be what it was
        session = Session(trial)
        team = of_fuzzy_agents(session.team)
    model, bodies = team.self_model, None
    if model is not None:
        bodies = Bodies({}, ())
        bodies.note("built", model)
    if arrays is None:
        _train(store, session, bodies)
    else:
        team.restore(arrays)
    if bodies and model:
        bodies.note("after", model)
    return team, session.scenario, bodies


def _train(store: Store, session: Session, bodies: Bodies | None) -> None:
    trial, model = session.trial, of_fuzzy_agents(session.team).self_model
    episodes = track(
        range(trial.episodes),
        f"training {trial.condition}, seed {trial.seed} again",
        console=Console(stderr=True),
        transient=True,
        disable=not sys.stderr.isatty(),
    )
    for episode in episodes:
        if bodies and model and episode == trial.settings.scenario.onset and episode > 0:
            bodies.note("before", model)
        session.train(1, episode)
    measured = [measure.name for measure in store.measures()]
    kept = _kept(store, trial)
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


def _kept(store: Store, trial: Trial) -> list[tuple[object, ...]]:
    """Return the training episodes of a trial as they are kept, those of a curriculum first."""
    names, every = store.episodes()
    at = [names.index(name) for name in columns(store.measures())]
    condition, seed, phase = (names.index(name) for name in ("condition", "seed", "phase"))
    own = (row for row in every if (row[condition], row[seed]) == (trial.condition, trial.seed))
    trained = (row for row in own if row[phase] == "training" or row[phase].startswith(STAGE))
    return [tuple(row[i] for i in at) for row in trained]


def folder_of(directory: Path, trial: Trial, conditions: Sequence[str]) -> Path:
    """Return where the explanation of a trial is kept: one folder for each condition and seed."""
    names = [re.sub(r"[^\w.=+-]+", "-", c)[:60].strip("-.") for c in conditions]
    at = list(conditions).index(trial.condition)
    name = names[at] if names.count(names[at]) == 1 and names[at] else f"condition{at + 1}"
    return directory / "explain" / f"{name}-seed{trial.seed}"


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
