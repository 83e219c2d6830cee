"""Failures of messages between agents, and absences of agents, with their times.

Messages of named agents are lost, delayed or replaced by random actions; agents are absent or leave
the team. Random failures have a random stream of their own, so that
environments and policies stay paired. The setting `unseen` of `core.search.settings` says what
agents assume about actions that they did not receive.
"""

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.random import Generator
from pydantic import Field, NonNegativeInt, model_validator

from ..numerics import BoolArray, IntArray
from ..plugins.settings import Fraction, Names, Settings, mask_of
from .repair import Repair


class Scheduled(Settings):
    """A failure with a beginning and, optionally, an end.

    A failure begins at a step of an episode and lasts over all further episodes until its end.
    Evaluation follows all training.
    """

    part: ClassVar[str] = ""
    """Name of the field that lists what fails."""

    episode: NonNegativeInt = 0
    """Episode in which the failure begins, counted from 0."""
    step: NonNegativeInt = 0
    """Step of that episode at which the failure begins."""
    end_episode: NonNegativeInt | None = None
    """Episode in which the failure ends; by default it does not end."""
    end_step: NonNegativeInt = 0
    """Step of that episode at which the failure ends."""

    @property
    def named(self) -> tuple[str, ...]:
        """Names, patterns or numbers of what fails."""
        names: tuple[str, ...] = dict(self)[self.part]
        return names

    @property
    def span(self) -> tuple[int, int | None]:
        """Episode in which the failure begins, and the first one without it, if it ends."""
        end = self.end_episode
        return self.episode, None if end is None else end + (self.end_step > 0)

    def lasts(self, episode: int, step: int) -> bool:
        """Return whether the failure is active at a step of an episode."""
        now = episode, step
        over = self.end_episode is not None and now >= (self.end_episode, self.end_step)
        return now >= (self.episode, self.step) and not over

    def mask(self, agents: Sequence[str], where: str) -> BoolArray:
        """Return whether the failure names an agent ``(n,)``.

        Raises
        ------
        ValueError
            If it names an unknown agent; `where` is the key of the failure in the settings.
        """
        return mask_of(self.named, agents, f"{where}.{self.part}")

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.end_episode is None and self.end_step:
            raise ValueError("end_step needs an end_episode")
        end = self.end_episode, self.end_step
        if end[0] is not None and end <= (self.episode, self.step):
            raise ValueError(
                f"ends at {end}, allowed: after its beginning at {self.episode, self.step}"
            )
        return self


STREAM = 2**32 - 2
"""Key of the random stream of message failures, derived from the seed of an episode. Failures of a
scenario have the keys 0, 1, ...; sensor noise has the next key after this one."""


LOST = -1
"""Action that stands for a lost message."""
GARBLED = -1
"""Age of a message with an unreadable payload."""


class MessageFailure(Scheduled):
    """A failure of the messages of some agents during some time; by default none arrives."""

    part: ClassVar[str] = "agents"

    kind: str = ""
    agents: Names
    """Names or patterns of agents, one or a list."""

    @property
    def text(self) -> str:
        """One-line description."""
        written = self.model_dump(exclude={"kind", "agents"}, exclude_defaults=True).items()
        rest = "".join(f", {key} {value}" for key, value in written)
        return f"{self.kind or 'failing'}: {', '.join(self.agents)}{rest}"

    @property
    def history_length(self) -> int:
        """Delay of the messages in decisions."""
        return 0

    def passed(
        self, actions: IntArray, past: Sequence[IntArray], n_actions: int, rng: Generator
    ) -> IntArray:
        """Return the actions that arrive ``(k,)``, with `LOST` for lost messages.

        Parameters
        ----------
        actions
            ``(k,)`` decided actions.
        past
            Actions ``(k,)`` of these agents in earlier decisions, the most recent last.
        n_actions
            Number of actions of every agent.
        rng
            Random stream of the failures.
        """
        return np.full_like(actions, LOST)


class LostMessages(MessageFailure):
    """Each message of the agents is lost with some probability."""

    kind: Literal["lost"] = "lost"
    probability: Fraction = 1.0
    """Probability that a message is lost. At 1 the agents are silent."""

    def passed(
        self, actions: IntArray, past: Sequence[IntArray], n_actions: int, rng: Generator
    ) -> IntArray:
        """Return the actions, some of them lost."""
        return np.where(rng.random(len(actions)) >= self.probability, actions, LOST)


class DelayedMessages(MessageFailure):
    """Each message of the agents arrives some decisions late."""

    kind: Literal["delayed"] = "delayed"
    decisions: Annotated[int, Field(ge=1, le=1000)] = 1
    """Delay in decisions. No message arrives in the first decisions of an episode."""

    @property
    def history_length(self) -> int:
        """The delay."""
        return self.decisions

    def passed(
        self, actions: IntArray, past: Sequence[IntArray], n_actions: int, rng: Generator
    ) -> IntArray:
        """Return the actions of an earlier decision."""
        is_early = len(past) < self.decisions
        return np.full_like(actions, LOST) if is_early else past[-self.decisions]


class NoisyMessages(MessageFailure):
    """Each message of the agents is replaced by a random action with some probability."""

    kind: Literal["noisy"] = "noisy"
    probability: Fraction = 0.3
    """Probability that a message is replaced."""

    def passed(
        self, actions: IntArray, past: Sequence[IntArray], n_actions: int, rng: Generator
    ) -> IntArray:
        """Return the actions, some of them replaced by random ones."""
        k = len(actions)
        noise = rng.integers(n_actions, size=k, dtype=np.int64)
        return np.where(rng.random(k) < self.probability, noise, actions)


class AbsentAgents(MessageFailure):
    """The agents perform the neutral action and send no messages; the others are not informed."""

    kind: Literal["absent"] = "absent"


class LeftAgents(MessageFailure):
    """The agents have left the team, and all others know. The hierarchy is repaired.

    Agents that have left neither decide nor communicate, and no agent searches over them. An agent
    that joins later is absent from the first episode until it joins.
    """

    kind: Literal["left"] = "left"
    repair: Repair = "grandparents"
    """New superiors of the subordinates of an agent that has left: its superiors
    (``grandparents``), the ``next`` subordinate in the order of decision, which takes its place, or
    no agent (``none``)."""
    action: str | None = None
    """Action of the agents meanwhile; by default the neutral one."""


AnyMessageFailure = Annotated[
    LostMessages | DelayedMessages | NoisyMessages | AbsentAgents | LeftAgents,
    Field(discriminator="kind"),
]
"""Any message failure, distinguished by `kind`."""


def actions_of_left(
    failures: Sequence[MessageFailure], names: Sequence[str], neutral: int
) -> list[int]:
    """Return the action of agents that have left, for every failure.

    Raises
    ------
    ValueError
        If an action is unknown; one line.
    """
    actions = []
    for k, failure in enumerate(failures):
        action = failure.action if isinstance(failure, LeftAgents) else None
        if action is not None and action not in names:
            raise ValueError(
                f"topology.failures[{k}].action = {action!r}: unknown action, allowed: "
                f"{', '.join(names)}"
            )
        actions.append(neutral if action is None else names.index(action))
    return actions
