"""The claims of the paper, each with what is measured and the criterion that decides it.

No verdict is given by hand: measures and criteria stand here. A criterion looks at an estimate with
its 95 % interval. A claim *holds* if the whole interval meets the criterion, *does not hold* if
none of it does, and is *not decided* in between, or by fewer than `LEAST_SEEDS`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

import numpy as np

from ..results.results import Results, from_arrays
from . import measures as measured
from .measures import Measured

Verdict = Literal["holds", "does not hold", "not decided"]


LEAST_SEEDS = 5
"""Seeds below which no interval is trusted with a verdict."""


class Criterion(Protocol):
    """Decides by an estimate."""

    def decide(self, found: Measured) -> Verdict:
        """Return the verdict."""
        ...


@dataclass(frozen=True)
class AtLeast:
    """The value must reach a threshold."""

    threshold: float

    def __str__(self) -> str:
        return f"at least {self.threshold:g}"

    def decide(self, found: Measured) -> Verdict:
        """Compare the interval with the threshold."""
        e = found.estimate
        if e.low >= self.threshold:
            return "holds"
        return "does not hold" if e.high < self.threshold else "not decided"


@dataclass(frozen=True)
class AtMost:
    """The value must not pass a threshold."""

    threshold: float

    def __str__(self) -> str:
        return f"at most {self.threshold:g}"

    def decide(self, found: Measured) -> Verdict:
        """Compare the interval with the threshold."""
        e = found.estimate
        if e.high <= self.threshold:
            return "holds"
        return "does not hold" if e.low > self.threshold else "not decided"


@dataclass(frozen=True)
class Within:
    """The value must be equal to zero but for a margin; a test, if there is one, must find none."""

    margin: float

    def __str__(self) -> str:
        return f"within {self.margin:g} of 0, no p < .05"

    def decide(self, found: Measured) -> Verdict:
        """Compare the interval with the margin on both sides, and p with .05."""
        e = found.estimate
        outside = e.low > self.margin or e.high < -self.margin
        if outside or (found.p is not None and found.p < 0.05):
            return "does not hold"
        return "holds" if e.low >= -self.margin and e.high <= self.margin else "not decided"


@dataclass(frozen=True)
class Claim:
    """A claim of the paper.

    Attributes
    ----------
    name
        For programs.
    text
        What is claimed.
    place
        Where.
    study
        The study that measures it.
    measure
        What is measured.
    compute
        Measures it; none of the study's results: it cannot be decided.
    criterion
        What the measure must be.
    """

    name: str
    text: str
    place: str
    study: str
    measure: str
    compute: Callable[[Results], Measured | None]
    criterion: Criterion


CLAIMS: tuple[Claim, ...] = (
    Claim(
        "learns", "wheels learn over epochs to push the box to the goal", "IX-A, Fig. 5b",
        "learning-curve", "success in episodes 16-20, less that of the better of frozen and random",
        measured.learned(), AtLeast(0.5),
    ),
    Claim(
        "more", "learning achieves more than planning with the reward function",
        "not claimed: a control", "learning-curve",
        "success in episodes 16-20, less that of planner",
        measured.learned(known=(measured.PLANNER,)), AtLeast(0.05),
    ),
    Claim(
        "sooner", "learning reaches the goal sooner than planning with the reward function",
        "not claimed: a control", "learning-curve", "evaluation steps, over the planner's",
        measured.sooner_than_planned, AtMost(0.9),
    ),
    Claim(
        "epochs", "the box reaches the goal by epoch 7 to 10", "IX-A, Fig. 6",
        "learning-curve", "success in episodes 7-10", measured.success(slice(6, 10)), AtLeast(0.8),
    ),
    Claim(
        "orientation", "it gets there with proper orientation", "IX-A, Fig. 5a",
        "learning-curve", "success in episodes 16-20, within 15 degrees",
        measured.oriented, AtLeast(0.8),
    ),
    Claim(
        "contact", "robots learn to maintain contact", "IX-A, Fig. 6",
        "learning-curve", "time in contact, episodes 16-20 less 1-5, less the same of planner",
        measured.contact_gained, AtLeast(0.05),
    ),
    Claim(
        "printed", "the printed constants and rule base (5^7) learn it", "IV, V, IX-A",
        "learning-curve", "as the first line, preset paper", measured.learned("paper"),
        AtLeast(0.5),
    ),
    Claim(
        "cost", "2.45e12 operations nested, 1.1e27 as one agent", "VII, Eq. 18-23",
        "cost", "greatest relative error of the two, by Eq. 18 and 23", measured.cost_error,
        Within(0.01),
    ),
    Claim(
        "complexity", "nesting reduces the complexity of joint-action learners [4]", "X-A",
        "cost", "joint actions tried by a chain of four, over those of joint-action learners",
        measured.tried_beside_joint_action_learners, AtMost(0.5),
    ),
    Claim(
        "optimum", "agents that observe each other agree on the optimal joint action", "V, X-A",
        "games", "P(optimal joint action), worst game, nested with observed frequencies",
        measured.optimal("nested, observed"), AtLeast(0.8),
    ),
    Claim(
        "maximum", "the same, the best being expected of those below", "V, X-A",
        "games", "P(optimal joint action), worst game, nested with the maximum",
        measured.optimal("nested, maximum"), AtLeast(0.8),
    ),
    Claim(
        "order", "the order of the chain is arbitrary", "X-A",
        "chain-order", "greatest difference of evaluation success from the first order",
        measured.order_matters, Within(0.15),
    ),
    Claim(
        "speed", "scales with the number of agents: time", "Abstract, VII",
        "scaling", "time of a decision over the decision period, most robots, not by enumeration",
        measured.decision_share, AtMost(1.0),
    ),
    Claim(
        "size", "scales with the number of agents: success", "Abstract, XI",
        "scaling", "evaluation success with most robots over that with fewest",
        measured.success_by_size, AtLeast(0.8),
    ),
    Claim(
        "failure", "recovers from a failed wheel by learning", "X-B",
        "wheel-failure", "success at the end over before, weights adapt, worst fault",
        measured.recovered("weights"), AtLeast(0.8),
    ),
    Claim(
        "self-model", "the same, its self-model adapting too", "X-B, extended",
        "wheel-failure", "success at the end over before, both adapt, worst fault",
        measured.recovered("both"), AtLeast(0.8),
    ),
    Claim(
        "shape", "the shape of the box is indifferent", "II-C",
        "shapes", "evaluation success over that with the square, worst shape",
        measured.worst_shape(), AtLeast(0.8),
    ),
    Claim(
        "points", "a robot's pushing points depend on the geometry of the object", "X-B, of [10]",
        "related", "success over that with the square, worst shape, pushing points as a team",
        measured.worst_shape("pushing points, team"), AtMost(0.8),
    ),
    Claim(
        "wheels", "an agent per wheel does not", "X-B",
        "related", "success over that with the square, worst shape, nested wheels",
        measured.worst_shape("nested"), AtLeast(0.8),
    ),
    Claim(
        "model", "no task model or contact points are needed", "II-B, II-C, XI",
        "ablation", "evaluation success, box predicted not to move, over the default's",
        measured.without("static predictor"), AtLeast(0.8),
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
    """What was found of a claim; `measured` is None if its study has no results."""

    claim: Claim
    measured: Measured | None
    verdict: Verdict


def judge(results: Mapping[str, Results]) -> tuple[Finding, ...]:
    """Decide every claim by the results of its study, by name."""
    findings = []
    for claim in CLAIMS:
        found = claim.compute(results.get(claim.study, from_arrays({})))
        if found is None or not np.isfinite(found.estimate.value):
            findings.append(Finding(claim, None, "not decided"))
            continue
        enough = found.seeds == 0 or found.seeds >= LEAST_SEEDS
        verdict = claim.criterion.decide(found) if enough else "not decided"
        findings.append(Finding(claim, found, verdict))
    return tuple(findings)
