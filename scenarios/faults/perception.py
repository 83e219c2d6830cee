"""Imperfect sensors: each agent perceives the scenario with its own delay, noise and losses.

The ``[[scenario.perception]]`` tables of a spec describe the sensors of any scenario, see
`nested_agents.core.plugins.settings.PerceptionSettings`. With states x, predictions f, delay k_i
and normal noise r_i, drawn for every decision, agent i perceives and predicts

    x_i(t) = x(t - k_i) + r_i(t) * (high - low),    f_i(u) = f(u) + x_i(t) - x(t)

Its sensors are wrong, while its model of the effect of actions is right. It assumes that agents of
bodies that it does not perceive take the neutral action. Agents also learn from perceived states.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...core.interface.abilities import interactions_of
from ...core.interface.prediction import Prediction
from ...core.interface.scenario import Scenario, ScenarioWrapper, Transition
from ...core.numerics import BoolArray, FloatArray, IntArray, nx, stream_of
from ...core.plugins.settings import PerceptionSettings, mask_of

STREAM = 2**32 - 6
"""Key of the random stream of sensor noise under the seed of an episode."""


def perceived(scenario: Scenario, settings: Sequence[PerceptionSettings]) -> Scenario:
    """Return a scenario with the sensors of the settings; unchanged if there are none.

    Raises
    ------
    ValueError
        If the settings name an unknown agent or body.
    """
    return PerceivedScenario(scenario, settings) if settings else scenario


class PerceivedScenario(ScenarioWrapper):
    """A scenario that each agent perceives with its own sensors.

    Parameters
    ----------
    scenario
        The true scenario.
    settings
        The sensors. If several name the same agent, the maximum noise and delay, the minimum reach
        and all losses apply.

    Examples
    --------
    The second of three carts perceives the state one decision late.

    >>> from nested_agents.scenarios.line_up import LineUpSettings
    >>> carts = LineUpSettings(carts=3).build()
    >>> late = PerceivedScenario(carts, [PerceptionSettings(agents=carts.agents[1], delay=1)])
    >>> first = late.reset(0)
    >>> second = late.step(np.zeros(3, dtype=int)).states
    >>> bool((second[1] == first[1]).all()), bool((second[0] == first[0]).all())
    (True, False)
    """

    def __init__(self, scenario: Scenario, settings: Sequence[PerceptionSettings]) -> None:
        super().__init__(scenario)
        groups = scenario.groups
        n = len(self.agents)
        noise = np.zeros(n)
        self._delays = np.zeros(n, dtype=np.int64)
        body = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
        others = body[:, None] != np.arange(len(groups))
        lost = np.zeros(others.shape, dtype=bool)
        distances = distances_of(scenario)
        for i, one in enumerate(settings):
            key = f"scenario.perception[{i}]"
            mask = mask_of(one.agents, self.agents, f"{key}.agents")
            noise[mask] = np.maximum(noise[mask], one.noise)
            self._delays[mask] = np.maximum(self._delays[mask], one.delay)
            named = mask_of(one.lost, self.agents, f"{key}.lost")
            lost |= np.outer(mask, [named[list(group)].any() for group in groups])
            lost[mask] |= distances[mask] > (np.inf if one.reach is None else one.reach)
        self.perceived: BoolArray = others & ~lost
        # Agents that each agent assumes to take the neutral action
        self._unperceived = [np.flatnonzero(row[body]) for row in others & lost]
        self._low, width = self.state_space.ranges
        self._scale = noise[:, None] * width
        self._width = width
        self._periodic = np.array([v.periodic for v in self.state_space.variables])
        self._past: list[FloatArray] = []
        self._rng = stream_of(0, STREAM)

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode and return the perceived states."""
        self._rng = stream_of(seed, STREAM)
        states = self.scenario.reset(seed, episode)
        self._past = []
        return self._perceive(states)

    def step(self, joint_action: IntArray) -> Transition:
        """Execute a joint action; the transition has the perceived states."""
        transition = self.scenario.step(joint_action)
        return replace(transition, states=self._perceive(transition.states))

    def predict(self) -> Prediction | None:
        """Return the predictions of the agents."""
        prediction = self.scenario.predict()
        return None if prediction is None else PerceivedPrediction(prediction, self)

    def unperceived(self, agent: int) -> IntArray:
        """Return the agents that an agent does not perceive ``(k,)``."""
        return self._unperceived[agent]

    def offsets(self, agent: int) -> FloatArray:
        """Return the errors ``(n, d)`` of the states of all agents as one agent perceives them."""
        delayed = self._past[-1 - min(int(self._delays[agent]), len(self._past) - 1)]
        offsets: FloatArray = delayed - self._past[-1] + self._drawn[agent]
        return offsets

    def within(self, states: FloatArray) -> FloatArray:
        """Return states with periodic variables wrapped into their range."""
        wrapped = self._low + (states - self._low) % self._width
        return np.where(self._periodic, wrapped, states)

    def _perceive(self, states: FloatArray) -> FloatArray:
        """Return the state that each agent perceives of itself, and store the true states."""
        self._past = [*self._past, states.copy()][-1 - int(self._delays.max()) :]
        # The count of draws does not depend on the settings, so that runs stay paired.
        self._drawn = self._rng.standard_normal(states.shape) * self._scale
        own = [self._past[-1][i] + self.offsets(i)[i] for i in range(len(states))]
        return self.within(np.array(own))


