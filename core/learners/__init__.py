"""Learners: how the consequent weights of all agents follow from experience.

Conventions. A learner sees *after-states*: the states ``(n, d)`` that the agents enter, with the
reward received on entering them, R(s) of Eq. 7. The first state of an episode carries no reward
and is not learned from. A terminal state counts as entered again for ever: its value is
R(s) / (1 - discount). Siblings differ where their mathematics differs.
"""

from ..plugins.plugged import SettingsRegistry
from .learner import LearnerSettings, TeamSettings

PEERS = f"{__name__.rpartition('.')[0]}.policies.settings"

LEARNERS = SettingsRegistry(
    "learner",
    {
        "batch-td": f"{__name__}.batch:BatchTDSettings",
        "td-lambda": f"{__name__}.td:TDLambdaSettings",
        "optimistic-td": f"{__name__}.optimistic:OptimisticTDSettings",
        "fmq": f"{__name__}.fmq:FMQSettings",
        "sparse-cooperative": f"{__name__}.sparse_cooperative:SparseCooperativeSettings",
        "q-learning": f"{__name__}.q_learning:QLearningSettings",
        "vdn": f"{__name__}.vdn:ValueDecompositionSettings",
        "fitted-q": f"{__name__}.fitted_q:FittedQSettings",
        "frozen": f"{__name__}.frozen:FrozenSettings",
        "ppo": f"{PEERS}:PPOSettings",
        "ippo": f"{PEERS}:IPPOSettings",
        "mappo": f"{PEERS}:MAPPOSettings",
        "dqn": f"{PEERS}:DQNSettings",
    },
    LearnerSettings,
    TeamSettings,
)
"""Learners by name."""

__all__ = ["LEARNERS", "LearnerSettings", "TeamSettings"]
