"""The signals study: what it is worth to be told what others decide, if each knows something else.

Conditions are learners and Bayesian agents, told or not, by number of agents. Measured are how
often an agent is right, how often the last one is, and how often the team's vote is; beside each
stands what theory says of Bayesian agents in the same hierarchy, where it can be computed
(`nested_agents_signals.theory`).
"""

from typing import NamedTuple

import numpy as np
from nested_agents_signals.bayesian import Bayesian
from nested_agents_signals.scenario import SignalsSettings
from nested_agents_signals.theory import expected

from nested_agents import Analysis, Session, Spec, SpecError, Study, Summary, bootstrap
from nested_agents.analysis import Estimate, Figures, Results, Sizes, distinct, exactly, label_but
from nested_agents.study import Trial, TrialResult, check_evaluated

SHARES = {"right": "share right", "last": "last right", "vote": "vote right"}
"""What is compared with theory: measures of an episode, and their titles."""
PUBLISHED = ("success", *SHARES)
"""Measures of an episode that published results keep."""
THEORY = "theory"
"""Head of the names of what theory says."""


def check(spec: Spec) -> None:
    """Raise `SpecError` unless agents of private signals are evaluated."""
    check_evaluated(spec)
    for condition in spec.conditions():
        if not isinstance(condition.settings.scenario, SignalsSettings):
            raise SpecError(
                f"scenario.kind = {condition.settings.scenario.kind!r}: signals needs 'signals'"
            )


def measure(trial: Trial) -> TrialResult:
    """Train, evaluate, and ask theory; imported by name in workers."""
    session = Session(trial)
    session.train(trial.episodes)
    session.evaluate()
    hierarchy = session.team.hierarchy
    numbers = {"robots": float(len(hierarchy)), "messages": float(hierarchy.n_messages)}
    learner = trial.settings.learner
    indifferent = learner.indifferent if isinstance(learner, Bayesian) else "signal"
    scenario = trial.settings.scenario
    if isinstance(scenario, SignalsSettings):
        theory = expected(hierarchy, scenario.accuracy, indifferent)
        if theory is not None:
            numbers[f"{THEORY}.right"] = float(theory.right.mean())
            numbers[f"{THEORY}.last"] = float(theory.right[-1])
            if np.isfinite(theory.vote):
                numbers[f"{THEORY}.vote"] = theory.vote
    return session.result(numbers)


class SignalsCase(NamedTuple):
    """One condition."""

    seeds: int
    """How many have finished."""
    system: str
    """Who decides, told or not."""
    agents: int
    """How many."""
    sizes: Sizes
    """Those of all cases."""
    values: dict[str, Estimate]
    """Estimates, and what theory says, by title."""

    @property
    def label(self) -> str:
        """How its line of the table is called."""
        return f"{self.sizes.shown(self.agents)}, {self.system}".removeprefix(", ")

    @property
    def known(self) -> list[tuple[Estimate, float]]:
        """Estimates of which theory says something, and what it says."""
        titles = [title for title in SHARES.values() if f"{title}, {THEORY}" in self.values]
        return [(self.values[t], float(self.values[f"{t}, {THEORY}"].value)) for t in titles]


def analyse(results: Results) -> Analysis:
    """Estimate, and compare with theory; 95% intervals, seeds as the unit of sampling."""
    sizes = Sizes.of(results, results.of_phase("evaluation"))
    cases = []
    for condition, agents in sizes.counts.items():
        numbers = results.numbers(condition)
        values: dict[str, Estimate] = {}
        for name, title in SHARES.items():
            means = results.means(condition, "evaluation", name).to_numpy()
            values[title] = bootstrap(means, bounds=(0.0, 1.0))
            if f"{THEORY}.{name}" in numbers:
                values[f"{title}, {THEORY}"] = exactly(numbers[f"{THEORY}.{name}"][0])
        values["messages"] = exactly(numbers["messages"][0])
        columns = results.columns.get(condition, {"name": condition})
        system = label_but(columns, sizes.keys)
        seeds = len(results.seeds(condition))
        cases.append(SignalsCase(seeds, system, agents, sizes, values))
    cases.sort(key=lambda case: case.agents)
    table = tuple(Summary(case.label, case.seeds, case.values) for case in cases)
    return Analysis(table, tuple(_notes(cases)), cases)


def _notes(cases: list[SignalsCase]) -> list[str]:
    """Say of who decides in how many estimates theory lies within the interval."""
    lines = []
    for system in distinct(case.system for case in cases):
        known = [pair for case in cases if case.system == system for pair in case.known]
        within = sum(bool(e.low <= value <= e.high) for e, value in known)
        if known:
            lines.append(f"{system}: theory within the interval in {within} of {len(known)}")
    head = ["Theory: of Bayesian agents in the same hierarchy, exactly."] if lines else []
    return head + lines


def draw(analysis: Analysis) -> Figures:
    """Return the figure: shares by number of agents; in gray, what theory says."""
    from nested_agents import figures as f

    cases = analysis.cases
    systems = distinct(case.system for case in cases)
    figure, panels = f.panels(1, len(SHARES), (2.9 * len(SHARES), 3.4), sharey=True)
    for axes, title in zip(panels[0], SHARES.values(), strict=True):
        for index, system in enumerate(systems):
            own = [case for case in cases if case.system == system]
            agents = [case.agents for case in own]
            f.draw_line(axes, agents, [case.values[title] for case in own], index, len(systems))
            known = [case for case in own if f"{title}, {THEORY}" in case.values]
            axes.plot(
                [case.agents for case in known],
                [float(case.values[f"{title}, {THEORY}"].value) for case in known],
                color="#888888", lw=0.8, zorder=0,
            )  # fmt: skip
        f.scale_axis(axes, sorted({case.agents for case in cases}))
        axes.set_title(title, loc="left")
        axes.set_xlabel(cases[0].sizes.word)
    f.name_lines(figure, systems, "means over seeds, bars: 95% intervals; gray: theory")
    return {"signals": figure}


class SignalsStudy(Study):
    """Compares told agents with theory."""

    PUBLISHED = PUBLISHED
    check = staticmethod(check)
    measure = staticmethod(measure)
    analyse = staticmethod(analyse)
    draw = staticmethod(draw)