class PerceivedPrediction(Prediction):
    """Predictions of agents from the states that they perceive.

    Rewards are predicted from the true state; only unperceived agents make them wrong.

    Parameters
    ----------
    prediction
        Prediction from the true state.
    scenario
        Scenario with the sensors.
    agent
        Agent that predicts. By default, each agent predicts its own states, and rewards are
        predicted for the given joint actions.
    """

    def __init__(
        self, prediction: Prediction, scenario: PerceivedScenario, agent: int | None = None
    ) -> None:
        self._prediction = prediction
        self._scenario = scenario
        self._agent = agent
        self._offsets = np.zeros(0) if agent is None else scenario.offsets(agent)
        self.repeats = prediction.repeats

    def of(self, agent: int) -> Prediction:
        """Return the prediction of one agent."""
        return PerceivedPrediction(self._prediction, self._scenario, agent)

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of any agent."""
        if self._agent is None:
            return self.of(agent).states(agent, joint_actions)
        states = self._prediction.states(agent, self._assumed(joint_actions))
        return self._scenario.within(states + self._offsets[agent])

    def rewards(self, joint_actions: IntArray) -> FloatArray | None:
        """Return the rewards ``(m,)``, if they are predicted."""
        return self._prediction.rewards(self._assumed(joint_actions))

    def _assumed(self, joint_actions: IntArray) -> IntArray:
        """Return joint actions in which unperceived agents take the neutral action."""
        if self._agent is None:
            return joint_actions
        assumed = joint_actions.copy()
        unperceived = self._scenario.unperceived(self._agent)
        assumed[:, unperceived] = self._scenario.action_set.neutral
        return assumed


def distances_of(scenario: Scenario) -> FloatArray:
    """Return the distances of bodies from agents ``(n, G)`` in links, infinite if unconnected.

    Links are the interactions of the scenario; by default each body is linked to the next.

    Examples
    --------
    >>> from nested_agents.scenarios.line_up import LineUpSettings
    >>> distances_of(LineUpSettings(carts=3).build())[0].tolist()
    [0.0, 1.0, 2.0]
    """
    groups = scenario.groups
    bodies = {agent: body for body, group in enumerate(groups) for agent in group}
    interactions = interactions_of(scenario)
    graph = nx.path_graph(len(groups))
    if interactions is not None:
        graph = nx.create_empty_copy(graph)
        graph.add_edges_from((bodies[a], bodies[b]) for a, b in interactions)
    apart = np.full((len(groups), len(groups)), np.inf)
    for body, lengths in nx.all_pairs_shortest_path_length(graph):
        apart[body, list(lengths)] = list(lengths.values())
    return apart[[bodies[agent] for agent in range(len(scenario.agents))]]
