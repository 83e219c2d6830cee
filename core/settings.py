"""The settings of a learner, as they stand in the ``[learner]`` table of a spec.

Each model refuses unknown keys and values outside the stated ranges when it is built.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Fraction = Annotated[float, Field(ge=0, le=1)]


class Settings(BaseModel):
    """A frozen model that refuses unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class ScenarioSettings(Settings):
    """What the settings of all scenarios inherit."""

    kind: str = ""

    @property
    def onset(self) -> int | None:
        """Episode in which something is scheduled to change, such as a failure; none: never."""
        return None


class RuleBaseSettings(Settings):
    """The fuzzy rule base that every agent holds (Section IV-B)."""

    membership: Literal["triangular", "sigmoid"] = "triangular"
    """Shape of the membership functions; the paper's are differences of sigmoids (Eq. 6)."""
    memberships: Annotated[int, Field(ge=2, le=15)] | None = None
    """Membership functions per variable, spread evenly; none: the state space's own centres."""
    steepness: Positive = 8.0
    """Sigmoid slope times the distance of neighbouring centres (c_j of Eq. 6, dimensionless)."""
    order: Annotated[int, Field(ge=1, le=12)] = 1
    """Variables per rule: 1 sums one-variable rule bases, d is the paper's full product."""
    products: tuple[tuple[str, ...], ...] = ()
    """Further products of variables by name, summed to those of `order`."""
    precision: Literal["float64", "float32"] = "float64"
    """Of consequent weights and traces; float32 halves memory and traffic."""


class PaperExploration(Settings):
    """Epsilon-decreasing with a diminishing temperature (Section V).

    The temperature is ``T(t) = 1 + T_max exp(-s t)``; with probability
    ``epsilon (T(t) - 1) / (T_max - 1)``, cut off at 1, an agent explores.
    """

    kind: Literal["paper"] = "paper"
    epsilon: Fraction = 1.0
    """Exploration rate at the start; not printed in the paper."""
    max_temperature: Annotated[float, Field(gt=1)] = 100.0
    """T_max; not printed in the paper."""
    decay: NonNegative = 0.005
    """s per step, printed in Section IX."""
    clock: Literal["episode", "run"] = "run"
    """Whether t counts the steps of the episode or of the whole run; not stated in the paper."""
    exploit: Literal["greatest", "sample"] = "greatest"
    """Take the action of greatest probability (Section V), or sample Eq. 14."""
    explore: Literal["uniform", "boltzmann"] = "uniform"
    """How the "random action" of the other case is drawn; not stated in the paper."""


class BurstExploration(Settings):
    """Random actions that are held for a while, at a rate that falls from episode to episode.

    The fraction of explorative decisions in episode ``k`` is ``max(floor, rate * decay ** k)``.
    """

    kind: Literal["burst"] = "burst"
    rate: Fraction = 0.3
    decay: Fraction = 0.75
    floor: Fraction = 0.02
    length: Annotated[float, Field(ge=1)] = 4.0
    """Mean number of decisions for which a random action is repeated."""


class Decision(Settings):
    """How values become a joint action."""

    rule: Literal["value", "reward", "reward-and-value", "random"] = "value"
    """Decide by f of the predicted state, by its predicted reward, by reward + discount f, or at
    random. f of an after-state contains its reward already: the sum weighs the reward twice."""
    others: Literal["max", "mean", "observed"] = "max"
    """What the agents below are expected to do: the best for this agent, anything with equal
    chance, or what they were seen to do so far (the paper's "stochastically observing")."""
    evaluator: Literal["auto", "exact", "sampling", "latin-hypercube", "moments", "extremes"] = (
        "auto"
    )
    """Enumerate all joint actions, try a random sample of them, try as many as `budget` allows and
    spread them evenly if that is not all, or go by the sum of what robots contribute: `moments` for
    others "mean" and "observed", `extremes` for others "max". Auto: exact up to `exact_up_to`,
    sampling up to `sampling_up_to`, beyond by sums if the scenario can."""
    samples: Annotated[int, Field(ge=1, le=1_000_000)] = 64
    """Joint actions of the agents below tried with each own action when sampling."""
    budget: Annotated[int, Field(ge=1, le=1_000_000_000)] = 131_072
    """Moves of robots predicted for a decision of the whole team, about, by latin-hypercube."""
    exact_up_to: Annotated[int, Field(ge=1, le=10)] = 5
    """Agents that may still be free when `evaluator` is auto and enumeration is exact."""
    sampling_up_to: Annotated[int, Field(ge=1)] = 12
    """Agents that may still be free when `evaluator` is auto and joint actions are sampled."""


class SelfModelSettings(Settings):
    """Whether and how fast a robot revises what it believes its wheels to do."""

    enabled: bool = False
    """Otherwise prediction takes every robot as nominal."""
    prior_effect: Positive = 0.3
    """Standard deviation of a wheel's effect around the nominal one [m/s per m/s]."""
    prior_constant: Positive = 0.003
    """Standard deviation of the constant part of the motion [m/s]."""
    noise: Positive = 0.004
    """Standard deviation of a measured speed around the model's [m/s]."""
    surprise: Positive = 9.0
    """Squared innovation, in units of its expected square, from which on a change is assumed."""
    inflation: Positive = 1.0
    """Share of the prior covariance that is added then."""


