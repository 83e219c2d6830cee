"""A team: a hierarchy of agents that decide together and learn each on its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from inspect import signature
from pathlib import Path
from typing import Any, cast

import numpy as np

from ..adaptation.predictors import GivenPredictor, Mirror
from ..adaptation.self_model import Calibration, SelfModel
from ..decision.exploration import Explorer
from ..evaluators.evaluator import NOTHING_GIVEN, DecisionProblem, Deliberation, Evaluator
from ..hierarchy.failures import MessageFailure, Messages
from ..hierarchy.hierarchy import Hierarchy
from ..interface.prediction import NOT_EXPLORING, Prediction
from ..interface.scenario import Actors, EmbodiedScenario, Scenario, Transition, rows_of
from ..learners import check_prediction
from ..learners.learner import Learner, LearnerSettings
from ..numerics import FloatArray, IntArray, greatest, set_words, words_of


class Team:
    """Agents in a hierarchy, one rule base each; consequent weights are an agent's own or a role's.

    Parameters
    ----------
    settings
        How the agents explore, decide and learn.
    scenario
        Where they act.
    hierarchy
        Who decides before whom, and sees whom.
    seed
        Source of everything random in the team.
    failures
        What fails of the messages down the hierarchy.

    Attributes
    ----------
    learner
        Owns the consequent weights.
    rows
        ``(n,)`` which row of them each agent has.
    space, rules
        What values are functions of, and the rule base that all agents have.
    explorer
        Chooses actions by value.
    evaluator
        Values actions; none: actions are drawn at random.
    self_model
        What the wheels do, as learned; none: prediction takes every body as nominal.
    calibration
        The predictor's constants, as learned; none: as the scenario believes them to be.
    predictor
        What predicts in place of the scenario; none: the scenario does.
    mirror
        Doubles what is learned from; none: it is what the agents met.
    seen
        ``(n, A)`` how often each agent was seen to take each action, one of each to begin with.
    given
        ``(n, A, n, A)`` the same given each action of another, if the teammate model asks for it.

    Raises
    ------
    ValueError
        If the hierarchy is over other agents than the scenario's, the settings do not fit its state
        space, or need a prediction that it has not.
    """

    def __init__(
        self,
        settings: LearnerSettings,
        scenario: Scenario,
        hierarchy: Hierarchy,
        seed: np.random.SeedSequence,
        failures: Sequence[MessageFailure] = (),
    ) -> None:
        if not isinstance(settings, LearnerSettings):
            raise ValueError(f"settings = {settings!r}: must be a learner's, as BatchTDSettings()")
        if hierarchy.agents != tuple(scenario.agents):
            raise ValueError(
                f"topology: agents {', '.join(hierarchy.agents)} are not the scenario's "
                f"{', '.join(scenario.agents)}"
            )
        check_prediction(settings, scenario)
        self.hierarchy, self.action_set = hierarchy, scenario.action_set
        n, n_actions, space = len(hierarchy), len(scenario.action_set), scenario.state_space
        self.self_model = SelfModel.of(settings.self_model, scenario)
        self.calibration = Calibration.of(settings.calibration, scenario)
        self.predictor: Any = _predictor_of(scenario, settings)
        adapting = ("self_model", "calibration", "predictor")
        self._adapting: dict[str, Any] = {
            name: part for name in adapting if hasattr(part := getattr(self, name), "adapt")
        }
        self.mirror = Mirror.of(scenario) if getattr(settings, "mirrored", False) else None
        self.rows = rows_of(scenario, shared=settings.weights == "role")
        rows = self.rows if self.mirror is None else self.mirror.rows(self.rows)
        self.messages = Messages(hierarchy, failures, n_actions)
        self._values_actions = settings.values_actions
        self._senders = _senders(settings, self.messages, hierarchy)
        self._n_told = max(map(len, self._senders), default=0)
        self.space, self.rules = settings.rules_over(space, self.action_set, self._n_told)
        self.learner: Learner = settings.build(self.rules, rows)
        parameters = signature(self.learner.observe).parameters
        self._arguments = parameters.keys() & {"left", "joint_action"}
        self._states: FloatArray = np.zeros((n, space.n_variables))
        self._left: FloatArray = self._states
        self.evaluator: Evaluator | None = None
        decision = settings.decision
        if decision.rule != "random":
            problem = DecisionProblem(
                self.rules, hierarchy, n_actions, scenario.groups,
                discount=settings.discount,
                handed_down=hierarchy.told == "ancestors" and not failures,
                **{name: value for name, value in decision if name != "evaluator"},
            )  # fmt: skip
            own: Any = self.learner
            self.evaluator = own if self._values_actions else decision.evaluator.build(problem)
        self.explorer: Explorer = settings.exploration.build(n)
        self.rng = np.random.Generator(np.random.PCG64(seed))
        self.seen: FloatArray = np.ones((n, n_actions))
        conditional = self.evaluator is not None and decision.teammates == "conditional"
        self.given: FloatArray = np.ones((n, n_actions) * 2 if conditional else (0, 0, 0, 0))
        self._unseen, self._discount = decision.unseen, settings.discount
        # Those who are told all that was decided before, and consider all others.
        self._hears_all = {
            i
            for k, i in enumerate(hierarchy.order)
            if len(hierarchy.above(i)) == k and not hierarchy.unseen(i) and not failures
        }
        self._last: IntArray = np.full(n, scenario.action_set.neutral)

    def check(self, prediction: Prediction) -> None:
        """Refuse a prediction without what the team decides by.

        Raises
        ------
        ValueError
            If it decides by rewards, and the prediction knows none; or by plans, and the
            prediction does not go on; one line.
        """
        problem = getattr(self.evaluator, "problem", None)
        if not isinstance(problem, DecisionProblem) or problem.rule == "value":
            return
        if not hasattr(prediction, "rewards"):
            raise ValueError(
                f"learner.decision.rule = {problem.rule!r}: no rewards are predicted, use value"
            )
        if getattr(self.evaluator, "continues", False) and not hasattr(prediction, "after"):
            raise ValueError(
                "learner.decision.evaluator: plans of several decisions need a scenario that "
                "predicts from predicted states"
            )

    def begin_world(self, seed: int | np.random.SeedSequence, episode: int) -> None:
        """Note that a world begins, in which what fails of the messages follows from `seed`."""
        self.messages.begin(seed, episode)
        self._last = np.full(len(self.hierarchy), self.action_set.neutral)

    def begin_episode(self) -> None:
        """Note that an episode of learning begins."""
        self.explorer.begin_episode()
        self.learner.begin_episode()

    def predict(self, scenario: Scenario, states: FloatArray | None = None) -> Any:
        """Predict from the scenario's present state, by what has been learned of it.

        The agents' `states` ``(n, d)`` are needed by learners and evaluators that ask for them. The
        prediction is None in a scenario that has none, and of agents that value actions.
        """
        if states is not None:
            self._states = states
        if self.predictor is not None:
            return self.predictor.predict(self._states)
        if self._values_actions or not hasattr(scenario, "predict"):
            return None
        if self.self_model is None and self.calibration is None:
            return scenario.predict()
        embodied = cast(EmbodiedScenario, scenario)
        effects = self.self_model.effects if self.self_model else embodied.nominal_effects
        if self.calibration is None:
            return embodied.predict_with(effects)
        return embodied.predict_with(effects, self.calibration.constants)

    def act(self, prediction: Prediction, *, explore: bool = True) -> IntArray:
        """Decide a joint action ``(n,)``, from the top of the hierarchy down.

        Without `explore` every agent takes its greatest action and the team's memory stays as it
        is, apart from the random numbers that break ties.
        """
        n = len(self.hierarchy)
        self._left = self._states
        if self._n_told:  # a column for each action told, as yet that of nobody
            nobody = np.full((n, self._n_told), float(len(self.action_set)))
            self._left = np.hstack([self._states, nobody])
        if self.evaluator is None:
            self._last = self.rng.integers(len(self.action_set), size=n)
            return self._last
        theta = self.learner.theta
        weights = [theta[row] for row in self.rows]
        joint = self._at_once(self.evaluator, prediction, weights, explore)
        if joint is None:
            joint = self._in_order(self.evaluator, prediction, weights, explore)
        self.messages.advance(joint)
        self._last = joint
        if explore:
            self.explorer.advance()
            every = np.arange(n)
            self.seen[every, joint] += 1.0
            if self.given.size:
                self.given[every[:, None], joint[:, None], every, joint] += 1.0
        return joint

    def _at_once(
        self, evaluator: Evaluator, prediction: Prediction, weights: list[FloatArray], explore: bool
    ) -> IntArray | None:
        """Return what all decide by one call of the evaluator, None if it takes one for each."""
        exploring = getattr(self.explorer, "exploring", None) if explore else NOT_EXPLORING
        n = len(self.hierarchy)
        decide = getattr(evaluator, "decide", None)
        if decide is None or exploring is None or len(self._hears_all) < n:
            return None
        joint = np.full(n, self.action_set.neutral)
        first = Deliberation(
            self.hierarchy.order[0], joint, prediction, weights, self.seen, self.rng,
            present=self._states,
        )  # fmt: skip
        return decide(first, exploring)

    def _in_order(
        self, evaluator: Evaluator, prediction: Prediction, weights: list[FloatArray], explore: bool
    ) -> IntArray:
        """Return what all decide, one agent after the other."""
        n, n_actions = len(self.hierarchy), len(self.action_set)
        frequencies = self.seen / self.seen.sum(axis=1, keepdims=True)
        joint = np.full(n, self.action_set.neutral)
        for i in self.hierarchy.order:
            senders, known = self._known(i, joint)
            if self._senders:
                told = known[self._senders[i]]
                self._left[i, self._states.shape[1] :][: len(told)] = told
            given = NOTHING_GIVEN
            if self.given.size:
                given = self.given[i] / self.given[i].sum(axis=2, keepdims=True)
            deliberation = Deliberation(
                i, known, prediction, weights, frequencies, self.rng, given, senders, self._left
            )
            values = evaluator.values(deliberation)
            if len(values) != n_actions:
                raise ValueError(f"the evaluator gave {len(values)} values of {n_actions} actions")
            if explore:
                joint[i] = self.explorer.choose(i, values, self.rng)
            else:
                joint[i] = greatest(values, self.rng)
            if self.messages.is_absent(i):
                joint[i] = self.action_set.neutral
        return joint

    def _known(self, agent: int, joint_action: IntArray) -> tuple[IntArray, IntArray]:
        """Return of whom an agent hears, ``(k,)``, and the actions ``(n,)`` that it reckons with.

        The unseen maintain, or do again what they did last; whoever plans sees to it otherwise.
        """
        if agent in self._hears_all:
            return self.messages.told[agent], joint_action
        senders, actions = self.messages.heard(agent, joint_action)
        neutral = self.action_set.neutral
        known = self._last.copy() if self._unseen == "last" else np.full_like(joint_action, neutral)
        known[senders] = actions
        return senders, known

    def adapt(self, prediction: Prediction, joint_action: IntArray, transition: Transition) -> None:
        """Revise what predictions rest on by what `joint_action` did."""
        for part in self._adapting.values():
            part.adapt(prediction, joint_action, transition)

    def learn(self, transition: Transition) -> None:
        """Take in what a step led to."""
        states, reward, left, taken = transition.states, transition.reward, self._left, self._last
        if transition.terminated and not transition.absorbing:
            reward = reward * (1.0 - self._discount)  # which learners have entered again for ever
        if self.mirror is not None:
            states, reward = self.mirror.states(states), self.mirror.reward(reward)
            left, taken = self.mirror.states(left), np.tile(taken, 2)
        offered = {"left": left, "joint_action": taken}
        arguments: Any = {name: offered[name] for name in self._arguments}
        self._count(self.learner.observe(states, reward, transition.terminated, **arguments))

    def end_episode(self) -> None:
        """Learn what is learned after an episode."""
        self._count(self.learner.end_episode())
        if hasattr(self.predictor, "end_episode"):
            self.predictor.end_episode()

    def _count(self, updates: int) -> None:
        if self.evaluator is not None:
            self.evaluator.counts.weight_updates += updates

    def continue_from(self, former: Team, rows: IntArray) -> None:
        """Begin where the team of another scenario ended, between two episodes.

        It goes on with its weights and experience, with how often agents of each row were seen to
        take each action, with its exploration and its random numbers; with self-model and
        calibration if the bodies are alike, and with conditional frequencies if the agents are as
        many, which otherwise begin anew.

        Parameters
        ----------
        former
            A team of the same settings.
        rows
            ``(n_rows,)`` the row of its weights that each row goes on from, see `carried_rows`.

        Raises
        ------
        ValueError
            If the learner or the exploration knows no way; one line.
        """
        for key, part, *given in (
            ("learner.kind", self.learner, former.learner, rows),
            ("learner.exploration.kind", self.explorer, former.explorer),
        ):
            if not hasattr(part, "continue_from"):
                raise ValueError(
                    f"{key}: {type(part).__name__} has no continue_from, by which it would go on "
                    "with another team"
                )
            part.continue_from(*given)
        self.rng.bit_generator.state = former.rng.bit_generator.state
        seen = [former.seen[former.rows == rows[row]].mean(axis=0) for row in self.rows]
        self.seen = np.stack(seen)
        if self.given.shape == former.given.shape:
            self.given = former.given.copy()
        for name in self._adapting.keys() & former._adapting.keys():
            self._adapting[name].continue_from(former._adapting[name])

    def save(self, path: Path | str) -> None:
        """Write everything that the team remembers to an ``.npz`` file: arrays only."""
        with open(path, "wb") as file:
            np.savez(file, allow_pickle=False, **self.arrays())

    def load(self, path: Path | str) -> None:
        """Continue from what `save` wrote; the team must be built from the same settings.

        Raises
        ------
        ValueError
            If the file is not of a team of this shape.
        """
        with np.load(path, allow_pickle=False) as arrays:
            self.restore(dict(arrays))

    def arrays(self) -> dict[str, FloatArray]:
        """Return everything that the team remembers as named arrays."""
        parts = {"learner": self.learner, **self._adapting}
        return {
            "generator": words_of(self.rng),
            "explorer": self.explorer.memory,
            "seen": self.seen,
            **({"given": self.given} if self.given.size else {}),
            **{f"{p}.{k}": array for p in parts for k, array in parts[p].arrays().items()},
        }

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from what `arrays` returned."""
        own = self.arrays()
        if arrays.keys() != own.keys():
            raise ValueError(
                f"team: saved arrays {', '.join(sorted(arrays))} are not this team's "
                f"{', '.join(sorted(own))}"
            )
        fixed = ("learner.theta", "learner.trace", "learner.reach", "seen", "explorer", "generator")
        for name in (name for name in fixed if name in own):
            if arrays[name].shape != own[name].shape:
                raise ValueError(
                    f"team: saved {name} has shape {arrays[name].shape}, this team's "
                    f"{own[name].shape}"
                )
        set_words(self.rng, arrays["generator"])
        self.explorer.memory[:] = arrays["explorer"]
        self.seen = arrays["seen"].copy()
        if self.given.size:
            self.given = arrays["given"].copy()
        for name, part in {"learner": self.learner, **self._adapting}.items():
            part.restore({k: arrays[f"{name}.{k}"] for k in part.arrays()})


