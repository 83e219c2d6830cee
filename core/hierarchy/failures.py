"""What fails, by name and from when to when; messages down the hierarchy, and how they fail.

An agent is told the actions that those above it have decided. A failure of messages concerns what
named agents say: it is lost, late, wrong, or not said at all because the agent is absent; or an
agent is told by others than it was. All that is random here has a stream of its own, so that worlds
and policies stay paired. How an agent reads what it was not told is the team's own business, see
`nested_agents.core.learners.learner`.
"""

from collections.abc import Mapping, Sequence
from typing import Annotated, ClassVar, Literal, NamedTuple, Self

import numpy as np
from numpy.random import Generator
from pydantic import Field, NonNegativeInt, model_validator

from ..numerics import BoolArray, IntArray, stream_of
from ..plugins.settings import Fraction, Names, Settings, mask_of
from .hierarchy import Hierarchy
from .turns import Turn


class Scheduled(Settings):
    """From when to when something fails.

    A failure begins at its step of its episode and lasts, from episode to episode, until its end;
    evaluation comes after all training.
    """

    part: ClassVar[str] = ""
    """The field that names what fails."""

    episode: NonNegativeInt = 0
    """Episode in which it begins, counted from 0."""
    step: NonNegativeInt = 0
    """Step of that episode at which it begins."""
    end_episode: NonNegativeInt | None = None
    """Episode in which it ends; none: it lasts."""
    end_step: NonNegativeInt = 0
    """Step of that episode at which it ends."""

    @property
    def named(self) -> tuple[str, ...]:
        """What it names, by name, pattern or number: its field called `part`."""
        names: tuple[str, ...] = dict(self)[self.part]
        return names

    def lasts(self, episode: int, step: int) -> bool:
        """Return whether it is on at a step of an episode."""
        now = episode, step
        over = self.end_episode is not None and now >= (self.end_episode, self.end_step)
        return now >= (self.episode, self.step) and not over

    def mask(self, agents: Sequence[str], where: str) -> BoolArray:
        """Return which of the agents ``(n,)`` it names.

        Raises
        ------
        ValueError
            If it names one that there is not; the line begins with the key `where` it stands.
        """
        return mask_of(self.named, agents, f"{where}.{self.part}")

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.end_episode is None and self.end_step:
            raise ValueError("end_step needs an end_episode")
        end = self.end_episode, self.end_step
        if end[0] is not None and end <= (self.episode, self.step):
            raise ValueError(f"its end {end} must come after its begin {self.episode, self.step}")
        return self


STREAM = 2**32 - 2
"""Key of the stream from which failures of messages draw, under the seed of an episode's world;
failures of a scenario have 0, 1, ..., and sensor noise the key after this."""


NOTHING: Mapping[int, object] = {}
"""What is said beside actions by agents who tell nothing else."""
LOST = -1
"""What arrives where a message does not."""
GARBLED = -1
"""Age of a message whose content nobody can read any more."""


class Sent(NamedTuple):
    """Messages of some agents before they fail."""

    actions: IntArray
    """``(k,)`` what they have decided."""
    past: Sequence[IntArray]
    """The same of the decisions before, the last one last."""
    n_actions: int
    """Actions of every agent."""
    rng: Generator
    """For what is random."""


class MessageFailure(Scheduled):
    """A failure of the messages of some agents, from when to when."""

    part: ClassVar[str] = "agents"

    kind: str = ""
    agents: Names
    """Agents by name or pattern, one or a list."""

    @property
    def text(self) -> str:
        """What fails, in a line."""
        written = self.model_dump(exclude={"kind", "agents"}, exclude_defaults=True).items()
        rest = "".join(f", {key} {value}" for key, value in written)
        return f"{self.kind or 'failing'}: {', '.join(self.agents)}{rest}"

    @property
    def memory(self) -> int:
        """How many decisions back it needs what was decided."""
        return 0

    def passed(self, sent: Sent) -> IntArray:
        """Return what arrives ``(k,)``, `LOST` where nothing does."""
        return sent.actions

    def ages(self, sent: Sent, arrived: IntArray, ages: IntArray) -> IntArray:
        """Return how many decisions ago was said what arrives ``(k,)``, or `GARBLED`."""
        return np.where(arrived == sent.actions, ages, GARBLED)


