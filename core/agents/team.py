"""Teams: agents that decide jointly, stage by stage of a hierarchy, and learn together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from ..hierarchy.failures import LeftAgents, MessageFailure, actions_of_left
from ..hierarchy.hierarchy import Hierarchy
from ..hierarchy.messages import NO_PAYLOADS, Messages, Payloads
from ..hierarchy.stages import DecisionStage, Inbox, decision_stages
from ..interface.agents import (
    AnyAgents,
    Counts,
    ObservesJointActions,
    Rearrangeable,
    SendsPayloads,
    StateDict,
    ValuesStates,
    Vectorized,
    checked_actions,
)
from ..interface.environments import Transitions
from ..interface.experience import Decision, Experience, Observation
from ..interface.prediction import UNPREDICTED
from ..interface.scenario import Scenario, checked_scenario, prediction_of
from ..numerics import AnyArray, BoolArray, FloatArray, IntArray
from ..plugins.settings import Settings
from ..plugins.words import expect
from .decision_costs import join_costs, total_costs
from .inspection import inspect_agents, record_values, recorded_values
from .leader import build_leader, enter_scenario
from .parts import build_parts, counts_of, load_state, owners_in, state_of, weight_bytes_of

if TYPE_CHECKING:
    from ..learners.learner import TeamSettings

A = TypeVar("A", bound=AnyAgents)


class Team:
    """Agents of one or several kinds that decide jointly in a hierarchy.

    Parameters
    ----------
    settings
        Settings of the agents.
    scenario
        Scenario in which they act.
    hierarchy
        Order of decisions, communication and lookahead.
    seed
        Seed of all random numbers of the team.
    failures
        Message failures and absences, with their times.

    Attributes
    ----------
    parts
        The agents, one part for each kind.
    needs_prediction
        Whether some agents decide or learn by the scenario's predictions.
    leader
        The leader above all agents, if the scenario has options for one.
    learns
        Whether the episode is one of training.
    messages
        Delivery of messages.
    costs
        Measures of the costs of decisions.
    decision_costs
        Costs of the last decision, by the names of `costs`.

    Raises
    ------
    ValueError
        If the hierarchy does not consist of the scenario's agents, or the settings do not fit the
        scenario; one line.
    """

    def __init__(
        self,
        settings: TeamSettings,
        scenario: object,
        hierarchy: Hierarchy,
        seed: np.random.SeedSequence,
        failures: Sequence[MessageFailure] = (),
    ) -> None:
        expect("settings of a team or of a learner", Settings, settings=settings)
        expect("a hierarchy", Hierarchy, hierarchy=hierarchy)
        expect("what policy_seed returns", np.random.SeedSequence, seed=seed)
        checked = checked_scenario(scenario)
        if hierarchy.agents != tuple(checked.agents):
            raise ValueError(
                f"topology: agents {', '.join(hierarchy.agents)} are not the scenario's "
                f"{', '.join(checked.agents)}"
            )
        if not settings.uses_hierarchy:
            hierarchy = Hierarchy(checked.agents, [])
            failures = ()
        self.hierarchy = hierarchy
        self.action_set = checked.action_set
        self.needs_prediction = settings.needs_prediction
        self.parts, self._part_of = build_parts(
            settings, checked, hierarchy, seed, messages_fail=bool(failures)
        )
        numbered = dict(enumerate(self.parts))
        self._senders = {k: p for k, p in numbered.items() if isinstance(p, SendsPayloads)}
        self._observing = {k: p for k, p in numbered.items() if isinstance(p, ObservesJointActions)}
        self.costs = join_costs(self.parts, counts_messages=bool(self._senders))
        self.decision_costs: Mapping[str, float] = {}
        self._n_received = 0
        self.messages = Messages(
            hierarchy, failures, len(checked.action_set), has_payloads=bool(self._senders)
        )
        self._present = hierarchy
        neutral = self.action_set.neutral
        actions = actions_of_left(failures, self.action_set.names, neutral)
        self._actions_of_left = partial(self.messages.actions_of_left, actions, neutral)
        self.leader = build_leader(settings, checked, seed, messages_fail=bool(failures))
        self.learns = True
        self._all = self.parts if self.leader is None else (*self.parts, *self.leader.agents)

    @cached_property
    def _stages(self) -> tuple[DecisionStage, ...]:
        # After the repair "next", agents may receive actions from agents of their own stage.
        repairs = [f.repair for f in self.messages.failures if isinstance(f, LeftAgents)]
        acts_in_parallel = [p.acts_in_parallel and "next" not in repairs for p in self.parts]
        return decision_stages(self.hierarchy, self._part_of, acts_in_parallel)

    def only(self, kind: type[A]) -> A:
        """Return the agents of a team that consists of one part of this kind.

        Raises
        ------
        ValueError
            If the team consists of other agents; one line.
        """
        if len(self.parts) == 1 and isinstance(self.parts[0], kind):
            return self.parts[0]
        others = ", ".join(type(part).__name__ for part in self.parts)
        raise ValueError(f"learner.kind: needs one part of {kind.__name__}; the team has {others}")

    @property
    def is_stochastic(self) -> bool:
        """Whether the policy of some part is stochastic."""
        return any(part.is_stochastic for part in self.parts)

    @property
    def counts(self) -> Counts:
        """Number of evaluations so far, of the parts that count them."""
        return counts_of(self._all)

    @property
    def weight_bytes(self) -> int:
        """Memory of all learned weights [bytes]."""
        return weight_bytes_of(self._all)

    @contextmanager
    def drawing_apart(self) -> Iterator[None]:
        """Restore the states of all random generators on exit."""
        generators = [part.rng.bit_generator for part in self._all]
        states = [generator.state for generator in generators]
        yield
        for generator, state in zip(generators, states, strict=True):
            generator.state = state

    def check(self, observation: Observation) -> None:
        """Refuse an observation without what the agents decide by.

        Raises
        ------
        ValueError
            One line.
        """
        for part in self.parts:
            part.observe(observation, explore=False)

    def observe(
        self, scenario: Scenario, states: FloatArray, previous: IntArray | None = None
    ) -> Observation:
        """Return the observation of a scenario, with its prediction if the agents need one.

        Parameters
        ----------
        scenario
            The scenario in its present state.
        states
            ``(n, d)`` present states of the agents.
        previous
            ``(n,)`` previous joint action; None at the beginning of an episode, when the team's
            leader enters the scenario.

        Raises
        ------
        ValueError
            If the prediction is none, or the team has a leader and the scenario has not; one line.
        """
        if previous is None:  # an episode begins
            enter_scenario(self.leader, scenario)
        prediction = prediction_of(scenario) if self.needs_prediction else UNPREDICTED
        return Observation(states, prediction, previous)

    def reset(
        self, seed: int | np.random.SeedSequence, episode: int, *, learn: bool = False
    ) -> None:
        """Start an episode, of training if the team is to `learn`.

        Random message failures follow from `seed`.
        """
        self.messages.reset(seed, episode)
        if self.leader is not None:
            self.leader.reset(learn=learn)
        self.learns = learn
        for part in self._all:
            part.reset(episode, learn=learn)

    def act(
        self, observation: Observation, *, explore: bool = True, inspect: bool = False
    ) -> Decision:
        """Return a joint decision.

        Parameters
        ----------
        observation
            States of all agents.
        explore
            Whether the agents explore; in an episode without learning, only stochastic policies
            do. Other agents take an action of greatest value, which changes only the random
            numbers that break ties.
        inspect
            Whether the decision contains those of single agents, see `AgentDecision`. The joint
            action is the same, but takes longer if agents would share one search.

        Examples
        --------
        >>> from nested_agents.core.learners.batch import BatchTDSettings
        >>> from nested_agents.scenarios.line_up import LineUpSettings
        >>> carts = LineUpSettings(carts=2).build()
        >>> chain = Hierarchy(carts.agents, [carts.agents])
        >>> team = Team(BatchTDSettings(), carts, chain, np.random.SeedSequence(0))
        >>> observation = team.observe(carts, carts.reset(0))
        >>> decision = team.act(observation, explore=False, inspect=True)
        >>> [list(agent.received) for agent in decision.agents]
        [[], ['cart1']]
        """
        if self._present is not self.messages.hierarchy:
            self._rearrange()
        if inspect and observation.states.ndim > 2:
            raise ValueError("inspect = True: a decision of one environment only")
        if self.leader is not None:
            observation, skilled = self.leader.lead(observation, explore=explore)
            if skilled is not None:
                self.decision_costs = {measure.name: 0.0 for measure in self.costs}
                return Decision(skilled, ())
            explore = explore and not self.learns  # in training only the leader explores
        inputs = tuple(
            part.observe(observation, explore=explore and (self.learns or part.is_stochastic))
            for part in self.parts
        )
        inboxes: list[Inbox] | None = [] if inspect else None
        if inspect:
            record_values(self.parts, inputs)
        joint_action = self._decide(observation, inputs, inboxes)
        payloads = self._payloads(inputs) if self._senders else NO_PAYLOADS
        self.messages.advance(joint_action, payloads)
        for k, observing in self._observing.items():
            observing.conclude(inputs[k], joint_action)
        if self.costs:
            self.decision_costs = total_costs(
                self.parts, inputs, joint_action, self.costs, self._n_received
            )
            self._n_received = 0
        if inboxes is None:
            return Decision(joint_action, inputs)
        values = recorded_values(self.parts, inputs)
        names = self.hierarchy.agents
        agents = inspect_agents(names, self.action_set.names, joint_action, values, inboxes)
        return Decision(joint_action, inputs, agents)

    def _decide(
        self, observation: Observation, inputs: tuple[object, ...], inboxes: list[Inbox] | None
    ) -> IntArray:
        """Return the joint action, decided stage by stage; append the inboxes to a list."""
        shape = (*observation.states.shape[:-2], len(self.hierarchy))
        joint_action = np.full(shape, self.action_set.neutral)
        by_agent = joint_action.T  # a view with the axis of agents first
        if self.messages.failures:
            left = self.messages.left
            joint_action[..., left] = self._actions_of_left()[left]
        for stage in self._stages:
            part = self.parts[stage.part]
            payloads = self._payloads(inputs) if stage.part in self._senders else None
            inbox = self.messages.deliver(stage, joint_action, payloads)
            if not len(inbox.agents):
                continue
            if inboxes is not None:
                inboxes.append(inbox)
            actions = part.act(inputs[stage.part], inbox)
            by_agent[inbox.agents] = checked_actions(part, actions, len(self.action_set)).T
            self._n_received += len(inbox.senders)
        return joint_action

    def value(self, agent: str, states: FloatArray) -> FloatArray:
        """Return the values ``(...)`` of an agent, by its name, at states ``(..., d)``.

        States are in the order of the scenario's state variables.

        Raises
        ------
        ValueError
            If there is no such agent, or it has no value function of its own states; one line.
        """
        names = self.hierarchy.agents
        if agent not in names:
            raise ValueError(f"agent = {agent!r}, allowed: {', '.join(names)}")
        index = names.index(agent)
        part = self.parts[self._part_of[index]]
        if not isinstance(part, ValuesStates):
            raise ValueError(f"{type(part).__name__}: has no value function of an agent's states")
        return part.value(index, np.asarray(states, dtype=float))

    def _rearrange(self) -> None:
        """Pass a repaired hierarchy to all parts."""
        self._present = self.messages.hierarchy
        left = np.flatnonzero(self.messages.left)
        for part in self.parts:
            if isinstance(part, Rearrangeable):
                part.rearrange(self._present, left, self._actions_of_left()[left])

    def _payloads(self, inputs: tuple[object, ...]) -> Payloads:
        """Return the payloads of the messages sent so far, by agent."""
        payloads: dict[int, object] = {}
        for k, sender in self._senders.items():
            payloads.update(sender.payloads(inputs[k]))
        return payloads

    def learn(self, experience: Experience) -> None:
        """Learn from a step. Below a leader, only the leader learns."""
        if self.leader is not None:
            self.leader.learn(experience)
            return
        for part, inputs in zip(self.parts, experience.decision.inputs, strict=True):
            part.learn(experience, inputs)

    def learn_batch(self, decision: Decision, steps: Transitions, last: BoolArray) -> None:
        """Learn from one step of many environments; `last` says which episodes end."""
        for part, inputs in zip(self.parts, decision.inputs, strict=True):
            assert isinstance(part, Vectorized)  # see `ManyEnvironmentsLoop`
            part.learn_batch(decision.joint_action, inputs, steps, last)

    def warm_start(self, former: Team) -> None:
        """Start with what the team of another scenario or hierarchy learned, between episodes.

        Raises
        ------
        ValueError
            If it cannot be used here; one line.
        """
        # Only one of the teams may have a leader that learns, which is the last.
        for part, before in zip(self._all, former._all, strict=False):
            part.warm_start(before)

    def save(self, path: Path | str) -> None:
        """Write the `state_dict` and the owners of the weights to an ``.npz`` file."""
        with open(path, "wb") as file:
            np.savez(file, allow_pickle=False, **self.state_dict(), **owners_in(self._all))

    def load(self, path: Path | str) -> None:
        """Continue from a file of `save`; the team must be built from the same settings.

        Raises
        ------
        ValueError
            If the file holds a team of another shape.
        """
        with np.load(path, allow_pickle=False) as arrays:
            owners = owners_in(self._all)
            self.load_state_dict({name: arrays[name] for name in arrays if name not in owners})

    def state_dict(self) -> StateDict:
        """Return the saved state of all parts as named arrays."""
        return state_of(self._all)

    def load_state_dict(self, state: Mapping[str, AnyArray]) -> None:
        """Continue from a `state_dict`.

        Raises
        ------
        ValueError
            If it is that of another team.
        """
        load_state(self._all, state)
