"""Settings of decisions."""

from typing import Annotated, Literal

from pydantic import Field

from ..plugins.models import Plugged
from ..plugins.settings import Settings
from . import EVALUATORS, EvaluatorSettings
from .enumeration import AutoSettings
from .errors import ErrorSettings
from .evaluator import Plan, Teammates, Unseen, ValueOf


class DecisionSettings(Settings):
    """Settings of decisions: the ``[learner.decision]`` table of a spec."""

    rule: Literal["value", "reward", "reward-and-value", "random"] = "value"
    """Criterion: the value f of the predicted state, its predicted reward, reward + discount f, or
    random actions. The value of an after-state includes its reward; the sum therefore weighs the
    reward twice, which helps if rewards lead part of the way."""
    teammates: Teammates = "best-response"
    """Assumed actions of the agents below: the best for this agent, uniformly random, drawn by
    their observed frequencies (the paper's "stochastically observing"), or drawn by their observed
    frequencies given this agent's action (``conditional``)."""
    value_of: ValueOf = "own"
    """Averaged values: the agent's own, its own and those of the agents below it (``below``), or
    those of all agents (``team``). Use ``own`` if an agent's state shows the effect of its action,
    ``team`` if an action that helps one agent may hinder others."""
    unseen: Unseen = "maintain"
    """Assumed actions of agents whose actions this agent neither receives nor searches over, silent
    agents included: maintain, repeat the last action, or follow the plan of ``best-response``."""
    plan: Plan = "private"
    """Plans of ``best-response``: each agent makes its own unless an agent above hands one down
    with its messages (``private``), or all agents compute the same plan from common knowledge."""
    evaluator: Annotated[EvaluatorSettings, Plugged(EVALUATORS, EVALUATORS.parsed)] = AutoSettings()
    """Search over joint actions of the agents below: the name of an evaluator, or its table."""
    budget: Annotated[int | None, Field(ge=1)] = None
    """Maximum number of joint actions that the team tries in a decision, to compare hierarchies at
    equal computing. The budget is divided equally over the agents; what an agent does not need goes
    to the others. Without this key the search alone decides."""
    errors: ErrorSettings | None = None
    """Individual errors of agents. With this table every agent also makes plans of its own."""
