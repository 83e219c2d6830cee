"""Explanation of a trained team: its value functions, policy and self-model.

A study keeps its trained teams if its spec says so. Otherwise the training is repeated and compared
with the kept episodes. Either way, the explained team is the one that was measured.

The value function f of an agent is decomposed by the analysis of variance (Hoeffding 1948), with
all rules equally likely, into a constant, functions of one variable with mean zero, and
interactions::

    f(x) = c + sum_j g_j(x_j) + the rest

A rule base of order 1 has no rest. Of one of order d the functions of one variable are marginals:
the mean over the rules of all other variables. The *share* of a part is its share of the variance
of f, all rules being equally likely; which rules were ever visited it does not know.
"""

import re
import sys
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from math import degrees
from pathlib import Path

import numpy as np
import pandas as pd
from rich.console import Console
from rich.markup import escape
from rich.progress import track

from ...core.agents.fuzzy import FuzzyAgents
from ...core.agents.loop import world_seed
from ...core.agents.team import Team
from ...core.interface.experience import Observation
from ...core.interface.prediction import Prediction
from ...core.interface.scenario import PolicyMap, Scenario
from ...core.interface.spaces import Variable
from ...core.models.learned_predictor import LearnedPredictor
from ...core.models.self_model import SelfModel
from ...core.numerics import FloatArray, IntArray
from ...core.plugins.printing import printable
from ...core.values.partitions import Partition
from ...core.values.rule_base import RuleBase
from ...scenarios.checking.predictions import state_differences
from ..errors import WIDTH, SpecError, refused
from ..store.database import STAGE, columns
from ..store.durable import TEAM
from ..store.store import Store
from ..trials.session import EVALUATION_WORLDS, Session
from ..trials.trial import Trial

WORDS = {
    2: ("low", "high"),
    3: ("low", "medium", "high"),
    5: ("very low", "low", "medium", "high", "very high"),
}
"""Words for the membership functions of variables without labels."""


@dataclass(frozen=True)
class Parts:
    """Decomposition of the value function f of one agent."""

    constant: float
    """Mean of all rules."""
    singles: tuple[FloatArray, ...]
    """``(m_j,)`` consequents of every variable j, of mean zero: g_j at the centres."""
    variance: float
    """Variance over all rules."""

    def share(self, consequents: FloatArray) -> float:
        """Return the share of the variance that consequents of mean zero have."""
        return float((consequents**2).mean()) / self.variance if self.variance > 0 else 0.0

    @property
    def rest(self) -> float:
        """Share of what several variables do together."""
        return max(0.0, 1.0 - sum(map(self.share, self.singles))) if self.variance > 0 else 0.0


def take_apart(rules: RuleBase, theta: FloatArray) -> Parts:
    """Return the parts of f for one agent's consequent weights ``(n_rules,)``.

    Examples
    --------
    Two variables with LOW and HIGH: the rule HIGH, HIGH pays, no other.

    >>> base = RuleBase([Partition((0.0, 1.0), "triangular")] * 2, [(0, 1)])
    >>> parts = take_apart(base, np.array([0.0, 0.0, 0.0, 4.0]))
    >>> parts.constant, parts.singles[0].tolist(), round(parts.rest, 2)
    (1.0, [-1.0, 1.0], 0.33)
    """
    sizes = [partition.size for partition in rules.partitions]
    weights = np.split(np.asarray(theta, dtype=float), np.cumsum(rules.sizes)[:-1])
    of_terms = zip(rules.terms, weights, strict=True)
    tensors = [(term, own.reshape([sizes[j] for j in term])) for term, own in of_terms]
    singles: list[FloatArray] = [np.zeros(size) for size in sizes]
    for term, tensor in tensors:
        for j in term:
            singles[j] += _onto(tensor, term, (j,)) - tensor.mean()
    constant = float(sum(tensor.mean() for _, tensor in tensors))
    return Parts(constant, tuple(singles), _variance(tensors))


def _onto(tensor: FloatArray, term: Sequence[int], kept: Sequence[int]) -> FloatArray:
    """Return the mean over all variables of a term but some."""
    return np.asarray(tensor.mean(axis=tuple(i for i, j in enumerate(term) if j not in kept)))


