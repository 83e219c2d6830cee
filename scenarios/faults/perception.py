"""Agents that perceive a scenario each for itself, so that what they predict differs.

What is perceived is described by the ``[[scenario.perception]]`` of a spec, of every scenario, see
`nested_agents.core.plugins.settings.PerceptionSettings`. An agent i that perceives late or with
noise takes itself to be where it is not, and predicts from there: with x the state and f what is
predicted,

    x_i(t) = x(t - k_i) + r_i(t) * (high - low),    f_i(u) = f(u) + x_i(t) - x(t)

r_i being normal noise that is drawn anew for every decision. So its sensors are wrong, and its
model of what an action changes is right. The agents of a body that it does not perceive are taken
to do nothing: they maintain. Learning is from what is perceived, too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ...core.interface.plain import as_prediction
from ...core.interface.prediction import Prediction
from ...core.interface.scenario import Scenario, Transition
from ...core.interface.spaces import StateSpace
from ...core.numerics import BoolArray, FloatArray, IntArray, nx, stream_of
from ...core.plugins.settings import PerceptionSettings, mask_of

STREAM = 2**32 - 6
"""Key of the stream from which noise of perception is drawn, under the seed of an episode."""


def perceived(scenario: Scenario, settings: Sequence[PerceptionSettings]) -> Scenario:
    """Return a scenario as its agents perceive it; as it is, if nothing is said of that.

    Raises
    ------
    ValueError
        If an agent or a body is named that there is not; one line.
    """
    return PerceivedScenario(scenario, settings) if settings else scenario


class PerceivedScenario(Scenario):
    """A scenario that agents perceive each for itself.

    Parameters
    ----------
    scenario
        As it is.
    settings
        How it is perceived; of several that name an agent, noise and delay are the greatest, reach
        the least, and lost is what any of them loses.

    Examples
    --------
    The second of three carts perceives what was a decision ago.

    >>> from nested_agents.scenarios.line_up import LineUpSettings
    >>> carts = LineUpSettings(carts=3).build()
    >>> late = PerceivedScenario(carts, [PerceptionSettings(agents=carts.agents[1], delay=1)])
    >>> first = late.reset(0)
    >>> second = late.step(np.zeros(3, dtype=int)).states
    >>> bool((second[1] == first[1]).all()), bool((second[0] == first[0]).all())
    (True, False)
    """

    is_private = True

    def __init__(self, scenario: Scenario, settings: Sequence[PerceptionSettings]) -> None:
        self.scenario = scenario
        self.agents = tuple(scenario.agents)
        self.state_space: StateSpace = scenario.state_space
        self.action_set = scenario.action_set
        self.measures = scenario.measures
        self.interactions = scenario.interactions
        self.horizon = scenario.horizon
        self.repeats = scenario.repeats
        self.recorded = scenario.recorded
        n = len(self.agents)
        self._noise = np.zeros(n)
        self._delays = np.zeros(n, dtype=np.int64)
        lost = np.zeros((n, len(scenario.groups)), dtype=bool)
        distances = distances_of(scenario)
        for i, one in enumerate(settings):
            key = f"scenario.perception[{i}]"
            mask = mask_of(one.agents, self.agents, f"{key}.agents")
            self._noise[mask] = np.maximum(self._noise[mask], one.noise)
            self._delays[mask] = np.maximum(self._delays[mask], one.delay)
            if one.lost:
                named = mask_of(one.lost, self.agents, f"{key}.lost")
                bodies = np.array([named[list(group)].any() for group in scenario.groups])
                lost |= np.outer(mask, bodies)
            if one.reach is not None:
                lost[mask] |= distances[mask] > one.reach
        own = ~scenario.perceived
        self.perceived: BoolArray = ~own & ~lost
        self._body = np.zeros(n, dtype=np.int64)
        for body, group in enumerate(scenario.groups):
            self._body[list(group)] = body
        # Whom each agent takes to do nothing.
        self._idle = [np.flatnonzero(~(own | self.perceived)[i][self._body]) for i in range(n)]
        self._low, width = self.state_space.ranges
        self._scale = self._noise[:, None] * width
        self._width = width
        self._periodic = np.array([v.periodic for v in self.state_space.variables])
        self._past: list[FloatArray] = []
        self._rng = stream_of(0, STREAM)

    @cached_property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """The agents by body."""
        return self.scenario.groups

    @cached_property
    def roles(self) -> tuple[str, ...]:
        """The role of every agent."""
        return self.scenario.roles

    @property
    def predicts(self) -> bool:
        """Whether it predicts."""
        return self.scenario.predicts

    @property
    def lacks_prediction(self) -> str:
        """Why it predicts nothing."""
        return self.scenario.lacks_prediction

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode and return the states that agents perceive."""
        self._rng = stream_of(seed, STREAM)
        states = self.scenario.reset(seed, episode)
        self._past = []
        return self._perceive(states)

    def step(self, joint_action: IntArray) -> Transition:
        """Carry out a joint action; return the states that agents perceive."""
        transition = self.scenario.step(joint_action)
        return replace(transition, states=self._perceive(transition.states))

    def predict(self) -> Prediction | None:
        """Return the prediction, which every agent makes for itself."""
        prediction = as_prediction(self.scenario.predict())
        return None if prediction is None else PerceivedPrediction(prediction, self)

    def partners(self) -> Sequence[int] | None:
        """Return for every agent the one in whose place it stands in the mirror."""
        return self.scenario.partners()

    def measure(self) -> Mapping[str, Any]:
        """Return the measurements of the present state, as it is."""
        return self.scenario.measure()

    def constants_of_episode(self) -> Mapping[str, Any]:
        """Return what is kept once an episode."""
        return self.scenario.constants_of_episode()

    @property
    def draws(self) -> bool:
        """Whether recordings of its episodes can be drawn."""
        return self.scenario.draws

    def animate(self, recording: Mapping[str, Any], path: Path) -> None:
        """Draw a recording."""
        self.scenario.animate(recording, path)

    def idle(self, agent: int) -> IntArray:
        """Return whom an agent does not perceive, and takes to do nothing ``(k,)``."""
        return self._idle[agent]

    def offsets(self, agent: int) -> FloatArray:
        """Return by how much the states of all ``(n, d)`` are off, as an agent perceives them."""
        late = self._past[-1 - min(int(self._delays[agent]), len(self._past) - 1)]
        offsets: FloatArray = late - self._past[-1] + self._drawn[agent]
        return offsets

    def within(self, states: FloatArray) -> FloatArray:
        """Return states with periodic variables within their period."""
        turned = self._low + (states - self._low) % self._width
        return np.where(self._periodic, turned, states)

    def _perceive(self, states: FloatArray) -> FloatArray:
        """Return what each agent takes for its state, and remember the states."""
        self._past = [*self._past[-int(self._delays.max()) :], states.copy()]
        if not self._delays.any():
            self._past = self._past[-1:]
        # As many numbers whoever has noise: agents stay paired.
        self._drawn = self._rng.standard_normal(states.shape) * self._scale
        own = [self._past[-1][i] + self.offsets(i)[i] for i in range(len(states))]
        return self.within(np.array(own))


