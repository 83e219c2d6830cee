"""The explanation of a trained team: text of 80 columns, and figures."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from textwrap import fill

import jinja2
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from ...core.agents.joint import body_of
from ...core.numerics import pd
from ..errors import WIDTH
from ..presentation import figures
from ..presentation.figures import add_legend, look, marker
from .team import (
    BodyEffects,
    Explanation,
    Parts,
    exponent,
    labels,
    mean_shares,
    percent,
    place,
    rules_table,
)

TEMPLATE = Path(__file__).with_name("text.txt.jinja")
N_VARIABLES = 3
"""Number of variables in a summary."""


def summarize(explained: Explanation) -> list[str]:
    """Return the most important facts about a trained team in about ten lines.

    The first agent stands for all agents of the team.
    """
    trial = explained.trial
    count = f"{len(explained.agents)} agents with {explained.rules.n_rules} rules each"
    lines = [f"{trial.condition}, seed {trial.seed}: {count}."]
    if not any(part.variance > 0 for part in explained.parts):
        return [*lines, "All rules have equal weights: the team has learned nothing."]
    first = explained.parts[0]
    lines.append(f"Most important state variables, with the values for {explained.agents[0]}:")
    for j, share in list(mean_shares(explained.parts).items())[:N_VARIABLES]:
        variable = explained.variables[j]
        partition = explained.rules.partitions[j]
        names = labels(variable, partition)
        best, worst = (
            f"{names[k]} ({place(variable, partition.centres[k])})"
            for k in (int(first.singles[j].argmax()), int(first.singles[j].argmin()))
        )
        lines.append(f"  {variable.name} ({percent(share)}): best is {best}, worst {worst}")
    groups = share_rules(explained.agents, explained.parts)
    if len(groups) == 1:
        lines.append("All agents share one value function.")
    elif len(groups) < len(explained.agents):
        lines.append(f"The agents share {len(groups)} value functions.")
    if explained.bodies:
        failures = list(verdicts(explained.bodies, explained.actuators))
        lines += failures or ["The self-model finds that all actuators work."]
    return lines


def text(explained: Explanation) -> str:
    """Return the whole explanation; agents with the same functions are written once."""
    parts = explained.parts
    variables = explained.variables
    bodies = explained.bodies
    alike = share_rules(explained.agents, parts)
    first = [explained.agents.index(names[0]) for names in alike]
    shares = [f"{variables[j].name} {percent(share)}" for j, share in mean_shares(parts).items()]
    environment = jinja2.Environment(trim_blocks=True, undefined=jinja2.StrictUndefined)
    environment.filters["wrapped"] = _wrapped
    template = environment.from_string(TEMPLATE.read_text(encoding="utf-8"))
    rendered = template.render(
        e=explained,
        has_learned=any(p.variance > 0 for p in parts),
        shares=shares,
        is_additive=max(map(len, explained.rules.terms)) == 1,
        rest=percent(float(np.mean([p.rest for p in parts]))),
        power=exponent(parts),
        rules=rules_table(
            explained.rules,
            variables,
            [explained.agents[i] for i in first],
            [parts[i] for i in first],
        ),
        alike=[" = ".join(names) for names in alike if len(names) > 1],
        verdicts=list(verdicts(bodies, explained.actuators)) if bodies else (),
        effects=effects_table(bodies, explained.actuators) if bodies else "",
        errors="" if explained.errors is None else explained.errors.to_string(float_format="%.3g"),
    )
    # Tables of pandas fill the last column with spaces.
    return "\n".join(line.rstrip() for line in rendered.splitlines()).rstrip() + "\n"


def share_rules(agents: Sequence[str], parts: Sequence[Parts]) -> list[list[str]]:
    """Return groups of agents with equal functions, which share weights."""
    groups: dict[bytes, list[str]] = {}
    for name, part in zip(agents, parts, strict=True):
        groups.setdefault(np.concatenate(part.singles).tobytes(), []).append(name)
    return list(groups.values())


def _wrapped(sentence: str) -> str:
    # A number stays with its percent sign, and with the name before it.
    sentence = " ".join(sentence.split())
    sentence = re.sub(r"\b(\w{1,40}) (?=<?\d+ %)", "\\1\u00a0", sentence).replace(" %", "\u00a0%")
    return fill(sentence, 79).replace("\u00a0", " ") + "\n"


ROWS = ("ahead", "left", "turning")
"""The rows of an effect [m/s, m/s, rad/s], per unit of commanded speed."""
LEAST_CHANGE = 0.25
"""A smaller change of an actuator's drive is not spoken of."""


def effects_table(bodies: BodyEffects, actuators: Sequence[str]) -> str:
    """Return the effects of every body's actuators, row by row and moment by moment."""
    rows = {}
    for r, own in enumerate(by_body(bodies, actuators)):
        names = [*(name.rpartition(".")[2] for name in own), "constant"]
        for i, row in enumerate(ROWS):
            for moment, effects in bodies.moments.items():
                rows[body_of(own[0]), row, moment] = pd.Series(effects[r][i], names)
    frame = pd.DataFrame(rows).T
    moving = frame.groupby(level=[0, 1]).transform("any").any(axis=1)  # a joint can but turn
    text: str = frame[moving].to_string(line_width=WIDTH, float_format="{:+.2f}".format)
    return text


