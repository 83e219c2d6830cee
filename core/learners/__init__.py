"""Learners, which update the consequent weights of all agents from experience.

A learner observes *after-states*: the states ``(n, d)`` that the agents enter, with the reward
received on entering them, R(s) of Eq. 7. The first state of an episode has no reward and is not
learned from. A terminal state counts as entered forever: its value is R(s) / (1 - discount).
"""

from ..interface.scenario import Scenario
from ..plugins.registry import SettingsRegistry
from .learner import CORE, LearnerSettings, TeamSettings

PPO = f"{CORE}.networks.settings"

LEARNERS = SettingsRegistry(
    "learner",
    {
        "batch-td": f"{__name__}.batch:BatchTDSettings",
        "td-lambda": f"{__name__}.td:TDLambdaSettings",
        "optimistic-td": f"{__name__}.td:OptimisticTDSettings",
        "fmq": f"{__name__}.td:FMQSettings",
        "sparse-cooperative": f"{__name__}.sums:SparseCooperativeSettings",
        "q-learning": f"{__name__}.td:QLearningSettings",
        "vdn": f"{__name__}.sums:ValueDecompositionSettings",
        "fitted-q": f"{__name__}.fitted_q:FittedQSettings",
        "frozen": f"{__name__}.td:FrozenSettings",
        "written": f"{__name__}.written:WrittenSettings",
        "ppo": f"{PPO}:PPOSettings",
        "ippo": f"{PPO}:IPPOSettings",
        "hierarchy-ppo": f"{PPO}:HierarchyPPOSettings",
        "mappo": f"{PPO}:MAPPOSettings",
        "mixed": f"{CORE}.agents.mixed:MixedSettings",
    },
    LearnerSettings,
    TeamSettings,
    function_base=f"{CORE}.functions.settings:FunctionSettings",
)
"""Learners by name."""


def check_prediction(settings: TeamSettings, scenario: Scenario) -> None:
    """Refuse a learner that needs predictions in a scenario without a predictor.

    Raises
    ------
    ValueError
        If there is no predictor; the message names the learners that need none.
    """
    lack = scenario.lacks_prediction
    if not settings.needs_prediction or not lack:
        return
    kinds = [k for k in LEARNERS.built_in if k != "mixed"]
    others = [k for k in kinds if not LEARNERS.parsed(k).needs_prediction]
    raise ValueError(
        f"learner.kind = {settings.kind!r}: needs predicted states, but {lack}; use "
        f"{', '.join(others)}, learner.predictor.kind = 'learned' or "
        "learner.decision.rule = 'random'"
    )


__all__ = ["LEARNERS", "LearnerSettings", "TeamSettings", "check_prediction"]