class LostMessages(MessageFailure):
    """Each message of the agents is lost with a probability."""

    kind: Literal["lost"] = "lost"
    probability: Fraction = 1.0
    """Of each message; 1: the agents are silent."""

    def passed(self, sent: Sent) -> IntArray:
        """Return what is not lost."""
        arrives = sent.rng.random(len(sent.actions)) >= self.probability
        return np.where(arrives, sent.actions, LOST)


class DelayedMessages(MessageFailure):
    """Each message of the agents arrives some decisions late."""

    kind: Literal["delayed"] = "delayed"
    decisions: Annotated[int, Field(ge=1, le=1000)] = 1
    """How many; before as many have been made, nothing is said."""

    @property
    def memory(self) -> int:
        """As many decisions back."""
        return self.decisions

    def passed(self, sent: Sent) -> IntArray:
        """Return what the agents did as many decisions before."""
        is_early = len(sent.past) < self.decisions
        return np.full_like(sent.actions, LOST) if is_early else sent.past[-self.decisions]

    def ages(self, sent: Sent, arrived: IntArray, ages: IntArray) -> IntArray:
        """Return as many decisions more."""
        return ages + self.decisions


class NoisyMessages(MessageFailure):
    """Each message of the agents is replaced by a random action with a probability."""

    kind: Literal["noisy"] = "noisy"
    probability: Fraction = 0.3
    """Of each message."""

    def passed(self, sent: Sent) -> IntArray:
        """Return the actions, some of them replaced by random ones."""
        k, rng = len(sent.actions), sent.rng
        noise = rng.integers(sent.n_actions, size=k, dtype=np.int64)
        return np.where(rng.random(k) < self.probability, noise, sent.actions)


class AbsentAgents(MessageFailure):
    """The agents perform the neutral action and send no messages; nobody knows."""

    kind: Literal["absent"] = "absent"

    def passed(self, sent: Sent) -> IntArray:
        """Return that nothing arrives."""
        return np.full_like(sent.actions, LOST)


class ReparentedAgents(MessageFailure):
    """The agents are told by another superior; those who consider them do not know."""

    kind: Literal["reparented"] = "reparented"
    superior: str
    """Name of an agent that decides before them."""


AnyMessageFailure = Annotated[
    LostMessages | DelayedMessages | NoisyMessages | AbsentAgents | ReparentedAgents,
    Field(discriminator="kind"),
]
"""Any failure of messages: a table distinguished by `kind`."""


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
        self.told: list[IntArray] = [np.array(hierarchy.above(i), dtype=np.int64) for i in range(n)]
        """Per agent those who tell it, if nothing fails."""
        self._told_instead = {
            k: _reparented(hierarchy, failure, np.flatnonzero(self._masks[k]), where(k))
            for k, failure in enumerate(failures)
            if isinstance(failure, ReparentedAgents)
        }
        beside: list[list[int]] = [[] for _ in range(n)]
        for a, b in hierarchy.neighbours if hierarchy.told != "none" else ():
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

    def failing(self, episode: int, moments: int) -> BoolArray:
        """Return whose messages fail before each of the first decisions of an episode.

        The array is ``(moments, n)``; of agents with another superior, those to them fail.
        """
        when = [[f.lasts(episode, step) for f in self.failures] for step in range(moments)]
        return np.array(when) @ np.array(self._masks)

    def absent(self, agents: IntArray) -> IntArray:
        """Return who of some agents takes no part in the present decision."""
        absent = np.zeros(len(self.told), dtype=bool)
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
    changed = Hierarchy(names, edges, told=hierarchy.told, bodies=hierarchy.bodies)
    return {i: np.array(changed.above(i), dtype=np.int64) for i in range(len(hierarchy))}
