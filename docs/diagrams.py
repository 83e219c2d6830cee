"""Draws the figures of README and docs with matplotlib, from the committed results.

``python -m docs.diagrams [NAME ...]`` writes them, or those that are named, as PNG into
``docs/figures``. Each figure is a function; its title is a sentence.
"""

import sys
from collections.abc import Iterable, Sequence
from math import log10
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyBboxPatch, Polygon

import nested_agents as na
from nested_agents.analysis import Estimate, Results, format_number
from nested_agents.figures import COLORS
from nested_agents.parts import Problem
from research import RESULTS, load
from research.experience import TASKS
from research.studies.games import analyse as analyse_games

FIGURES = Path(__file__).resolve().parent / "figures"
BLUE, ORANGE, GREEN = COLORS[:3]
GRAY = "#666666"
WIDTH = 5.4
"""Width of a figure [inches]: with letters of 10 points it can be read at 390 pixels."""
STYLE = {
    "font.size": 10,
    "axes.titlesize": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "figure.titlesize": 11.5,
    "savefig.dpi": 180,
}
LINES = (
    (BLUE, "-", "o"),
    (ORANGE, "--", "s"),
    (GREEN, "-.", "^"),
    ("#666666", ":", "D"),
    ("#CC79A7", (0, (6, 1.5)), "v"),
)
"""Color, line style and marker of the first, second, ... line: they differ in gray, too."""
EQUAL_COMPUTING = "At equal computing the lead of the chain grows"
ACTIONS = ("increase", "decrease", "maintain", "zero")


def titled(figure: Figure, title: str) -> Figure:
    """Put a sentence above a figure, at its left."""
    figure.suptitle(title, x=0.01, ha="left", weight="bold")
    return figure


def canvas(width: float, height: float) -> tuple[Figure, Axes]:
    """Return a figure [inches] and its only axes, in the same units, without a frame."""
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, width), ylim=(0, height), aspect="equal")
    axes.axis("off")
    return figure, axes


def box(axes: Axes, x: float, y: float, text: str, color: str = GRAY, width: float = 1.3) -> None:
    """Draw a box with text around a point."""
    height = 0.3 + 0.16 * text.count("\n")
    patch = FancyBboxPatch(
        (x - width / 2, y - height / 2), width, height,
        boxstyle="round,pad=0.03", edgecolor=color, facecolor="white", linewidth=1.3,
    )  # fmt: skip
    axes.add_patch(patch)
    axes.text(x, y, text, ha="center", va="center", linespacing=1.3)


def arrow(axes: Axes, start: Sequence[float], end: Sequence[float], color: str = GRAY) -> None:
    """Draw an arrow."""
    style = {"arrowstyle": "-|>", "color": color, "lw": 1.3}
    axes.annotate("", xy=end, xytext=start, arrowprops=style)


def draw_points(
    axes: Axes, x: Sequence[float], estimates: Iterable[Estimate | tuple[float, ...]], line: int,
    label: str, *, joined: bool = True,
) -> None:  # fmt: skip
    """Draw estimates with their intervals in the style `LINES[line]`, joined by a line."""
    color, style, marker = LINES[line]
    style = style if joined else "none"
    values, low, high = np.array([[float(part) for part in e] for e in estimates]).T
    axes.errorbar(
        x, values, (values - low, high - values),
        color=color, ls=style, marker=marker, ms=5, lw=1.6, elinewidth=1, label=label,
    )  # fmt: skip


def success_of(results: Results, condition: str, phase: str = "evaluation") -> tuple[float, ...]:
    """Return the success of a condition with its interval."""
    return tuple(float(part) for part in na.rate(results.success(condition, phase)))


