"""Teams: agents that decide jointly, stage by stage of a hierarchy, and learn together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ..hierarchy.failures import LeftAgents, MessageFailure
from ..hierarchy.hierarchy import Hierarchy
from ..hierarchy.messages import NO_PAYLOADS, Messages, Payloads
from ..hierarchy.stages import DecisionStage, Inbox, decision_stages
from ..interface.abilities import options_of
from ..interface.agents import (
    AgentContext,
    Agents,
    Counts,
    Inspectable,
    ObservesJointActions,
    Rearrangeable,
    RecordsValues,
    ReportsCosts,
    ReportsResources,
    SendsPayloads,
    StateDict,
    ValuesStates,
    Vectorized,
    select_prefix,
)
from ..interface.environments import Transitions
from ..interface.experience import Decision, Experience, Observation
from ..interface.measures import Measure
from ..interface.prediction import UNPREDICTED
from ..interface.scenario import Scenario, checked_scenario, prediction_of
from ..numerics import AnyArray, BoolArray, FloatArray, IntArray
from ..plugins.settings import Settings
from ..plugins.words import expect
from .inspection import inspect_agents
from .kept import begin_with
from .leader import Leader

if TYPE_CHECKING:
    from ..learners.learner import TeamSettings

A = TypeVar("A", bound=Agents[Any])
MESSAGES = Measure("messages", "messages", gathering="sum", better="lower", least=0.0)
"""Number of received messages, a measure of teams that send payloads."""


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
        kinds = settings.members(checked, hierarchy)
        seeds = [seed] if len(kinds) == 1 else seed.spawn(len(kinds))
        parts: list[Agents[Any]] = []
        self._part_of = [0] * len(hierarchy)
        for (members, own, kept), own_seed in zip(kinds, seeds, strict=True):
            for agent in members.tolist():
                self._part_of[agent] = len(parts)
            context = AgentContext(
                checked, hierarchy, members, own_seed, messages_fail=bool(failures)
            )
            parts.append(own.agents(context))
            if kept is not None:
                begin_with(parts[-1], kept, len(parts) - 1)
        self.parts = tuple(parts)
        numbered = dict(enumerate(parts))
        self._senders = {k: p for k, p in numbered.items() if isinstance(p, SendsPayloads)}
        self._reporting = {k: p for k, p in numbered.items() if isinstance(p, ReportsCosts)}
        self._observing = {k: p for k, p in numbered.items() if isinstance(p, ObservesJointActions)}
        sent = [MESSAGES] if self._senders else []
        self.costs = join_costs([*sent, *(m for p in self._reporting.values() for m in p.costs)])
        self.decision_costs: Mapping[str, float] = {}
        self._n_received = 0
        self.messages = Messages(
            hierarchy, failures, len(checked.action_set), has_payloads=bool(self._senders)
        )
        self._present = hierarchy
        self._actions_of_left = _actions_of_left(failures, checked)
        self.leader: Leader | None = None
        options = options_of(checked)
        if options is not None:
            if failures or settings.n_environments > 1:
                key = "topology.failures" if failures else "learner.environments"
                raise ValueError(f"{key}: not for agents below a leader, leave out scenario.leader")
            needs_prediction = self.needs_prediction
            own_seed = seed.spawn(1)[0]
            self.leader = Leader(checked, options, own_seed, needs_prediction=needs_prediction)
        self._all = self.parts if self.leader is None else (*self.parts, *self.leader.agents)

    @cached_property
    def _stages(self) -> tuple[DecisionStage, ...]:
        # After the repair "next", agents may receive actions from agents of their own stage.
        is_sequential = any(
            isinstance(failure, LeftAgents) and failure.repair == "next"
            for failure in self.messages.failures
        )
        acts_in_parallel = [part.acts_in_parallel and not is_sequential for part in self.parts]
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
        total = Counts()
        for part in self._all:
            if isinstance(part, ReportsResources):
                total.add(part.counts)
        return total

    @property
    def weight_bytes(self) -> int:
        """Memory of all learned weights [bytes]."""
        return sum(
            part.weight_bytes
            if isinstance(part, ReportsResources)
            else sum(array.nbytes for array in part.state_dict().values())
            for part in self._all
        )

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
            ``(n,)`` previous joint action of the episode, if there is one.

        Raises
        ------
        ValueError
            If the scenario predicts something that is no prediction, or has no leader where the
            team has one; one line.
        """
        if previous is None:  # an episode begins
            options = options_of(scenario)
            if (self.leader is None) != (options is None):
                raise ValueError(
                    "scenario.leader: build the team in a scenario with the same leader"
                )
            if self.leader is not None and options is not None:
                self.leader.enter(scenario, options)
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
            self.leader.reset()
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
            Whether the agents explore. If not, each takes an action of greatest value, and the
            team changes only the random numbers that break ties.
        inspect
            Whether the decision contains the values, received actions and exploration of single
            agents, see `AgentDecision`. The joint action is the same; agents that would share one
            search then search one after the other, which takes longer.

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
            explore = False
        inputs = tuple(part.observe(observation, explore=explore) for part in self.parts)
        inboxes: list[Inbox] | None = None
        if inspect:
            inboxes = []
            for part, own in zip(self.parts, inputs, strict=True):
                if isinstance(part, RecordsValues):
                    part.record_values(own)
        joint_action = self._decide(observation, inputs, inboxes)
        payloads = self._payloads(inputs) if self._senders else NO_PAYLOADS
        self.messages.advance(joint_action, payloads)
        for k, observing in self._observing.items():
            observing.conclude(inputs[k], joint_action)
        if self.costs:
            self.decision_costs = self._costs_of_decision(inputs, joint_action)
        if inboxes is None:
            return Decision(joint_action, inputs)
        values: dict[int, FloatArray] = {}
        for part, own in zip(self.parts, inputs, strict=True):
            if isinstance(part, Inspectable):
                values.update(part.action_values(own))
        agents = inspect_agents(
            self.hierarchy.agents, self.action_set.names, joint_action, values, inboxes
        )
        return Decision(joint_action, inputs, agents)

    def _decide(
        self,
        observation: Observation,
        inputs: tuple[object, ...],
        inboxes: list[Inbox] | None = None,
    ) -> IntArray:
        """Return the joint action, decided stage by stage; append the inboxes to a list."""
        shape = (*observation.states.shape[:-2], len(self.hierarchy))
        joint_action = np.full(shape, self.action_set.neutral)
        by_agent = joint_action.T  # a view with the axis of agents first
        fail = bool(self.messages.failures)
        if fail:
            left = self.messages.left
            joint_action[..., left] = self._joint_action_of_left()[left]
        for stage in self._stages:
            part = self.parts[stage.part]
            payloads = self._payloads(inputs) if stage.part in self._senders else None
            inbox = self.messages.deliver(stage, joint_action, payloads)
            if not len(inbox.agents):
                continue
            if inboxes is not None:
                inboxes.append(inbox)
            by_agent[inbox.agents] = part.act(inputs[stage.part], inbox).T
            self._n_received += len(inbox.senders)
            if fail:
                joint_action[self.messages.absent(inbox.agents)] = self.action_set.neutral
        return joint_action

    def value(self, agent: str, states: FloatArray) -> FloatArray:
        """Return the value function of an agent at some states.

        Parameters
        ----------
        agent
            Name of the agent.
        states
            ``(..., d)`` states of the agent, in the order of the scenario's state variables.

        Returns
        -------
        FloatArray
            ``(...)`` values.

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

    def _joint_action_of_left(self) -> IntArray:
        """Return the actions ``(n,)`` of agents that have left; others are neutral."""
        return self.messages.actions_of_left(self._actions_of_left, self.action_set.neutral)

    def _rearrange(self) -> None:
        """Pass a repaired hierarchy to all parts."""
        self._present = self.messages.hierarchy
        left = np.flatnonzero(self.messages.left)
        for part in self.parts:
            if isinstance(part, Rearrangeable):
                part.rearrange(self._present, left, self._joint_action_of_left()[left])

    def _payloads(self, inputs: tuple[object, ...]) -> Payloads:
        """Return the payloads of the messages sent so far, by agent."""
        payloads: dict[int, object] = {}
        for k, sender in self._senders.items():
            payloads.update(sender.payloads(inputs[k]))
        return payloads

    def _costs_of_decision(
        self, inputs: tuple[object, ...], joint_action: IntArray
    ) -> Mapping[str, float]:
        """Return the costs of a decision by the names of `costs`."""
        total = {measure.name: 0.0 for measure in self.costs}
        total[MESSAGES.name] = float(self._n_received)
        self._n_received = 0
        for k, part in self._reporting.items():
            for name, value in part.decision_costs(inputs[k], joint_action).items():
                total[name] += value
        return total

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
        """Write the `state_dict` to an ``.npz`` file."""
        with open(path, "wb") as file:
            np.savez(file, allow_pickle=False, **self.state_dict())

    def load(self, path: Path | str) -> None:
        """Continue from a file of `save`; the team must be built from the same settings.

        Raises
        ------
        ValueError
            If the file holds a team of another shape.
        """
        with np.load(path, allow_pickle=False) as arrays:
            self.load_state_dict(dict(arrays))

    def state_dict(self) -> StateDict:
        """Return the saved state of all parts as named arrays."""
        if len(self._all) == 1:
            return self._all[0].state_dict()
        return {
            f"part{k}.{name}": array
            for k, part in enumerate(self._all)
            for name, array in part.state_dict().items()
        }

    def load_state_dict(self, state: Mapping[str, AnyArray]) -> None:
        """Continue from a `state_dict`.

        Raises
        ------
        ValueError
            If it is that of another team.
        """
        if len(self._all) == 1:
            self._all[0].load_state_dict(state)
            return
        for k, part in enumerate(self._all):
            part.load_state_dict(select_prefix(f"part{k}.", state))


def join_costs(measures: Sequence[Measure]) -> tuple[Measure, ...]:
    """Return the measures of the costs of all parts, each once.

    Raises
    ------
    ValueError
        If two parts report one cost in different units; one line.
    """
    by_name: dict[str, Measure] = {}
    for measure in measures:
        known = by_name.setdefault(measure.name, measure)
        if known != measure:
            raise ValueError(
                f"learner.costs.{measure.name} = {measure.unit!r}: another part of the team gives "
                f"it in {known.unit!r}"
            )
    return tuple(by_name.values())


def _actions_of_left(failures: Sequence[MessageFailure], scenario: Scenario) -> list[int]:
    """Return the action of agents that have left, for every failure.

    Raises
    ------
    ValueError
        If an action is unknown; one line.
    """
    names = scenario.action_set.names
    actions = []
    for k, failure in enumerate(failures):
        action = failure.action if isinstance(failure, LeftAgents) else None
        if action is not None and action not in names:
            raise ValueError(
                f"topology.failures[{k}].action = {action!r}: unknown action, allowed: "
                f"{', '.join(names)}"
            )
        actions.append(scenario.action_set.neutral if action is None else names.index(action))
    return actions
