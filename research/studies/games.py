"""The games study: how often learners of all kinds find the optimum of a repeated game.

A step is a play. After the first episode of training, and after the last one, nothing is explored
or learned for a while: the last play of that while is optimal or it is not. Ties between equally
good actions are broken at random at every play, so that agents who cannot agree on one of two
optima miss it about every second time. The first of the two evaluations leaves the team and its
random numbers as they were.
"""

from collections.abc import Iterator, Sequence
from itertools import product
from string import ascii_uppercase
from textwrap import wrap

from nested_agents import Analysis, Session, Study, Summary, rate
from nested_agents.analysis import Case, Figures, Results, distinct, format_number, system_of
from nested_agents.study import Trial, TrialResult
from nested_agents.study import check_evaluated as check

PUBLISHED = ("success",)
"""Measures of an episode that published results keep."""
TIMED = False
"""Trials are too short for their times to say anything."""
AFTER_ONE = "evaluation:after one episode"
"""Phase of the evaluation after the first episode of training."""
WIDTH = 80
"""Width of a printed line [characters]."""
COLUMNS = 3
"""Panels of the figure that stand beside each other."""


def measure(trial: Trial) -> TrialResult:
    """Train, and evaluate after the first and the last episode; imported by name in workers."""
    session = Session(trial)
    session.train(1)
    with session.team.drawing_apart():
        session.evaluate(phase=AFTER_ONE)
    session.train(trial.episodes - 1, first=1)
    return session.finish()


def analyse(results: Results) -> Analysis:
    """Estimate; 95% Wilson intervals, seeds as the unit of sampling."""
    cases = []
    table = []
    for condition in results.of_phase("evaluation"):
        system, swept = system_of(results, condition)
        setting = tuple(map(str, swept.values()))
        steps = results.values(condition, "steps")
        optimal = {}
        if results.has(condition, AFTER_ONE) and steps.shape[1] > 1:
            optimal[int(steps[0, 0])] = rate(results.success(condition, AFTER_ONE))
        optimal[int(steps[0].sum())] = rate(results.success(condition, "evaluation"))
        cases.append(Case(system, setting, optimal))
        estimates = {title_of(plays): estimate for plays, estimate in optimal.items()}
        table.append(Summary(condition, len(steps), estimates))
    return Analysis(tuple(table), tuple(_side_by_side(cases)), cases)


def title_of(plays: int) -> str:
    """Return the title of an estimate.

    >>> title_of(5000)
    'optimal, 5,000 plays'
    """
    return f"optimal, {plays:,} plays"


def _side_by_side(cases: Sequence[Case]) -> Iterator[str]:
    """Yield the systems as columns, the settings as rows, for each number of plays."""
    systems = distinct(case.system for case in cases)
    settings = distinct(case.setting for case in cases)
    letters = dict(zip(systems, ascii_uppercase, strict=False))
    if len(letters) < 2 or len(letters) < len(systems):
        return
    by_place = {(case.setting, case.system): case.values for case in cases}
    widest = max(len(", ".join(setting)) for setting in settings)
    legend = "; ".join(f"{letter} {system}" for system, letter in letters.items())
    yield from ("", *wrap(legend, WIDTH))
    for plays in distinct(plays for case in cases for plays in case.values):
        yield f"\nProbability of the optimal joint action after {plays:,} plays"
        yield " " * widest + "".join(f"{letter:>5}" for letter in letters.values())
        for setting in settings:
            line = f"{', '.join(setting):{widest}}"
            for system in systems:
                estimate = by_place.get((setting, system), {}).get(plays)
                line += f"{format_number(float(estimate.value)) if estimate else '-':>5}"
            yield line


def draw(analysis: Analysis) -> Figures:
    """Return the figure: probabilities of the optimum with their 95% intervals.

    A panel for each game (the first thing that settings differ in), the systems one below the
    other, a color and a marker for the rest of the setting; what is filled has been measured after
    all plays.
    """
    from nested_agents import figures as f

    cases = analysis.cases
    systems = distinct(case.system for case in cases)
    games = distinct(case.setting[:1] for case in cases)
    rests = distinct(case.setting[1:] for case in cases)
    plays = sorted({count for case in cases for count in case.values})
    looks = {}
    for (i, rest), count in product(enumerate(rests), plays):
        color = f.look(i)["color"]
        face = color if count == plays[-1] else "white"
        looks[rest, count] = {"color": color, "marker": f.marker(i), "markerfacecolor": face}
    places = dict(zip(looks, f.beside(len(looks)), strict=True))
    each = 2.3, 0.5 + 0.24 * len(systems)
    figure, panels = f.grid(len(games), COLUMNS, each, (1.8, 0.9), sharex=True, sharey=True)
    for axes, game in zip(panels.flat, games, strict=False):
        axes.set_title(", ".join(game), loc="left")
        for case in (case for case in cases if case.setting[:1] == game):
            for count, estimate in case.values.items():
                key = case.setting[1:], count
                row = systems.index(case.system) + places[key]
                f.draw_row(axes, row, estimate, **looks[key], markersize=3.5)
        f.as_rates(axes, "x")
        axes.grid(axis="x", alpha=0.25)
        for line in range(len(systems) - 1):
            axes.axhline(line + 0.5, color="#e4e4e4", linewidth=0.6, zorder=0)
    f.name_rows(panels[0, 0], systems)
    for axes in panels[-1]:
        axes.set_xlabel("P(optimal joint action)")
    handles = [
        f.handle(", ".join((*rest, f"{count:,} plays")), **look)
        for (rest, count), look in looks.items()
    ]
    f.add_legend(figure, handles, "bars: 95% intervals", max_columns=2)
    return {"games": figure}


class GamesStudy(Study):
    """Estimates how often learners find the optimum of a game."""

    PUBLISHED = PUBLISHED
    TIMED = TIMED
    check = staticmethod(check)
    measure = staticmethod(measure)
    analyse = staticmethod(analyse)
    draw = staticmethod(draw)
