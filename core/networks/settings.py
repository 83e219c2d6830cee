"""The settings of learners with networks, as they stand in the ``[learner]`` table of a spec.

Defaults are those of stable-baselines3, but for those that docs/peers.md names and accounts for.
"""

from pkgutil import resolve_name
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from ..interface.agents import Agents, Placement
from ..learners.learner import CORE, TeamSettings
from ..plugins.settings import Fraction, NonNegative, Positive, unwritten

Count = Annotated[int, Field(ge=1)]
Width = Annotated[int, Field(ge=1, le=4096)]


class PeerSettings(TeamSettings):
    """What the settings of all share who act by themselves.

    `build` returns the `Peer`, of a scenario, a seed and, if it uses one, a hierarchy.
    """

    kind_of_agents = f"{CORE}.agents.peer:PeerAgents"
    discount: Annotated[float, Field(ge=0, lt=1)] = 0.97
    """Discount per decision."""


class NetworkSettings(PeerSettings):
    """What the settings of learners with networks share, which need stable-baselines3."""

    learning_rate: Positive = 3e-4
    """Step size of Adam."""
    batch_size: Count = 64
    """Transitions in a minibatch."""
    hidden: Annotated[tuple[Width, ...], Field(min_length=1)] = (64, 64)
    """Units of the hidden layers of every network."""
    _without_extra: ClassVar[str] = ""
    """What would do without the extra."""

    def agents(self, placement: Placement) -> Agents[Any]:
        """Return the agents that act in a scenario.

        Raises
        ------
        ValueError
            If they cannot act there, or the extra is missing; one line.
        """
        try:
            return super().agents(placement)
        except ImportError as error:
            raise ValueError(
                f"learner.kind = {self.kind!r}: needs the extra peers, pip install "
                "'nested-agents[peers]', in a checkout ./dev exec pip install stable-baselines3 "
                f"({error}){self._without_extra}"
            ) from None


class PolicyGradientSettings(NetworkSettings):
    """What the settings of PPO (Schulman et al. 2017) in all its forms share."""

    learning_rate: Positive = 1e-3
    """Step size of Adam."""
    batch_size: Count = 256
    """Transitions in a minibatch."""
    rollout: Annotated[int, Field(ge=2)] = 256
    """Decisions between two updates."""
    epochs: Count = 10
    """Passes over the rollout at every update."""
    gae_lambda: Fraction = 0.95
    """Trace decay of the generalised advantage estimate."""
    clip: Positive = 0.2
    """Clipping range of the probability ratio."""
    entropy: NonNegative = 0.01
    """Weight of the entropy bonus."""


class PPOSettings(PolicyGradientSettings):
    """PPO (Schulman et al. 2017): one centralised policy sees all states and acts for all."""

    kind: Literal["ppo"] = "ppo"
    kind_of_agents = f"{CORE}.networks.policies:CentralPPO"
    weights: ClassVar[str] = "all"
    numbered: ClassVar[bool] = True
    critic: ClassVar[str] = "own"
    value_of: ClassVar[str] = "team"


class MultiAgentPPOSettings(PolicyGradientSettings):
    """What the settings of PPO with a policy for every agent share."""

    kind_of_agents = f"{CORE}.networks.policies:HierarchyPPO"
    _without_extra = "; learner.environments = 16 in study = 'experience' does without"
    weights: Annotated[Literal["all", "role", "own"], unwritten("all")] = "all"
    """Whether all agents share the weights of one policy and one critic, those of a role do, or
    every agent has its own."""
    numbered: Annotated[bool, unwritten(True)] = True
    """Whether an agent's inputs say which one it is."""
    critic: Annotated[Literal["central", "own"], unwritten("central")] = "central"
    """Whether critics see all states beside the agent's own, or that alone."""
    value_of: Annotated[Literal["own", "team"], unwritten("own")] = "own"
    """Whether an agent's reward is its own, or the mean of all agents'."""
    environments: Annotated[int, Field(ge=1, le=4096), unwritten(1)] = 1
    """Environments that are stepped at once: from 2 on the networks are in NumPy and need no
    extra, and `rollout` counts decisions of every world. The keys below are theirs."""
    normalised: Annotated[Literal["rewards", "values"], unwritten("rewards")] = "rewards"
    """What is divided by the deviation of returns so far: rewards, or what critics learn."""
    learning_rate_decisions: Annotated[Count | None, unwritten(None)] = None
    """Decisions of all worlds over which `learning_rate` falls to 0 in a line; none: it stays."""
    entropy_decisions: Annotated[Count | None, unwritten(None)] = None
    """The same of `entropy`."""

    @property
    def n_environments(self) -> int:
        """In how many worlds it learns at once."""
        return self.environments

    @model_validator(mode="after")
    def _of_many_worlds(self) -> Self:
        keys = ("normalised", "learning_rate_decisions", "entropy_decisions")
        changed = self.model_dump(include=set(keys))
        if self.environments == 1 and changed:
            name, value = next(iter(changed.items()))
            raise ValueError(f"{name} = {value!r}: needs environments, 2 or more")
        return self

    def agents(self, placement: Placement) -> Agents[Any]:
        """Return the agents that act in a scenario, in many worlds by NumPy alone."""
        if self.environments == 1:
            return super().agents(placement)
        return resolve_name(f"{CORE}.networks.many_worlds:ManyWorldsPPO")(self, placement)


class HierarchyPPOSettings(MultiAgentPPOSettings):
    """PPO of agents in a hierarchy: each acts by its own state and the actions that it is told."""

    kind: Literal["hierarchy-ppo"] = "hierarchy-ppo"
    kind_of_agents = f"{CORE}.networks.policies:hierarchy_ppo"
    uses_hierarchy: ClassVar[bool] = True
    value_of: Annotated[Literal["own", "team"], unwritten("team")] = "team"
    """Whether an agent's reward is its own, or the mean of all agents'."""


class MAPPOSettings(MultiAgentPPOSettings):
    """Multi-agent PPO (Yu et al. 2022): agents are told nothing, critics see all states."""

    kind: Literal["mappo"] = "mappo"


class IPPOSettings(MultiAgentPPOSettings):
    """Independent PPO (de Witt et al. 2020): agents are told nothing, critics see their state."""

    kind: Literal["ippo"] = "ippo"
    critic: Annotated[Literal["central", "own"], unwritten("own")] = "own"
    """Whether critics see all states beside the agent's own, or that alone."""


class DQNSettings(NetworkSettings):
    """DQN (Mnih et al. 2015) for one agent, such as that of ``agents = "team"``."""

    kind: Literal["dqn"] = "dqn"
    kind_of_agents = f"{CORE}.networks.deep_q:DeepQ"
    memory: Count = 50_000
    """Transitions in the replay memory."""
    begin: Count = 500
    """Decisions before the first update."""
    interval: Count = 4
    """Decisions between two updates."""
    target_interval: Count = 250
    """Decisions between two copies to the target network."""
    exploration_begin: Fraction = 1.0
    """Exploration rate at the first decision."""
    exploration_end: Fraction = 0.05
    """Exploration rate from `exploration_decisions` on."""
    exploration_decisions: Count = 2000
    """Decisions over which the exploration rate falls linearly."""
