"""Writes the generated pages of the reference, from the code that they are about.

``conf.py`` calls `write` before the pages are read: keys of a spec, presets, columns of results and
commands. Only the meanings of columns with times are written by hand.
"""

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import click

from nested_agents.core.interface.measures import Measure
from nested_agents.scenarios import SCENARIOS
from nested_agents.scenarios.box_pushing.states.variables import STATE_VARIABLES
from nested_agents.scenarios.box_pushing.world.boxes import BOXES
from nested_agents.scenarios.box_pushing.world.robots import ROBOTS
from nested_agents.scenarios.kinematic_chain.variables import CHAIN_VARIABLES
from nested_agents.studies.cli.main import COMMANDS, load_command
from nested_agents.studies.cli.main import nested_agents as program
from nested_agents.studies.results.results import EPISODE_COLUMNS, NUMBERS, TRIAL_COLUMNS
from nested_agents.studies.spec.keys import tables
from nested_agents.studies.spec.presets import PRESETS
from nested_agents.studies.spec.tables import dumps

BESIDE = {
    "*swept keys*": ("", "a column for every swept key, and `name` if the spec has overrides"),
    "*measures*": ("", "measures of the scenario, in the tables below"),
    "seconds.decision": ("s", "time spent on decisions, including predictions"),
    "seconds.physics": ("s", "time spent on physics"),
    "seconds.sensors": ("s", "time spent on sensing"),
    "seconds.learning": ("s", "time spent on learning"),
    "seconds.total": ("s", "time that the trial took"),
    "*numbers*": ("", "numbers of the trial that the study keeps, in the table below"),
}
"""Unit and meaning of columns that depend on the study, and of times."""
EPISODES = tuple(
    (name, *(EPISODE_COLUMNS | BESIDE)[name])
    for name in (
        "condition", "*swept keys*", "seed", "phase", "episode", "steps", "*measures*", "return"
    )
)  # fmt: skip
"""Columns of the rows of episodes: name, unit, meaning."""
TRIALS = tuple(
    (name, *(TRIAL_COLUMNS | BESIDE)[name])
    for name in (
        "condition", "*swept keys*", "seed", "state", "identity", "error", "seconds.decision",
        "seconds.physics", "seconds.sensors", "seconds.learning", "seconds.total", "*numbers*",
    )
)  # fmt: skip
VARIABLES = {"box-pushing": STATE_VARIABLES, "kinematic-chain": CHAIN_VARIABLES}
"""State variables by the scenario that has them."""


def write(folder: Path) -> None:
    """Write the pages that have changed into a folder."""
    folder.mkdir(exist_ok=True)
    pages = {"keys": keys(), "columns": columns(), "commands": commands()}
    pages["changelog"] = iter([changelog()])
    for name, lines in pages.items():
        text = "\n".join(lines) + "\n"
        path = folder / f"{name}.md"
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def table(headings: Iterable[str], rows: Iterable[Iterable[str]]) -> Iterator[str]:
    """Yield the lines of a table."""
    headings = list(headings)
    yield f"| {' | '.join(headings)} |"
    yield f"|{'---|' * len(headings)}"
    for row in rows:
        yield f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |"
    yield ""


def code(text: str) -> str:
    """Return a text as code, or nothing for nothing."""
    return f"`{text}`" if text else ""


def prose(text: str) -> str:
    """Return the reStructuredText of a docstring as Markdown."""
    return text.replace("``", "`").replace("<", "&lt;")


