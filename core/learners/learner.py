"""What every learner is to a team, and what the settings of all learners share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from pkgutil import resolve_name
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field

from ..adaptation.calibration import CalibrationSettings
from ..adaptation.predictors import GivenPredictor, Predictor
from ..adaptation.self_model import SelfModelSettings
from ..decision.exploration import (
    EXPLORATIONS,
    BurstExploration,
    ExplorationSettings,
    no_way_on,
)
from ..decision.settings import DecisionSettings
from ..hierarchy.hierarchy import Hierarchy
from ..interface.agents import Agents, Placement
from ..interface.scenario import Scenario
from ..interface.spaces import ActionSet, StateSpace
from ..numerics import FloatArray, IntArray
from ..plugins.registry import Plugged
from ..plugins.settings import PartSettings, unwritten
from ..values.rule_base import RuleBase, RuleBaseSettings

CORE = __name__.rpartition(".learners")[0]
"""Where the rooms are in which agents are found by name."""


class Learner(ABC):
    """Turns experience into consequent weights.

    Agents that share weights have one row of them in common; `rows`, which a learner is built with,
    says which row is whose.
    """

    theta: FloatArray
    """``(n_rows, n_rules)`` consequent weights."""

    @abstractmethod
    def begin_episode(self) -> None:
        """Forget what reached into the past: an episode begins."""

    @abstractmethod
    def observe(self, states: FloatArray, reward: float | FloatArray, terminated: bool) -> int:
        """Take in the states entered; return the number of consequent weights changed.

        Parameters
        ----------
        states
            ``(n, d)`` states that the agents entered.
        reward
            Received on entering them: one number, or ``(n,)``.
        terminated
            Whether they are terminal.
        """

    def observe_decision(
        self,
        left: FloatArray,
        joint_action: IntArray,
        states: FloatArray,
        reward: float | FloatArray,
        terminated: bool,
    ) -> int:
        """Take in what a decision led to; learners of after-states `observe` that alone.

        Parameters
        ----------
        left
            ``(n, d)`` what the agents knew when they decided: the states that they were in, with
            the actions that they were told if the learner values actions.
        joint_action
            ``(n,)`` what they then did.
        states, reward, terminated
            As of `observe`.
        """
        return self.observe(states, reward, terminated)

    @abstractmethod
    def end_episode(self) -> int:
        """Learn what is learned after an episode. Returns the number of weights changed."""

    @abstractmethod
    def arrays(self) -> dict[str, FloatArray]:
        """Return everything that `restore` needs."""

    @abstractmethod
    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""

    def continue_from(self, former: Self, rows: IntArray) -> None:
        """Begin with what a learner of the same settings has learned for other agents.

        Parameters
        ----------
        former
            The other one, which is not modified and whose episodes are over.
        rows
            ``(n_rows,)`` from which of its rows each row goes on.

        Raises
        ------
        ValueError
            If it cannot; one line.
        """
        raise ValueError(no_way_on("learner.kind", self))


class MembersOf(NamedTuple):
    """Agents of a team that are of one kind."""

    members: IntArray
    """``(k,)`` who they are, in agent order."""
    settings: TeamSettings
    """How they decide and learn."""
    team: str | None = None
    """File of a team whose weights they begin with; none: they have learned nothing."""


class TeamSettings(PartSettings):
    """What stands in the ``[learner]`` table of a spec: how those who act learn.

    `LearnerSettings` are of fuzzy agents; others are in `core.networks`.
    """

    uses_hierarchy: ClassVar[bool] = False
    """Whether those who act pass actions down a hierarchy."""
    kind_of_agents: ClassVar[str] = ""
    """Where the class of `Agents` is that they are settings of, imported when it is wanted."""

    discount: Annotated[float, Field(ge=0, lt=1)] = 0.95
    """Discount per decision, gamma of Eq. 7: low where actions pay at once, high where they pay
    late."""

    def agents(self, placement: Placement) -> Agents[Any]:
        """Return the agents that act in a scenario, in their place of a hierarchy.

        Raises
        ------
        ValueError
            If they cannot act there; one line.
        """
        agents: Agents[Any] = resolve_name(self.kind_of_agents)(self, placement)
        return agents

    def members(self, scenario: Scenario, hierarchy: Hierarchy) -> list[MembersOf]:
        """Return the agents of every kind: by default all are of one.

        Raises
        ------
        ValueError
            If nobody decides for an agent; one line.
        """
        return [MembersOf(np.arange(len(hierarchy)), self)]

    @property
    def n_environments(self) -> int:
        """Number of environments in which it learns at once."""
        return 1

    @property
    def needs_prediction(self) -> bool:
        """Whether it acts only in scenarios that predict, see `core.interface.scenario`."""
        return False

    @property
    def needs_rewards(self) -> bool:
        """Whether it decides by predicted rewards, so that a world is asked for them."""
        return False


class LearnerSettings(TeamSettings):
    """What the settings of all learners share.

    `build` returns the learner of a team, all consequent weights zero. It is given the agents' rule
    base and the row of weights of every agent ``(n,)``; all rows are somebody's.
    """

    uses_hierarchy = True
    kind_of_agents = f"{CORE}.agents.fuzzy:FuzzyAgents"

    values_actions: ClassVar[bool] = False
    """Whether the learner values an agent's own actions in its present state and given what it is
    told, which takes no prediction: then it is the team's evaluator, too."""

    rule_base: RuleBaseSettings = RuleBaseSettings()
    """Fuzzy rule base of every agent."""
    weights: Literal["own", "role"] = "own"
    """Whether every agent has consequent weights of its own, or all agents of one role (the left
    wheels, say) share them and pool their experience; alike where a scenario has no roles."""
    exploration: Annotated[ExplorationSettings, Plugged(EXPLORATIONS)] = BurstExploration()
    """How agents explore."""
    decision: DecisionSettings = DecisionSettings()
    """How values become a joint action."""
    self_model: SelfModelSettings = SelfModelSettings()
    """What bodies learn of their own wheels."""
    calibration: CalibrationSettings = CalibrationSettings()
    """What the team learns of the constants of its predictor."""
    predictor: Annotated[Predictor, unwritten(GivenPredictor())] = GivenPredictor()
    """What predicts: the scenario, nothing but persistence, or what has been learned."""

    @property
    def needs_rewards(self) -> bool:
        """Whether it decides by predicted rewards."""
        return self.decision.rule in ("reward", "reward-and-value")

    @property
    def is_mirrored(self) -> bool:
        """Whether what the mirror image of the team would have met is experience as well."""
        return False

    def rules_over(
        self, space: StateSpace, actions: ActionSet, n_told: int
    ) -> tuple[StateSpace, RuleBase]:
        """Return what values are functions of, and the agents' rule base over it.

        Parameters
        ----------
        space, actions
            Those of the scenario.
        n_told
            By how many others an agent is told what they decided, at most.
        """
        return space, RuleBase.build(space, self.rule_base)

    @property
    def needs_prediction(self) -> bool:
        """Whether it acts only in scenarios that predict: unless it has a predictor of its own."""
        is_given = isinstance(self.predictor, GivenPredictor)
        return is_given and self.decision.rule != "random" and not self.values_actions