def idea() -> Figure:
    """Draw a hierarchy of four wheels: messages are solid arrows, lookahead dashed arcs."""
    figure, axes = canvas(WIDTH, 3.4)
    places = {1: (1.6, 2.5), 2: (0.8, 1.45), 3: (2.4, 1.45), 4: (2.4, 0.45)}
    for above, below in ((1, 2), (1, 3), (3, 4)):
        start, end = np.array(places[above]), np.array(places[below])
        along = (end - start) / np.linalg.norm(end - start)
        start, end = start + 0.27 * along, end - 0.27 * along
        arrow(axes, start, end, "black")
        bend = 0.45 if (above, below) == (1, 2) else -0.45
        style = {"arrowstyle": "-|>", "color": GREEN, "lw": 1.4, "ls": (0, (4, 2))}
        style |= {"connectionstyle": f"arc3,rad={bend}", "shrinkA": 2, "shrinkB": 2}
        axes.annotate("", xy=end, xytext=start, arrowprops=style)
    for name, place in places.items():
        agent(axes, place, name)
    for robot, (left, right) in zip(((4.5, 1.4), (4.5, 0.4)), ((1, 2), (3, 4)), strict=True):
        axes.add_patch(Circle(robot, 0.26, facecolor="white", edgecolor="black", linewidth=1.5))
        axes.plot(*zip(robot, np.add(robot, (0.26, 0)), strict=True), color="black")
        for name, side in ((left, 0.24), (right, -0.24)):
            agent(axes, np.add(robot, (0, side)), name, 0.14)
    axes.text(3.95, 0.9, "two robots\nwith two\nwheels each", ha="right", va="center", color=GRAY)
    axes.plot([2.65, 3.05], [2.75, 2.75], color="black", lw=1.4)
    axes.text(3.15, 2.75, "communication: sends\nits decided action", va="center")
    axes.plot([2.65, 3.05], [2.2, 2.2], color=GREEN, lw=1.4, ls=(0, (4, 2)))
    axes.text(3.15, 2.2, "lookahead: searches\nover the other's actions", va="center")
    axes.text(0.05, 3.2, "Agents decide in the order of a hierarchy", weight="bold", size=11.5)
    return figure


def agent(axes: Axes, place: Sequence[float], name: int, radius: float = 0.22) -> None:
    """Draw an agent as a circle with its number in the order of decision; colors are robots."""
    color = BLUE if name <= 2 else ORANGE
    axes.add_patch(Circle(tuple(place), radius, facecolor=color, edgecolor="white", zorder=3))
    axes.text(*place, str(name), ha="center", va="center", color="white", weight="bold", zorder=4)


def communication_lookahead() -> Figure:
    """Draw the success of the same teams with and without communication and lookahead."""
    results = load("edges").results
    cases = {
        "both": "evaluation",
        "lookahead\nonly": "evaluation:considered only",
        "communication\nonly": "evaluation:told only",
        "neither": "evaluation:neither",
    }
    figure = Figure(figsize=(WIDTH + 0.3, 3.0), layout="constrained")
    for axes, robots in zip(figure.subplots(1, 3, sharey=True), (2, 4, 8), strict=True):
        for row, phase in enumerate(cases.values()):
            value, low, high = success_of(results, f"value_of=own, robots={robots}", phase)
            color, hatch = (BLUE, "") if row < 2 else (ORANGE, "//")
            axes.barh(row, value, 0.62, color=color, hatch=hatch, edgecolor="white")
            axes.plot([low, high], [row, row], color="black", lw=1.2)
            axes.text(high + 0.03, row, format_number(value), va="center")
        axes.set(xlim=(0, 1.45), xlabel="success", title=f"{robots} robots,\n{2 * robots} agents")
        axes.set_xticks((0.0, 0.5, 1.0))
        axes.set_yticks(range(len(cases)), list(cases))
    axes.invert_yaxis()
    title = (
        "If agents maximize their own value, teams need lookahead;\n"
        "communication alone is worse than neither"
    )
    return titled(figure, title)


def nested_decision() -> Figure:
    """Draw four agents in a chain: messages, and the joint actions that each agent tries."""
    figure, axes = canvas(WIDTH + 0.8, 2.9)
    names = ("robot 1,\nleft", "robot 1,\nright", "robot 2,\nleft", "robot 2,\nright")
    places = np.linspace(0.7, 5.5, 4)
    tried = [Problem().actions ** (4 - i) for i in range(4)]
    for i, (x, name) in enumerate(zip(places, names, strict=True)):
        box(axes, x, 1.85, name, BLUE, 0.8)
        axes.text(x, 1.2, f"tries {tried[i]}\njoint actions", ha="center", va="center")
        if i:
            arrow(axes, (places[i - 1] + 0.45, 1.85), (x - 0.45, 1.85), "black")
            sent = ", ".join(f"$a_{k + 1}$" for k in range(i))
            axes.text((places[i - 1] + x) / 2, 1.95, sent, ha="center", va="bottom")
    axes.text(0.05, 2.65, "Nesting saves rules, not joint actions", weight="bold", size=11.5)
    axes.text(0.05, 2.35, "Arrows are messages with the actions decided so far.", color=GRAY)
    rules = Problem().rules
    sums = (
        ("four nested agents", "5^7", sum(tried), rules * sum(tried), BLUE),
        ("one agent for all four wheels", "5^{28}", tried[0], rules**4 * tried[0], GRAY),
    )
    axes.text(3.1, 0.75, "rules × joint actions (paper, Section VII)", ha="center")
    for y, (who, power, joint, pairs, color) in zip((0.45, 0.15), sums, strict=True):
        digits, exponent = f"{pairs:.1e}".split("e+")
        text = f"${power}$ × {joint} = ${digits} \\times 10^{{{int(exponent)}}}$"
        axes.text(2.9, y, who, ha="right", va="center", color=color)
        axes.text(3.1, y, text, va="center", color=color)
    return figure