def keys() -> Iterator[str]:
    """Yield the page on the keys of a spec."""
    yield "# Keys of a spec\n"
    yield "This page is generated from the settings models that check every spec. In a terminal,"
    yield "`nested-agents keys scenario.box` prints a part of it. A heading names the table of a"
    yield "spec that contains the keys below it. *Required* means that there is no default. *None*"
    yield "means that no value is set, which TOML cannot express; if it is the default, `unset`"
    yield "restores it. A spec starts from the [preset](#presets) `default` if it names no other."
    yield "If the preset sets a key, its value replaces the default.\n"
    for one in tables():
        yield f"## {code(one.heading) if one.name else 'The top of a spec'}\n"
        yield f"{prose(one.summary)}\n"
        if one.keys:
            yield from table(
                ("key", "meaning", "unit", "default", "type", "allowed"),
                (
                    (
                        code(k.name),
                        prose(k.meaning),
                        k.unit,
                        code(k.default)
                        + (f" (in preset `default`: {code(k.preset)})" if k.preset else ""),
                        k.type,
                        code(k.allowed),
                    )
                    for k in one.keys
                ),
            )
    yield "## Presets\n"
    yield "A preset is a named set of values from which a spec starts. The tables of the spec"
    yield "override these values. `nested-agents presets NAME` prints a preset in full.\n"
    for name, preset in PRESETS.items():
        summary = preset["summary"]
        yield f"### `{name}`\n\n{summary[0].upper()}{summary[1:]}.\n"
        tables_of = {key: own for key, own in preset.items() if isinstance(own, dict)}
        tables_of.pop("other_scenarios", None)
        yield f"```toml\n{dumps(tables_of).strip()}\n```\n"
    yield "## Boxes, robots and state variables by name\n"
    yield f"Boxes: {', '.join(map(code, BOXES))}.\n"
    yield f"Robots: {', '.join(map(code, ROBOTS))}.\n"
    for kind, registry in VARIABLES.items():
        yield f"State variables of `{kind}`, besides the speed of the agent's own actuator:\n"
        named = ((name, registry.find(name)) for name in registry.built_in)
        yield from table(
            ("state variable", "unit", "range", "meaning"),
            (
                (
                    code(name),
                    v.variable.unit,
                    f"{v.variable.low:.3g} to {v.variable.high:.3g}",
                    prose(" ".join((v.function.__doc__ or "").partition("\n\n")[0].split())),
                )
                for name, v in named
            ),
        )


def columns() -> Iterator[str]:
    """Yield the page on the columns of results."""
    yield "# Columns of results\n"
    yield "`export` writes the tables `episodes` and `trials`. `nested-agents results --format csv`"
    yield "prints the rows of episodes, too. The unit 1 is that of a pure number.\n"
    headings = ("column", "unit", "meaning")
    for title, rows in (
        ("Rows of episodes", EPISODES), ("Rows of trials", TRIALS),
        ("Numbers of trials", [(name, *number) for name, number in NUMBERS.items()]),
    ):  # fmt: skip
        yield f"## {title}\n"
        yield from table(headings, ((code(n) if "*" not in n else n, u, m) for n, u, m in rows))
    yield "## Measures of the scenarios\n"
    yield "A scenario declares its own [measures](../extending.md#a-scenario). These are"
    yield "the measures of the built-in scenarios. *Value* says how the value of an episode follows"
    yield "from those of its steps: the last one, their mean, sum or maximum. Environments of"
    yield "Gymnasium and PettingZoo have two measures: `success`, which is 0 unless a spec defines"
    yield "`scenario.success`, and `total_reward`, the sum of the rewards, mean over agents.\n"
    for kind in SCENARIOS.built_in:
        if kind in ("gymnasium", "pettingzoo"):
            continue  # built only of an environment
        yield f"### `{kind}`\n"
        declared = SCENARIOS.parsed(kind).build()
        yield from table(
            ("column", "heading", "unit", "value", "better", "bounds"),
            (
                (code(m.name), m.title, m.unit, "yes (1) or no (0)" if m.is_rate else m.gathering,
                 m.better or "", bounds(m))
                for m in declared.measures
            ),
        )  # fmt: skip


def bounds(measure: Measure) -> str:
    """Return what a measure cannot be below or above."""
    ends = [f">= {measure.least:g}"] if measure.least is not None else []
    ends += [f"<= {measure.greatest:g}"] if measure.greatest is not None else []
    return code(", ".join(ends))


def commands() -> Iterator[str]:
    """Yield the page on the command line."""
    yield "# Commands\n"
    yield "In a checkout, write `./dev exec` before every command. The exit status is 0 if the"
    yield "command succeeds, 1 if a trial failed, and 130 after Ctrl-C. It is 2 if the input has a"
    yield "mistake, which one line on standard error names.\n"
    yield from table(
        ("command", "purpose"), ((f"[`{n}`](#{n})", t) for n, (_, t) in COMMANDS.items())
    )
    for name in COMMANDS:
        command = load_command(name)
        yield f"## {name}\n"
        if isinstance(command, click.Group):
            for below, one in command.commands.items():
                yield f"### {name} {below}\n"
                yield from _usage(one, f"{name} {below}")
        else:
            yield from _usage(command, name)


def _usage(command: click.Command, name: str) -> Iterator[str]:
    parent = click.Context(program, info_name="nested-agents", **program.context_settings)
    context = click.Context(
        command, info_name=name, parent=parent, terminal_width=88, max_content_width=88
    )
    yield f"```text\n{command.get_help(context).strip()}\n```\n"


def changelog() -> str:
    """Return the changelog without links to files of the repository."""
    text = (Path(__file__).parents[1] / "CHANGELOG.md").read_text(encoding="utf-8")
    return re.sub(r"\[([^]]*)\]\((?!http)[^)]*\)", r"\1", text)