def _variance(tensors: Sequence[tuple[tuple[int, ...], FloatArray]]) -> float:
    """Return the variance of a sum of terms: terms covary in what their variables in common do."""
    total = 0.0
    for (term, tensor), (other, second) in combinations_with_replacement(tensors, 2):
        if common := [j for j in term if j in other]:
            first = _onto(tensor, term, common) - tensor.mean()
            covariance = (first * (_onto(second, other, common) - second.mean())).mean()
            total += float(covariance) * (1.0 if other == term else 2.0)
    return total


def labels(variable: Variable, partition: Partition) -> tuple[str, ...]:
    """Return words for the membership functions of a variable.

    Its own words if the partition is its own; else by rank, or by the centre on a circle.

    Examples
    --------
    >>> gap = Variable("gap", "m", 0.0, 1.0)
    >>> labels(gap, Partition.of(gap))
    ('very low', 'low', 'medium', 'high', 'very high')
    """
    if variable.labels and variable.centres == partition.centres:
        return variable.labels
    if not variable.periodic and partition.size in WORDS:
        return WORDS[partition.size]
    return tuple(f"about {place(variable, centre)}" for centre in partition.centres)


def place(variable: Variable, value: float) -> str:
    """Return a value of a variable with its unit; angles in degrees.

    >>> place(Variable("turn", "rad", -3.2, 3.2), 0.5), place(Variable("gap", "m", 0, 1), 0.015)
    ('29°', '0.015 m')
    """
    if variable.unit == "rad":
        return f"{degrees(value):.0f}°"
    return f"{value:.3g}" + (f" {variable.unit}" if variable.unit != "1" else "")


def rules_table(
    rules: RuleBase, variables: Sequence[Variable], agents: Sequence[str], parts: Sequence[Parts]
) -> str:
    """Return the rules of some agents in words, a column of consequents for each agent.

    Variables come in the order of their mean share.
    """
    power = exponent(parts)
    lines = list[tuple[str, ...]]()
    for j in mean_shares(parts):
        variable = variables[j]
        partition = rules.partitions[j]
        shares = [percent(p.share(p.singles[j])) for p in parts]
        lines.append((f"{variable.name}, share of the variance", *shares))
        words = zip(labels(variable, partition), partition.centres, strict=True)
        for k, (word, centre) in enumerate(words):
            consequents = (f"{p.singles[j][k] * 10**power:+.2f}" for p in parts)
            rule = f"IF {variable.name} is {word}, {place(variable, centre)}:"
            lines.append((rule, *consequents))
        lines.append(("", *[""] * len(parts)))
    names, *columns = zip(*lines, strict=True)
    heads: pd.Index = pd.Index(agents)
    if any("." in name for name in agents):
        heads = pd.MultiIndex.from_tuples([name.rpartition(".")[::2] for name in agents])
    frame = pd.DataFrame(list(zip(*columns, strict=True)), index=names, columns=heads)
    return frame.to_string(line_width=WIDTH, sparsify=False).replace("  \\\n", "\n")


def mean_shares(parts: Sequence[Parts]) -> dict[int, float]:
    """Return the share of each variable, mean over agents, in the order of these means."""
    shares = np.mean([list(map(p.share, p.singles)) for p in parts], axis=0)
    return {int(j): float(shares[j]) for j in np.argsort(-shares, kind="stable")}


def percent(share: float) -> str:
    """Return a share in whole percents.

    >>> percent(0.254), percent(0.0004), percent(0.0)
    ('25%', '<1%', '0%')
    """
    return "<1%" if 0 < share < 0.005 else f"{share:.0%}"


def exponent(parts: Sequence[Parts]) -> int:
    """Return the power of ten by which consequents are multiplied to be read in two decimals.

    The greatest then lies between 1 and 10.
    """
    greatest = max((float(np.abs(g).max()) for p in parts for g in p.singles), default=0.0)
    return -int(np.floor(np.log10(greatest))) if greatest > 0 else 0


Effects = tuple[FloatArray, ...]


