"""The messages of a team: who is told what in a decision, given what fails and who has left."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..numerics import BoolArray, IntArray, stream_of
from .failures import (
    GARBLED,
    LOST,
    STREAM,
    AbsentAgents,
    LeftAgents,
    MessageFailure,
    ReparentedAgents,
    Sent,
)
from .hierarchy import Hierarchy
from .repair import without
from .turns import Turn

NOTHING: Mapping[int, object] = {}
"""What is said beside actions by agents who tell nothing else."""


class Arrived(NamedTuple):
    """The messages that arrive at an agent."""

    senders: IntArray
    """``(k,)`` whose they are."""
    actions: IntArray
    """``(k,)`` what these have decided, as it arrives."""
    ages: IntArray
    """``(k,)`` how many decisions ago that was said, or `GARBLED`."""


class Messages:
    """The messages of a team: which agent is told which actions in a decision.

    What is said beside an action, its content, has the fate of the message. Agents who tell more
    than actions are also told what their neighbours did and said in the decision before.

    Parameters
    ----------
    hierarchy
        Who is told by whom.
    failures
        What fails, and when.
    n_actions
        Actions of every agent.
    has_contents
        Whether there are agents who tell more than actions.

    Raises
    ------
    ValueError
        If a failure names an agent that there is not, or a superior that decides too late.

    Examples
    --------
    >>> from nested_agents.core.hierarchy.failures import LostMessages
    >>> chain = Hierarchy("abc", [("a", "b"), ("b", "c")])
    >>> messages = Messages(chain, [LostMessages(agents="a")], n_actions=4)
    >>> messages.begin(0, episode=0)
    >>> arrived = messages.heard(2, np.array([3, 1, 0]))
    >>> arrived.senders.tolist(), arrived.actions.tolist()
    ([1], [1])
    """

    def __init__(
        self,
        hierarchy: Hierarchy,
        failures: Sequence[MessageFailure],
        n_actions: int,
        *,
        has_contents: bool = False,
    ) -> None:
        n = len(hierarchy)
        self.failures, self._n_actions = tuple(failures), n_actions
        """What is ever to fail."""
        where = "topology.failures[{}]".format
        self._masks = [f.mask(hierarchy.agents, where(k)) for k, f in enumerate(failures)]
        self.hierarchy = hierarchy
        """Who decides before whom of those who are there."""
        self.gone: BoolArray = np.zeros(n, dtype=bool)
        """``(n,)`` who has left."""
        self.told: list[IntArray] = [
            np.array(hierarchy.senders(i), dtype=np.int64) for i in range(n)
        ]
        """Per agent those who tell it, if no message fails."""
        self._repaired: dict[tuple[int, ...], Hierarchy] = {(): hierarchy}
        self._told_instead = {
            k: _reparented(hierarchy, failure, np.flatnonzero(self._masks[k]), where(k))
            for k, failure in enumerate(failures)
            if isinstance(failure, ReparentedAgents)
        }
        beside: list[list[int]] = [[] for _ in range(n)]
        for a, b in hierarchy.neighbors if hierarchy.communication != "none" else ():
            beside[a].append(b)
            beside[b].append(a)
        self._beside = [np.array(sorted(others), dtype=np.int64) for others in beside]
        self._memory = max([failure.memory for failure in failures], default=0) + has_contents
        self.begin(0, 0)

    def begin(self, seed: int | np.random.SeedSequence, episode: int) -> None:
        """Start an episode; what is random in it follows from `seed`."""
        self._rng = stream_of(seed, STREAM)
        self._episode, self._step = episode, 0
        self._past: list[IntArray] = []
        self._contents: list[Mapping[int, object]] = []
        self._strike()

    def advance(self, joint_action: IntArray, contents: Mapping[int, object] = NOTHING) -> None:
        """Note what all did in a decision, and said beside, after which the next one comes."""
        if self._memory:
            self._past = [*self._past, joint_action.copy()][-self._memory :]
            self._contents = [*self._contents, contents][-self._memory :]
        self._step += 1
        self._strike()

    def _strike(self) -> None:
        now = self._episode, self._step
        self._active = [k for k, f in enumerate(self.failures) if f.lasts(*now)]
        self._arrange(tuple(k for k in self._active if isinstance(self.failures[k], LeftAgents)))

    def _arrange(self, left: tuple[int, ...]) -> None:
        """Repair the hierarchy for those whom some failures have let leave."""
        if left in self._repaired and self._repaired[left] is self.hierarchy:
            return
        if left not in self._repaired:
            self._repaired[left] = self._without(left)
        self.hierarchy = self._repaired[left]
        every = range(len(self.hierarchy))
        self.told = [np.array(self.hierarchy.senders(i), dtype=np.int64) for i in every]
        self.gone = np.zeros(len(self.hierarchy), dtype=bool)
        for k in left:
            self.gone |= self._masks[k]

    def _without(self, left: Sequence[int]) -> Hierarchy:
        """Return the hierarchy without those whom some failures name, one after the other."""
        hierarchy = self._repaired[()]
        for k in left:
            failure = self.failures[k]
            if isinstance(failure, LeftAgents):
                names = np.flatnonzero(self._masks[k]).tolist()
                hierarchy = without(hierarchy, names, failure.repair)
        return hierarchy

    def acting_for(self, actions: Sequence[int], neutral: int) -> IntArray:
        """Return what agents do who have left ``(n,)``, by what each failure has them do."""
        joint = np.full(len(self.told), neutral)
        for k in self._active:
            if isinstance(self.failures[k], LeftAgents):
                joint[self._masks[k]] = actions[k]
        return joint

    def failing(self, episode: int, moments: int) -> BoolArray:
        """Return whose messages fail before each of the first decisions of an episode.

        The array is ``(moments, n)``; of agents with another superior, those to them fail.
        """
        when = [[f.lasts(episode, step) for f in self.failures] for step in range(moments)]
        return np.array(when) @ np.array(self._masks)

    def absent(self, agents: IntArray) -> IntArray:
        """Return who of some agents takes no part in the present decision."""
        absent: BoolArray = np.zeros(len(self.told), dtype=bool)
        for k in self._active:
            if isinstance(self.failures[k], AbsentAgents):
                absent |= self._masks[k]
        return agents[absent[agents]]

    def failed_turn(self, agents: IntArray, joint_action: IntArray) -> Turn:
        """Return the turn of some agents, with what of the messages arrives and as it does."""
        return _turn(agents, [self.heard(agent, joint_action) for agent in agents.tolist()])

    def turn_with_contents(
        self, agents: IntArray, joint_action: IntArray, contents: Mapping[int, object]
    ) -> Turn:
        """Return the turn of some agents who are also told what is said beside actions.

        Their neighbours' actions and contents are those of the decision before.
        """
        every = [
            arrived
            for agent in agents.tolist()
            for arrived in (self.heard(agent, joint_action), self.heard_before(agent))
        ]
        by_age = [contents, *reversed(self._contents)]
        contents_of = [
            None if age == GARBLED else by_age[age].get(sender)
            for arrived in every
            for sender, age in zip(arrived.senders.tolist(), arrived.ages.tolist(), strict=True)
        ]
        turn = _turn(np.repeat(agents, 2), every)
        return turn._replace(agents=agents, contents=tuple(contents_of))

    def heard(self, agent: int, joint_action: IntArray) -> Arrived:
        """Return whom an agent hears of, and what, given what has been decided."""
        senders = self.told[agent]
        for k in self._active:
            senders = self._told_instead[k][agent] if k in self._told_instead else senders
        return self._arrived(senders, joint_action, self._past, 0)

    def heard_before(self, agent: int) -> Arrived:
        """Return what an agent hears of its neighbours: what they did in the decision before."""
        *past, last = self._past or [np.zeros(len(self.told), dtype=np.int64)]
        senders = self._beside[agent] if self._past else self._beside[agent][:0]
        return self._arrived(senders, last, past, 1)

    def _arrived(
        self, senders: IntArray, joint_action: IntArray, before: Sequence[IntArray], age: int
    ) -> Arrived:
        """Return what arrives of what some agents say of a decision, an age ago."""
        actions = joint_action[senders]
        ages = np.full(len(senders), age)
        for k in self._active:
            concerned = np.flatnonzero(self._masks[k][senders])
            past = [joint[senders[concerned]] for joint in before]
            sent = Sent(actions[concerned], past, self._n_actions, self._rng)
            passed = self.failures[k].passed(sent)
            ages[concerned] = self.failures[k].ages(sent, passed, ages[concerned])
            actions[concerned] = passed
            arrive = actions != LOST
            senders, actions, ages = senders[arrive], actions[arrive], ages[arrive]
        return Arrived(senders, actions, ages)


def _turn(agents: IntArray, arrived: Sequence[Arrived]) -> Turn:
    """Return the turn of some agents at which messages arrive."""
    receivers = np.repeat(agents, [len(own.senders) for own in arrived])
    senders = np.concatenate([own.senders for own in arrived])
    return Turn(agents, receivers, senders, np.concatenate([own.actions for own in arrived]))


def _reparented(
    hierarchy: Hierarchy, failure: ReparentedAgents, agents: IntArray, where: str
) -> dict[int, IntArray]:
    """Return who is told by whom when some agents have another superior."""
    names, order = hierarchy.agents, hierarchy.order
    known = f"{where}.superior = {failure.superior!r}"
    if failure.superior not in names:
        raise ValueError(f"{known}: no such agent, allowed {', '.join(names[:8])}")
    superior = names.index(failure.superior)
    for agent in agents:
        if order.index(superior) >= order.index(agent):
            raise ValueError(f"{known}: must decide before {names[agent]!r}")
    edges = [(names[a], names[b]) for a, b in hierarchy.edges if b not in agents]
    edges += [(failure.superior, names[agent]) for agent in agents]
    changed = Hierarchy(
        names, edges, communication=hierarchy.communication, bodies=hierarchy.bodies
    )
    return {i: np.array(changed.senders(i), dtype=np.int64) for i in range(len(hierarchy))}
