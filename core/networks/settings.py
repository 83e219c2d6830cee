"""Settings of PPO, as in the ``[learner]`` table of a spec.

Defaults are those of stable-baselines3, except for the ones that research/notebooks/ppo.md lists.
"""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from ..learners.learner import CORE, TeamSettings
from ..plugins.settings import Fraction, NonNegative, Positive

Count = Annotated[int, Field(ge=1)]
Width = Annotated[int, Field(ge=1, le=4096)]


class NetworkSettings(TeamSettings):
    """Settings that all kinds of PPO (Schulman et al. 2017) share."""

    kind_of_agents = f"{CORE}.networks.agents:PPOAgents"
    discount: Annotated[float, Field(ge=0, lt=1)] = 0.97
    """Discount per decision."""
    learning_rate: Positive = 1e-3
    """Step size of Adam."""
    batch_size: Count = 256
    """Transitions in a minibatch."""
    hidden: Annotated[tuple[Width, ...], Field(min_length=1)] = (64, 64)
    """Units of the hidden layers of every network."""
    rollout: Annotated[int, Field(ge=2)] = 256
    """Decisions in every environment between two updates."""
    epochs: Count = 10
    """Passes over the rollout in every update."""
    gae_lambda: Fraction = 0.95
    """Trace decay of the generalized advantage estimate."""
    clip: Positive = 0.2
    """Clipping range of the probability ratio."""
    entropy: NonNegative = 0.01
    """Weight of the entropy bonus."""
    environments: Annotated[int, Field(ge=1, le=4096)] = 1
    """Number of environments that are stepped at once; 2 or more need a budget in decisions."""
    learning_rate_decisions: Count | None = None
    """Decisions, summed over all environments, over which `learning_rate` falls linearly to 0.
    Without a number it stays constant. The count begins again in every stage of a curriculum, as
    does the optimizer."""
    entropy_decisions: Count | None = None
    """Decisions, summed over all environments, over which `entropy` falls linearly to 0. Without a
    number it stays constant. The count begins again in every stage of a curriculum."""

    @property
    def n_environments(self) -> int:
        """Number of environments in which it learns at once."""
        return self.environments


class PPOSettings(NetworkSettings):
    """PPO (Schulman et al. 2017): one centralized policy sees all states and acts for all."""

    kind: Literal["ppo"] = "ppo"
    kind_of_agents = f"{CORE}.networks.agents:CentralPPOAgents"
    weights: ClassVar[str] = "all"
    numbered: ClassVar[bool] = True
    critic: ClassVar[str] = "central"
    value_of: ClassVar[str] = "team"


class MultiAgentPPOSettings(NetworkSettings):
    """Settings that PPO with a policy for every agent shares."""

    weights: Literal["all", "role", "own"] = "all"
    """Agents that share the weights of one policy and one critic: all agents, those of a role, or
    none."""
    numbered: bool = True
    """Whether the inputs of an agent contain its number, one-hot."""
    critic: Literal["central", "own"] = "central"
    """Whether critics see the states of all agents, or that of their own agent alone."""
    value_of: Literal["own", "team"] = "own"
    """Whether an agent maximizes its own reward, or the mean reward of all agents."""


class HierarchyPPOSettings(MultiAgentPPOSettings):
    """PPO with communication: agents see the actions that superiors tell them."""

    kind: Literal["hierarchy-ppo"] = "hierarchy-ppo"
    uses_hierarchy: ClassVar[bool] = True
    value_of: Literal["own", "team"] = "team"
    """Whether an agent maximizes its own reward, or the mean reward of all agents."""


class MAPPOSettings(MultiAgentPPOSettings):
    """Multi-agent PPO (Yu et al. 2022): no communication, critics see all states."""

    kind: Literal["mappo"] = "mappo"


class IPPOSettings(MultiAgentPPOSettings):
    """Independent PPO (de Witt et al. 2020): no communication, critics see their agent's state."""

    kind: Literal["ippo"] = "ippo"
    critic: Literal["central", "own"] = "own"
    """Whether critics see the states of all agents, or that of their own agent alone."""