class CalibrationSettings(Settings):
    """Whether and how fast a team revises the constants of its predictor."""

    enabled: bool = False
    """Otherwise they stay as the scenario believes them to be."""
    prior: Positive = 0.7
    """Standard deviation of the logarithm of a constant at first: 0.7 is a factor of 2."""
    noise: Positive = 0.008
    """Standard deviation of a measured speed around the predicted one [m/s]."""
    surprise: Positive = 4.0
    """Mean squared innovation of a body, in units of the expected square, above which it counts
    less."""
    drift: NonNegative = 0.003
    """What is added to the standard deviation (as squares) by every decision that pushes."""


class LearnerSettings(Settings):
    """What all learners share."""

    rule_base: RuleBaseSettings = RuleBaseSettings()
    discount: Annotated[float, Field(ge=0, lt=1)] = 0.95
    """gamma of Eq. 7."""
    exploration: Annotated[PaperExploration | BurstExploration, Field(discriminator="kind")] = (
        BurstExploration()
    )
    decision: Decision = Decision()
    self_model: SelfModelSettings = SelfModelSettings()
    calibration: CalibrationSettings = CalibrationSettings()


class TDLambdaSettings(LearnerSettings):
    """Online TD(lambda), Eq. 7-13."""

    kind: Literal["td-lambda"] = "td-lambda"
    step_size: Positive = 0.00012
    """alpha of Eq. 13."""
    trace_decay: Fraction = 0.4
    """lambda of Eq. 8."""
    normalised: bool = False
    """Divide the step size by the squared length of the feature vector."""
    averaging: Annotated[float, Field(ge=1, allow_inf_nan=False)] = 1.0
    """Steps over which the weights that decide average those that learn; 1: they are the same."""


class GradientTDSettings(LearnerSettings):
    """Gradient TD(lambda), the convergent method cited as [26]."""

    kind: Literal["gradient-td"] = "gradient-td"
    correction: Literal["tdc", "gtd2"] = "tdc"
    """TD with gradient correction, or GTD2."""
    step_size: Positive = 0.01
    """alpha, of the consequent weights."""
    second_step_size: Positive = 0.005
    """beta, of the second weights."""
    trace_decay: Fraction = 0.4
    """lambda."""


class ReplaySettings(LearnerSettings):
    """What learners share that regress on all experience, after every episode and during it."""

    ridge: Positive = 10.0
    """Weight of the squared consequents against squared errors of rewards scaled by 100."""
    sweeps: Annotated[int, Field(ge=1, le=10_000)] = 30
    """Regressions on freshly discounted targets each time."""
    mixing: Annotated[float, Field(gt=0, le=1)] = 0.5
    """Share of the way that the weights go towards the last regression's: below 1 the policy does
    not jump from episode to episode."""
    interval: Annotated[int, Field(ge=1)] = 100
    """Decisions of an episode after which is regressed without waiting for its end."""


class BatchTDSettings(ReplaySettings):
    """Batch TD(lambda): towards what followed."""

    kind: Literal["batch-td"] = "batch-td"
    trace_decay: Fraction = 0.0
    """lambda: 0 bootstraps from the next state, 1 sums the rewards of the whole episode."""


class AnovaTDSettings(ReplaySettings):
    """Batch TD(lambda) of the full product, with a prior that prefers few variables at a time."""

    kind: Literal["anova-td"] = "anova-td"
    trace_decay: Fraction = 0.0
    """lambda, as of batch TD."""
    interaction: Annotated[float, Field(gt=0, le=10, allow_inf_nan=False)] = 0.1
    """rho: prior variance of a function of k + 1 variables over that of one of k."""
    tolerance: Annotated[float, Field(gt=0, le=1)] = 0.01
    """Share of its prior variance that may be left out of an after-state."""
    dictionary: Annotated[int, Field(ge=1, le=4096)] = 800
    """After-states that all others are described by, at most."""


class FittedValueSettings(ReplaySettings):
    """Fitted value iteration: towards the best of the predicted next states."""

    kind: Literal["fitted-value"] = "fitted-value"
    candidates: Annotated[int, Field(ge=1)] = 64
    """Joint actions tried from every state in memory, drawn anew at every step."""


class FrozenSettings(LearnerSettings):
    """No learning: the consequents stay zero. The control of every learning curve."""

    kind: Literal["frozen"] = "frozen"


Learner = Annotated[
    TDLambdaSettings
    | GradientTDSettings
    | BatchTDSettings
    | AnovaTDSettings
    | FittedValueSettings
    | FrozenSettings,
    Field(discriminator="kind"),
]
"""Any learner's settings, told apart by `kind`."""
