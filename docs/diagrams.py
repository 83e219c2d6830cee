"""Draws the diagrams of the guide, in the one style of all figures of the toolkit.

``conf.py`` calls `draw` before the pages are read. Each diagram is a function that returns a
figure. ``python -m docs.diagrams`` draws those of the README, which are committed.
"""

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyBboxPatch, Polygon

from nested_agents.core.agents.cost import Problem
from nested_agents.core.values.partitions import Partition
from nested_agents.studies.presentation import figures
from nested_agents.studies.presentation.figures import COLOURS, SETTINGS, write
from nested_agents.studies.results import published
from nested_agents.studies.results.notation import format_number
from nested_agents.studies.results.statistics import Estimate, rate
from research import RESULTS

BLUE, ORANGE, GREEN = COLOURS[:3]
GREY = "#777777"
PASSED = ("$a_1$", "$a_1, a_2$", "$a_1, a_2, a_3$")
ACTIONS = ("increase", "decrease", "maintain", "zero")


def draw(folder: Path) -> None:
    """Write all diagrams as SVG into a folder."""
    folder.mkdir(exist_ok=True)
    for make in (nested_decision, perception, learner, predictions, program, scale):
        with mpl.rc_context(SETTINGS):
            figure = make()
        write(figure, folder / f"{make.__name__}.svg")


def canvas(width: float, height: float) -> tuple[Figure, Axes]:
    """Return a figure [inches] and its only axes, in the same units, without a frame."""
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, width), ylim=(0, height), aspect="equal")
    axes.axis("off")
    return figure, axes


def box(axes: Axes, x: float, y: float, text: str, colour: str = GREY, width: float = 1.3) -> None:
    """Draw a box with text around a point."""
    height = 0.3 + 0.16 * text.count("\n")
    patch = FancyBboxPatch(
        (x - width / 2, y - height / 2), width, height,
        boxstyle="round,pad=0.03", edgecolor=colour, facecolor="white", linewidth=1.3,
    )  # fmt: skip
    axes.add_patch(patch)
    axes.text(x, y, text, ha="center", va="center", linespacing=1.3)


def arrow(
    axes: Axes, start: Sequence[float], end: Sequence[float], text: str = "", colour: str = GREY
) -> None:
    """Draw an arrow with a word beside its middle."""
    axes.annotate(
        "", xy=end, xytext=start, arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.3}
    )
    x, y = np.add(start, end) / 2
    axes.text(x, y + 0.2, text, ha="center", va="bottom", color=colour)


def idea() -> Figure:
    """Draw a hierarchy of four wheels: messages are solid arrows, lookahead dashed arcs."""
    figure, axes = canvas(5.0, 3.2)
    places = {1: (1.6, 2.65), 2: (0.8, 1.55), 3: (2.4, 1.55), 4: (2.4, 0.5)}
    for above, below in ((1, 2), (1, 3), (3, 4)):
        start, end = np.array(places[above]), np.array(places[below])
        along = (end - start) / np.linalg.norm(end - start)
        start, end = start + 0.27 * along, end - 0.27 * along
        arrow(axes, start, end, colour="black")
        bend = 0.45 if (above, below) == (1, 2) else -0.45
        style = {"arrowstyle": "-|>", "color": GREEN, "lw": 1.4, "ls": (0, (4, 2))}
        style |= {"connectionstyle": f"arc3,rad={bend}", "shrinkA": 2, "shrinkB": 2}
        axes.annotate("", xy=end, xytext=start, arrowprops=style)
    for name, place in places.items():
        agent(axes, place, name)
    for robot, (left, right) in zip(((4.3, 1.55), (4.3, 0.5)), ((1, 2), (3, 4)), strict=True):
        axes.add_patch(Circle(robot, 0.26, facecolor="white", edgecolor="black", linewidth=1.5))
        axes.plot(*zip(robot, np.add(robot, (0.26, 0)), strict=True), color="black")
        for name, side in ((left, 0.24), (right, -0.24)):
            agent(axes, np.add(robot, (0, side)), name, 0.14)
    axes.text(4.3, 2.02, "two robots", ha="center", color=GREY)
    axes.plot([2.65, 3.05], [2.95, 2.95], color="black", lw=1.4)
    axes.text(3.15, 2.95, "communication:\ndecided actions", va="center", linespacing=1.1)
    axes.plot([2.65, 3.05], [2.45, 2.45], color=GREEN, lw=1.4, ls=(0, (4, 2)))
    axes.text(3.15, 2.45, "lookahead: actions\nsearched over", va="center", linespacing=1.1)
    return figure


