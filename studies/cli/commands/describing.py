"""Commands that need no study: presets, keys, topologies, and what they cost."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ....core.shell import command_line
from ...errors import SpecError, refused
from .. import options
from ..display import print_data, print_text, print_wrapped

if TYPE_CHECKING:
    from ....topologies import view
    from ...cost.formats import Form as CostForm


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
            print_wrapped(preset["summary"], f"{key:<{left}}", left)
        return 0
    from ...spec.resolution import resolve
    from ...spec.tables import dumps

    settings = resolve(name, {})
    if defaults := settings.scenario.scenario_defaults(name):
        print_text("# Changes of the preset by this scenario:")
        print_text(*(f"# {line}" for line in dumps(defaults).splitlines() if line), "")
    print_data(dumps(settings.model_dump()))
    return 0


@click.command()
@click.argument("prefix", metavar="[PREFIX]", required=False)
def keys(prefix: str | None) -> int:
    """List the tables of a spec; with PREFIX list keys: default, type, allowed values, meaning.

    PREFIX is a table or a key, such as learner.rule_base or scenario.box.mass. A spec starts from
    the preset default; where a key has another value there, both values are listed.
    """
    from ...spec.keys import keys_below, nearest, outline

    if prefix is None:
        for name, parts in outline().items():
            print_wrapped(", ".join(parts), f"[{name}]  " if name else "top of the spec  ")
        print_text(
            "", f"To list the keys of a table or of one key: {command_line('keys', 'PREFIX')}"
        )
        return 0
    tables = keys_below(prefix)
    if not tables:
        raise SpecError(f"{prefix}: unknown key; {nearest(prefix)}")
    for number, table in enumerate(tables):
        if number:
            print_text("")
        print_text(table.heading)
        for key in table.keys:
            words = ", ".join(filter(None, [key.type, key.allowed, key.unit and f"[{key.unit}]"]))
            print_wrapped(f"{key.name} = {key.value}: {words}")
            print_wrapped(key.meaning, "    ")
    return 0


@click.command()
@options.out("File to write; by default the schema is printed.", "FILE.json")
def schema(out: Path | None) -> int:
    """Write the JSON schema of specs, with which editors complete and check keys.

    An editor that knows TOML reads the schema if a spec begins with the line #:schema FILE.json.
    """
    import json

    from ...spec.schema import schema as schema_of
    from ...store import durable

    text = json.dumps(schema_of(), indent=1) + "\n"
    if out is None:
        print_data(text)
        return 0
    durable.write(out, text.encode())
    print_text(out)
    return 0


MAX_NUMBERS = 10_000
"""Numbers that one range may have."""
RANGE = re.compile(r"(\d{1,15})(?::(\d{1,15})(?::(\*?)(\d{1,15}))?)?", re.ASCII)
"""First and last number, and what is added or multiplied from one number to the next."""


def several(name: str, default: str, text: str) -> options.Decorator:
    """Return an option that takes several numbers, lists of numbers and ranges."""
    return click.option(
        name, multiple=True, metavar="N|RANGE...", default=(default,) if default else (), help=text
    )


@click.command()
@several(
    "--agents",
    "4",
    "Numbers of agents and ranges: 4 8 16, 1:16, 2:64:2 (every second), 4:64:*2 (doubled).",
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
@several(
    "--memberships",
    "",
    "Membership functions of each of the seven state variables, 5 by default; rules = "
    "memberships^7.",
)
@several("--rules", "", "|S|, rules of one agent, instead of --memberships.")
@several("--actions", "4", "|A|, actions of one agent.")
@options.number("--iterations", "N", 450, "L, iterations (steps) of an epoch.")
@click.option("--measured/--no-measured", help="Also count and time steps of the running system.")
@click.option("--network/--no-network", help="Also count the messages of a decision.")
@click.option(
    "--budget",
    type=int,
    metavar="N",
    help="Also show the cost if the team may try N joint actions in a decision, as with the key "
    "learner.decision.budget.",
)
@options.formats("table", "json", "csv", "latex")
@options.plot
def cost(
    topology: tuple[str, ...], form: CostForm, plot: Path | None, **quantities: options.Checked
) -> int:
    """Print the cost of hierarchies, by formula (Eq. 18-23) and, if requested, measured.

    Several numbers of agents, rules and actions give a row for each combination.
    """
    from ...cost.formats import format_rows
    from ...cost.table import cost_table
    from ...presentation.progress import say

    with refused():
        for name in ("agents", "memberships", "rules", "actions"):
            texts = quantities[name]
            quantities[name] = numbers(name, texts) if texts else None
        if quantities["measured"]:
            if plot is not None:  # a figure that cannot be read is refused before anything is timed
                from ...cost.figure import check

                check(cost_table(topology, **{**quantities, "measured": False}).rows, plot)
            say("Measuring. Code is compiled first; steps of over about a second are left out.")
        rows = cost_table(topology, **quantities).rows
        if plot is not None:
            from ...cost.figure import draw

            draw(rows, plot)
            say(f"figure  {plot}")
    print_data(f"{format_rows(rows, form)}\n")
    return 0


def numbers(name: str, texts: Sequence[str]) -> list[int]:
    """Return the numbers in lists of numbers and ranges; both ends of a range are included.

    Raises
    ------
    ValueError
        If a text is no list of whole numbers and ranges; one line that names the option.

    Examples
    --------
    >>> numbers("agents", ["4,8", "16"]), numbers("agents", ["1:3"]), numbers("rules", ["4:32:*2"])
    ([4, 8, 16], [1, 2, 3], [4, 8, 16, 32])
    """
    chosen: list[int] = []
    for part in ",".join(texts).split(","):
        match = RANGE.fullmatch(part.strip())
        first, last, times, step = match.groups("") if match else ("1", "0", "", "")
        number = int(first)
        end = int(last or first)
        by = int(step or 1)
        is_long = not times and by > 0 and (end - number) // by >= MAX_NUMBERS
        if number > end or by < (2 if times else 1) or (times and number < 1) or is_long:
            raise ValueError(
                f"{name} = {part!r}, allowed: whole numbers such as 4 or 4,8,16, and ranges of at "
                f"most {MAX_NUMBERS:,} numbers such as 1:16, 2:64:2 or 4:64:*2"
            )
        while number <= end:
            chosen.append(number)
            number = number * by if times else number + by
    return list(dict.fromkeys(chosen))


@click.command()
@click.argument("spec", type=options.PATH, metavar="SPEC.toml")
@options.number("--seconds", "S", 1.0, "How long each condition is timed [s].")
@options.formats("table", "csv", text="Output format; CSV has the times of parts in seconds.")
@options.changes
def profile(spec: Path, seconds: float, form: str, changes: tuple[str, ...]) -> int:
    """Show the time of a decision part by part, and the joint actions that it tries.

    Each condition of SPEC.toml acts and learns for a while; nothing is kept. The table has the
    processor time by part, and compares the joint actions tried with the formulas.
    """
    from ...cost.profile import lines
    from ...cost.profile import profile as profile_of
    from ...presentation.progress import say
    from ...presentation.tables import in_csv
    from ...spec.spec import Spec

    say("Compiling code, then timing the decisions of every condition.")
    with refused():
        timed = profile_of(Spec.load(spec, changes), seconds)
    if form == "csv":
        print_data(in_csv(timed))
    else:
        print_text(*lines(timed))
    return 0


TOPOLOGY = {"kind", "members", "edges"}
"""Keys of a file that holds a topology and no more."""


@click.group(no_args_is_help=False)
def topology() -> None:
    """List the topologies, or show one of them."""


@topology.command("list")
def list_all() -> int:
    """List the topologies, built-in and installed."""
    from ....topologies.view import list_kinds

    print_text(list_kinds())
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
    help="Number of robots with consecutive agents; default: one for every two agents.",
)
@click.option(
    "--per",
    type=click.Choice(["actuator", "body", "team"]),
    default="actuator",
    help="One agent per actuator, per body or for the team, as the key agents of a spec.",
)
@click.option(
    "--actions", type=click.IntRange(2), metavar="N", default=4, help="Actions of each actuator."
)
@click.option(
    "--scenario",
    metavar="KIND",
    help="Use the agents of a scenario with its default settings, such as spread or signals.",
)
@options.formats("table", "json")
@options.plot
def show(
    topology: str,
    scenario: str | None,
    form: view.Form,
    plot: Path | None,
    **team: options.Checked,
) -> int:
    """Show a topology: edges, order of decision, communication, lookahead, cost.

    SPEC is a topology as in a spec: chain:reversed, tree:2, file.py:function, graph.json,
    teams.json, ...; or the spec of a study, which shows its hierarchies over its agents.
    """
    from ....topologies.view import format_view, view

    with refused():
        views = _of_spec(topology) if scenario is None else _over(topology, scenario)
        if views is None:
            views = [view(topology, **team)]
        elif team["agents"] or team["robots"] or team["per"] != "actuator":
            source = "the study" if scenario is None else f"the scenario {scenario}"
            raise SpecError(f"{topology}: {source} defines the agents; omit the options for agents")
        for number, hierarchy in enumerate(views, 1):
            if plot is not None:
                several = f"-{number}" if len(views) > 1 else ""
                _draw(hierarchy, plot.with_name(f"{plot.stem}{several}{plot.suffix}"))
            if number > 1:
                print_text("")
            print_text(format_view(hierarchy, form))
    return 0


def _draw(hierarchy: view.HierarchyView, path: Path) -> None:
    from ....topologies.drawing import draw  # matplotlib takes its time
    from ...presentation.progress import say

    draw(
        hierarchy.hierarchy,
        path,
        bodies=hierarchy.bodies,
        title=hierarchy.title,
        failing=hierarchy.failing,
    )
    say(f"figure  {path}")


def _of_spec(path: str) -> list[view.HierarchyView] | None:
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
        return None  # the reader of topologies says why
    if TOPOLOGY & table.keys() or (list(table) == ["topology"] and "kind" not in table["topology"]):
        return None

    from ...spec.spec import Spec
    from ...trials.hierarchies import hierarchies_of

    spec = Spec.load(Path(path))
    with spec.sources.active():
        return hierarchies_of(spec)


def _over(topology: str, scenario: str) -> list[view.HierarchyView]:
    """Return a topology over the agents of a scenario.

    Raises
    ------
    SpecError
        If there is no such scenario or topology, or they do not fit; one line.
    """
    from ...spec.spec import Spec
    from ...trials.hierarchies import hierarchies_of

    spec = Spec.of({"scenario": {"kind": scenario}, "topology": topology})
    with spec.sources.active():
        return [replace(one, text=topology) for one in hierarchies_of(spec)]