def perception() -> Figure:
    """Draw the state variables of the preset `default`, as one agent of a robot observes them."""
    figure, axes = canvas(WIDTH + 0.8, 3.6)
    robot, center, goal = np.array([1.0, 1.9]), np.array([2.6, 1.45]), np.array([5.4, 1.75])
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * 0.42
    turn = np.array([[np.cos(0.2), -np.sin(0.2)], [np.sin(0.2), np.cos(0.2)]])
    axes.add_patch(Polygon(square @ turn.T + center, facecolor="#DDDDDD", edgecolor="black"))
    axes.add_patch(Polygon(square + goal, fill=False, linestyle="--", edgecolor=GRAY))
    axes.text(*goal, "goal", ha="center", va="center", color=GRAY)
    pusher = center + np.array([-0.735, -0.1]) @ turn.T
    for place, color in ((robot, BLUE), (pusher, GRAY)):
        axes.add_patch(Circle(place, 0.3, facecolor="white", edgecolor=color, linewidth=1.5))
        axes.plot(*zip(place, np.add(place, (0.28, 0.1)), strict=True), color=color)
    wheel = np.add(robot, (-0.19, 0.24)), np.add(robot, (0.06, 0.31))
    axes.plot(*zip(*wheel, strict=True), color=ORANGE, linewidth=5)
    axes.text(0.1, 2.35, "speed of the\nagent's wheel", color=ORANGE)
    face = center + np.array([-0.42, 0.2]) @ turn.T
    axes.plot(*zip(robot, face, strict=True), color=BLUE, linestyle=":")
    axes.text(0.1, 1.2, "gap to the nearest\nface, its bearing,\nside of the box", color=BLUE,
              va="top")  # fmt: skip
    axes.text(2.0, 0.72, "share of other robots\nthat are not at the box", color=GRAY, va="top")
    axes.annotate("", goal - (0.42, 0), np.add(center, (0.3, 0)),
                  arrowprops={"arrowstyle": "<->", "color": GREEN})  # fmt: skip
    axes.text(4.1, 1.15, "distance from the goal,\nand how fast it shrinks", color=GREEN,
              ha="center", va="top")  # fmt: skip
    push = center + (center - pusher) / np.linalg.norm(center - pusher) * 2.4
    axes.plot(*zip(center, push, strict=True), color=ORANGE, linestyle="--", linewidth=1)
    axes.text(3.9, 2.4, "direction of the push, and by how\nmuch it misses the goal", color=ORANGE,
              ha="center")  # fmt: skip
    axes.text(3.9, 0.15, "not observed: outline of the box, failed wheels", ha="center", color=GRAY)
    axes.text(0.05, 3.35, "An agent observes its wheel, its robot and the push of the team",
              weight="bold", size=11.5)  # fmt: skip
    return figure


def learner() -> Figure:
    """Draw the membership functions of a variable, and the function that weights make of them."""
    figure = Figure(figsize=(WIDTH + 0.8, 2.9), layout="constrained")
    left, right = figure.subplots(1, 2)
    x = np.linspace(-0.4, 0.4, 401)
    centers = (-0.3, -0.06, 0.0, 0.06, 0.3)
    strengths = na.Partition(centers, "triangular").strengths(x)
    for k, (color, style, _) in enumerate(LINES):
        left.plot(x, strengths[:, k], color=color, linestyle=style)
    left.set(xlabel="cross-track error [m]", ylabel="firing strength", title="five rules")
    weights = np.array([-1.94, 0.44, 1.34, 0.44, -0.28])
    right.plot(x, strengths @ weights, color=BLUE)
    right.plot(centers, weights, "o", color=ORANGE)
    right.annotate("consequent\nweight", (0.06, 0.44), (0.13, 0.9), color=ORANGE,
                   arrowprops={"arrowstyle": "-", "color": ORANGE})  # fmt: skip
    right.set(xlabel="cross-track error [m]", ylabel="value", title="strengths times weights")
    return titled(figure, "Weights turn membership functions into a value function")