def communication_lookahead() -> Figure:
    """Draw the success of the same teams with and without communication and lookahead."""
    results = published.load(RESULTS / "edges.json").results
    cases = {
        "both": "evaluation",
        "lookahead only": "evaluation:considered only",
        "communication only": "evaluation:told only",
        "neither": "evaluation:neither",
    }
    figure, panels = figures.panels(1, 3, (7.2, 2.5), sharey=True)
    for axes, robots in zip(panels[0], (2, 4, 8), strict=True):
        condition = f"value_of=own, robots={robots}"
        for row, phase in enumerate(cases.values()):
            value, low, high = map(float, rate(results.success(condition, phase)))
            colour = BLUE if row < 2 else ORANGE
            axes.barh(row, value, 0.62, color=colour, alpha=0.85)
            axes.plot([low, high], [row, row], color="black", lw=1.2)
            axes.text(high + 0.03, row, format_number(value), va="center")
        axes.set(xlim=(0, 1.2), xlabel="success", title=f"{robots} robots, {2 * robots} agents")
        axes.set_xticks((0.0, 0.5, 1.0))
        axes.set_yticks(range(len(cases)), list(cases))
        axes.grid(axis="x", alpha=0.25)
    panels[0, 0].invert_yaxis()
    figure.suptitle("Teams need lookahead; communication adds less", x=0.02, ha="left")
    return figure


def agent(axes: Axes, place: Sequence[float], name: int, radius: float = 0.22) -> None:
    """Draw an agent as a circle with its number in the order of decision; colours are robots."""
    colour = BLUE if name <= 2 else ORANGE
    axes.add_patch(Circle(tuple(place), radius, facecolor=colour, edgecolor="white", zorder=3))
    axes.text(*place, str(name), ha="center", va="center", color="white", weight="bold", zorder=4)


def nested_decision() -> Figure:
    """Draw four agents in a chain: who tells whom, and the state-action pairs of each."""
    figure, axes = canvas(7.2, 2.5)
    names = ("robot1.left", "robot1.right", "robot2.left", "robot2.right")
    places = np.linspace(0.85, 6.35, 4)
    tried = [Problem().actions ** (4 - i) for i in range(4)]
    for i, (x, name) in enumerate(zip(places, names, strict=True)):
        box(axes, x, 1.65, name, BLUE)
        axes.text(x, 1.15, f"tries {tried[i]} joint\nactions of {4 - i}", ha="center", va="center")
        if i:
            arrow(axes, (places[i - 1] + 0.7, 1.65), (x - 0.7, 1.65), PASSED[i - 1], ORANGE)
    axes.text(3.6, 2.28, "superior → subordinate: actions that have been decided are passed down",
              ha="center", color=ORANGE)  # fmt: skip
    rules = Problem().rules
    sums = (
        ("four nested agents", "5^7", sum(tried), rules * sum(tried), BLUE),
        ("one agent for all four wheels", "5^{28}", tried[0], rules**4 * tried[0], GREY),
    )
    axes.text(3.6, 0.68, "rules × joint actions (paper, Section VII)", ha="center")
    for y, (who, power, joint, pairs, colour) in zip((0.4, 0.12), sums, strict=True):
        digits, exponent = f"{pairs:.1e}".split("e+")
        text = f"${power}$ × {joint} = ${digits} \\times 10^{{{int(exponent)}}}$"
        axes.text(3.5, y, who, ha="right", color=colour)
        axes.text(3.7, y, text, color=colour)
    return figure


