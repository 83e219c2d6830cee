"""The explanation of a trained team: text of 80 columns, and figures."""

from collections.abc import Iterator, Sequence
from itertools import islice
from textwrap import wrap

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from ...core.numerics import pd
from ..errors import WIDTH
from ..presentation import figures
from ..presentation.tables import text_of
from .functions import labels, mean_shares, percent, place
from .team import Explanation, WheelEffects

N_VARIABLES = 3
"""Number of variables in a summary."""
MAX_LINES = 8
"""Maximum number of roles in the figure of functions."""
MIN_CHANGE = 0.25
"""Minimum reported change of an actuator, as a share of its nominal drive."""
MIN_DRIVE = 0.1
"""Share of its drive up to which an actuator is said not to drive."""


def summarize(explained: Explanation) -> list[str]:
    """Return the most important facts about a trained team in about ten lines.

    The first agent stands for all agents of the team.
    """
    trial = explained.trial
    count = f"{len(explained.agents)} agents with {explained.rules.n_rules} rules each"
    lines = [f"{trial.condition}, seed {trial.seed}: {count}."]
    if not _has_learned(explained):
        return [*lines, "All rules have equal weights: the team has learned nothing."]
    first = explained.parts[0]
    lines.append(f"Most important state variables, with the values for {explained.agents[0]}:")
    for j, share in islice(mean_shares(explained.parts).items(), N_VARIABLES):
        rules = _names_of_rules(explained, j)
        best, worst = (rules[int(k(first.singles[j]))] for k in (np.argmax, np.argmin))
        lines.append(
            f"  {explained.variables[j].name} ({percent(share)}): best is {best}, worst {worst}"
        )
    roles = len(explained.roles)
    if roles == 1:
        lines.append("All agents share one value function.")
    elif roles < len(explained.agents):
        lines.append(f"The agents share {roles} value functions.")
    return [*lines, *_self_model_lines(explained)]


def text(explained: Explanation) -> str:
    """Return the whole explanation; agents with the same functions have one column."""
    trial = explained.trial
    lines = [f"{trial.condition}, seed {trial.seed}: the team after {trial.lengths}"]
    lines += ["", "FUNCTIONS", "", *_functions(explained)]
    if explained.effects:
        lines += ["", "SELF-MODEL", "", *_self_model_lines(explained)]
    return "\n".join(line.rstrip() for text in lines for line in text.splitlines() or [""]) + "\n"


def _has_learned(explained: Explanation) -> bool:
    return any(part.variance > 0 for part in explained.parts)


def _functions(explained: Explanation) -> Iterator[str]:
    """Yield the shares of variables and the rules in words, a column for each role."""
    if not _has_learned(explained):
        yield "All consequent weights are equal: the agents have learned nothing."
        return
    roles = explained.roles
    order = mean_shares(explained.parts)
    columns = [names.partition(" = ")[0] for names in roles]
    shares = [[percent(p.share(p.singles[j])) for p in roles.values()] for j in order]
    yield "Share of each state variable in the variance of the value function f:"
    yield f"\n{_table(shares, [explained.variables[j].name for j in order], columns)}"
    yield ""
    if max(map(len, explained.rules.terms)) > 1:
        rest = percent(float(np.mean([part.rest for part in explained.parts])))
        yield f"Interactions of variables have a share of {rest}."
    yield from wrap(
        "Rules: what each value of a variable adds to f, as the mean over the rules of all other "
        "variables. The unit is that of the return, the discounted sum of rewards.",
        WIDTH,
    )
    shared = [names for names in roles if " = " in names]
    if shared:
        text = f"Agents with shared weights have one column: {'; '.join(shared)}."
        yield from wrap(text, WIDTH)
    weights = np.hstack([np.vstack([p.singles[j] for p in roles.values()]) for j in order]).T
    digits = max(0, 2 - int(np.floor(np.log10(np.abs(weights).max()))))
    rules = [
        f"IF {explained.variables[j].name} is {rule}:"
        for j in order
        for rule in _names_of_rules(explained, j)
    ]
    yield f"\n{_table([[f'{w:+.{digits}f}' for w in row] for row in weights], rules, columns)}"


