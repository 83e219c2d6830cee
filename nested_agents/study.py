"""Base class of studies, their trials, and checks of their specs."""

from .core.agents.loop import StepRecord, world_seed
from .studies.catalogue.study import (
    Study,
    check_evaluated,
    check_evaluations,
    check_rule_bases,
)
from .studies.trials.arrangement import check_conditions
from .studies.trials.session import EVALUATION_WORLDS, Session, run_trial
from .studies.trials.trial import Trial, TrialResult, trials_of

__all__ = [
    "EVALUATION_WORLDS",
    "Session",
    "StepRecord",
    "Study",
    "Trial",
    "TrialResult",
    "check_conditions",
    "check_evaluated",
    "check_evaluations",
    "check_rule_bases",
    "run_trial",
    "trials_of",
    "world_seed",
]
