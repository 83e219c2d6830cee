"""The fit study: where edges matter, and which ones.

Overrides are edges of one game, by name: the game's own ones, these with fill-in, as many wrong
ones, all of a chain, those of a star, none. Sweeps vary the game. All edges of one game meet the
same worlds, seed by seed: in games whose payoffs follow from the seed, the same payoffs.

One measure was fixed beforehand: evaluation success. Of a game that is the share of evaluated plays
that are optimal: if one play is evaluated, that of seeds that reach the optimum. In each game all
edges are compared with none, as in the study `hierarchies`.
"""

from nested_agents import Analysis, Session, Spec, SpecError, Study, rate
from nested_agents.analysis import (
    EVALUATED,
    Figures,
    Results,
    SizedCase,
    Sizes,
    distinct,
    exactly,
    label,
)
from nested_agents.analysis import compare_hierarchies as analysis_of
from nested_agents.study import Trial, TrialResult, check_evaluated

PUBLISHED = ("success",)
"""Measures of an episode that published results keep."""
REFERENCE = "none"
"""The edges that all others are compared with."""
COLUMNS = 4
"""Panels of the figure that stand beside each other, at most."""


def check(spec: Spec) -> None:
    """Raise `SpecError` unless trained teams are evaluated, and one has no edges."""
    check_evaluated(spec)
    if REFERENCE not in (override.name for override in spec.overrides):
        raise SpecError(f'overrides: fit compares with name = "{REFERENCE}", there is none')


def measure(trial: Trial) -> TrialResult:
    """Train and evaluate; imported by name in workers."""
    session = Session(trial)
    session.train(trial.episodes)
    session.evaluate()
    hierarchy = trial.settings.arrange(session.world)[1]
    bodies = float(len(session.world.groups))
    return session.result({"robots": bodies, "messages": float(hierarchy.n_messages)})


def analyse(results: Results) -> Analysis:
    """Estimate and compare; 95% intervals, seeds as the unit of sampling."""
    sizes = Sizes.of(results, results.of_phase("evaluation"))
    cases = []
    if not sizes.keys:  # games of several sizes differ in other columns
        sizes = Sizes(dict.fromkeys(sizes.counts, 1))
    for condition, agents in sizes.counts.items():
        columns = results.columns.get(condition, {"name": condition})
        game = {k: v for k, v in columns.items() if k not in ("name", *sizes.keys) and v != ""}
        messages = results.numbers(condition)["messages"][0]
        success = rate(results.success(condition, "evaluation"))
        values = {EVALUATED: success, "messages": exactly(messages)}
        edges = str(columns.get("name", ""))
        setting = label(game) if game else ""
        cases.append(SizedCase(condition, edges, setting, agents, sizes, values))
    return analysis_of(results, cases, REFERENCE)


def draw(analysis: Analysis) -> Figures:
    """Return the figure: success by edges, a panel for each game."""
    from nested_agents import figures as f

    cases = analysis.cases
    games = distinct(case.setting for case in cases)
    edges = distinct(case.name for case in cases)
    each = 1.7, 0.6 + 0.22 * len(edges)
    figure, panels = f.grid(len(games), COLUMNS, each, (1.2, 0.6), sharex=True, sharey=True)
    for axes, game in zip(panels.flat, games, strict=False):
        axes.set_title(game, loc="left")
        for case in (case for case in cases if case.setting == game):
            row = edges.index(case.name)
            color = f.look(row)["color"]
            f.draw_row(axes, row, case.values[EVALUATED], color=color, marker=f.marker(row))
        f.as_rates(axes, "x")
        axes.grid(axis="x", alpha=0.25)
    f.name_rows(panels[0, 0], edges)
    figure.supxlabel(f"{EVALUATED}, bars: 95% intervals", fontsize=9)
    return {"fit": figure}


class FitStudy(Study):
    """Compares edges of a game."""

    PUBLISHED = PUBLISHED
    check = staticmethod(check)
    measure = staticmethod(measure)
    analyse = staticmethod(analyse)
    draw = staticmethod(draw)
