"""How much agents must disagree before a message is worth sending.

``python -m nested_agents.results.disagreement [FIGURE]`` prints the table of docs/edges.md
from the committed rows, and draws it. Teams were trained once and judged under errors of each
agent's own, told what those above them decided, or silent. The threshold was named before the runs:
where the line through the differences of success, told less silent, crosses zero; its interval is
that of resampled seeds.
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from ..studies.cli.display import print_text
from ..studies.presentation import figures
from ..studies.results import published
from ..studies.results.analysis import Difference, differences, format_p
from ..studies.results.notation import bracketed, two_figures
from ..studies.results.results import Results
from ..studies.results.statistics import Array, Estimate, bootstrap, rate
from ..studies.store.database import EVALUATION
from . import ROWS

ERRORS = (0.0, 0.2, 0.3, 0.4, 0.5)
"""Standard deviations of the agents' own errors in weights."""
NAMES = ("s = 0", "s = .2", "s = .3", "s = .4", "s = .5")
RESAMPLES = 4000
SIDES = ("told", "silent")


class Disagreement(NamedTuple):
    """What a message is worth to a team, by the size of errors."""

    robots: int
    seeds: int
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
    """The error beyond which telling succeeds more often; not a number where the line is flat."""


def disagreement(results: Results, robots: int) -> Disagreement:
    """Return what the rows of one study of disagreement say."""
    (condition,) = results.conditions
    success: dict[str, list[Estimate]] = {side: [] for side in SIDES}
    decisions: dict[str, list[Estimate]] = {side: [] for side in SIDES}
    agreement: dict[str, list[float]] = {side: [] for side in SIDES}
    means: dict[str, list[Array]] = {side: [] for side in SIDES}
    for side in SIDES:
        for name in NAMES:
            phase = f"{EVALUATION}{side}, {name}"
            success[side].append(rate(results.values(condition, "success", phase)))
            steps = results.means(condition, phase, "steps").to_numpy()
            decisions[side].append(bootstrap(steps))
            agreement[side].append(float(results.values(condition, "agreement", phase).mean()))
            means[side].append(results.means(condition, phase).to_numpy())
    pairs = [
        (name, "success", *(results.means(condition, f"{EVALUATION}{s}, {name}") for s in SIDES))
        for name in NAMES
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
        for name in NAMES
    ]
    less = np.array(means["told"]) - np.array(means["silent"])
    return Disagreement(
        robots,
        less.shape[1],
        success,
        decisions,
        agreement,
        differences({"": pairs})[""],
        differences({"": logs}, of_rates=False)[""],
        _threshold(less),
    )


def _threshold(less: Array) -> Estimate:
    """Return where the line through differences ``(errors, n_seeds)`` crosses zero."""
    rng = np.random.default_rng(0)
    drawn = rng.integers(less.shape[1], size=(RESAMPLES, less.shape[1]))
    slopes, begins = np.polyfit(ERRORS, less[:, drawn].mean(axis=2), 1)
    slope, begin = np.polyfit(ERRORS, less.mean(axis=1), 1)
    roots = np.where(slopes > 0.0, -begins / np.where(slopes > 0.0, slopes, 1.0), np.inf)
    low, high = np.quantile(np.clip(roots, 0.0, None), [0.025, 0.975])
    return Estimate(*map(np.asarray, (-begin / slope if slope > 0.0 else np.nan, low, high)))


def rows() -> list[Disagreement]:
    """Return what is known of every size that has been run."""
    known = sorted(ROWS.glob("disagreement-*.json"), key=lambda path: int(path.stem[13:]))
    return [disagreement(published.load(path).results, int(path.stem[13:])) for path in known]


def lines(every: list[Disagreement]) -> list[str]:
    """Return the table of the page, and the thresholds."""
    table = [
        "| robots | error s | told | silent | difference | agreement, told and silent "
        "| decisions, told and silent | silent over told |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for own in every:
        for k, name in enumerate(NAMES):
            told, silent = (bracketed(own.success[side][k]) for side in SIDES)
            d = own.compared[k]
            difference = f"{bracketed(d.estimate)}, p {format_p(d.p)}"
            right = " and ".join(f"{own.agreement[side][k]:.2f}"[1:] for side in SIDES)
            spent = " and ".join(two_figures(float(own.decisions[side][k].value)) for side in SIDES)
            longer = Estimate(*map(np.exp, own.longer[k].estimate))
            times = f"{bracketed(longer)}, p {format_p(own.longer[k].p)}"
            shown = name.removeprefix("s = ")
            table.append(
                f"| {own.robots} | {shown} | {told} | {silent} | {difference} | {right} | {spent} "
                f"| {times} |"
            )
    thresholds = [
        f"threshold, {own.robots} robots, {own.seeds} seeds: {bracketed(own.threshold)}"
        for own in every
    ]
    return [*table, "", *thresholds]


def draw(every: list[Disagreement]) -> Figure:
    """Return success by error, told and silent, a panel for each size."""
    figure, panels = figures.panels(1, len(every), (3.4 * len(every) + 0.4, 2.9), sharey=True)
    for axes, own in zip(panels[0], every, strict=True):
        for index, side in enumerate(SIDES):
            values = own.success[side]
            middle = [float(e.value) for e in values]
            errors = [
                [float(e.value - e.low) for e in values],
                [float(e.high - e.value) for e in values],
            ]
            style = figures.style(index)
            axes.errorbar(ERRORS, middle, yerr=errors, capsize=2, **style)
        axes.axvline(float(own.threshold.value), color="#888888", lw=0.8, ls=":")
        axes.set_title(f"{own.robots} robots", loc="left")
        axes.set_xlabel("error of each agent's weights [SD]")
        figures.as_rates(axes)
    figures.name_lines(figure, list(SIDES), "success; bars: 95 %; dotted: the threshold")
    return figure


if __name__ == "__main__":
    known = rows()
    print_text(*lines(known))
    if len(sys.argv) > 1:
        figures.write(draw(known), Path(sys.argv[1]))
