"""The figures of the atlas, one for each question."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import groupby

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from nested_agents import bootstrap, figures
from nested_agents.analysis import Estimate, stack_estimates

from .atlas_predictions import SMALL, Check, checks, exponents
from .atlas_rows import ALREADY, MEASURES, NO_FAULT, TeamKind, quality

PANEL = (5.0, 2.4)
"""Width and height of a panel [inch]."""
MARGIN = (0.4, 0.4)
MOST = 100.0
"""The greatest ratio of what was predicted to what was measured that is drawn."""


def draw_success(rows: pd.DataFrame) -> Figure:
    """Return who wins where: by task, what it is ranked by against size; a line for each team.

    What fails at several sizes has a panel of its own.
    """
    sizes_of = rows.groupby(["task", "fault"])["size"].transform("nunique")
    is_own = (rows["fault"] != NO_FAULT) & (sizes_of > 1)
    titles = rows["task"].mask(is_own, rows["task"] + ", " + rows["fault"])
    tasks = list(dict.fromkeys(titles))
    figure, panels = figures.grid(len(tasks), 2, PANEL, MARGIN, sharey=True)
    for axes, task in zip(panels.flat, tasks, strict=False):
        own = rows[titles == task]
        measure = quality(str(own["task"].iloc[0]))
        teams = list(own.groupby(list(TeamKind._fields), sort=False))
        handles = []
        for index, (team, of_team) in enumerate(teams):
            by_size = of_team.groupby("size")[measure]
            sizes = [int(n) for n, _ in by_size]
            values = [bootstrap(v.to_numpy(dtype=float), bounds=(0.0, 1.0)) for _, v in by_size]
            figures.draw_line(axes, sizes, values, index, len(teams))
            handles.append(figures.handle(name_of(team), **figures.style(index)))
        figures.scale_axis(axes, sorted(int(n) for n in own["size"].unique()))
        figures.as_rates(axes)
        axes.set_title(f"{task}: {MEASURES[measure]}", loc="left")
        axes.legend(handles=handles, fontsize=6, loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.supxlabel("number of agents; evaluation with 95% intervals", fontsize=8)
    return figure


def draw_exponents(rows: pd.DataFrame) -> Figure:
    """Return how time, memory and messages of a decision grow: exponents, 95% intervals."""
    names = ("decision_median", "team_bytes", "messages", "steps")
    by_measure = {name: exponents(rows, name) for name in names}
    teams = list(dict.fromkeys(team for own in by_measure.values() for team in own))
    height = 1.0 + 0.2 * len(teams)
    figure, panels = figures.panels(1, len(names), (10.5, height), sharey=True)
    for axes, (name, own) in zip(panels[0], by_measure.items(), strict=True):
        places = [teams.index(team) for team in own]
        known = stack_estimates(list(own.values()))
        axes.hlines(places, known.low, known.high, lw=1.2)
        axes.plot(known.value, places, "o", markersize=4)
        axes.axvline(1.0, color="#888888", lw=0.8, ls=":")
        axes.set_title(MEASURES[name], loc="left", fontsize=8)
        axes.set_xlabel("exponent of n")
    labels = [f"{team.task}: {name_of(team)}" for team in teams]
    panels[0, 0].set_yticks(range(len(teams)), labels)
    panels[0, 0].set_ylim(len(teams) - 0.3, -0.7)
    return figure


def draw_checks(checked: Sequence[Check]) -> Figure:
    """Return what laws of small teams predicted, over what larger ones measured."""
    by_measure = {k: list(own) for k, own in groupby(sorted(checked, key=_measure), key=_measure)}
    figure, panels = figures.grid(len(by_measure), 3, (3.0, 2.2), MARGIN)
    for axes, (name, own) in zip(panels.flat, by_measure.items(), strict=False):
        ratios = [Estimate(*(e / check.measured for e in check.predicted)) for check in own]
        known = stack_estimates(ratios)
        places = np.arange(len(own))
        colors = ["C0" if check.is_inside else "C3" for check in own]
        low, middle, high = np.clip((known.low, known.value, known.high), 1.0 / MOST, MOST)
        axes.vlines(places, low, high, color=colors, lw=1.2)
        axes.scatter(places, middle, c=colors, s=12)
        axes.update_datalim([(0.0, 0.5), (0.0, 2.0)])
        axes.axhline(1.0, color="#888888", lw=0.8, ls=":")
        figures.log_axis(axes)
        every = 1 + len(own) // 25  # labels that do not lie over each other
        shown = [str(check.size) for check in own[::every]]
        axes.set_xticks(places[::every], shown, fontsize=6, rotation=90)
        axes.set_title(MEASURES[name], loc="left")
    figure.supylabel("predicted / measured", fontsize=8)
    text = f"number of agents; red: outside the 90% interval; beyond {MOST:g} times: at the edge"
    figure.supxlabel(text, fontsize=8)
    return figure


def _measure(check: Check) -> str:
    return check.measure


def name_of(team: Sequence[str]) -> str:
    """Return what a team is called beside others of its task."""
    _, hierarchy, learner, fault = team
    return ", ".join([hierarchy, learner, *([fault] if fault != NO_FAULT else [])])


FIGURES: Mapping[str, Callable[[pd.DataFrame], Figure]] = {
    "atlas-success": draw_success,
    "atlas-exponents": draw_exponents,
    "atlas-predictions": lambda rows: draw_checks(
        [*checks(rows), *checks(rows[rows["source"] == ALREADY], SMALL // 2)]
    ),
}
"""By name of the file."""
