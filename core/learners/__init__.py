"""Learners: how the consequent weights of all agents follow from experience.

Conventions. A learner sees *after-states*: the states ``(n, d)`` that the agents enter, with the
reward received on entering them, R(s) of Eq. 7. The first state of an episode carries no reward
and is not learned from. A terminal state counts as entered again for ever: its value is
R(s) / (1 - discount). Siblings differ where their mathematics differs.
"""

from __future__ import annotations

from ..rules.rule_base import RuleBase
from ..settings import (
    AnovaTDSettings,
    BatchTDSettings,
    FittedValueSettings,
    FrozenSettings,
    GradientTDSettings,
    TDLambdaSettings,
)
from ..settings import Learner as LearnerSettings
from .anova import AnovaTD
from .batch import BatchTD, FittedValue
from .gradient import GradientTD
from .learner import Frozen, Learner
from .td import TDLambda

__all__ = [
    "AnovaTD",
    "BatchTD",
    "FittedValue",
    "Frozen",
    "GradientTD",
    "Learner",
    "TDLambda",
    "build_learner",
]


def build_learner(settings: LearnerSettings, rules: RuleBase, n_agents: int) -> Learner:
    """Build the learner that `settings` describe, with all consequent weights zero."""
    if isinstance(settings, TDLambdaSettings):
        return TDLambda(settings, rules, n_agents)
    if isinstance(settings, GradientTDSettings):
        return GradientTD(settings, rules, n_agents)
    if isinstance(settings, AnovaTDSettings):
        return AnovaTD(settings, rules, n_agents)
    if isinstance(settings, BatchTDSettings):
        return BatchTD(settings, rules, n_agents)
    if isinstance(settings, FittedValueSettings):
        return FittedValue(settings, rules, n_agents)
    assert isinstance(settings, FrozenSettings)
    return Frozen(rules, n_agents)
