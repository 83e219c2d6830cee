"""Commands that need no study: presets, keys, topologies, what they cost, and checks."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...errors import SpecError, refused
from .. import options
from ..display import print_wrapped

if TYPE_CHECKING:
    from pandas import DataFrame

    from ....topologies.view import HierarchyView
    from ...cost.table import Form


@click.command()
@click.argument("name", metavar="[NAME]", required=False)
def presets(name: str | None) -> int:
    """List the presets, or print one in full.

    NAME is a preset to print as the tables of a spec, defaults included.
    """
    from ...spec.presets import PRESETS

    if name is None:
        left = max(map(len, PRESETS)) + 2
        for key, preset in PRESETS.items():
            print_wrapped(preset.summary, f"{key:<{left}}", left)
        return 0
    from ...spec.layers import resolve
    from ...spec.tables import dumps

    settings = resolve(name, {}, {}).settings
    if defaults := settings.scenario.scenario_defaults(name):
        print("# What this scenario lays over the preset, as it is set here:")
        print(*(f"# {line}" for line in dumps(defaults).splitlines() if line), sep="\n", end="\n\n")
    print(dumps(settings.model_dump()), end="")
    return 0


@click.command()
@click.argument("prefix", metavar="[PREFIX]", required=False)
def keys(prefix: str | None) -> int:
    """List the keys of a spec: default, type, what is allowed, meaning.

    A spec begins from the preset default; where that has another value, both are listed.

    PREFIX is a table or a key, such as learner.rule_base or scenario.box.mass.
    """
    from ...spec.keys import keys_below, nearest

    tables = keys_below(prefix or "")
    if not tables:
        raise SpecError(f"{prefix}: there is no such key; {nearest(prefix or '')}")
    for number, table in enumerate(tables):
        print(*[""] * bool(number), table.heading, sep="\n")
        for key in table.keys:
            words = ", ".join(filter(None, [key.type, key.allowed, key.unit and f"[{key.unit}]"]))
            print_wrapped(f"{key.name} = {key.value}: {words}")
            print_wrapped(key.meaning, "    ")
    return 0


SHORT = "{:.2g}".format
"""How numbers are printed."""
LESSONS = 8
"""Episodes from which a predictor has learned when its errors are shown."""
Case = tuple[str, Callable[[], Any], list[int]]
"""What a scenario is called, a function that makes it, and the episodes to play."""


@click.command()
@click.argument("source", metavar="SPEC.toml|FILE.py:NAME")
@options.number("--steps", "N", 40, "Most steps of the episodes that are played for it.")
@options.changes
def check(source: str, steps: int, changes: tuple[str, ...]) -> int:
    """Check what every scenario must promise, such as equal bits for equal seeds.

    A table shows the values met of every variable beside its range, and the root mean square error
    of its prediction beside that of persistence, as if all stayed as it is. Where agents learn to
    predict, a second table shows the errors of that after a few episodes.

    SPEC.toml is a spec, whose conditions are checked; FILE.py:NAME a function or class in a Python
    file that makes a scenario of one's own.
    """
    from pandas import DataFrame

    from ....scenarios.checking.checker import ScenarioError, check_scenario

    faults = 0
    for label, factory, episodes in _cases(source, changes):
        try:
            findings = check_scenario(factory, steps=steps, episodes=episodes)
        except ScenarioError as error:
            faults += 1
            print(f"FAULT   {label}: {error}")
        except ValueError as error:
            raise SpecError(str(error)) from None
        else:
            print_wrapped(f"{label}: {', '.join(findings.passed)}", "passed  ", 8)
            for name, reason in findings.unchecked.items():
                print_wrapped(f"{name}: {reason}", "not checked  ", 8)
            for warning in findings.warnings():
                print_wrapped(warning, "warning  ", 8)
            frame = DataFrame(findings.variables).rename(columns={"persistence": "as it is"})
            print("", frame.to_string(index=False, na_rep="", float_format=SHORT), "", sep="\n")
    is_spec = not source.partition(":")[0].endswith(".py")
    if not faults and is_spec:
        faults += _report_order(source, changes, steps)
    if not faults and is_spec:
        for label, errors in _learned_errors(source, changes, steps):
            print_wrapped(f"{label}: what {LESSONS} episodes teach to predict", "learned  ", 8)
            print("", errors.to_string(float_format=SHORT), "", sep="\n")
    return 1 if faults else 0


def _report_order(source: str, changes: tuple[str, ...], steps: int) -> bool:
    """Say that trials depend on what ran before them; return whether they do."""
    from ...spec.spec import Spec
    from ...trials.order import fault_of_order, has_programs
    from ...trials.trial import trials_of

    trials = trials_of(Spec.load(Path(source), changes))
    if not has_programs(trials[0]):
        return False
    fault = fault_of_order(trials, steps)
    if fault:
        print(f"FAULT   order of trials: {fault}")
    else:
        print_wrapped("order of trials: the same rows in two orders", "passed  ", 8)
    return bool(fault)


def _learned_errors(
    source: str, changes: tuple[str, ...], steps: int
) -> Iterator[tuple[str, DataFrame]]:
    """Yield the errors of learned predictors by variable, see `errors_of`, each once."""
    from ....core.adaptation.predictors import LearnedPredictorSettings
    from ...explain.team import errors_of
    from ...spec.spec import Spec
    from ...trials.session import Session
    from ...trials.trial import trials_of

    seen: set[Any] = set()
    for trial in trials_of(Spec.load(Path(source), changes)):
        predictor = getattr(trial.settings.learner, "predictor", None)
        what = trial.settings.scenario, predictor
        if what in seen or not isinstance(predictor, LearnedPredictorSettings):
            continue
        seen.add(what)
        session = Session(replace(trial, episodes=LESSONS, steps=steps, curriculum=()))
        session.train(LESSONS)
        errors = errors_of(session.team, session.scenario, trial.seed)
        if errors is not None:
            yield trial.condition, errors


def _cases(source: str, changes: tuple[str, ...]) -> Iterator[Case]:
    """Yield what is to be checked, each scenario of a spec once."""
    from ....core.interface.plain import as_scenario
    from ....core.learners import check_prediction
    from ...spec.spec import Spec

    if ".py:" in source or source.endswith(".py"):
        if changes:
            raise SpecError("--set: lays values over a spec, not over a Python file")
        with refused():
            factory = _factory_of(source)
        try:
            factory()
        except (Exception, SystemExit) as error:
            message = f"raised {type(error).__name__}: {' '.join(str(error).split())}"
            raise SpecError(f"{source}, called as a scenario is, {message}") from None
        yield source.rpartition(":")[2], factory, [0, 1]
        return
    seen: set[Any] = set()
    for condition in Spec.load(Path(source), changes).conditions():
        settings = condition.settings.scenario
        with refused():
            check_prediction(condition.settings.learner, as_scenario(settings.build()))
        if settings not in seen:
            seen.add(settings)
            # Played are the first episode and those in which failures begin.
            failures = getattr(settings, "failures", ())
            episodes = sorted({0, *(failure.episode for failure in failures)})
            yield condition.label, settings.build, episodes


def _factory_of(source: str) -> Callable[[], object]:
    """Return what makes a scenario of one's own, by its own settings as they are by default."""
    from ....core.plugins.sources import active
    from ....scenarios import SCENARIOS

    thing: Callable[[], object] = active().load(source)
    if not hasattr(thing, "Settings"):
        return thing
    try:
        build: Callable[[], object] = SCENARIOS.parsed(source).build
    except ValueError as error:
        raise ValueError(f"{source}: its Settings have no defaults for all keys, {error}") from None
    return build