def perception() -> Figure:
    """Draw the state variables of the preset `default`, as one agent of a robot observes them."""
    figure, axes = canvas(7.2, 3.1)
    robot, centre, goal = np.array([1.4, 1.9]), np.array([3.3, 1.45]), np.array([6.4, 1.75])
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * 0.42
    turn = np.array([[np.cos(0.2), -np.sin(0.2)], [np.sin(0.2), np.cos(0.2)]])
    axes.add_patch(Polygon(square @ turn.T + centre, facecolor="#DDDDDD", edgecolor="black"))
    axes.add_patch(Polygon(square + goal, fill=False, linestyle="--", edgecolor=GREY))
    axes.text(goal[0], goal[1] - 0.62, "goal", ha="center", color=GREY)
    pusher = centre + np.array([-0.735, -0.1]) @ turn.T
    for place, colour in ((robot, BLUE), (pusher, GREY)):
        axes.add_patch(Circle(place, 0.3, facecolor="white", edgecolor=colour, linewidth=1.5))
        axes.plot(*zip(place, np.add(place, (0.28, 0.1)), strict=True), color=colour)
    wheel = np.add(robot, (-0.19, 0.24)), np.add(robot, (0.06, 0.31))
    axes.plot(*zip(*wheel, strict=True), color=ORANGE, linewidth=5)
    axes.text(1.4, 2.35, "speed of the\nagent's own wheel", color=ORANGE, ha="center")
    face = centre + np.array([-0.42, 0.2]) @ turn.T
    axes.plot(*zip(robot, face, strict=True), color=BLUE, linestyle=":")
    axes.text(0.1, 1.3, "gap to the nearest face,\nits bearing, and on which\nside it stands",
              color=BLUE, va="top")  # fmt: skip
    axes.text(2.6, 0.55, "other robots: share that\nis away from the box", color=GREY, ha="center",
              va="top")  # fmt: skip
    axes.annotate("", goal, centre, arrowprops={"arrowstyle": "<->", "color": GREEN})
    axes.text(4.9, 1.0, "distance of the box from the goal,\nand how fast it shrinks",
              color=GREEN, ha="center")  # fmt: skip
    push = centre + (centre - pusher) / np.linalg.norm(centre - pusher) * 2.7
    axes.plot(*zip(centre, push, strict=True), color=ORANGE, linestyle="--", linewidth=1)
    axes.text(4.4, 2.42, "push of the robots in contact: its bearing, and by\nhow much it misses "
              "the goal (cross-track error)", color=ORANGE, ha="center")  # fmt: skip
    axes.text(5.3, 0.25, "not observed: the outline of the box, failed\nwheels, actions that the "
              "agent has not been told", ha="center", color=GREY)  # fmt: skip
    return figure


