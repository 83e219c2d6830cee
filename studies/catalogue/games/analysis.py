"""The games study: how often learners of all kinds find the optimum of a repeated game.

A step is a play. After the first episode of training, and after the last one, nothing is explored
or learned for a while: the last play of that while is optimal or it is not. Ties between equally
good actions are broken at random at every play, so that agents who cannot agree on one of two
optima miss it about every second time. The first of the two evaluations leaves the team and its
random numbers as they were.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from string import ascii_uppercase
from textwrap import wrap
from typing import Any

from ...results.results import Results
from ...results.statistics import Estimate, rate
from ...results.summary import Summary, two_figures
from ...spec.errors import SpecError
from ...spec.spec import Spec
from ...store.schema import ELSEWHERE
from ...trials.session import Session
from ...trials.trial import Trial, TrialResult

AFTER_ONE = f"{ELSEWHERE}after one episode"
"""Phase of the evaluation after the first episode of training."""
WIDTH = 80
"""Of a note [characters]."""


def check(spec: Spec) -> None:
    """Raise `SpecError` unless trained teams are evaluated."""
    if spec.evaluation < 1:
        raise SpecError("evaluation = 0: games compares evaluation success, needs 1 or more")


def measure(trial: Trial) -> TrialResult:
    """Train, and evaluate after the first and the last episode; imported by name in workers."""
    session = Session(trial)
    session.train(1)
    generator = session.team.rng.bit_generator
    state = generator.state
    session.evaluate(phase=AFTER_ONE)
    generator.state = state
    session.train(trial.episodes - 1, first=1)
    session.evaluate()
    session.evaluate_elsewhere()
    return session.result()


@dataclass(frozen=True)
class Case:
    """One condition.

    Attributes
    ----------
    system
        Name of its override: what learns and decides.
    setting
        What it is compared in: the game, the exploration.
    found
        By number of plays, the probability of the optimal joint action.
    """

    system: str
    setting: tuple[str, ...]
    found: Mapping[int, Estimate]


@dataclass(frozen=True)
class Games:
    """The analysis.

    Attributes
    ----------
    table
        One line per condition.
    cases
        The same for figures.
    notes
        The systems side by side, for printing.
    """

    table: tuple[Summary, ...]
    cases: tuple[Case, ...]
    notes: tuple[str, ...]

    @property
    def headline(self) -> str:
        """What a report speaks of first: the evaluation after all plays."""
        return titled(max((max(case.found) for case in self.cases), default=0))


def analyse(results: Results) -> Games:
    """Estimate; 95 % Wilson intervals, seeds as the unit of sampling."""
    cases, table = [], []
    first = results.phases.get(AFTER_ONE, {})
    for condition, evaluation in results.evaluation.items():
        columns = results.columns.get(condition, {"name": condition})
        setting = tuple(str(v) for k, v in columns.items() if k != "name" and v != "")
        steps = results.training[condition]["steps"]
        found = {}
        if condition in first and steps.shape[1] > 1:
            found[int(steps[0, 0])] = rate(first[condition]["success"])
        found[int(steps[0].sum())] = rate(evaluation["success"])
        cases.append(Case(_system(columns, condition), setting, found))
        estimates = {titled(plays): estimate for plays, estimate in found.items()}
        table.append(Summary(condition, len(steps), estimates))
    return Games(tuple(table), tuple(cases), tuple(_side_by_side(cases)))


def titled(plays: int) -> str:
    """Return the title of an estimate.

    >>> titled(5000)
    'optimal, 5,000 plays'
    """
    return f"optimal, {plays:,} plays"


def _system(columns: Mapping[str, Any], condition: str) -> str:
    return str(columns.get("name", condition))


def _side_by_side(cases: list[Case]) -> Iterator[str]:
    """Yield the systems as columns, the settings as rows, for each number of plays."""
    systems = list(dict.fromkeys(case.system for case in cases))
    settings = list(dict.fromkeys(case.setting for case in cases))
    letters = dict(zip(systems, ascii_uppercase, strict=False))
    if len(letters) < 2 or len(letters) < len(systems):
        return
    by_place = {(case.setting, case.system): case.found for case in cases}
    widest = max(len(", ".join(setting)) for setting in settings)
    legend = "; ".join(f"{letter} {system}" for system, letter in letters.items())
    yield from ("", *wrap(legend, WIDTH))
    for plays in dict.fromkeys(plays for case in cases for plays in case.found):
        yield f"\nProbability of the optimal joint action after {plays:,} plays"
        yield " " * widest + "".join(f"{letter:>4}" for letter in letters.values())
        for setting in settings:
            cells = (by_place.get((setting, system), {}).get(plays) for system in systems)
            shown = "".join(f"{two_figures(float(e.value)) if e else '-':>4}" for e in cells)
            yield f"{', '.join(setting):{widest}}{shown}"
