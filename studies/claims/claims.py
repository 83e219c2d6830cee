"""The claims of the paper, each with what is measured and the criterion that decides it.

No verdict is given by hand: measures and criteria stand here. A criterion looks at an estimate with
its 95 % interval. A claim *holds* if the whole interval meets the criterion, *does not hold* if
none of it does, and is *not decided* in between, or by fewer than `LEAST_SEEDS`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Literal

import numpy as np

from ..presentation.cells import ends
from ..results.results import NOTHING, Results
from . import measures as measured
from .measures import Measured

Verdict = Literal["holds", "does not hold", "not decided"]

LEAST_SEEDS = 5
"""Seeds below which no interval is trusted with a verdict."""


@dataclass(frozen=True)
class Criterion:
    """An estimate meets it between two bounds, if no test finds a difference.

    Examples
    --------
    >>> at_least(0.8).text, within(0.01).text
    ('at least 0.8', 'within 0.01 of 0, no p < .05')
    """

    text: str
    """The criterion in words."""
    low: float = -inf
    """The lower bound, included."""
    high: float = inf
    """The upper bound, included."""

    def decide(self, measured: Measured) -> Verdict:
        """Compare the whole interval with the bounds, and p with .05."""
        e = measured.estimate
        if e.high < self.low or e.low > self.high or (measured.p is not None and measured.p < 0.05):
            return "does not hold"
        return "holds" if e.low >= self.low and e.high <= self.high else "not decided"


def at_least(threshold: float) -> Criterion:
    """Return the criterion that a value reaches a threshold."""
    return Criterion(f"at least {threshold:g}", low=threshold)


def at_most(threshold: float) -> Criterion:
    """Return the criterion that a value does not pass a threshold."""
    return Criterion(f"at most {threshold:g}", high=threshold)


def within(margin: float) -> Criterion:
    """Return the criterion that a value is zero but for a margin."""
    return Criterion(f"within {margin:g} of 0, no p < .05", -margin, margin)


@dataclass(frozen=True)
class Claim:
    """A claim of the paper."""

    name: str
    """For programs."""
    text: str
    """What is claimed."""
    place: str
    """Where."""
    study: str
    """The study that measures it."""
    measure: str
    """What is measured."""
    compute: Callable[[Results], Measured | None]
    """Measures it; none of the study's results: it cannot be decided."""
    criterion: Criterion
    """What the measure must be."""