def learner() -> Figure:
    """Draw the membership functions of a variable, and the function that weights make of them."""
    figure = Figure(figsize=(7.2, 2.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    x = np.linspace(-0.4, 0.4, 401)
    centres = (-0.3, -0.06, 0.0, 0.06, 0.3)
    strengths = Partition(centres, "triangular").strengths(x)
    styles = ("-", (0, (5, 2)), (0, (1, 1.2)), (0, (6, 1.5, 1, 1.5)), "-")
    for k, style in enumerate(styles):
        left.plot(x, strengths[:, k], color=COLOURS[k], linestyle=style)
    left.set(xlabel="cross-track error [m]", ylabel="firing strength",
             title="five rules: IF the error is far right, ... THEN")  # fmt: skip
    weights = np.array([-1.94, 0.44, 1.34, 0.44, -0.28])
    right.plot(x, strengths @ weights, color=BLUE)
    right.plot(centres, weights, "o", color=ORANGE)
    right.annotate("a consequent weight", (0.06, 0.44), (0.12, 1.0), color=ORANGE,
                   arrowprops={"arrowstyle": "-", "color": ORANGE})  # fmt: skip
    right.set(xlabel="cross-track error [m]", ylabel="part of the value f",
              title="value: strengths times consequent weights")  # fmt: skip
    return figure


def predictions() -> Figure:
    """Draw the way from a state and joint actions to predicted states, values and an action."""
    figure, axes = canvas(7.2, 2.3)
    box(axes, 0.75, 1.2, "state", BLUE, 0.9)
    heights = (1.95, 1.45, 0.95, 0.45)
    values = (1.31, 0.62, 1.04, 0.71)
    for name, y, value in zip(ACTIONS, heights, values, strict=True):
        arrow(axes, (1.25, 1.2), (1.95, y))
        box(axes, 2.5, y, name, GREY, 0.95)
        arrow(axes, (3.05, y), (3.6, y), colour=ORANGE)
        box(axes, 4.25, y, "next state", ORANGE, 1.1)
        arrow(axes, (4.85, y), (5.35, y), colour=GREEN)
        best = value == max(values)
        text = f"f = {value}" + ", taken" * best
        axes.text(5.45, y, text, va="center", color=GREEN, weight="bold" if best else "normal")
    axes.text(2.5, 2.2, "own action, with those below", ha="center", color=GREY)
    axes.text(4.25, 2.2, "predictor", ha="center", color=ORANGE)
    axes.text(5.9, 2.2, "rule base", ha="center", color=GREEN)
    axes.text(3.6, 0.1, "no reward enters: a learner knows of the reward only what it was paid",
              ha="center", color=GREY)  # fmt: skip
    return figure


SUCCESS = (
    ("team's value (default), within 450 decisions", (
        ("scaling", "2", 2), ("scaling", "4", 4), ("scaling", "8", 8), ("scaling", "16", 16),
        ("crowds", "32", 32),
    )),
    ("the same, trained with eight robots", (("wide", "8, wide box", 64),)),
    ("own value (own-value), within 200 decisions", tuple(
        ("own-value", f"own value, robots={n}", n) for n in (2, 4, 8)
    )),
    ("planner, which has the reward function", tuple(
        ("controls", f"planner, robots={n}", n) for n in (2, 4, 8, 16)
    )),
    ("frozen; random is the same", tuple(
        ("controls", f"frozen, robots={n}", n) for n in (2, 4, 8, 16)
    )),
)  # fmt: skip
"""Lines of `scale`, each of published tables, their conditions and numbers of robots."""


def scale() -> Figure:
    """Draw evaluation success by number of robots, of published rows, with their intervals."""
    figure = Figure(figsize=(7.2, 3.6), layout="constrained")
    axes = figure.subplots()
    for i, (_, points) in enumerate(SUCCESS):
        estimates = [published_rate(table, condition) for table, condition, _ in points]
        figures.draw_line(axes, [n for *_, n in points], estimates, i, len(SUCCESS))
    figures.scale_axis(axes, (2, 4, 8, 16, 32, 64))
    axes.set(xlabel="robots", ylabel="evaluation success", ylim=(-0.03, 1.03))
    figures.name_lines(figure, [label for label, _ in SUCCESS], "bars: 95% intervals")
    return figure


def published_rate(table: str, condition: str) -> Estimate:
    """Return the success in evaluation of a published table, of `wide` that with 64 robots."""
    phase = "evaluation:sixty-four" if table == "wide" else "evaluation"
    results = published.load(RESULTS / f"{table}.json").results
    return rate(results.success(condition, phase))


def program() -> Figure:
    """Draw a sheet with lines of code: in the gallery it stands for programs without a picture."""
    figure, axes = canvas(4.0, 2.8)
    box(axes, 2.0, 1.4, "\n" * 12, width=2.6)
    lines = ((0, 1.2, BLUE), (0, 1.7, GREY), (1, 1.3, GREY), (1, 0.9, ORANGE), (2, 1.1, GREY))
    for row, (indent, length, colour) in enumerate((*lines, (1, 0.7, GREEN))):
        start, height = 0.95 + 0.25 * indent, 2.3 - 0.35 * row
        axes.plot([start, start + length], [height] * 2, color=colour, linewidth=4)
    return figure


if __name__ == "__main__":
    for make in (idea, communication_lookahead):
        with mpl.rc_context(SETTINGS | {"font.size": 11}):
            committed = make()
        write(committed, Path(__file__).with_name(f"{make.__name__}.png"))