class PerceivedPrediction(Prediction):
    """A prediction that every agent makes for itself; not asked as that of one, each of its own.

    Parameters
    ----------
    prediction
        From where the agents are.
    scenario
        Who perceives.
    """

    def __init__(self, prediction: Prediction, scenario: PerceivedScenario) -> None:
        self._prediction = prediction
        self._scenario = scenario

    def of(self, agent: int) -> Prediction:
        """Return what an agent predicts itself."""
        return OwnPrediction(self._prediction, self._scenario, agent)

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states of an agent, as it predicts them itself."""
        return self.of(agent).states(agent, joint_actions)

    def rewards(self, joint_actions: IntArray) -> FloatArray | None:
        """Return the rewards, which nobody here is wrong about."""
        return self._prediction.rewards(joint_actions)


class OwnPrediction(Prediction):
    """What one agent predicts, by what it perceives.

    Rewards are predicted from where agents are: only whom it does not perceive makes them wrong.
    """

    def __init__(self, prediction: Prediction, scenario: PerceivedScenario, agent: int) -> None:
        self._prediction = prediction
        self._scenario = scenario
        self._agent = agent
        self._offsets = scenario.offsets(agent)

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of any agent."""
        states = self._prediction.states(agent, self._taken(joint_actions))
        return self._scenario.within(states + self._offsets[agent])

    def rewards(self, joint_actions: IntArray) -> FloatArray | None:
        """Return the rewards ``(m,)``, if they are predicted."""
        return self._prediction.rewards(self._taken(joint_actions))

    def _taken(self, joint_actions: IntArray) -> IntArray:
        """Return joint actions in which whom it does not perceive does nothing."""
        idle = self._scenario.idle(self._agent)
        if not len(idle):
            return joint_actions
        taken = joint_actions.copy()
        taken[:, idle] = self._scenario.action_set.neutral
        return taken


def distances_of(scenario: Scenario) -> FloatArray:
    """Return how far bodies are from agents ``(n, G)``, in links; infinite where none lead there.

    Links are the interactions that the scenario declares, else each body has the next in order.

    Examples
    --------
    >>> from nested_agents.scenarios.line_up import LineUpSettings
    >>> distances_of(LineUpSettings(carts=3).build())[0].tolist()
    [0.0, 1.0, 2.0]
    """
    groups = scenario.groups
    bodies = {agent: body for body, group in enumerate(groups) for agent in group}
    graph = nx.path_graph(len(groups))
    if scenario.interactions is not None:
        graph.remove_edges_from(list(graph.edges))
        graph.add_edges_from((bodies[a], bodies[b]) for a, b in scenario.interactions)
    apart = np.full((len(groups), len(groups)), np.inf)
    for body, lengths in nx.all_pairs_shortest_path_length(graph):
        apart[body, list(lengths)] = list(lengths.values())
    return apart[[bodies[agent] for agent in range(len(scenario.agents))]]
