"""Fuzzy agents: every agent has a value function, a fuzzy rule base with learned weights.

An agent evaluates its actions by the predicted next states or, with learners of action values, in
its present state. Consequent weights belong to an agent or to a role.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from typing import Self

import numpy as np

from ..hierarchy.hierarchy import Hierarchy
from ..hierarchy.stages import Inbox
from ..interface.agents import AgentContext, Agents, Counts, StateDict, add_prefix, select_prefix
from ..interface.experience import Experience, Observation
from ..interface.measures import Measure
from ..interface.prediction import NOT_EXPLORING, UNPREDICTED
from ..interface.scenario import carried_rows, check_transfer, owners_of, rows_of
from ..learners import check_prediction
from ..learners.learner import Learner, LearnerSettings
from ..models.predictors import GivenPredictor, Mirror
from ..models.team_model import TeamModel
from ..numerics import AnyArray, FloatArray, IntArray, greatest, set_words, words_of
from ..plugins.words import must_inherit
from ..search.evaluator import NO_AGENTS, Aggregation, DecisionContext, Evaluator
from ..search.exploration import Explorer
from .action_counts import ActionCounts
from .team_search import TeamSearch
from .views import FuzzyInputs, Views, senders_of, weights_by_agent


class FuzzyAgents(Agents[FuzzyInputs]):
    """Agents with fuzzy rule bases: value function, search, exploration and prediction.

    Parameters
    ----------
    settings
        Settings of rule base, learner, decision and exploration.
    context
        Scenario, hierarchy and members.

    Attributes
    ----------
    learner
        Learner, which owns the consequent weights.
    members
        ``(k,)`` agents of the team that belong to this part.
    rows
        ``(k,)`` row of weights of every member.
    space, rules
        Inputs of the value function as a state space, and the rule base over it.
    explorer
        Chooses actions by their values.
    search
        Searches for actions, with an evaluator of actions.
    model
        Predictor, with self-model and calibration.
    mirror
        Adds mirror images to experience; None if experience is not mirrored.
    action_counts
        Counts of the actions of all agents, for models of teammates.
    views
        Own views of the agents; None if all share prediction and weights.

    Raises
    ------
    ValueError
        If the settings do not fit the state space, or require a prediction that is missing.
    """

    def __init__(self, settings: LearnerSettings, context: AgentContext) -> None:
        scenario = context.scenario
        check_prediction(settings, scenario)
        _check_settings(settings, context)
        self.settings = settings
        self.scenario = scenario
        self.members = context.members
        self.action_set = scenario.action_set
        self.rng = np.random.Generator(np.random.PCG64(context.seed))
        self.model = TeamModel(
            settings.predictor, settings.self_model, settings.calibration, scenario
        )
        self._senders = senders_of(settings, context.hierarchy)
        self._n_told = max(map(len, self._senders), default=0)
        self.space, self.rules = settings.rules_over(
            scenario.state_space, scenario.action_set, self._n_told
        )
        self.mirror = Mirror.of(scenario) if settings.is_mirrored else None
        self.rows = rows_of(scenario, self.members, shared=settings.weights == "role")
        rows = self.rows if self.mirror is None else self.mirror.rows(self.rows)
        self.learner: Learner = settings.build(self.rules, rows)
        must_inherit("learner.kind", self.learner, Learner)
        learned = self.learner if isinstance(self.learner, Evaluator) else None
        self.search = TeamSearch(settings, self.rules, learned, context)
        n = len(context.hierarchy)
        own_rows = dict(zip(self.members.tolist(), self.rows.tolist(), strict=True))
        self._row_of = [own_rows.get(agent) for agent in range(n)]
        self.views: Views | None = None
        self.costs: tuple[Measure, ...] = ()
        if self.search.is_private:
            plans = isinstance(self.evaluator, Aggregation) and self.evaluator.plans
            n_rules = self.learner.theta.shape[1]
            self.views = Views(settings, context, self._row_of, n_rules, plans=plans)
            self.costs = self.views.costs
        self.explorer: Explorer = settings.exploration.build(n)
        must_inherit("learner.exploration.kind", self.explorer, Explorer)
        self._neutral = np.full(n, self.action_set.neutral)
        is_conditional = settings.decision.teammates == "conditional" and bool(self.evaluator)
        self.action_counts = ActionCounts(n, len(self.action_set), is_conditional=is_conditional)

    @property
    def evaluator(self) -> Evaluator | None:
        """Evaluator of actions; None if actions are drawn at random."""
        return self.search.evaluator

    def rearrange(self, hierarchy: Hierarchy, left: IntArray, actions: IntArray) -> None:
        """Search in a repaired hierarchy; all agents know the actions of those that have left."""
        self.search.rearrange(hierarchy, left, actions)

    @property
    def counts(self) -> Counts:
        """Number of evaluations so far."""
        return self.search.counts

    @property
    def weight_bytes(self) -> int:
        """Memory of the consequent weights [bytes]."""
        return self.learner.theta.nbytes

    def reset(self, episode: int, *, learn: bool) -> None:
        """Start an episode."""
        if learn:
            self.explorer.begin_episode()
            self.learner.begin_episode()

    def observe(self, seen: Observation, *, explore: bool) -> FuzzyInputs:
        """Return the inputs of a decision."""
        left = seen.states
        if self._n_told:  # columns for received actions, which `act` fills in
            missing = np.full((len(left), self._n_told), float(len(self.action_set)))
            left = np.hstack([left, missing])
        prediction = UNPREDICTED if self.settings.values_actions else self.model.predict(seen)
        self.search.check(prediction, self._neutral)
        theta = self.learner.theta
        return FuzzyInputs(
            left=left,
            previous=seen.previous if self.settings.decision.unseen == "last" else None,
            prediction=prediction,
            weights=weights_by_agent(self._row_of, theta),
            frequencies=self.action_counts.frequencies,
            explore=explore,
            views={} if self.views is None else self.views.by_agent(prediction, theta),
        )

    def _context(
        self, inputs: FuzzyInputs, agent: int, known: IntArray, senders: IntArray = NO_AGENTS
    ) -> DecisionContext:
        """Return the knowledge of an agent that decides, given the known actions ``(n,)``."""
        prediction, weights = inputs.views.get(agent, (inputs.prediction, inputs.weights))
        return DecisionContext(
            agent=agent,
            joint_action=known,
            prediction=prediction,
            weights=weights,
            frequencies=inputs.frequencies,
            rng=self.rng,
            given=self.action_counts.frequencies_given(agent),
            told=senders,
            present=inputs.left,
        )

    def _joint_search(self, inputs: FuzzyInputs, first: int) -> IntArray | None:
        """Return the joint action ``(n,)`` of one search for all agents, or None."""
        exploring = self.explorer.exploring if inputs.explore else NOT_EXPLORING
        if self.evaluator is None or exploring is None:
            return None
        return self.evaluator.decide(self._context(inputs, first, self._neutral.copy()), exploring)

    def act(self, inputs: FuzzyInputs, inbox: Inbox) -> IntArray:
        """Return the action ``(1,)`` of the only agent of a stage.

        If all agents receive all earlier actions, one search in the first stage may find them all.
        """
        (agent,) = inbox.agents.tolist()
        inputs.decided.add(agent)
        inputs.received += len(inbox.senders)
        if self.evaluator is None:
            return self.rng.integers(len(self.action_set), size=1)
        is_first = agent == self.search.hierarchy.order[0]
        if self.search.is_joint and is_first and inputs.values is None:
            inputs.joint_action = self._joint_search(inputs, agent)
        if inputs.joint_action is not None:
            return inputs.joint_action[inbox.agents]
        return np.array([self._choose(inputs, agent, inbox.senders, inbox.actions)])

    def _choose(self, inputs: FuzzyInputs, agent: int, senders: IntArray, actions: IntArray) -> int:
        """Return the action of an agent, given the received actions."""
        assert self.evaluator is not None
        known = (self._neutral if inputs.previous is None else inputs.previous).copy()
        if len(self.search.left):
            senders = np.concatenate([senders, self.search.left])
            actions = np.concatenate([actions, self.search.actions_of_left])
        known[senders] = actions
        if self._senders:
            told = known[self._senders[agent]]
            inputs.left[agent, self.scenario.state_space.n_variables :][: len(told)] = told
        values = self.evaluator.values(self._context(inputs, agent, known, senders))
        if len(values) != len(self.action_set):
            raise ValueError(
                f"the evaluator returned {len(values)} values for {len(self.action_set)} actions"
            )
        if inputs.values is not None:
            inputs.values[agent] = values.copy()
        if self.views is not None and self.evaluator.expected is not None:
            inputs.expected[agent] = self.evaluator.expected.copy()
        if inputs.explore:
            return self.explorer.choose(agent, values, self.rng)
        return greatest(values, self.rng)

    def conclude(self, inputs: FuzzyInputs, joint_action: IntArray) -> None:
        """Advance exploration and count the actions of all agents, if the agents explore."""
        if not inputs.explore or self.evaluator is None:
            return
        self.explorer.advance()
        self.action_counts.add(joint_action, self.search.left)

    def decision_costs(self, inputs: FuzzyInputs, joint_action: IntArray) -> Mapping[str, float]:
        """Return agreement and communication, for agents with views of their own."""
        if self.views is None:
            return {}
        return self.views.decision_costs(inputs, joint_action, self.search.left)

    def record_values(self, inputs: FuzzyInputs) -> None:
        """Keep the values of actions in this decision; each agent then searches on its own."""
        inputs.values = {}

    def action_values(self, inputs: FuzzyInputs) -> Mapping[int, FloatArray]:
        """Return the recorded values ``(A,)`` of the actions of each member."""
        return inputs.values or {}

    def value(self, agent: int, states: FloatArray) -> FloatArray:
        """Return the value function of an agent at states ``(..., d)``.

        Raises
        ------
        ValueError
            If the states have other variables; one line.
        """
        row = self._row_of[agent]
        assert row is not None  # the team asks the part of the agent
        variables = [variable.name for variable in self.space.variables]
        if not states.ndim or states.shape[-1] != len(variables):
            raise ValueError(
                f"states: shape {states.shape}, allowed: (..., {len(variables)}), the variables "
                f"{', '.join(variables)}"
            )
        flat = states.reshape(-1, len(variables))
        return self.rules.values(self.learner.theta[row], flat).reshape(states.shape[:-1])

    def learn(self, experience: Experience, inputs: FuzzyInputs) -> None:
        """Update predictor and weights; after the last step, also learn from the episode."""
        self.model.learn(experience, inputs.prediction)
        transition = experience.transition
        states = transition.states[self.members]
        left = inputs.left[self.members]
        taken = experience.decision.joint_action[self.members]
        reward = transition.reward
        idle = np.flatnonzero([agent not in inputs.decided for agent in self.members.tolist()])
        if np.ndim(reward):
            reward = np.asarray(reward)[self.members]
        if transition.terminated and not transition.absorbing:
            # Learners assume that a terminal state is repeated forever.
            reward = reward * (1.0 - self.settings.discount)
        if self.mirror is not None:
            states = self.mirror.states(states)
            reward = self.mirror.reward(reward)
            left = self.mirror.states(left)
            taken = np.tile(taken, 2)
            idle = np.append(idle, idle + len(self.members))
        self.learner.idle = idle
        updates = self.learner.observe_decision(
            left, taken, states, reward, transition.terminated, experience.duration
        )
        if experience.last:
            updates += self.learner.end_episode()
            self.model.end_episode()
        self.counts.weight_updates += updates

    @property
    def owners(self) -> list[str]:
        """The owner of each member's weights."""
        return owners_of(self.scenario, self.members, shared=self.settings.weights == "role")

    def _rows_carried(self, owners: Sequence[str]) -> IntArray:
        """Return the row of trained weights with these owners from which each row starts."""
        return carried_rows(owners, self.owners, shared=self.settings.weights == "role")

    def assign_rows(self, owners: Sequence[str]) -> None:
        """Give rows of weights and experience, loaded in the order of their owners, to these.

        Raises
        ------
        ValueError
            If they are not the owners of these agents' weights; one line.
        """
        rows = self._rows_carried(owners)
        if (rows != np.arange(len(rows))).any():
            self.learner.warm_start(deepcopy(self.learner), rows)

    def warm_start(self, former: Self) -> None:
        """Start from agents with the same settings that learned in another scenario.

        Weights, experience, action counts, exploration and random numbers continue. Self-model and
        calibration continue if the bodies are equal, conditional counts if the number of agents is.

        Raises
        ------
        ValueError
            If the learner or the exploration does not support it; one line.
        """
        check_transfer(former.scenario, self.scenario)
        rows = self._rows_carried(former.owners)
        self.learner.warm_start(former.learner, rows)
        self.explorer.warm_start(former.explorer)
        self.rng.bit_generator.state = former.rng.bit_generator.state
        alike = [former.members[former.rows == rows[row]] for row in self.rows]
        pairs = list(zip(self.members.tolist(), alike, strict=True))
        self.action_counts.warm_start(former.action_counts, pairs)
        self.model.warm_start(former.model)

    def state_dict(self) -> StateDict:
        """Return the saved state."""
        memory: StateDict = {
            "generator": words_of(self.rng),
            "explorer": self.explorer.memory,
            **self.action_counts.state_dict(),
        }
        memory |= add_prefix("learner.", self.learner.state_dict())
        for name, part in self.model.adaptive.items():
            memory |= add_prefix(f"{name}.", part.state_dict())
        return memory

    def load_state_dict(self, state: Mapping[str, AnyArray]) -> None:
        """Continue from a `state_dict`.

        Raises
        ------
        ValueError
            If it is that of other agents.
        """
        own = self.state_dict()
        if state.keys() != own.keys():
            raise ValueError(
                f"team: saved arrays {', '.join(sorted(state))} are not this team's "
                f"{', '.join(sorted(own))}"
            )
        for name in ("learner.theta", "learner.trace", "seen", "explorer", "generator"):
            if name in own and state[name].shape != own[name].shape:
                raise ValueError(
                    f"team: saved {name} has shape {state[name].shape}, this team's "
                    f"{own[name].shape}"
                )
        set_words(self.rng, state["generator"])
        self.explorer.memory[:] = state["explorer"]
        self.action_counts.load_state_dict(state)
        self.learner.load_state_dict(select_prefix("learner.", state))
        for name, part in self.model.adaptive.items():
            part.load_state_dict(select_prefix(f"{name}.", state))


def _check_settings(settings: LearnerSettings, context: AgentContext) -> None:
    """Refuse a predictor without use, and mirrored experience of a part of the team."""
    if settings.values_actions and not isinstance(settings.predictor, GivenPredictor):
        raise ValueError(
            f"learner.predictor.kind = {settings.predictor.kind!r}: learner.kind = "
            f"{settings.kind!r} decides without a prediction"
        )
    if settings.is_mirrored and not context.is_whole:
        raise ValueError("learner.mirrored = true: needs the whole team in one part; use false")