@dataclass
class BodyEffects:
    """Effects of actuators as the self-model estimated them at some moments."""

    moments: dict[str, Effects]
    """Effects of all bodies by moment: ``built``, perhaps ``before`` the first failure, ``after``
    all training."""
    deviations: Effects
    """Standard deviations of the last of them, as the self-model has them."""

    def note(self, moment: str, model: SelfModel) -> None:
        """Record the present estimates."""
        self.moments[moment] = tuple(effect.copy() for effect in model.effects)
        self.deviations = model.deviations


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
    bodies: BodyEffects | None
    """Estimates of the self-model; None without one."""
    errors: pd.DataFrame | None
    """Errors of the learned predictor, see `errors_of`; None without one."""


def explain(store: Store, trial: Trial) -> Explanation:
    """Explain the team of a trial: the one that is kept, else it is trained again.

    Raises
    ------
    SpecError
        If the trial cannot be built, its team cannot be read, or an episode of the training is not,
        to the last bit, the one that is kept.
    """
    with trial.sources.active():
        session, bodies = _load_team(store, trial)
        agents = session.team.only(FuzzyAgents)
        taken = [take_apart(agents.rules, theta) for theta in agents.learner.theta]
        return Explanation(
            trial=trial,
            agents=session.scenario.agents,
            actuators=session.world.agents,
            rules=agents.rules,
            variables=agents.space.variables,
            parts=tuple(taken[row] for row in agents.rows),
            policy=_policy(session),
            bodies=bodies,
            errors=errors_of(session.team, session.scenario, trial.seed),
        )


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
        seen = Observation(nowhere, scenario, imagined=prediction)
        return session.team.act(seen, explore=False).joint_action

    def predict() -> Prediction | None:
        return agents.model.predict(Observation(nowhere, scenario))

    try:
        policy = scenario.show_policy(choose, predict)
    except ValueError as error:
        return str(error)
    return policy or "the scenario has no method show_policy for agents such as these"


def _load_team(store: Store, trial: Trial) -> tuple[Session, BodyEffects | None]:
    """Return a session with the team of a trial, and what its bodies were believed to be."""
    arrays = store.recording(trial.identity, TEAM) if trial.keep_teams else None
    with refused(f"{store.directory}: "):  # a file that settings name may not be what it was
        session = Session(trial)
        if not all(isinstance(part, FuzzyAgents) for part in session.team.parts):
            kind = trial.settings.learner.kind
            raise ValueError(f"learner.kind = {kind!r}: explain needs agents with rule bases")
        model = session.team.only(FuzzyAgents).model.self_model
    bodies = BodyEffects({}, ())
    if model:
        bodies.note("built", model)
    if arrays is None:
        _train(store, session, bodies)
    else:
        session.team.load_state_dict(arrays)
    if model:
        bodies.note("after", model)
    return session, bodies if model else None


def _train(store: Store, session: Session, bodies: BodyEffects) -> None:
    trial = session.trial
    model = session.team.only(FuzzyAgents).model.self_model
    if trial.decisions is not None:
        session.train_until(trial.decisions)
    episodes = track(
        range(trial.episodes if trial.decisions is None else 0),
        escape(printable(f"training {trial.condition}, seed {trial.seed} again")),
        console=Console(stderr=True),
        transient=True,
        disable=not sys.stderr.isatty(),
    )
    for episode in episodes:
        if model and episode == trial.settings.scenario.onset and episode > 0:
            bodies.note("before", model)
        session.train(1, episode)
    measured = [measure.name for measure in store.measures()]
    former = _kept_rows(store, trial)
    again = [row.flat(measured) for row in session.result().rows]
    if former != again:
        pairs = zip(former, again, strict=False)
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
    predictor = agents.model.predictor if isinstance(agents, FuzzyAgents) else None
    if not isinstance(predictor, LearnedPredictor):
        return None
    horizon = predictor.horizon
    errors: defaultdict[str, list[FloatArray]] = defaultdict(list)
    for episode in range(EVALUATION_WORLDS, EVALUATION_WORLDS + EPISODES):
        world = world_seed(seed, episode)
        states = scenario.reset(world, episode)
        team.reset(world, episode)
        for _ in range(DECISIONS):
            joint = team.act(Observation(states, scenario), explore=False).joint_action
            guesses = {"learned": _states(predictor.predict(states), joint), "persistence": states}
            given = scenario.predict() if scenario.horizon == horizon else None
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