MOST_AGENTS = 10_000
"""Of one row: its integers have some fifty thousand digits."""
RANGE = re.compile(r"(\d{1,6})(?::(\d{1,6})(?::(\*?)(\d{1,6}))?)?", re.ASCII)
"""From, to, and what is added or multiplied from one number to the next."""


@click.command()
@click.option(
    "--agents",
    metavar="N|RANGE,...",
    default="4",
    help="Numbers of agents and ranges: 4,8,16, 1:16, 2:64:2 (every second), 4:64:*2 (doubled).",
)
@click.option(
    "--topology",
    multiple=True,
    metavar="SPEC...",
    default=("chain",),
    help="One or more topologies as in a spec: chain teams tree:2 ..., or LABEL=SPEC with a label "
    "of your own; single-agent: Eq. 23; or ways to decide: best-response, max-plus, fitted-q, "
    "hierarchy-ppo.",
)
@options.number("--rules", "N", 5**7, "|S|, rules of one agent.")
@options.number("--actions", "N", 4, "|A|, actions of one agent.")
@options.number("--iterations", "N", 450, "L, iterations (steps) of an epoch.")
@click.option("--measured/--no-measured", help="Also count and time steps of the running system.")
@click.option(
    "--repeats",
    type=int,
    metavar="N",
    help="Measure so often, each time with a new team; from 2 on times have an interval.",
)
@click.option(
    "--network/--no-network",
    help="Also count messages, and how long a decision waits for them at 1 and 10 ms each.",
)
@options.formats("table", "json", "csv", "latex")
@options.plot
def cost(
    agents: str,
    topology: tuple[str, ...],
    measured: bool,
    repeats: int | None,
    network: bool,
    form: Form,
    plot: Path | None,
    **quantities: int,
) -> int:
    """Print the cost of hierarchies, by formula (Eq. 18-23) and, if asked, measured."""
    from ....core.agents.cost import Problem
    from ...cost.table import cost_table, written
    from ...presentation.progress import say

    with refused():
        problem, sizes = Problem(**quantities), numbers(agents)
        if measured := measured or repeats is not None:
            say("measuring, first compiling what is not: no steps of more than a second or so")
        often = 1 if repeats is None else repeats
        rows = cost_table(
            topology, sizes, problem, measured=measured, repeats=often, network=network
        ).rows
        if plot is not None:
            from ...cost.figure import draw

            draw(rows, plot)
    print(written(rows, form))
    return 0


