"""Delivery of messages: the inbox of every stage, given message failures and absent agents."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..numerics import BoolArray, IntArray, stream_of
from .failures import (
    GARBLED,
    LOST,
    STREAM,
    AbsentAgents,
    LeftAgents,
    MessageFailure,
)
from .hierarchy import Hierarchy
from .repair import without
from .stages import DecisionStage, Inbox

Payloads = Mapping[int, object]
"""Payloads of messages by sender."""
NO_PAYLOADS: Payloads = {}


Received = tuple[IntArray, IntArray, IntArray]
"""Messages that one agent receives: senders ``(k,)``, their actions ``(k,)`` as received, and the
numbers ``(k,)`` of decisions since they were sent, or `GARBLED`."""


class Messages:
    """The messages of a team.

    The payload of a message shares the fate of its action. Agents that send payloads also receive
    the actions and payloads of their neighbors from the previous decision.

    Parameters
    ----------
    hierarchy
        Order of decisions and communication.
    failures
        Message failures and absences, with their times.
    n_actions
        Number of actions of every agent.
    has_payloads
        Whether some agents send payloads.

    Attributes
    ----------
    hierarchy
        Hierarchy of the agents that are present; repaired when agents leave.
    left
        ``(n,)`` whether an agent has left the team.

    Raises
    ------
    ValueError
        If a failure names an unknown agent.

    Examples
    --------
    >>> from nested_agents.core.hierarchy.failures import LostMessages
    >>> chain = Hierarchy("abc", [("a", "b"), ("b", "c")])
    >>> messages = Messages(chain, [LostMessages(agents="a")], n_actions=4)
    >>> messages.reset(0, episode=0)
    >>> senders, actions, _ = messages.received(2, np.array([3, 1, 0]))
    >>> senders.tolist(), actions.tolist()
    ([1], [1])
    """

    def __init__(
        self,
        hierarchy: Hierarchy,
        failures: Sequence[MessageFailure],
        n_actions: int,
        *,
        has_payloads: bool = False,
    ) -> None:
        self.failures = tuple(failures)
        self._n_actions = n_actions
        self._masks = [
            failure.mask(hierarchy.agents, f"topology.failures[{k}]")
            for k, failure in enumerate(failures)
        ]
        self._repaired: dict[tuple[int, ...], Hierarchy] = {(): hierarchy}
        self._neighbors: list[list[int]] = [[] for _ in hierarchy.agents]
        for a, b in hierarchy.neighbors if hierarchy.communication != "none" else ():
            self._neighbors[a].append(b)
            self._neighbors[b].append(a)
        self._history_length = max([f.history_length for f in failures], default=0) + has_payloads
        self._departures: tuple[int, ...] | None = None
        self.reset(0, 0)

    def reset(self, seed: int | np.random.SeedSequence, episode: int) -> None:
        """Start an episode; random failures follow from `seed`."""
        self._rng = stream_of(seed, STREAM)
        self._episode = episode
        self._step = 0
        self._past_actions: list[IntArray] = []
        self._past_payloads: list[Payloads] = []
        self._activate_failures()

    def advance(self, joint_action: IntArray, payloads: Payloads = NO_PAYLOADS) -> None:
        """Keep the actions and payloads of a decision, and go on to the next one."""
        if self._history_length:
            sent = np.where(self.left | self.absent, LOST, joint_action)
            past_actions = [*self._past_actions, sent]
            past_payloads = [*self._past_payloads, payloads]
            self._past_actions = past_actions[-self._history_length :]
            self._past_payloads = past_payloads[-self._history_length :]
        self._step += 1
        self._activate_failures()

    def deliver(
        self, stage: DecisionStage, joint_action: IntArray, payloads: Payloads | None = None
    ) -> Inbox:
        """Return the inbox of a stage, given the actions ``(..., n)`` decided so far.

        Agents that have left or are absent do not decide.
        """
        agents, receivers, senders = stage[1:]
        if not self.failures and payloads is None:
            return Inbox(agents, receivers, senders, joint_action[..., senders])
        agents = agents[~(self.left | self.absent)[agents]]
        mailboxes = []
        for agent in agents.tolist():
            mailboxes.append((agent, self.received(agent, joint_action)))
            if payloads is not None:
                mailboxes.append((agent, self.received_from_neighbors(agent)))
        empty = np.zeros(0, dtype=np.int64)
        received = [mailbox for _, mailbox in mailboxes]
        counts = [len(senders) for senders, _, _ in received]
        return Inbox(
            agents,
            np.repeat(np.array([agent for agent, _ in mailboxes], dtype=np.int64), counts),
            np.concatenate([empty, *(senders for senders, _, _ in received)]),
            np.concatenate([empty, *(actions for _, actions, _ in received)]),
            () if payloads is None else self._payloads_of(received, payloads),
        )

    def received(self, agent: int, joint_action: IntArray) -> Received:
        """Return the messages that reach an agent, given the actions decided so far."""
        return self._transmit(self._senders[agent], [*self._past_actions, joint_action], 0)

    def received_from_neighbors(self, agent: int) -> Received:
        """Return the messages that neighbors sent in the previous decision."""
        senders = np.array(sorted(self._neighbors[agent]), dtype=np.int64)
        if not self._past_actions:
            return senders[:0], senders[:0], senders[:0]
        return self._transmit(senders, self._past_actions, 1)

    @property
    def absent(self) -> BoolArray:
        """Whether agents ``(n,)`` take no part in the present decision, unknown to the others."""
        absent: BoolArray = np.zeros(len(self.left), dtype=bool)
        for k in self._active:
            if isinstance(self.failures[k], AbsentAgents):
                absent |= self._masks[k]
        return absent

    def actions_of_left(self, actions: Sequence[int], neutral: int) -> IntArray:
        """Return the actions ``(n,)`` of agents that have left, by failure; others are neutral."""
        joint_action = np.full(len(self.left), neutral)
        for k in self._active:
            if isinstance(self.failures[k], LeftAgents):
                joint_action[self._masks[k]] = actions[k]
        return joint_action

    def failing(self, episode: int, steps: int) -> IntArray:
        """Return what fails in the first steps of an episode ``(steps, n)``.

        It is 0 for an agent without failures, 1 if its messages fail, and 2 if it is absent.
        """
        active = [[f.lasts(episode, step) for f in self.failures] for step in range(steps)]
        absences = [isinstance(f, AbsentAgents | LeftAgents) for f in self.failures]
        named = np.array(self._masks) * np.add(absences, 1)[:, None]
        failing: IntArray = (np.array(active)[:, :, None] * named).max(axis=1)
        return failing

    def _activate_failures(self) -> None:
        now = self._episode, self._step
        self._active = [k for k, failure in enumerate(self.failures) if failure.lasts(*now)]
        departures = tuple(k for k in self._active if isinstance(self.failures[k], LeftAgents))
        if departures != self._departures:
            self._departures = departures
            self._repair_hierarchy(departures)

    def _repair_hierarchy(self, departures: tuple[int, ...]) -> None:
        """Remove the agents that failures of kind `LeftAgents` name, one after the other."""
        if departures not in self._repaired:
            hierarchy = self._repaired[()]
            for k in departures:
                failure = self.failures[k]
                if isinstance(failure, LeftAgents):
                    named = np.flatnonzero(self._masks[k]).tolist()
                    hierarchy = without(hierarchy, named, failure.repair)
            self._repaired[departures] = hierarchy
        self.hierarchy = self._repaired[departures]
        self._senders = [
            np.array(self.hierarchy.senders(i), dtype=np.int64) for i in range(len(self.hierarchy))
        ]
        self.left: BoolArray = np.zeros(len(self.hierarchy), dtype=bool)
        for k in departures:
            self.left |= self._masks[k]

    def _transmit(self, senders: IntArray, history: Sequence[IntArray], age: int) -> Received:
        """Return what arrives of the last joint action of a history, sent `age` decisions ago.

        Delays come before other failures, and of several delays the longest counts.
        """
        senders = senders[history[-1][senders] != LOST]  # absent in an earlier decision
        actions = history[-1][senders]
        ages = np.full(len(senders), age)
        delays = [failure.history_length for failure in self.failures]
        for k in sorted(self._active, key=lambda k: (delays[k] == 0, delays[k])):
            affected = np.flatnonzero(self._masks[k][senders])
            past = [joint_action[senders[affected]] for joint_action in history[:-1]]
            sent = actions[affected]
            arrived = self.failures[k].passed(sent, past, self._n_actions, self._rng)
            if delays[k]:
                ages[affected] = age + delays[k]
            else:
                ages[affected] = np.where(arrived != sent, GARBLED, ages[affected])
            actions[affected] = arrived
            is_received = actions != LOST
            senders = senders[is_received]
            actions = actions[is_received]
            ages = ages[is_received]
        return senders, actions, ages

    def _payloads_of(self, received: Sequence[Received], payloads: Payloads) -> tuple[object, ...]:
        """Return the payload of every received message."""
        by_age = [payloads, *reversed(self._past_payloads)]
        return tuple(
            None if age == GARBLED else by_age[age].get(sender)
            for senders, _, ages in received
            for sender, age in zip(senders.tolist(), ages.tolist(), strict=True)
        )