def _senders(
    settings: LearnerSettings, messages: Messages, hierarchy: Hierarchy
) -> list[list[int]]:
    """Return, by agent, whose actions are part of its state, in the order of decision."""
    if not settings.values_actions:
        return []
    if hierarchy.neighbours:
        raise ValueError(
            f"learner.kind = {settings.kind!r}: agents use what they are told, and neighbours tell "
            "nothing; set topology.oriented, in which order they decide"
        )
    return [sorted(senders, key=hierarchy.order.index) for senders in messages.told]


def _predictor_of(scenario: Scenario, settings: LearnerSettings) -> Any:
    if isinstance(settings.predictor, GivenPredictor):
        return None
    named = f"learner.predictor.kind = {settings.predictor.kind!r}"
    if settings.values_actions:
        raise ValueError(f"{named}: learner.kind = {settings.kind!r} decides without a prediction")
    for name in ("self_model", "calibration"):
        if getattr(settings, name).enabled:
            raise ValueError(
                f"learner.{name}.enabled: revises what the scenario predicts, and {named} predicts "
                "in its place; use 'given'"
            )
    return settings.predictor.build(scenario)


def of_fuzzy_agents(team: Actors) -> Team:
    """Return a team that is a hierarchy of fuzzy agents.

    Raises
    ------
    ValueError
        If those who act are no such team, but a learner that acts for all; one line.
    """
    if not isinstance(team, Team):
        raise ValueError(
            f"learner.kind: {type(team).__name__} acts for all by itself; this needs agents with "
            "rule bases"
        )
    return team
