"""The leader of a team. Its actions are options (Sutton, Precup and Singh 1999).

A decision of a leader and what follows until its option ends is one step of a semi-Markov decision
process. If the option lasts k decisions with rewards r_1 to r_k, the leader learns from::

    Q(x, option) = r_1 + gamma r_2 + ... + gamma^(k-1) r_k + gamma^k max Q(x', other)
"""

from __future__ import annotations

import numpy as np

from ..hierarchy.hierarchy import Hierarchy
from ..hierarchy.stages import Inbox
from ..interface.abilities import options_of
from ..interface.agents import AgentContext
from ..interface.experience import Decision, Experience, Observation
from ..interface.options import LeaderOptions
from ..interface.scenario import Scenario, Transition, prediction_of
from ..learners.fitted_q import FittedQSettings
from ..learners.learner import TeamSettings
from ..numerics import FloatArray, IntArray
from ..search.evaluator import NO_AGENTS
from .fuzzy import FuzzyAgents
from .views import FuzzyInputs

INBOX = Inbox(np.zeros(1, np.int64), NO_AGENTS, NO_AGENTS, NO_AGENTS)
"""A leader has no superior that sends it messages."""


class LeaderView(Scenario):
    """States and actions of a leader, as its learner needs them. It has no episodes of its own."""

    agents = ("leader",)

    def __init__(self, options: LeaderOptions) -> None:
        self.state_space = options.state_space
        self.action_set = options.action_set

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Refuse; the scenario below starts episodes."""
        raise RuntimeError("the scenario below starts episodes")

    def step(self, joint_action: IntArray) -> Transition:
        """Refuse; the agents below carry out options."""
        raise RuntimeError("the agents below carry out options")


class Leader:
    """Leader of a team.

    Parameters
    ----------
    scenario, options
        Scenario in which the leader is built, and its options.
    seed
        Seed of the leader's random numbers.
    needs_prediction
        Whether the agents below decide or learn by predictions.

    Attributes
    ----------
    agents
        The agent that decides and learns; empty for a leader by rule.
    """

    def __init__(
        self,
        scenario: Scenario,
        options: LeaderOptions,
        seed: np.random.SeedSequence,
        *,
        needs_prediction: bool,
    ) -> None:
        self.agents: tuple[FuzzyAgents, ...] = ()
        self._needs_prediction = needs_prediction
        if options.learner is not None:
            assert isinstance(options.learner, FittedQSettings)
            view = LeaderView(options)
            context = AgentContext(view, Hierarchy(view.agents, []), np.arange(1), seed)
            try:
                self.agents = (FuzzyAgents(options.learner, context),)
            except ValueError as error:  # keys of the learner are those of a table of the scenario
                where = "scenario.leader." if str(error).startswith("learner.") else ""
                raise ValueError(f"{where}{error}") from None
        self.enter(scenario, options)
        self.reset(learn=True)

    def enter(self, scenario: Scenario, options: LeaderOptions) -> None:
        """Lead the agents of a scenario, which may be another one in every episode."""
        self._scenario = scenario
        self._options = options

    def reset(self, *, learn: bool) -> None:
        """Start an episode, of training if the leader is to `learn`."""
        self._learns = learn and bool(self.agents)
        self._decided: tuple[Observation, IntArray, FuzzyInputs] | None = None
        self._duration = 0
        self._return = 0.0

    def lead(
        self, observation: Observation, *, explore: bool
    ) -> tuple[Observation, IntArray | None]:
        """Choose an option when none is running.

        Returns
        -------
        Observation
            Observation of the agents below.
        IntArray or None
            Their actions ``(n,)``, if a given skill acts for them.
        """
        options = self._options
        is_running = 0 < self._duration < options.limit and options.advance()
        if not is_running:
            states = options.begin(self._decide(explore=explore))
            observation = observation._replace(states=states)
            if self._needs_prediction:  # an option that begins changes what is predicted
                observation = observation._replace(prediction=prediction_of(self._scenario))
            self._duration = 0
        self._duration += 1
        return observation, options.joint_action()

    def _decide(self, *, explore: bool) -> int:
        """Return an option; a leader that learns has first learned from the last one."""
        if not self.agents:
            return self._options.rule()
        (agent,) = self.agents
        observation = Observation(self._options.observe()[None])
        if self._decided is not None and self._learns:
            self._learn(observation.states, terminated=False, last=False)
        inputs = agent.observe(observation, explore=explore and self._learns)
        action = agent.act(inputs, INBOX)
        agent.conclude(inputs, action)
        self._decided = observation, action, inputs
        return int(action[0])

    def learn(self, experience: Experience) -> None:
        """Add the mean reward of a step below, and learn if the episode ends with it.

        A lost task is terminal to the leader. A terminal reward repeats forever if the state does.
        """
        if not self._learns:
            return
        transition = experience.transition
        discount = self.agents[0].settings.discount
        reward = float(np.mean(transition.reward))
        if transition.terminated and transition.absorbing:
            reward /= 1.0 - discount
        self._return += discount ** (self._duration - 1) * reward
        if experience.last:
            is_terminal = transition.terminated or transition.truncated
            self._learn(self._options.observe()[None], terminated=is_terminal, last=True)

    def _learn(self, states: FloatArray, *, terminated: bool, last: bool) -> None:
        """Learn from an option that has ended in some states ``(1, d)`` of the leader."""
        assert self._decided is not None
        before, action, inputs = self._decided
        result = Transition(states, self._return, terminated, False, {}, absorbing=False)
        decision = Decision(action, (inputs,))
        self.agents[0].learn(Experience(before, decision, result, last, self._duration), inputs)
        self._return = 0.0


def build_leader(
    settings: TeamSettings,
    scenario: Scenario,
    seed: np.random.SeedSequence,
    *,
    messages_fail: bool,
) -> Leader | None:
    """Return the leader of a team with some settings, or None if the scenario has no options.

    Raises
    ------
    ValueError
        If messages fail or there are several environments; one line.
    """
    options = options_of(scenario)
    if options is None:
        return None
    if messages_fail or settings.n_environments > 1:
        key = "topology.failures" if messages_fail else "learner.environments"
        raise ValueError(f"{key}: not for agents below a leader, leave out scenario.leader")
    (own_seed,) = seed.spawn(1)
    return Leader(scenario, options, own_seed, needs_prediction=settings.needs_prediction)


def enter_scenario(leader: Leader | None, scenario: Scenario) -> None:
    """Let the leader of a team, if there is one, lead in a scenario.

    Raises
    ------
    ValueError
        If only one of the team and the scenario has a leader; one line.
    """
    options = options_of(scenario)
    if (leader is None) != (options is None):
        raise ValueError("scenario.leader: build the team in a scenario with the same leader")
    if leader is not None and options is not None:
        leader.enter(scenario, options)
