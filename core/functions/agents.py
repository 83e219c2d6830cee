"""Agents that are functions: each is asked for its action when it is its turn.

All that is random in an answer follows from the seed, the episode, the step and the agent, whoever
else is asked, in whatever order. So topologies are compared on the same random numbers.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from ..hierarchy.turns import Turn
from ..interface.agents import Agents, Memory, Placement
from ..interface.experience import Observation
from ..interface.measures import Measure
from ..numerics import AnyArray, FloatArray, IntArray
from .asking import Asking
from .plain import HeardMessage, Query
from .recorded import canonical
from .replies import Reply
from .settings import FunctionSettings

COUNTED = (
    Measure("calls", "calls", gathering="sum", better="lower", least=0),
    Measure("message_bytes", "size of messages", "B", gathering="sum", better="lower", least=0),
)
"""What is measured of functions without being said: answers, and the size of contents."""


@dataclass
class FunctionInputs:
    """What functions decide by, and what has come of it."""

    present: FloatArray
    """``(n, d)`` the states that all agents are in."""
    replies: dict[int, Reply] = field(default_factory=dict)
    """What each has answered, by agent."""
    message_bytes: int = 0
    """Size of all contents that have arrived [B]."""


class FunctionAgents(Agents[FunctionInputs]):
    """Agents that decide by a function.

    Parameters
    ----------
    settings
        Which function, and its settings.
    placement
        Where they act.

    Raises
    ------
    ValueError
        If the function takes something else than it may; one line.
    """

    at_once = True
    has_contents = True

    def __init__(self, settings: FunctionSettings, placement: Placement) -> None:
        scenario = placement.scenario
        self.settings = settings
        self.members = placement.members
        self._agents = tuple(scenario.agents)
        self._actions = scenario.action_set.names
        self._variables = [variable.name for variable in scenario.state_space.variables]
        self._asking = Asking(settings, self._actions)
        self.rng = np.random.Generator(np.random.PCG64(placement.seed))
        self._key = placement.seed.generate_state(2, np.uint64)
        counted = [measure for measure in COUNTED if measure.name not in settings.costs]
        self.costs = (
            *counted,
            *(
                Measure(name, name, unit, gathering="sum", better="lower", least=0)
                for name, unit in settings.costs.items()
            ),
        )
        self.begin_world(0)

    def begin_world(self, episode: int) -> None:
        """Begin an episode: nobody remembers the one before."""
        self._episode = episode
        self._step = 0
        self._asking.begin()

    def perceive(self, seen: Observation, *, explore: bool) -> FunctionInputs:
        """Return what all see."""
        return FunctionInputs(seen.present)

    def decide(self, inputs: FunctionInputs, turn: Turn) -> IntArray:
        """Return what some agents answer to what they see and have been told."""
        agents = turn.agents.tolist()
        told = self._told(inputs, turn)
        queries = [self._query(inputs, agent, told[agent]) for agent in agents]
        inputs.replies |= dict(zip(agents, self._asking.replies(queries), strict=True))
        return np.array([inputs.replies[agent].action for agent in agents])

    def _query(self, inputs: FunctionInputs, agent: int, told: Mapping[str, HeardMessage]) -> Query:
        seen = dict(zip(self._variables, inputs.present[agent].tolist(), strict=True))
        place = [0, agent, self._step, self._episode]
        rng = np.random.Generator(np.random.Philox(counter=place, key=self._key))
        seed = (*self._key.tolist(), *place[1:])
        return Query(self._agents[agent], seen, told, rng, self._actions, self._step, seed)

    def _told(self, inputs: FunctionInputs, turn: Turn) -> dict[int, dict[str, HeardMessage]]:
        """Return the messages of each agent by sender, in agent order, and count them."""
        told: dict[int, dict[str, HeardMessage]] = {agent: {} for agent in turn.agents.tolist()}
        hears = self.settings.hears == "contents" and bool(turn.contents)
        contents = turn.contents if hears else (None,) * len(turn.senders)
        # What a sender says to all is one object; it is measured once.
        messages: dict[tuple[int, int, int], tuple[HeardMessage, int]] = {}
        arrays = (turn.receivers.tolist(), turn.senders.tolist(), turn.actions.tolist())
        for receiver, sender, action, content in zip(*arrays, contents, strict=True):
            key = sender, action, id(content)
            if key not in messages:
                message = HeardMessage(self._actions[action], content)
                messages[key] = message, 0 if content is None else len(canonical(content).encode())
            message, size = messages[key]
            if isinstance(content, list | dict):  # what one does with it changes nobody else's
                message = message._replace(content=deepcopy(content))
            told[receiver][self._agents[sender]] = message
            inputs.message_bytes += size
        return told

    def contents(self, inputs: FunctionInputs) -> Mapping[int, object]:
        """Return by agent what has been said so far."""
        replies = inputs.replies.items()
        return {agent: reply.message for agent, reply in replies if reply.message is not None}

    def spent(self, inputs: FunctionInputs) -> Mapping[str, float]:
        """Return what all answers of a decision have cost."""
        total = {measure.name: 0.0 for measure in self.costs}
        counts = (len(inputs.replies), inputs.message_bytes)
        for measure, count in zip(COUNTED, counts, strict=True):
            if measure.name not in self.settings.costs:
                total[measure.name] = float(count)
        for reply in inputs.replies.values():
            for name, value in reply.costs.items():
                total[name] += value
        return total

    def conclude(self, inputs: FunctionInputs, joint_action: IntArray) -> None:
        """Go on to the next decision."""
        self._step += 1

    def memory(self) -> Memory:
        """Return who they are: they remember nothing from one episode to the next."""
        return {"members": self.members}

    def restore(self, memory: Mapping[str, AnyArray]) -> None:
        """Refuse what other agents remember."""
        if memory.keys() != {"members"} or not np.array_equal(memory["members"], self.members):
            raise ValueError(f"team: saved arrays are not of the function {self.settings.kind}")

    def continue_from(self, former: Self) -> None:
        """Go on in another world, with nothing learned."""
