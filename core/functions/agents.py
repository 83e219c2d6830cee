"""Agents that decide by a function.

A function has some of the parameters in `PARAMETERS`; a function that decides for several agents in
one call has some of those in `BATCH_PARAMETERS`, which are lists with one entry per agent except
for ``actions`` and ``step``. All randomness of an answer follows from the seed, the episode, the
step and the agent, so that topologies are compared with common random numbers.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from inspect import Parameter, iscoroutinefunction, signature
from typing import Any, NamedTuple, Self

import numpy as np

from ..hierarchy.stages import Inbox
from ..interface.agents import AgentContext, Agents, StateDict
from ..interface.experience import Observation
from ..interface.measures import Measure
from ..learners import LEARNERS
from ..numerics import AnyArray, FloatArray, IntArray
from ..plugins import sources
from .replies import Reply, canonical, read_reply
from .settings import FunctionSettings

PARAMETERS = ("observation", "received", "rng", "agent", "actions", "step")
"""Parameters that a function may have."""
BATCH_PARAMETERS = ("observations", "received", "rngs", "agents", "actions", "step")
"""Parameters that a function may have which decides for several agents in one call."""
COMMON = ("actions", "step")
"""Parameters that are equal for all agents."""
COUNTED = (
    Measure("calls", "calls", gathering="sum", better="lower", least=0),
    Measure("message_bytes", "size of messages", "B", gathering="sum", better="lower", least=0),
)
"""Measures of all function agents: answers, and the size of the contents received."""


class FunctionError(ValueError):
    """A function did not answer as it should; one line that names the agent."""


class ReceivedMessage(NamedTuple):
    """Message of another agent."""

    action: str
    """Action that the sender decided."""
    content: Any = None
    """Content that the sender added; None if it added nothing, or the message was garbled."""


@dataclass
class FunctionInputs:
    """Inputs and answers of one decision."""

    states: FloatArray
    """States of all agents ``(n, d)``."""
    replies: dict[int, Reply] = field(default_factory=dict)
    """Answer of each agent that has decided."""
    message_bytes: int = 0
    """Size of all contents received [B]."""


class FunctionAgents(Agents[FunctionInputs]):
    """Agents that decide by a function.

    Parameters
    ----------
    settings
        The function and its settings.
    context
        Scenario, hierarchy, and random seed of the agents.

    Raises
    ------
    ValueError
        If the function is asynchronous, or has a parameter that is not allowed.
    """

    acts_in_parallel = True

    def __init__(self, settings: FunctionSettings, context: AgentContext) -> None:
        scenario = context.scenario
        self.settings = settings
        self.members = context.members
        self._agents = tuple(scenario.agents)
        self._actions = scenario.action_set.names
        self._variables = [variable.name for variable in scenario.state_space.variables]
        self._function: Callable[..., object] = LEARNERS.find(settings.kind)
        self._parameters = parameters_of(settings.kind, self._function)
        own = type(settings).model_fields.keys() - FunctionSettings.model_fields.keys()
        self._options = {name: value for name, value in settings if name in own}
        self.rng = np.random.Generator(np.random.PCG64(context.seed))
        self._key = context.seed.generate_state(2, np.uint64)
        measures = {measure.name: measure for measure in COUNTED}
        for name, unit in settings.costs.items():
            measures[name] = Measure(name, name, unit, gathering="sum", better="lower", least=0)
        self.costs = tuple(measures.values())
        self.reset(0, learn=False)

    def reset(self, episode: int, *, learn: bool) -> None:
        """Start an episode."""
        self._episode = episode
        self._step = -1

    def observe(self, seen: Observation, *, explore: bool) -> FunctionInputs:
        """Advance to the next decision and return its inputs."""
        self._step += 1
        return FunctionInputs(seen.states)

    def act(self, inputs: FunctionInputs, inbox: Inbox) -> IntArray:
        """Return the actions ``(k,)`` of the agents of a stage.

        Raises
        ------
        FunctionError
            If the function raises an error, or does not return an action.
        """
        agents = inbox.agents.tolist()
        received = self._received(inputs, inbox)
        arguments = [self._arguments(inputs, agent, received[agent]) for agent in agents]
        if "observations" in self._parameters:
            answers = self._call_batch(arguments)
        else:
            answers = [
                self._call(str(own["agent"]), {name: own[name] for name in self._parameters})
                for own in arguments
            ]
        for agent, answer in zip(agents, answers, strict=True):
            try:
                reply = read_reply(answer, self._actions, self.settings.costs)
            except ValueError as error:
                raise FunctionError(
                    f"agent {self._agents[agent]!r}: {self.settings.kind} {error}"
                ) from None
            inputs.replies[agent] = reply
        return np.array([inputs.replies[agent].action for agent in agents])

    def _arguments(
        self, inputs: FunctionInputs, agent: int, received: Mapping[str, ReceivedMessage]
    ) -> dict[str, object]:
        """Return the value of every parameter in `PARAMETERS` for one agent."""
        state = inputs.states[agent].tolist()
        counter = [0, agent, self._step, self._episode]
        return {
            "observation": dict(zip(self._variables, state, strict=True)),
            "received": received,
            "rng": np.random.Generator(np.random.Philox(counter=counter, key=self._key)),
            "agent": self._agents[agent],
            "actions": self._actions,
            "step": self._step,
        }

    def _call_batch(self, given: Sequence[Mapping[str, object]]) -> Sequence[object]:
        chosen: dict[str, object] = {}
        for one, many in zip(PARAMETERS, BATCH_PARAMETERS, strict=True):
            if many in self._parameters:
                chosen[many] = given[0][one] if one in COMMON else [own[one] for own in given]
        first = str(given[0]["agent"])
        answers = self._call(first, chosen)
        if not isinstance(answers, list | tuple | np.ndarray) or len(answers) != len(given):
            raise FunctionError(
                f"agent {first!r}: {self.settings.kind} returns {answers!r:.60}, allowed: a list "
                f"of {len(given)} answers"
            )
        return list(answers)

    def _call(self, agent: str, chosen: Mapping[str, object]) -> object:
        try:
            return self._function(**chosen, **self._options)
        except (Exception, SystemExit) as error:
            reason = f"{sources.format_error(error)}{sources.place(error)}"
            raise FunctionError(f"agent {agent!r}: {self.settings.kind} raises {reason}") from error

    def _received(
        self, inputs: FunctionInputs, inbox: Inbox
    ) -> dict[int, dict[str, ReceivedMessage]]:
        """Return the messages of each agent by sender, in agent order, and count their size."""
        received: dict[int, dict[str, ReceivedMessage]] = {a: {} for a in inbox.agents.tolist()}
        contents = inbox.payloads
        if self.settings.hears == "actions" or not contents:
            contents = (None,) * len(inbox.senders)
        arrays = (inbox.receivers.tolist(), inbox.senders.tolist(), inbox.actions.tolist())
        for receiver, sender, action, content in zip(*arrays, contents, strict=True):
            if content is not None:  # receivers may modify what they receive
                text = canonical(content)
                inputs.message_bytes += len(text.encode())
                content = json.loads(text)
            received[receiver][self._agents[sender]] = ReceivedMessage(
                self._actions[action], content
            )
        return received

    def payloads(self, inputs: FunctionInputs) -> Mapping[int, object]:
        """Return the contents of the messages of this decision by agent."""
        replies = inputs.replies.items()
        return {agent: reply.message for agent, reply in replies if reply.message is not None}

    def decision_costs(self, inputs: FunctionInputs, joint_action: IntArray) -> Mapping[str, float]:
        """Return the costs of all answers of a decision."""
        counted = {
            "calls": float(len(inputs.replies)),
            "message_bytes": float(inputs.message_bytes),
        }
        total = counted | dict.fromkeys(self.settings.costs, 0.0)
        for reply in inputs.replies.values():
            for name, value in reply.costs.items():
                total[name] += value
        return total

    def state_dict(self) -> StateDict:
        """Return the agents' indices; functions have no other state."""
        return {"members": self.members}

    def load_state_dict(self, state: Mapping[str, AnyArray]) -> None:
        """Check that saved arrays are those of these agents."""
        if state.keys() != {"members"} or not np.array_equal(state["members"], self.members):
            raise ValueError(f"team: saved arrays are not of the function {self.settings.kind}")

    def warm_start(self, former: Self) -> None:
        """Do nothing, because functions do not learn."""


def parameters_of(name: str, function: Callable[..., object]) -> tuple[str, ...]:
    """Return the positional parameters of a function that decides.

    Raises
    ------
    ValueError
        If the function is asynchronous, or has a parameter that is not allowed.
    """
    if iscoroutinefunction(function):
        raise ValueError(
            f"learner.kind = {name!r}: the function is async; decorate it with slow_calls of the "
            "plug-in nested_agents_language (pip install plugins/language_agents, in a checkout)"
        )
    own = [p for p in signature(function).parameters.values() if p.kind is not p.KEYWORD_ONLY]
    allowed = BATCH_PARAMETERS if any(p.name == "observations" for p in own) else PARAMETERS
    for parameter in own:
        if parameter.name not in allowed and parameter.default is Parameter.empty:
            raise ValueError(
                f"learner.kind = {name!r}: parameter {parameter.name!r}, allowed: "
                f"{', '.join(allowed)}; settings are annotated keyword-only parameters"
            )
    return tuple(p.name for p in own if p.name in allowed)