def predictions() -> Figure:
    """Draw the way from a state and joint actions to predicted states, values and an action."""
    figure, axes = canvas(WIDTH + 0.8, 2.9)
    box(axes, 0.5, 1.2, "state", BLUE, 0.7)
    values = (1.31, 0.62, 1.04, 0.71)
    for name, y, value in zip(ACTIONS, (1.95, 1.45, 0.95, 0.45), values, strict=True):
        arrow(axes, (0.9, 1.2), (1.4, y))
        box(axes, 1.95, y, name, GRAY, 0.9)
        arrow(axes, (2.45, y), (2.9, y), ORANGE)
        box(axes, 3.5, y, "next state", ORANGE, 1.0)
        arrow(axes, (4.05, y), (4.5, y), GREEN)
        best = value == max(values)
        text = f"{value}" + " (chosen)" * best
        axes.text(4.6, y, text, va="center", color=GREEN, weight="bold" if best else "normal")
    axes.text(1.95, 2.25, "joint action", ha="center", color=GRAY)
    axes.text(3.5, 2.25, "dynamics model", ha="center", color=ORANGE)
    axes.text(5.0, 2.25, "value function", ha="center", color=GREEN)
    axes.text(0.05, 2.6, "An agent chooses the action whose predicted state has most value",
              weight="bold", size=11.5)  # fmt: skip
    axes.text(3.1, 0.08, "The reward function is not used.", ha="center", color=GRAY)
    return figure


def learning_curves() -> Figure:
    """Draw success by episode of two teams and three controls, and the orientation of the box."""
    results = load("learning-curve").results
    figure = Figure(figsize=(WIDTH - 0.6, 4.9), layout="constrained")
    above, below = figure.subplots(2, 1, height_ratios=(1.4, 1), sharex=True)
    names = {
        "own-value": "learning team", "planner": "planner (knows reward)",
        "frozen": "untrained team", "paper": "constants of the paper",
        "pose": "learning, within 15°",
    }  # fmt: skip
    for line, (condition, label) in enumerate(names.items()):
        success = results.success(condition, "training")
        episodes = np.arange(0, success.shape[1], 2)
        pairs = [na.rate(success[:, e : e + 2]) for e in episodes]
        draw_points(above, episodes + 1.5 + 0.1 * line, pairs, line, label)
    errors = results.values("pose", "final_orientation_deg")
    means = [na.bootstrap(errors[:, e : e + 2].mean(axis=1)) for e in episodes]
    draw_points(below, episodes + 1.5, means, line, "")
    below.axhline(15.0, color=GRAY, linestyle=":", label="required: 15°")
    above.set(ylabel="success", ylim=(-0.05, 1.05))
    below.set(ylabel="orientation\nerror [deg]", ylim=(0.0, None))
    below.set(xlabel="episode of training", xticks=(1, 5, 10, 15, 20))
    figure.legend(loc="outside lower center", ncols=2, frameon=False)
    return titled(figure, "Two robots learn to push a box")


def hierarchies() -> Figure:
    """Draw success against the number of messages, for two values that agents maximize."""
    study = load("hierarchies")
    messages = study.results.trials.groupby("condition")["messages"].mean()
    figure = Figure(figsize=(WIDTH, 3.4), layout="constrained")
    axes = figure.subplots()
    names = {
        "independent": "independent", "star": "star", "chain of robots": "chain of robots",
        "tree:2": "binary tree", "teams": "teams", "chain": "chain",
    }  # fmt: skip
    for line, (value_of, label) in enumerate((("team", "team's value"), ("own", "own value"))):
        keys = [f"{name}, value_of={value_of}" for name in names]
        points = [success_of(study.results, key) for key in keys]
        draw_points(axes, [messages[key] + line for key in keys], points, line, label, joined=False)
    offsets = {
        "independent": (6, -12),
        "star": (-6, 12),
        "binary tree": (10, -2),
        "chain": (-14, 8),
    }
    for name, label in names.items():
        place = (
            messages[f"{name}, value_of=team"],
            success_of(study.results, f"{name}, value_of=team")[0],
        )
        offset = offsets.get(label, (4, 6))
        axes.annotate(label, place, offset, textcoords="offset points")
    axes.set(xlabel="messages in a decision", ylabel="success of eight robots", ylim=(0, 1.25))
    axes.set_yticks((0, 0.25, 0.5, 0.75, 1.0))
    axes.legend(loc="lower right", frameon=False)
    return titled(figure, "A chain of robots succeeds with few messages")


