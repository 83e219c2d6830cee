"""Interface of learners, and the base classes of their settings."""

from __future__ import annotations

from abc import ABC
from collections.abc import Mapping
from pkgutil import resolve_name
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from ..hierarchy.hierarchy import Hierarchy
from ..interface.agents import AgentContext, AnyAgents
from ..interface.scenario import Scenario
from ..interface.spaces import ActionSet, StateSpace
from ..models.calibration import CalibrationSettings
from ..models.predictors import GivenPredictor, PosePredictorSettings, Predictor
from ..models.self_model import SelfModelSettings
from ..numerics import FloatArray, IntArray
from ..plugins.models import Plugged
from ..plugins.settings import PartSettings
from ..search.exploration import (
    EXPLORATIONS,
    BurstExploration,
    ExplorationSettings,
    warm_start_refusal,
)
from ..search.settings import DecisionSettings
from ..values.rule_base import RuleBase, RuleBaseSettings

CORE = __name__.rpartition(".learners")[0]
"""Dotted name of the package that holds the kinds of agents."""


class Learner(ABC):
    """Learns consequent weights from experience.

    A subclass overrides `observe`, or `observe_decision` if it learns values of actions.
    Agents that share weights have one row of them in common. A learner is built with the row of
    every agent.
    """

    theta: FloatArray
    """``(n_rows, n_rules)`` consequent weights."""
    idle: IntArray = np.zeros(0, dtype=np.int64)
    """``(k,)`` indices of agents that did not decide, because they were absent, in the step that
    is learned from. They learn nothing from it."""

    def begin_episode(self) -> None:  # noqa: B027 - optional
        """Begin an episode: clear traces of the last one."""

    def observe(self, states: FloatArray, reward: float | FloatArray, terminated: bool) -> int:
        """Learn from the states entered; return the number of weights changed.

        Parameters
        ----------
        states
            ``(n, d)`` states that the agents entered.
        reward
            Received on entering them: one number, or ``(n,)``.
        terminated
            Whether they are terminal.

        Raises
        ------
        NotImplementedError
            If the class overrides neither this method nor `observe_decision`.
        """
        raise NotImplementedError(f"{type(self).__name__} has no method observe")

    def observe_decision(
        self,
        left: FloatArray,
        joint_action: IntArray,
        states: FloatArray,
        reward: float | FloatArray,
        terminated: bool,
        duration: int = 1,
    ) -> int:
        """Learn from a decision and its outcome. Learners of state values use the outcome only.

        Parameters
        ----------
        left
            ``(n, d)`` states in which the agents decided. Learners of action values append the
            actions that each agent was told.
        joint_action
            ``(n,)`` actions taken.
        states, reward, terminated
            As of `observe`.
        duration
            Number of decision periods that the actions lasted. What follows is discounted as often.
        """
        return self.observe(states, reward, terminated)

    def end_episode(self) -> int:
        """Make the updates that follow an episode; return the number of weights changed."""
        return 0

    def state_dict(self) -> dict[str, FloatArray]:
        """Return the saved state; by default, the weights are all of it."""
        return {"theta": self.theta}

    def load_state_dict(self, state: Mapping[str, FloatArray]) -> None:
        """Continue from a `state_dict`."""
        self.theta = state["theta"].copy()

    def warm_start(self, former: Self, rows: IntArray) -> None:
        """Start from the weights of a learner with the same settings that served other agents.

        Parameters
        ----------
        former
            The other learner, not modified, between episodes.
        rows
            ``(n_rows,)`` the row of `former` that each row starts from.

        Raises
        ------
        ValueError
            If this kind of learner does not support it.
        """
        raise ValueError(warm_start_refusal("learner.kind", self))


MembersOf = tuple[IntArray, "TeamSettings", str | None]
"""Indices ``(k,)`` of agents of one kind, their settings, and the file of the team that provides
their initial weights, or None."""


