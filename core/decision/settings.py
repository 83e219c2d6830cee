"""How values become a joint action: settings of decisions."""

from typing import Annotated, Literal

from ..evaluators import EVALUATORS, EvaluatorSettings
from ..evaluators.enumeration import AutoSettings
from ..evaluators.evaluator import Plan, Teammates, Unseen, ValueOf
from ..plugins.registry import Plugged
from ..plugins.settings import Settings, unwritten
from .errors import ErrorSettings


class DecisionSettings(Settings):
    """How values become a joint action: the ``[learner.decision]`` table of a spec."""

    rule: Literal["value", "reward", "reward-and-value", "random"] = "value"
    """Decide by f of the predicted state, by its predicted reward, by reward + discount f, or at
    random. f of an after-state contains its reward already: the sum weighs the reward twice, which
    helps where rewards lead part of the way."""
    teammates: Teammates = "best-response"
    """What the agents below are expected to do: the best for this agent, anything with equal
    probability, what they were seen to do so far (the paper's "stochastically observing"), or what
    they were seen to do when this agent did the same as it considers now (``conditional``)."""
    value_of: ValueOf = "own"
    """Whose value decides: the agent's own; the mean of its own and those of the agents below it;
    or the mean of all agents'. ``own`` where each state tells what its agent's action is worth,
    ``team`` where what helps one may hinder others."""
    unseen: Annotated[Unseen, unwritten("maintain")] = "maintain"
    """What agents are expected to do that this one neither considers nor hears of: to maintain, to
    do again what they did last, or to keep to the plan that ``best-response`` makes for them."""
    plan: Annotated[Plan, unwritten("private")] = "private"
    """Whose plan ``best-response`` decides by: each agent's own, unless one above it hands it down
    with what it tells; or one that all work out alike, which is common knowledge and no message."""
    evaluator: Annotated[EvaluatorSettings, Plugged(EVALUATORS, EVALUATORS.parsed)] = AutoSettings()
    """Which joint actions of the agents below are tried: the name of an evaluator, or its table."""
    errors: Annotated[ErrorSettings | None, unwritten(None)] = None
    """Errors that each agent has of its own; with this table it also plans for itself alone."""