def broken_messages() -> Figure:
    """Draw success by the fraction of lost messages, by what agents assume about silence."""
    results = load("edges-broken").results
    figure = Figure(figsize=(WIDTH + 0.6, 2.8), layout="constrained")
    panels = figure.subplots(1, 3, sharey=True)
    titles = {"chain": "chain", "tree:2": "binary tree", "teams": "teams"}
    assumed = {"plan": "plan for silent agents", "last": "repeat their last action",
               "maintain": "maintain their speed"}  # fmt: skip
    lost = (0.0, 0.3, 0.6, 0.9)
    phases = set(results.episodes["phase"])
    for axes, (name, title) in zip(panels, titles.items(), strict=True):
        for line, (how, label) in enumerate(assumed.items()):
            keys = [f"evaluation:lost {f'{p:g}'.removeprefix('0')}, {how}" for p in lost]
            keys = [key if key in phases else f"evaluation:{how}" for key in keys]
            keys = [key if key in phases else "evaluation" for key in keys]
            points = [success_of(results, name, key) for key in keys]
            draw_points(axes, np.add(lost, 0.02 * (line - 1)), points, line, label)
        axes.set(title=title, xticks=lost, ylim=(0, 1.05))
    panels[0].set_ylabel("success")
    panels[1].set_xlabel("probability that a message is lost")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=1,
                  frameon=False)  # fmt: skip
    return titled(figure, "Plans for silent agents replace lost messages")


CHANGES = {
    "state space of the paper (Eq. 1)": "state variables of the paper",
    "paper, as printed": "constants of the paper",
    "static predictor": "model in which the box never moves",
    "discount .999": "discount 0.999",
    "action repeat 1 (64 ms)": "decisions of 64 ms",
    "prediction horizon 8 (one decision)": "prediction of one decision",
    "teammates uniform": "others act at random",
    "online TD(lambda), no replay": "online learning, no replay",
    "attraction without contact": "reward without contact",
    "rigid predictor": "model without compliance",
}
"""Labels of the ten changes of `ablation`."""


def ablation() -> Figure:
    """Draw the difference in success that ten changes of a preset make."""
    results = load("ablation").results
    figure = Figure(figsize=(WIDTH, 3.6), layout="constrained")
    axes = figure.subplots()
    for row, (condition, label) in enumerate(CHANGES.items()):
        success = [results.success(name, "evaluation").mean(axis=1)
                   for name in (condition, "default")]  # fmt: skip
        value, low, high = map(float, na.bootstrap(success[0] - success[1]))
        axes.plot([low, high], [row, row], color=BLUE)
        axes.plot(value, row, "o", color=BLUE)
        axes.text(-1.27, row, label, va="center", ha="right")
    axes.axvline(0, color=GRAY, lw=1)
    axes.set(xlim=(-1.2, 0.1), yticks=(), xlabel="difference in success from own-value")
    axes.invert_yaxis()
    axes.spines["left"].set_visible(False)
    return titled(figure, "State variables and the dynamics model matter most")


def games() -> Figure:
    """Draw the probability of the optimal joint action as a heat map: settings by learners."""
    cases = analyse_games(load("games").results).cases
    systems = list(dict.fromkeys(case.system for case in cases))
    settings = list(dict.fromkeys(case.setting for case in cases))
    table = np.zeros((len(settings), len(systems)))
    for case in cases:
        values = list(case.values.values())
        table[settings.index(case.setting), systems.index(case.system)] = float(values[-1].value)
    figure = Figure(figsize=(WIDTH + 0.6, 5.0), layout="constrained")
    axes = figure.subplots()
    axes.imshow(table, cmap="Blues", vmin=0, vmax=1.9, aspect="auto")
    for row, column in np.ndindex(*table.shape):
        axes.text(column, row, format_number(table[row, column]), ha="center", va="center", size=9)
    names = [g.removesuffix("-climbing").replace(":", " ") for g, _ in settings]
    labels = [f"{g}, {e.replace('b', 'B', 1)}" for g, (_, e) in zip(names, settings, strict=True)]
    axes.set_yticks(range(len(settings)), labels)
    axes.set_xticks(range(len(systems)), systems, rotation=45, ha="right", rotation_mode="anchor")
    axes.spines[:].set_visible(False)
    return titled(figure, "Nested agents that expect best responses find every optimum")