CLAIMS: tuple[Claim, ...] = (
    Claim(
        "learns", "wheels learn over epochs to push the box to the goal", "IX-A, Fig. 5b",
        "learning-curve", "success in episodes 16-20, less that of the better of frozen and random",
        measured.learned(), at_least(0.5),
    ),
    Claim(
        "more", "learning achieves more than planning with the reward function",
        "not claimed: a control", "learning-curve",
        "success in episodes 16-20, less that of planner",
        measured.learned(known=(measured.PLANNER,)), at_least(0.05),
    ),
    Claim(
        "sooner", "learning reaches the goal sooner than planning with the reward function",
        "not claimed: a control", "learning-curve", "evaluation steps, over the planner's",
        measured.sooner_than_planned, at_most(0.9),
    ),
    Claim(
        "epochs", "the box reaches the goal by epoch 7 to 10", "IX-A, Fig. 6",
        "learning-curve", "success in episodes 7-10", measured.success(slice(6, 10)), at_least(0.8),
    ),
    Claim(
        "orientation", "it gets there with proper orientation", "IX-A, Fig. 5a",
        "learning-curve", "success in episodes 16-20, within 15 degrees",
        measured.success(measured.LAST, "pose", "preset pose"), at_least(0.8),
    ),
    Claim(
        "contact", "robots learn to maintain contact", "IX-A, Fig. 6",
        "learning-curve", "time in contact, episodes 16-20 less 1-5, less the same of planner",
        measured.contact_gained, at_least(0.05),
    ),
    Claim(
        "printed", "the printed constants and rule base (5^7) learn it", "IV, V, IX-A",
        "learning-curve", "as the first line, preset paper", measured.learned("paper"),
        at_least(0.5),
    ),
    Claim(
        "cost", "2.45e12 operations nested, 1.1e27 as one agent", "VII, Eq. 18-23",
        "cost", "greatest relative error of the two, by Eq. 18 and 23", measured.cost_error,
        within(0.01),
    ),
    Claim(
        "complexity", "nesting reduces the complexity of joint-action learners [4]", "X-A",
        "cost", "joint actions tried by a chain of four, over those of joint-action learners",
        measured.tried_beside_joint_action_learners, at_most(0.5),
    ),
    Claim(
        "optimum", "agents that observe each other agree on the optimal joint action", "V, X-A",
        "games", "P(optimal joint action), worst game, nested with observed frequencies",
        measured.optimal("nested, observed"), at_least(0.8),
    ),
    Claim(
        "maximum", "the same, the best being expected of those below", "V, X-A",
        "games", "P(optimal joint action), worst game, nested with the maximum",
        measured.optimal("nested, maximum"), at_least(0.8),
    ),
    Claim(
        "order", "the order of the chain is arbitrary", "X-A",
        "chain-order", "greatest difference of evaluation success from the first order",
        measured.order_matters, within(0.15),
    ),
    Claim(
        "speed", "scales with the number of agents: time", "Abstract, VII",
        "scaling", "time of a decision over the decision period, most robots, not by enumeration",
        measured.decision_share, at_most(1.0),
    ),
    Claim(
        "size", "scales with the number of agents: success", "Abstract, XI",
        "scaling", "evaluation success with most robots over that with fewest",
        measured.success_by_size, at_least(0.8),
    ),
    Claim(
        "failure", "recovers from a failed wheel by learning", "X-B",
        "wheel-failure", "success at the end over before, weights adapt, worst fault",
        measured.recovered("weights"), at_least(0.8),
    ),
    Claim(
        "self-model", "the same, its self-model adapting too", "X-B, extended",
        "wheel-failure", "success at the end over before, both adapt, worst fault",
        measured.recovered("both"), at_least(0.8),
    ),
    Claim(
        "shape", "the shape of the box is indifferent", "II-C",
        "shapes", "evaluation success over that with the square, worst shape",
        measured.worst_shape(), at_least(0.8),
    ),
    Claim(
        "points", "a robot's pushing points depend on the geometry of the object", "X-B, of [10]",
        "related", "success over that with the square, worst shape, pushing points as a team",
        measured.worst_shape("pushing points, team"), at_most(0.8),
    ),
    Claim(
        "wheels", "an agent per wheel does not", "X-B",
        "related", "success over that with the square, worst shape, nested wheels",
        measured.worst_shape("nested"), at_least(0.8),
    ),
    Claim(
        "model", "no task model or contact points are needed", "II-B, II-C, XI",
        "ablation", "evaluation success, box predicted not to move, over the default's",
        measured.without_model, at_least(0.8),
    ),
)  # fmt: skip
"""Every claim that is decided."""

STUDIES_OF_CLAIMS = tuple(dict.fromkeys(claim.study for claim in CLAIMS if claim.study != "cost"))
"""The studies that have to be run; costs are computed."""
SPECS = Path(__file__).parents[1] / "catalogue"
"""Where their specs are: one folder for each study."""
PUBLISHED = Path(__file__).parent / "published"
"""Where the committed results are."""
QUICK = Path(__file__).parent / "quick"
"""Where the small versions are."""


@dataclass(frozen=True)
class Finding:
    """The verdict on a claim; `measured` is None if its study has no results."""

    claim: Claim
    measured: Measured | None
    verdict: Verdict

    @property
    def result(self) -> str:
        """The value with its interval and number of seeds, as text."""
        if self.measured is None:
            return "no results"
        value, low, high = ends(self.measured.estimate)
        text = f"{value:.2f}" if self.measured.seeds else f"{value:.2g}"
        if self.measured.seeds:
            text += f" ({low:.2f} to {high:.2f}), {self.measured.seeds} seeds"
        else:
            text += ", computed"
        if self.measured.p is not None:
            text += f", p = {self.measured.p:.2g}"
        return text + (f", {self.measured.note}" if self.measured.note else "")


def judge(results: Mapping[str, Results]) -> tuple[Finding, ...]:
    """Decide every claim by the results of its study, by name."""
    findings = []
    for claim in CLAIMS:
        measurement = claim.compute(results.get(claim.study, NOTHING()))
        if measurement is None or not np.isfinite(measurement.estimate.value):
            findings.append(Finding(claim, None, "not decided"))
            continue
        enough = measurement.seeds == 0 or measurement.seeds >= LEAST_SEEDS
        verdict = claim.criterion.decide(measurement) if enough else "not decided"
        findings.append(Finding(claim, measurement, verdict))
    return tuple(findings)
