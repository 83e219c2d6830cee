"""Scaling study: success, time, memory and messages as functions of the number of robots.

Conditions usually differ in the number of robots and in the evaluator. In addition to episodes, a
trial keeps reproducible numbers, and its usage of time and memory. Laws of growth are fitted by the
command ``fit``.

Messages of a step are counted as in Section V: every agent sends its decided action to each agent
below it, so there is one message for every edge of the hierarchy's transitive closure;
n (n - 1) / 2 in a chain of n agents.
"""

import numpy as np

from ....core.agents.loop import StepRecord
from ....core.numerics import FloatArray
from ...results.analysis import Analysis, Figures, Summary, estimate_of, evaluated, left_out_lines
from ...results.results import Results
from ...results.sizes import Sizes
from ...results.statistics import NOT_NEGATIVE, bootstrap, exactly
from ...spec.tables import label_but
from ...trials.session import Session
from ...trials.trial import Trial, TrialResult
from ..learning_curve import BLOCKS, last_title
from ..sized import SizedCase, draw_by_size

NUMBERS = ("robots", "agents", "messages", "team_bytes", "decision_median")
"""Numbers of whole trials that the analysis needs."""
PUBLISHED = ("success",)
"""Measures in published results."""
PANELS = ("decision time [ms]", "learning [ms]", "team [MB]", "messages")
"""Titles of the panels of the figure after that of evaluation."""


def measure(trial: Trial) -> TrialResult:
    """Train and evaluate a team, and measure its time and memory."""
    session = Session.resumed(trial)
    session.train(trial.episodes - session.trained, session.trained)
    team = session.team
    hierarchy = team.hierarchy
    tried = np.array(session.joint_actions)
    # While all values are zero, as in the first episode, best responses try nothing.
    searched = tried > 0 if tried.any() else tried == 0
    seconds = np.array(session.decision_seconds)[searched]
    numbers = {
        "robots": float(len(session.world.groups)),
        "agents": float(len(hierarchy)),
        "messages": float(hierarchy.n_messages),
        "joint_actions": float(tried[searched].mean()),
        "team_bytes": float(sum(array.nbytes for array in team.state_dict().values())),
        "weight_bytes": float(team.weight_bytes),
    }
    period = trial.settings.scenario.period
    if period is not None:
        numbers["period_s"] = period
    touching: list[FloatArray] = []
    least: list[float] = []

    def note(record: StepRecord) -> None:
        """Record the minimum share of contact time of a robot in each episode."""
        if "contact_time" in record.transition.info:
            touching.append(record.transition.info["contact_time"])
            if record.last:
                pushing = max(float(np.max(touching, axis=1).sum()), 1e-12)
                least.append(float((np.sum(touching, axis=0) / pushing).min()))
                touching.clear()

    session.evaluate(note)
    session.run_other_evaluations()
    if least:
        numbers["least_touching"] = float(np.mean(least))
        numbers["all_touching"] = float((np.array(least) >= 0.5).mean())
    usage = {
        "decision_median": float(np.median(seconds)),
        "decision_99": float(np.quantile(seconds, 0.99)),
    }
    return session.result(numbers, usage)


def analyse(results: Results) -> Analysis:
    """Estimate with 95% intervals, with seeds as the unit of sampling; times are per step."""
    conditions = results.of_phase("training")
    sizes = Sizes.of(results, conditions)
    cases = [_case(results, condition, sizes) for condition in conditions]
    table = []
    for case in cases:
        is_size = case.condition == str(case.robots)
        label = sizes.shown(case.robots) if is_size else case.condition
        table.append(Summary(label, len(results.seeds(case.condition)), case.values))
    return Analysis(tuple(table), tuple(left_out_lines(results, "training")), cases)


def _case(results: Results, condition: str, sizes: Sizes) -> SizedCase:
    numbers = results.numbers(condition)
    steps = results.values(condition, "steps")
    main = results.main
    values = {
        last_title(main.heading, steps.shape[1]): estimate_of(
            results, condition, "training", main, BLOCKS["last"]
        ),
        **evaluated(results, condition),
    }
    if "all_touching" in numbers:
        values["all touch"] = bootstrap(numbers["all_touching"], bounds=(0, 1))
    costs = {
        "decision time [ms]": 1e3 * numbers["decision_median"],
        "learning [ms]": 1e3 * numbers["seconds.learning"] / steps.sum(axis=1),
        "team [MB]": 1e-6 * numbers["team_bytes"],
    }
    values |= {title: bootstrap(cost, bounds=NOT_NEGATIVE) for title, cost in costs.items()}
    values["messages"] = exactly(numbers["messages"][0])
    name = label_but(results.columns.get(condition, {}), sizes.keys) or "default"
    return SizedCase(condition, name, "", sizes.counts[condition], sizes, values)


def draw(analysis: Analysis) -> Figures:
    """Return the figure: means over seeds with 95% intervals against the number of robots."""
    return {"scaling": draw_by_size(analysis.cases, [analysis.cases[0].main, *PANELS])}