class TeamSettings(PartSettings):
    """Base class of the settings of agents: the ``[learner]`` table of a spec.

    `LearnerSettings` configure fuzzy agents. Other subclasses are in `core.networks`.
    """

    uses_hierarchy: ClassVar[bool] = False
    """Whether the agents communicate in a hierarchy."""
    kind_of_agents: ClassVar[str] = ""
    """Location of the configured subclass of `Agents`, imported on use."""

    discount: Annotated[float, Field(ge=0, lt=1)] = 0.95
    """Discount per decision, gamma of Eq. 7: low for immediate rewards, high for delayed ones."""

    def agents(self, context: AgentContext) -> AnyAgents:
        """Return the agents for a scenario and a hierarchy.

        Raises
        ------
        ValueError
            If they cannot act there.
        """
        agents: AnyAgents = resolve_name(self.kind_of_agents)(self, context)
        return agents

    def members(self, scenario: Scenario, hierarchy: Hierarchy) -> list[MembersOf]:
        """Return the agents by kind; by default all are of one kind.

        Raises
        ------
        ValueError
            If an agent has no settings.
        """
        return [(np.arange(len(hierarchy)), self, None)]

    @property
    def n_environments(self) -> int:
        """Number of environments in parallel."""
        return 1

    @property
    def needs_prediction(self) -> bool:
        """Whether it requires a scenario with a predictor, see `core.interface.scenario`."""
        return False

    @property
    def needs_rewards(self) -> bool:
        """Whether it decides by predicted rewards."""
        return False


class LearnerSettings(TeamSettings):
    """Base class of the settings of learners of fuzzy agents.

    `build` returns the learner of a team, with all consequent weights zero. It takes the agents'
    rule base and the row of weights of every agent ``(n,)``.
    """

    uses_hierarchy = True
    kind_of_agents = f"{CORE}.agents.fuzzy:FuzzyAgents"

    values_actions: ClassVar[bool] = False
    """Whether the learner learns values of an agent's own actions in its present state, given its
    messages. Such a learner needs no predictor and is also the team's evaluator."""

    rule_base: RuleBaseSettings = RuleBaseSettings()
    """The fuzzy rule base of every agent."""
    weights: Literal["own", "role"] = "own"
    """Parameter sharing: every agent has weights of its own, or all agents of one role (all left
    wheels, for example) share weights and pool their experience."""
    exploration: Annotated[ExplorationSettings, Plugged(EXPLORATIONS)] = BurstExploration()
    """Exploration of the agents."""
    decision: DecisionSettings = DecisionSettings()
    """Decisions: search, teammate model and criterion."""
    self_model: SelfModelSettings = SelfModelSettings()
    """Self-model: learned effects of the wheels of every body."""
    calibration: CalibrationSettings = CalibrationSettings()
    """Calibration of the constants of the predictor."""
    predictor: Predictor = GivenPredictor()
    """The predictor: that of the scenario, persistence, or a learned model."""

    @property
    def needs_rewards(self) -> bool:
        """Whether it decides by predicted rewards."""
        return self.decision.rule in ("reward", "reward-and-value")

    @property
    def is_mirrored(self) -> bool:
        """Whether to learn from the mirror image of every step, too."""
        return False

    def rules_over(
        self, space: StateSpace, actions: ActionSet, n_told: int
    ) -> tuple[StateSpace, RuleBase]:
        """Return the inputs of the value function as a state space, and the rule base over it.

        Parameters
        ----------
        space, actions
            Those of the scenario.
        n_told
            Maximum number of senders of an agent.
        """
        return space, RuleBase.build(space, self.rule_base)

    @property
    def needs_prediction(self) -> bool:
        """Whether it requires a scenario with a predictor; a learned predictor replaces it."""
        if isinstance(self.predictor, PosePredictorSettings):
            return True
        adapts = self.self_model.enabled or self.calibration.enabled
        decides = self.decision.rule != "random" and not self.values_actions
        return isinstance(self.predictor, GivenPredictor) and (adapts or decides)