def verdicts(bodies: BodyEffects, actuators: Sequence[str]) -> Iterator[str]:
    """Yield a line for every actuator that the self-model finds changed.

    The drive of an actuator is the projection of its effect on the effect as built. A change within
    two standard deviations is called uncertain.
    """
    built = bodies.moments["built"]
    last = bodies.moments["after"]
    for r, names in enumerate(by_body(bodies, actuators)):
        # A turning rate counts as the speed of an actuator that is built to turn most.
        unit = np.array([1.0, 1.0, 1.0 / max(1.0, float(np.abs(built[r][2]).max()))]) ** 2
        for actuator, name in enumerate(names):
            own = unit * built[r][:, actuator]
            length = float(own @ built[r][:, actuator])
            left = float(own @ last[r][:, actuator]) / length
            around = float(np.sqrt(own**2 @ bodies.deviations[r][:, actuator] ** 2)) / length
            if abs(left - 1.0) > LEAST_CHANGE:
                caveat = "" if abs(left - 1.0) > 2.0 * around else "; uncertain"
                share = f"{left:+.2f} ± {around:.2f} of its drive"
                yield f"{name}: {share}, {_name_drive(left)}{caveat}"


def by_body(bodies: BodyEffects, actuators: Sequence[str]) -> Iterator[Sequence[str]]:
    """Yield the names of every body's actuators."""
    first = 0
    for effect in bodies.moments["built"]:
        yield actuators[first : first + effect.shape[1] - 1]
        first += effect.shape[1] - 1


def _name_drive(left: float) -> str:
    if left < -LEAST_CHANGE:
        return "as if it were reversed"
    if left <= LEAST_CHANGE:
        return "as if it did not drive"
    return "as if it were weak" if left < 1.0 else "more than it was built for"


MOST_LINES = 8
"""Agents in one figure of functions."""


def draw(explained: Explanation) -> dict[str, Figure]:
    """Return all figures that there is something for, by name."""
    drawings: dict[str, Figure] = {}
    with figures.apply_style():
        if any(p.variance > 0 for p in explained.parts):
            blocks = range(0, len(explained.agents), MOST_LINES)
            for number, first in enumerate(blocks, 1):
                name = "functions" if len(blocks) == 1 else f"functions-{number}"
                drawings[name] = _functions(explained, slice(first, first + MOST_LINES))
        if not isinstance(explained.policy, str):
            drawings["policy"] = explained.policy.figure()
    return drawings


def _functions(explained: Explanation, block: slice) -> Figure:
    """Draw the functions of some agents, a panel for each variable."""
    figure, panels = figures.grid(len(explained.variables), 4, (2.45, 2.2), (0.0, 0.7), sharey=True)
    panels = panels.ravel()
    power = exponent(explained.parts)
    names = explained.agents[block]
    parts = explained.parts[block]
    shares = mean_shares(parts)
    styles = _styles(names)
    for j, variable in enumerate(explained.variables):
        axes = panels[j]
        partition = explained.rules.partitions[j]
        is_angle = variable.unit == "rad"
        scale = 180 / np.pi if is_angle else 1.0
        if is_angle:
            axes.xaxis.set_major_locator(MultipleLocator(90))
        ends = (variable.low, variable.high) if variable.periodic else partition.centres
        x = np.union1d(np.linspace(min(ends), max(ends), 401), partition.centres)
        centres = np.searchsorted(x, partition.centres).tolist()
        strengths = partition.strengths(x)
        for name, part in zip(names, parts, strict=True):
            y = 10.0**power * strengths @ part.singles[j]
            axes.plot(scale * x, y, lw=1.4, markevery=centres, label=name, **styles[name])
        unit = {"rad": " [°]", "1": ""}.get(variable.unit, f" [{variable.unit}]")
        axes.set_title(f"{variable.name}{unit}, {percent(shares[j])}", loc="left")
        axes.axhline(0.0, color="#cccccc", lw=0.8, zorder=0)
    factor = rf" [$\times 10^{{{-power}}}$]" if power else ""
    figure.supylabel(f"adds to f{factor}", fontsize=9)
    title = "markers: rules, less their mean; in the titles the share of the variance of f"
    add_legend(figure, panels[0].get_lines()[: len(names)], title)
    return figure


def _styles(agents: Sequence[str]) -> dict[str, dict[str, object]]:
    """Return how the line of each agent looks: colour and marker by body, dashes within it."""
    bodies: dict[str, list[str]] = {}
    for name in agents:
        bodies.setdefault(name.partition(".")[0], []).append(name)
    styles: dict[str, dict[str, object]] = {}
    for number, members in enumerate(bodies.values()):
        for member, name in enumerate(members):
            dashes = look(member)["ls"]
            styles[name] = look(number) | {"ls": dashes, "marker": marker(number), "ms": 3}
    return styles