def _table(cells: Sequence[Sequence[str]], rows: Sequence[str], columns: Sequence[str]) -> str:
    return text_of(pd.DataFrame(cells, index=rows, columns=columns))


def _names_of_rules(explained: Explanation, j: int) -> list[str]:
    """Return the membership functions of a variable in words, each with its center."""
    variable = explained.variables[j]
    partition = explained.rules.partitions[j]
    words = zip(labels(variable, partition), partition.centers, strict=True)
    return [f"{word} ({place(variable, center)})" for word, center in words]


def _self_model_lines(explained: Explanation) -> list[str]:
    if not explained.effects:
        return []
    changed = list(changes(explained.effects, explained.actuators))
    return changed or ["The self-model finds that all actuators work."]


def changes(bodies: Sequence[WheelEffects], actuators: Sequence[str]) -> Iterator[str]:
    """Yield a line for every actuator that the self-model finds changed.

    The drive of an actuator is the projection of its effect on its nominal effect. A change within
    two standard deviations is called uncertain.
    """
    remaining = iter(actuators)
    for nominal, learned, deviations in bodies:
        # A turning rate counts as the speed of an actuator that mainly turns its body.
        unit = np.array([1.0, 1.0, 1.0 / max(1.0, float(np.abs(nominal[2]).max()))]) ** 2
        for k in range(nominal.shape[1] - 1):
            name = next(remaining)
            own = unit * nominal[:, k]
            length = float(own @ nominal[:, k])
            drive = float(own @ learned[:, k]) / length
            deviation = float(np.sqrt(own**2 @ deviations[:, k] ** 2)) / length
            if abs(drive - 1.0) > MIN_CHANGE:
                caveat = "" if abs(drive - 1.0) > 2.0 * deviation else "; uncertain"
                share = f"{drive:+.2f} ± {deviation:.2f} of its drive"
                yield f"{name}: {share}, {_name_drive(drive, deviation)}{caveat}"


def _name_drive(drive: float, deviation: float) -> str:
    if abs(drive) <= max(MIN_DRIVE, 2.0 * deviation):
        return "as if it did not drive"
    if drive < 0.0:
        return "as if it were reversed"
    return "as if it were weak" if drive < 1.0 else "stronger than its geometry"


def draw(explained: Explanation) -> dict[str, Figure]:
    """Return the figure of the value functions, if the team has learned any."""
    drawings: dict[str, Figure] = {}
    with figures.apply_style():
        if _has_learned(explained):
            drawings["functions"] = _draw_functions(explained)
    return drawings


def _draw_functions(explained: Explanation) -> Figure:
    """Draw the functions of the first roles, a panel for each variable."""
    figure, panels = figures.grid(len(explained.variables), 4, (2.45, 2.2), (0.0, 0.7), sharey=True)
    roles = dict(islice(explained.roles.items(), MAX_LINES))
    shares = mean_shares(explained.parts)
    for j, variable in enumerate(explained.variables):
        axes = panels.flat[j]
        partition = explained.rules.partitions[j]
        is_angle = variable.unit == "rad"
        if is_angle:
            axes.xaxis.set_major_locator(MultipleLocator(90))
        ends = (variable.low, variable.high) if variable.periodic else partition.centers
        x = np.union1d(np.linspace(min(ends), max(ends), 401), partition.centers)
        strengths = partition.strengths(x)
        for i, part in enumerate(roles.values()):
            axes.plot(
                np.degrees(x) if is_angle else x,
                strengths @ part.singles[j],
                **figures.look(i),
                marker=figures.marker(i),
                markersize=3,
                markevery=np.searchsorted(x, partition.centers).tolist(),
            )
        unit = {"rad": " [°]", "1": ""}.get(variable.unit, f" [{variable.unit}]")
        axes.set_title(f"{variable.name}{unit}, {percent(shares[j])}", loc="left")
        axes.axhline(0.0, color="#cccccc", lw=0.8, zorder=0)
    figure.supylabel("adds to f", fontsize=9)
    title = "markers: rules; in the titles the share of the variance of f"
    labels = [names if len(names) < 40 else f"{names[:38]} …" for names in roles]
    figures.name_curves(figure, labels, title)
    return figure