def wheel_failure() -> Figure:
    """Draw success before and after a wheel fails, by what adapts."""
    results = load("wheel-failure").results
    figure = Figure(figsize=(WIDTH + 0.6, 3.3), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    lines = (
        ("true", "training", "weights and self-model adapt"),
        ("true", "weights kept", "self-model adapts"),
        ("false", "training", "weights adapt"),
        ("false", "weights kept", "nothing adapts"),
    )
    for axes, fault in zip(panels, ("seized", "reversed"), strict=True):
        for line, (enabled, phase, label) in enumerate(lines):
            condition = f"4 wheels, {fault}, enabled={enabled}"
            success = results.success(condition, phase)
            first = 32 - success.shape[1]
            for start, end in ((0, 20 - first), (20 - first, 32 - first)):
                groups = [(e, na.rate(success[:, e : e + 4])) for e in range(start, end, 4)]
                x = [first + e + 2.5 + 0.15 * line for e, _ in groups]
                if groups:  # not joined across the failure
                    name = label if end == 32 - first else "_"
                    draw_points(axes, x, [rate for _, rate in groups], line, name)
        axes.axvline(20.5, color="black", lw=1, ls=":")
        axes.text(20, 0.02, "failure", ha="right", va="bottom")
        axes.set(xlabel="episode", title=f"one wheel {fault}", ylim=(-0.03, 1.08))
    panels[0].set_ylabel("success")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2,
                  frameon=False)  # fmt: skip
    return titled(figure, "A self-model restores success after a wheel fails")


SIZES = (
    ("team's value (default)", (
        ("scaling", "2", 2), ("scaling", "4", 4), ("scaling", "8", 8), ("scaling", "16", 16),
        ("crowds", "32", 32),
    )),
    ("team's value, trained with 8", (("wide", "8, wide box", 64),)),
    ("own value, as in the paper", tuple(
        ("own-value", f"own value, robots={n}", n) for n in (2, 4, 8)
    )),
    ("planner (knows the reward)", tuple(
        ("controls", f"planner, robots={n}", n) for n in (2, 4, 8, 16)
    )),
    ("untrained", tuple(("controls", f"frozen, robots={n}", n) for n in (2, 4, 8, 16))),
)  # fmt: skip
"""Lines of `success_by_size`: label, and (table, condition, number of robots) of each point."""


def operations() -> Figure:
    """Draw the operations of five ways to decide by the number of agents, from the formulas."""
    names = {"single-agent": "one agent for all", "chain": "chain", "tree:2": "binary tree",
             "best-response": "best responses", "independent": "independent agents"}  # fmt: skip
    figure = Figure(figsize=(WIDTH, 3.4), layout="constrained")
    axes = figure.subplots()
    rows = na.cost_table(list(names), range(1, 17)).rows
    for line, (name, label) in enumerate(names.items()):
        own = [row for row in rows if row.topology == name]
        counts = [row.single_agent if row.nested_exact is None else row.nested_exact for row in own]
        color, style, marker = LINES[line]
        axes.plot([row.agents for row in own], [log10(count) for count in counts],
                  color=color, ls=style, marker=marker, ms=4, lw=1.6, label=label)  # fmt: skip
    axes.set(xlabel="agents", ylabel="log10(operations)", xticks=range(2, 17, 2))
    axes.legend(frameon=False)
    return titled(figure, "Four nested agents take 2e12 operations, one agent 1e27")


def success_by_size() -> Figure:
    """Draw evaluation success by number of robots."""
    figure = Figure(figsize=(WIDTH, 3.8), layout="constrained")
    axes = figure.subplots()
    for line, (label, points) in enumerate(SIZES):
        estimates = [
            success_of(load(table).results, condition,
                       "evaluation:sixty-four" if table == "wide" else "evaluation")
            for table, condition, _ in points
        ]  # fmt: skip
        sizes = [robots * (1 + 0.03 * line) for *_, robots in points]
        draw_points(axes, sizes, estimates, line, label)
    axes.set_xscale("log", base=2)
    axes.set_xticks((2, 4, 8, 16, 32, 64), ("2", "4", "8", "16", "32", "64"))
    axes.set(xlabel="robots", ylabel="success", ylim=(-0.03, 1.03))
    figure.legend(loc="outside lower center", ncols=2, frameon=False)
    return titled(figure, "The team's value lets teams scale to 16 robots")


