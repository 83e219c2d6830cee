"""Leaders: agents above all others, whose actions are options (Sutton, Precup and Singh 1999).

A decision of a leader and what follows until its option ends is one step of a semi-Markov decision
process. If the option lasts k decisions with rewards r_1 to r_k, the leader learns from::

    Q(x, option) = r_1 + gamma r_2 + ... + gamma^(k-1) r_k + gamma^k max Q(x', other)
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..hierarchy.hierarchy import Hierarchy
from ..hierarchy.stages import Inbox
from ..interface.agents import AgentContext, Agents, StateDict
from ..interface.experience import Decision, Experience, Observation
from ..interface.options import LedScenario, Options
from ..interface.scenario import Scenario, Transition
from ..learners.learner import TeamSettings
from ..numerics import AnyArray, FloatArray, IntArray

NAME = "leader"
NO_MESSAGES = np.zeros(0, np.int64)
INBOX = Inbox(np.zeros(1, np.int64), NO_MESSAGES, NO_MESSAGES, NO_MESSAGES)
"""A leader has no superior that sends it messages."""


def options_of(scenario: Scenario) -> Options | None:
    """Return the options of a leader in a scenario; None without a leader."""
    return scenario.options if isinstance(scenario, LedScenario) else None


class LeaderView(Scenario):
    """A scenario as its leader sees it, which is the only agent.

    The leader's steps are those of `Leader`.
    """

    agents = (NAME,)

    def __init__(self, options: Options) -> None:
        self.state_space = options.state_space
        self.action_set = options.action_set

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Refuse; the scenario below starts episodes."""
        raise NotImplementedError("the scenario below starts episodes")

    def step(self, joint_action: IntArray) -> Transition:
        """Refuse; the scenario below carries out options."""
        raise NotImplementedError("the scenario below carries out options")


class Leader:
    """Leader of a team.

    Parameters
    ----------
    options
        Options of the scenario in which the leader is built. In decisions, those of the observed
        scenario count.
    seed
        Seed of the leader's random numbers.

    Attributes
    ----------
    agents
        The agent that decides; None for the leader by rule.

    Raises
    ------
    ValueError
        If the settings are of a learner that does not count how long actions last; one line.
    """

    def __init__(self, options: Options, seed: np.random.SeedSequence) -> None:
        self.view = LeaderView(options)
        self.agents: Agents[Any] | None = None
        settings = options.learner
        if settings is not None:
            _check(settings)
            self._discount = settings.discount
            hierarchy = Hierarchy(self.view.agents, [])
            context = AgentContext(self.view, hierarchy, np.arange(1), seed)
            self.agents = settings.agents(context)
        self.reset(0)

    def reset(self, episode: int) -> None:
        """Start an episode, of training or of evaluation."""
        self._decision: tuple[Observation, Decision] | None = None
        self._duration = 0
        self._reward: float | None = None
        if self.agents is not None:
            self.agents.reset(episode)

    def begin_episode(self) -> None:
        """Start an episode of training."""
        if self.agents is not None:
            self.agents.begin_episode()

    def lead(
        self, options: Options, observation: Observation, *, explore: bool
    ) -> tuple[Observation, IntArray | None]:
        """Decide on an option if none is under way.

        Returns
        -------
        Observation
            Observation of the agents below.
        IntArray or None
            Their actions ``(n,)``, if the option is a given skill.
        """
        if self._duration == 0 or options.has_ended() or self._duration >= options.limit:
            own = Observation(options.observe()[None], self.view)
            if self._reward is not None:
                self._learn(Transition(own.present, self._reward, False, False, {}), last=False)
            states = options.begin(self._decide(options, own, explore=explore))
            observation = observation._replace(present=states)
            self._duration = 0
        self._duration += 1
        return observation, options.joint_action()

    def _decide(self, options: Options, own: Observation, *, explore: bool) -> int:
        """Return an option."""
        if options.learner is None:
            return options.rule()
        assert self.agents is not None
        inputs = self.agents.observe(own, explore=explore)
        action = self.agents.act(inputs, INBOX)
        self.agents.conclude(inputs, action)
        self._decision = own, Decision(action, (inputs,))
        return int(action[0])

    def learn(self, options: Options, experience: Experience) -> None:
        """Learn from a step of the scenario below."""
        if self.agents is None:
            return
        transition = experience.transition
        discounted = self._discount ** (self._duration - 1)
        reward = options.reward(transition)
        has_ended = transition.terminated or transition.truncated
        # The last reward repeats forever, because a terminal state lasts.
        reward = reward / (1.0 - self._discount) if has_ended else reward
        self._reward = (self._reward or 0.0) + discounted * reward
        if experience.last:
            states = options.observe()[None]
            end = Transition(states, self._reward, has_ended, False, {}, absorbing=False)
            self._learn(end, last=True)

    def _learn(self, transition: Transition, *, last: bool) -> None:
        """Learn from an option that has ended."""
        assert self.agents is not None
        assert self._decision is not None
        before, decision = self._decision
        experience = Experience(before, decision, transition, last, self._duration)
        self.agents.learn(experience, decision.inputs[0])
        self._reward = None

    def warm_start(self, former: Leader) -> None:
        """Start with what the leader of another team learned."""
        if self.agents is not None and former.agents is not None:
            self.agents.warm_start(former.agents)

    def state_dict(self) -> StateDict:
        """Return the saved state."""
        arrays = {} if self.agents is None else self.agents.state_dict()
        return {f"{NAME}.{name}": array for name, array in arrays.items()}

    def load_state_dict(self, state: Mapping[str, AnyArray]) -> None:
        """Continue from a `state_dict`."""
        if self.agents is not None:
            self.agents.load_state_dict(state)


def _check(settings: TeamSettings) -> None:
    """Refuse settings of agents that do not discount by the duration of an option."""
    if not settings.counts_durations:
        raise ValueError(
            f"scenario.leader.learner.kind = {settings.kind!r}: does not count how long an option "
            "lasts; use fitted-q or a function"
        )
