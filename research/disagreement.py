"""How much agents must disagree before a message is worth sending.

``python -m research.disagreement [FIGURE]`` prints the table of research/notebooks/edges.md
from the committed rows, and draws it. Teams were trained once and judged under errors of each
agent's own, told what those above them decided, or silent. The threshold was named before the runs:
where the line through the differences of success, told less silent, crosses zero; its interval is
that of resampled seeds.
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

import nested_agents as na
from nested_agents import bootstrap, figures, rate
from nested_agents.analysis import (
    NOT_NEGATIVE,
    RETURN,
    Array,
    Difference,
    Estimate,
    Results,
    differences,
    format_estimate,
    format_number,
    format_p,
)
from nested_agents.terminal import print_text

from . import RESULTS

EVALUATION = "evaluation:"
"""Prefix of the phase of an evaluation by another name."""
SHOWN = "s = "
"""Before the size of errors in the name of an evaluation."""
RESAMPLES = 4000
TITLE = "Success falls as values disagree, with messages and without"
"""Title of the figure."""
SIDES = ("told", "silent")


class Disagreement(NamedTuple):
    """What a message is worth to a team, by the size of errors."""

    robots: int
    seeds: int
    errors: dict[str, float]
    """By name, standard deviations of the agents' own errors in weights, the least first."""
    success: dict[str, list[Estimate]]
    """Of those told and of the silent, by error."""
    decisions: dict[str, list[Estimate]]
    """Decisions of an episode."""
    agreement: dict[str, list[float]]
    """In how many of the others an agent was right."""
    compared: tuple[Difference, ...]
    """Success of those told less that of the silent, p adjusted over errors."""
    longer: tuple[Difference, ...]
    """Logarithms of the decisions of the silent less those of the told, likewise."""
    threshold: Estimate
    """The error beyond which telling succeeds more often, at most the greatest that was tried."""


def disagreement(results: Results, robots: int) -> Disagreement:
    """Return what the rows of one study of disagreement say."""
    (condition,) = results.conditions
    begin = f"{EVALUATION}{SIDES[0]}, {SHOWN}"
    shown = [phase.removeprefix(begin) for phase in results.phases if phase.startswith(begin)]
    errors = {f"{SHOWN}{size}": float(size) for size in sorted(shown, key=float)}
    success: dict[str, list[Estimate]] = {side: [] for side in SIDES}
    decisions: dict[str, list[Estimate]] = {side: [] for side in SIDES}
    agreement: dict[str, list[float]] = {side: [] for side in SIDES}
    means: dict[str, list[Array]] = {side: [] for side in SIDES}
    for side in SIDES:
        for name in errors:
            phase = f"{EVALUATION}{side}, {name}"
            success[side].append(rate(results.values(condition, "success", phase)))
            steps = results.means(condition, phase, "steps").to_numpy()
            decisions[side].append(bootstrap(steps, bounds=NOT_NEGATIVE))
            agreement[side].append(float(results.values(condition, "agreement", phase).mean()))
            means[side].append(results.means(condition, phase).to_numpy())
    pairs = [
        (name, "success", *(results.means(condition, f"{EVALUATION}{s}, {name}") for s in SIDES))
        for name in errors
    ]
    logs = [
        (
            name,
            "decisions",
            *(
                np.log(results.means(condition, f"{EVALUATION}{s}, {name}", "steps"))
                for s in reversed(SIDES)
            ),
        )
        for name in errors
    ]
    less = np.array(means["told"]) - np.array(means["silent"])
    return Disagreement(
        robots,
        less.shape[1],
        errors,
        success,
        decisions,
        agreement,
        differences({"": pairs})[""],
        differences({"": logs}, RETURN)[""],
        _threshold(less, list(errors.values())),
    )


def _threshold(less: Array, errors: Sequence[float]) -> Estimate:
    """Return where the line through differences ``(n_errors, n_seeds)`` crosses zero, upwards.

    Lines that do not, among the errors tried, cross at the greatest of them.
    """
    rng = np.random.default_rng(0)
    every = np.arange(less.shape[1])
    drawn = np.vstack([every, rng.integers(len(every), size=(RESAMPLES, len(every)))])
    slopes, begins = np.polyfit(errors, less[:, drawn].mean(axis=2), 1)
    rises = slopes > 0.0
    crossed = np.where(rises, -begins / np.where(rises, slopes, 1.0), np.inf)
    own, *others = np.clip(crossed, 0.0, max(errors))
    return Estimate(own, *np.quantile(others, [0.025, 0.975]))


def _brief(threshold: Estimate, greatest: float) -> str:
    """Return a threshold and its interval, ends that were not reached as more than the greatest."""
    value, low, high = (
        f"> {format_number(greatest)}" if end >= greatest else format_number(end)
        for end in map(float, threshold)
    )
    return f"{value} [{low}, {high}]"


def rows() -> list[Disagreement]:
    """Return what is known of every size that has been run."""
    known = sorted(RESULTS.glob("disagreement-*.json"), key=lambda path: int(path.stem[13:]))
    return [disagreement(na.load(path).results, int(path.stem[13:])) for path in known]


def lines(every: list[Disagreement]) -> list[str]:
    """Return the table of the page, and the thresholds."""
    table = [
        "| robots | error s | told | silent | difference | agreement, told and silent "
        "| decisions, told and silent | silent over told |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for own in every:
        for k, name in enumerate(own.errors):
            told, silent = (format_estimate(own.success[side][k]) for side in SIDES)
            d = own.compared[k]
            difference = f"{format_estimate(d.estimate)}, p {format_p(d.p)}"
            right = " and ".join(format_number(own.agreement[side][k]) for side in SIDES)
            spent = " and ".join(
                format_number(float(own.decisions[side][k].value)) for side in SIDES
            )
            longer = Estimate(*map(np.exp, own.longer[k].estimate))
            times = f"{format_estimate(longer)}, p {format_p(own.longer[k].p)}"
            shown = format_number(own.errors[name])
            table.append(
                f"| {own.robots} | {shown} | {told} | {silent} | {difference} | {right} | {spent} "
                f"| {times} |"
            )
    thresholds = [
        f"threshold, {own.robots} robots, {own.seeds} seeds: "
        f"{_brief(own.threshold, max(own.errors.values()))}"
        for own in every
    ]
    return [*table, "", *thresholds]


def draw(every: list[Disagreement]) -> Figure:
    """Return success by error, with and without messages, a panel for each size."""
    figure, panels = figures.panels(1, len(every), (2.2 * len(every) + 0.4, 3.0), sharey=True)
    for axes, own in zip(panels[0], every, strict=True):
        for index, side in enumerate(SIDES):
            values = own.success[side]
            middle = [float(e.value) for e in values]
            errors = [
                [float(e.value - e.low) for e in values],
                [float(e.high - e.value) for e in values],
            ]
            style = figures.style(index)
            axes.errorbar(list(own.errors.values()), middle, yerr=errors, capsize=2, **style)
        axes.set_title(f"{own.robots} robots", loc="left")
        axes.set_xlabel("error of the weights [SD]")
        figures.as_rates(axes)
    figures.name_lines(figure, ["with messages", "without messages"], TITLE)
    return figure


if __name__ == "__main__":
    known = rows()
    print_text(*lines(known))
    if len(sys.argv) > 1:
        figures.write(draw(known), Path(sys.argv[1]))
