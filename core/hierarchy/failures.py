"""What fails, by name and from when to when: messages down the hierarchy, and agents that leave.

An agent is told the actions that those above it have decided. A failure of messages concerns what
named agents say: it is lost, late, wrong, or not said at all because the agent is absent; or an
agent is told by others than it was. All that is random here has a stream of its own, so that worlds
and policies stay paired. How an agent reads what it was not told is the team's own business, see
`nested_agents.core.learners.learner`.
"""

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal, NamedTuple, Self

import numpy as np
from numpy.random import Generator
from pydantic import Field, NonNegativeInt, model_validator

from ..numerics import BoolArray, IntArray
from ..plugins.settings import Fraction, Names, Settings, mask_of
from .repair import Repair


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
    def history_length(self) -> int:
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
    def history_length(self) -> int:
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


class LeftAgents(MessageFailure):
    """The agents have left the team, and all know; the hierarchy is repaired by a rule.

    They decide nothing, say nothing, and are neither told nor considered. An agent that joins later
    has left from the first episode on, until it comes.
    """

    kind: Literal["left"] = "left"
    repair: Repair = "grandparents"
    """Who stands above those right below an agent that has left: those above it, ``grandparents``;
    the ``next`` of them in the order of decision, who takes its place; or ``none``."""
    action: str | None = None
    """Name of the action that they perform meanwhile; none: the neutral one."""

    def passed(self, sent: Sent) -> IntArray:
        """Return that nothing arrives."""
        return np.full_like(sent.actions, LOST)


AnyMessageFailure = Annotated[
    LostMessages | DelayedMessages | NoisyMessages | AbsentAgents | ReparentedAgents | LeftAgents,
    Field(discriminator="kind"),
]
"""Any failure of messages: a table distinguished by `kind`."""