def steps_to_success(study: na.StudyResults) -> dict[str, tuple[float, ...]]:
    """Return mean decisions with intervals by condition; failed episodes count in full."""
    lines = study.compare(measure="steps").table.lines
    title = "evaluation steps to success"
    return {line.condition: tuple(map(float, line.estimates[title])) for line in lines}


def equal_computing() -> Figure:
    """Draw success and decisions to the goal by number of robots, for two budgets."""
    names = {"chain": "chain", "tree:2": "binary tree", "star": "star",
             "independent": "independent agents"}  # fmt: skip
    studies = {n: load(f"equal-computing-{n}") for n in ("boxes", 16, 32)}
    steps = {n: steps_to_success(study) for n, study in studies.items()}
    titles = {64: "64 joint actions", 1024: "1,024 joint actions\n(32 robots: 4,096)"}
    figure = Figure(figsize=(WIDTH, 4.9), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True, sharey="row")
    for (above, below), (budget, title) in zip(panels.T, titles.items(), strict=True):
        for line, (name, label) in enumerate(names.items()):
            cells = {
                n: ("boxes", f"hierarchy, topology={name}, robots={n}, budget={budget}")
                for n in (2, 4, 8)
            }
            if budget > 64:
                cells |= {n: (n, name) for n in (16, 32)}
            sizes = [n * (1 + 0.04 * (line - 1.5)) for n in cells]
            success = [success_of(studies[n].results, c) for n, c in cells.values()]
            draw_points(above, sizes, success, line, label)
            draw_points(below, sizes, [steps[n][c] for n, c in cells.values()], line, label)
        above.set(title=title, ylim=(-0.03, 1.05))
        below.set_xscale("log", base=2)
        ticks = (2, 4, 8, 16, 32)
        below.set_xticks(ticks, [str(n) for n in ticks])
        below.set(xlabel="robots", ylim=(0, 450))
    panels[0, 0].set_ylabel("success")
    panels[1, 0].set_ylabel("decisions")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2,
                  frameon=False)  # fmt: skip
    return titled(figure, EQUAL_COMPUTING)


def outcomes(rates: pd.Series, episodes: int) -> np.ndarray:
    """Return successes ``(n_seeds, episodes)`` with the given rate in each row."""
    return np.arange(episodes) < np.round(rates.to_numpy()[:, None] * episodes)


def ppo() -> Figure:
    """Draw success by decisions of training, of networks and of fuzzy agents with a model."""
    figure = Figure(figsize=(WIDTH + 0.6, 3.3), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    tasks = {"box": "two robots push a box", "arm": "arm of four joints"}
    names = {
        "fuzzy TD": "fuzzy TD with a model", "hierarchy-ppo, chain": "PPO along a chain",
        "hierarchy-ppo, no edges": "PPO without communication", "IPPO": "independent PPO",
    }  # fmt: skip
    for axes, (task, title) in zip(panels, tasks.items(), strict=True):
        rows = pd.read_csv(RESULTS / f"{task}-experience.csv")
        for line, (condition, label) in enumerate(names.items()):
            part = rows[rows["condition"] == condition]
            points = {
                decisions: na.rate(outcomes(group["success"], TASKS[task].episodes))
                for decisions, group in part.groupby("decisions")
            }
            draw_points(axes, list(points), list(points.values()), line, label)
        axes.set(xscale="log", title=title, xlabel="decisions of training", ylim=(-0.03, 1.05))
    panels[0].set_ylabel("success")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2,
                  frameon=False)  # fmt: skip
    return titled(figure, "With a model, a thousand decisions suffice")


ALL = (
    idea, communication_lookahead, nested_decision, perception, learner, predictions,
    learning_curves, hierarchies, broken_messages, ablation, games, wheel_failure,
    success_by_size, operations, equal_computing, ppo,
)  # fmt: skip


if __name__ == "__main__":
    for make in ALL:
        if not sys.argv[1:] or make.__name__ in sys.argv[1:]:
            with mpl.rc_context(STYLE):
                make().savefig(FIGURES / f"{make.__name__}.png")