def numbers(text: str) -> list[int]:
    """Return the numbers that a list of numbers and ranges names, both ends of each included.

    Examples
    --------
    >>> numbers("4,8,16"), numbers("1:3"), numbers("2:6:2"), numbers("4:64:*2")
    ([4, 8, 16], [1, 2, 3], [2, 4, 6], [4, 8, 16, 32, 64])
    """
    chosen: list[int] = []
    for part in text.split(","):
        match = RANGE.fullmatch(part.strip())
        first, last, times, step = match.groups("") if match else ("0", "", "", "")
        number, end, by = int(first), int(last or first), int(step or 1)
        if not 1 <= number <= end <= MOST_AGENTS or by < (2 if times else 1):
            raise ValueError(
                f"agents = {text!r}, allowed: 4, 4,8,16, 1:16, 2:64:2 or 4:64:*2, from 1 to "
                f"{MOST_AGENTS:,}"
            )
        while number <= end:
            chosen.append(number)
            number = number * by if times else number + by
    return list(dict.fromkeys(chosen))


TOPOLOGY = {"kind", "members", "edges"}
"""Keys of a file that holds a topology and no more."""


@click.group(no_args_is_help=False)
def topology() -> None:
    """List the topologies, or show one of them."""


@topology.command("list")
def list_all() -> int:
    """List the topologies, built-in and installed."""
    from ....topologies.view import list_kinds

    print(list_kinds())
    return 0


@topology.command()
@click.argument("topology", metavar="SPEC")
@click.option(
    "--agents",
    type=click.IntRange(1),
    metavar="N",
    help="Number of agents; default: two for each robot, else those that the topology names, "
    "else 4.",
)
@click.option(
    "--robots",
    type=click.IntRange(1),
    metavar="N",
    help="Number of robots, whose agents are consecutive; default: one for every two agents.",
)
@click.option(
    "--per",
    type=click.Choice(["actuator", "body", "team"]),
    default="actuator",
    help="What there is one agent for, as the key agents of a spec says.",
)
@click.option(
    "--actions", type=click.IntRange(2), metavar="N", default=4, help="Actions of each actuator."
)
@options.formats("table", "json")
@options.plot
def show(topology: str, form: Any, plot: Path | None, **team: Any) -> int:
    """Show a topology: edges, order of decision, who sees whom, cost.

    SPEC is a topology as in a spec: chain:reversed, tree:2, file.py:function, graph.json,
    teams.json, ...; or the spec of a study, whose hierarchies are shown over its own agents.
    """
    from ....topologies.view import format_view, view

    with refused():
        views = _of_spec(topology)
        if views is None:
            views = [view(topology, **team)]
        elif team["agents"] or team["robots"] or team["per"] != "actuator":
            raise SpecError(f"{topology}: is the spec of a study, which says its own agents")
        for number, shown in enumerate(views, 1):
            if plot is not None:
                from ....topologies.drawing import draw  # matplotlib takes its time

                several = f"-{number}" if len(views) > 1 else ""
                path = plot.with_name(f"{plot.stem}{several}{plot.suffix}")
                bodies, failing = shown.bodies, shown.failing
                draw(shown.hierarchy, path, bodies=bodies, title=shown.title, failing=failing)
            print(format_view(shown, form), end="\n\n" if number < len(views) else "\n")
    return 0


def _of_spec(path: str) -> list[HierarchyView] | None:
    """Return the distinct hierarchies of conditions and evaluations of a study's spec, or None.

    Each is called by the first that has it; None if the path is not that of a spec.

    Raises
    ------
    SpecError
        If one cannot be built; one line.
    """
    if not path.endswith(".toml") or not Path(path).is_file():
        return None
    try:
        table = tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except ValueError:
        return None  # whoever reads it as a topology says why
    if TOPOLOGY & table.keys() or (list(table) == ["topology"] and "kind" not in table["topology"]):
        return None

    from ....topologies.view import HierarchyView
    from ...spec.spec import Spec

    spec = Spec.load(Path(path))
    distinct: dict[tuple[object, ...], HierarchyView] = {}
    with spec.sources.active():
        for condition in spec.conditions():
            others = {f"{condition.label}, {name}": s for name, s in condition.evaluations}
            for label, settings in ({condition.label: condition.settings} | others).items():
                with refused(after=f" (condition {label!r})"):
                    scenario, hierarchy = settings.arrange(settings.scenario.build())
                own, failures = len(scenario.action_set), settings.topology.failures
                shown = HierarchyView(label, hierarchy, scenario.groups, own, failures)
                parts = hierarchy.told, hierarchy.considers, failures, own
                distinct.setdefault((hierarchy.agents, hierarchy.edges, *parts), shown)
    return list(distinct.values())
