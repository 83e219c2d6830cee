"""The shapes study: whether the shape of the box is indifferent, as the paper has it.

A team is trained with one box, and then acts greedily, without any further learning, with every box
that the spec lists under ``[evaluations]``, on the same worlds. What is reported of each box is its
success rate, the ratio to the rate with the box of training, and how much of the time in which any
robot pushes each of them does. The agents' state holds nothing of the shape; the predictor by which
they look ahead is given it (see docs/predictors.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...results.comparison import Difference, adjusted, ratio
from ...results.results import Arrays, Results
from ...results.statistics import bootstrap, rate
from ...results.summary import Summary
from ...results.verdicts import power_lines
from ...spec.errors import SpecError
from ...spec.spec import Spec
from ...trials.session import Session
from ...trials.trial import Trial, TrialResult
from ..contact import ContactShares

TRAINED = "trained on"
"""How the box of training is called among the others."""


def check(spec: Spec) -> None:
    """Raise `SpecError` unless there is another box to compare with."""
    if not spec.evaluations:
        raise SpecError('evaluations: missing; shapes needs one at least, as circle.box = "circle"')


def measure(trial: Trial) -> TrialResult:
    """Train a team with its own box, evaluate it with all; imported by name in workers."""
    session = Session(trial)
    session.train(trial.episodes)
    contacts = {name: ContactShares() for name in (TRAINED, *dict(trial.evaluations))}
    session.evaluate(contacts[TRAINED])
    session.evaluate_elsewhere(contacts)
    numbers = {
        f"touching.{name}.robot{r + 1}": float(share)
        for name, contact in contacts.items()
        if len(contact.shares)
        for r, share in enumerate(contact.shares.mean(axis=0))
    }
    return session.result(numbers)


@dataclass(frozen=True)
class Shapes:
    """The analysis.

    Attributes
    ----------
    table
        One line per condition and box, the box of training first.
    ratios
        By condition, success with each other box over that with the box of training, with p of no
        difference, adjusted over all boxes of the condition.
    notes
        Verdicts, for printing.
    """

    table: tuple[Summary, ...]
    ratios: dict[str, tuple[Difference, ...]]
    notes: tuple[str, ...]


def analyse(results: Results) -> Shapes:
    """Estimate and compare; 95 % intervals, seeds as the unit of sampling."""
    table: list[Summary] = []
    ratios: dict[str, tuple[Difference, ...]] = {}
    for condition, trained in results.evaluation.items():
        boxes = {TRAINED: trained} | results.elsewhere(condition)
        found = ratios[condition] = ratios_of(results, condition)
        by_box = {d.condition: d for d in found}
        for box, arrays in boxes.items():
            label = box if len(results.evaluation) == 1 else f"{condition}: {box}"
            estimates = {"success": rate(arrays["success"])}
            own = 1.0 if trained["success"].any() else np.nan
            estimates["ratio"] = by_box[box].estimate if box in by_box else bootstrap([own])
            estimates |= _further(arrays, results.numbers.get(condition, {}), box)
            table.append(Summary(label, len(arrays["success"]), estimates))
    notes = [line for condition, found in ratios.items() for line in _verdict(condition, found)]
    return Shapes(tuple(table), ratios, tuple(notes))


def ratios_of(results: Results, condition: str) -> tuple[Difference, ...]:
    """Return the ratios of a condition, box by box; none if it has not been evaluated."""
    if condition not in results.evaluation:
        return ()
    base = results.evaluation[condition]["success"]
    others = {box: arrays["success"] for box, arrays in results.elsewhere(condition).items()}
    runs = base.mean(axis=1)
    return adjusted(
        [
            Difference.of(box, "ratio", outcomes.mean(axis=1), runs, ratio(outcomes, base))
            for box, outcomes in others.items()
        ]
    )


def _further(arrays: Arrays, numbers: Arrays, box: str) -> dict:
    start = f"touching.{box}.robot"
    robots = {
        f"touches {n.removeprefix(start)}": v for n, v in numbers.items() if n.startswith(start)
    }
    found = {}
    if "stopped_at_goal" in arrays:
        found["stopped"] = rate(arrays["stopped_at_goal"])
    if "contact_fraction" in arrays:
        found["contact"] = bootstrap(arrays["contact_fraction"].mean(axis=1), bounds=(0, 1))
    return found | {title: bootstrap(values, bounds=(0, 1)) for title, values in robots.items()}


def least_ratio(found: tuple[Difference, ...]) -> Difference:
    """Return the ratio of the box that comes off worst.

    Raises
    ------
    ValueError
        If there is none.
    """
    if not found:
        raise ValueError("shapes: no further box has been evaluated")
    return min(found, key=lambda d: float(np.nan_to_num(d.estimate.value)))


def _verdict(condition: str, found: tuple[Difference, ...]) -> list[str]:
    if not found:
        return []
    lines = [f"\n{condition}, ratio to the box of training:"]
    for d in found:
        e = d.estimate
        lines.append(
            f"  {d.condition}: {e.value:.2f} [{e.low:.2f}, {e.high:.2f}], p = {d.p:.2g} (adjusted)"
        )
    return [*lines, *power_lines(found)]
