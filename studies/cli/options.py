"""Arguments and options that several commands share, and what all arguments must be.

An option that may be given several times takes several values at once, too: `complete`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, TypeAlias

import click
from click.core import ParameterSource

PATH = click.Path(path_type=Path)
"""A path, which need not exist."""
Checked: TypeAlias = Any
"""Values of options, which click has checked."""


def complete(command: click.Command, arguments: Iterable[str]) -> Iterator[str]:
    """Yield arguments in which each further value of an option has the option's name before it.

    Values go on up to the next option; those of ``KEY=VALUE`` up to an argument without ``=``.

    Raises
    ------
    click.UsageError
        If an argument is empty, as an unset shell variable is, or a value is missing.

    Examples
    --------
    >>> command = click.Command("run", params=[click.Option(["--set"], multiple=True)])
    >>> list(complete(command, ["--set", "a", "b", "--jobs", "3"]))
    ['--set', 'a', '--set', 'b', '--jobs', '3']
    """
    options = {
        name: option
        for option in command.params
        if isinstance(option, click.Option) and not option.is_flag
        for name in option.opts
    }
    name = ""
    is_due = False
    for argument in arguments:
        if argument in ("", *(f"{option}=" for option in options)):
            empty = name if is_due else argument.rstrip("=") or "an argument"
            raise click.UsageError(f"{empty}: must not be empty")
        if is_due and argument.startswith("--"):
            raise click.UsageError(f"{name} {argument}: is an option; a value must come first")
        if is_due:
            is_due = False
        elif argument in options:
            name = argument
            is_due = True
        elif name and options[name].multiple and _is_further(argument, options[name]):
            yield name
        else:
            name = ""
        yield argument


def refuse_unused(mode: str, used: Iterable[str]) -> None:
    """Refuse options of the command line that the running command does not use in a mode.

    Parameters
    ----------
    mode
        What the mode is called in the message, such as ``with --check``.
    used
        Parameters that it uses, by the names of the command's arguments.

    Raises
    ------
    click.UsageError
        If another option is given.
    """
    context = click.get_current_context()
    for option in context.command.params:
        source = context.get_parameter_source(str(option.name))
        if source is ParameterSource.COMMANDLINE and option.name not in used:
            raise click.UsageError(f"{option.opts[0]}: is not used {mode}")


def _is_further(argument: str, option: click.Option) -> bool:
    return argument[0] != "-" and ("=" in argument or "=" not in str(option.metavar))


directory = click.argument("directory", type=PATH, metavar="DIR")
"""An existing study."""

sources = click.argument("sources", type=PATH, metavar="DIR...|FILE.json", nargs=-1, required=True)
"""Existing studies, or a file of results."""

Decorator = Callable[[Callable[..., int]], Callable[..., int]]


def number(name: str, metavar: str, default: float, text: str) -> Decorator:
    """Return an option that takes a number, a whole one if its default is."""
    return click.option(name, metavar=metavar, type=type(default), default=default, help=text)


def flag(name: str, text: str) -> Decorator:
    """Return an option that takes no value."""
    return click.option(name, is_flag=True, help=text)


def out(
    text: str, metavar: str = "DIR", *, required: bool = False, default: str | None = None
) -> Decorator:
    """Return the option ``--out``, where to write."""
    if default is None:  # given as a default, None would be a value
        return click.option("--out", type=PATH, metavar=metavar, help=text, required=required)
    return click.option("--out", type=PATH, metavar=metavar, help=text, default=default)


jobs = click.option(
    "--jobs", type=int, metavar="N", help="Trials at a time; by default one for every core."
)
"""Number of worker processes."""

_backend = click.option(
    "--backend",
    type=click.Choice(["loky", "dask"]),
    default="loky",
    help="Run the trials in processes of this machine (loky) or in workers of a Dask cluster "
    "(dask; extra nested-agents[dask]). The results are the same.",
)
_address = click.option(
    "--address",
    metavar="tcp://HOST:PORT",
    help="Address of the scheduler of a running Dask cluster; --jobs limits the number of its "
    "workers. By default, a local cluster is started.",
)
_accept_code = flag(
    "--accept-code",
    "Continue a study although the installed code that computes it has changed.",
)


def running(command: Callable[..., int]) -> Callable[..., int]:
    """Add the options of who runs trials, as `nested_agents.studies.api.running.run` takes them."""
    return jobs(_backend(_address(_accept_code(command))))


checkpoint = number(
    "--checkpoint",
    "SECONDS",
    300.0,
    "Interval at which a running trial saves its state [s]; after an interruption it resumes from "
    "there, with the same results. 0: never.",
)

trust = flag(
    "--trust",
    "Trust the code of the study, now and later: run the Python files that came with it and import "
    "the modules that it names. This code has all of your permissions.",
)
"""Whether a study may run the code that it contains or names, see `core.plugins.trust`."""

changes = click.option(
    "--set",
    "changes",
    multiple=True,
    metavar="KEY=VALUE...",
    help='Change values of the spec: --set learner.ridge=1 "seeds=[3, 5]". May be repeated.',
)
"""Changes of a spec, see `nested_agents.studies.spec.tables.assignment`."""

figures = click.option(
    "--figures",
    multiple=True,
    type=click.Choice(["png", "svg", "pdf"]),
    metavar="png|svg|pdf...",
    help="Also write the figures of the study in these formats. The report always has them.",
)
"""Formats of the figures of a study."""

plot = click.option(
    "--plot", type=PATH, metavar="PATH", help="Write a figure: SVG, PNG or PDF by suffix."
)
"""A picture to write."""

as_study = click.option(
    "--as",
    "study",
    metavar="STUDY",
    help="Print the tables of another kind of study (a name or file.py:NAME); nothing is run.",
)
"""Another study than that which the trials were run for."""

where = click.option(
    "--where",
    metavar="QUERY",
    help="Use only trials that match a pandas query: \"robots == 8 and box == 'circle'\".",
)
"""A part of the trials, see `nested_agents.studies.results.results.chosen`."""

measure = click.option(
    "--measure",
    metavar="NAME",
    help="Measure of episodes (such as steps or return) or of trials (such as messages). By "
    "default success, return if no episode can succeed, or the first score of a table.",
)
"""Measure that is compared or fitted."""

phase = click.option(
    "--phase",
    metavar="PHASE",
    help="Phase of the episodes; by default evaluation, if there is one.",
)
"""Phase of the episodes of a study."""


size = click.option(
    "--size",
    metavar="KEY",
    help="The swept key that is the size; by default the number of robots or agents.",
)
"""Key of the team size."""

columns = click.option(
    "--columns",
    multiple=True,
    metavar="ROLE=COLUMN",
    help="Columns of a table of scores by role, separated by commas. Roles are condition, score, "
    "seed and item; condition=model+topology joins columns. By default, columns are named like "
    "their roles.",
)
"""Roles of the columns of a table, see `nested_agents.studies.api.loading.load`."""

better = click.option(
    "--better",
    type=click.Choice(["higher", "lower"]),
    help="Whether higher or lower scores of other tools are better; by default higher.",
)
"""Direction of the scores of a table."""


def formats(*choices: str, text: str = "Output format.") -> Decorator:
    """Return the option ``--format``; the first choice is its default."""
    kind = click.Choice(choices)
    return click.option("--format", "form", type=kind, default=choices[0], help=text)


form = formats(
    "table",
    "markdown",
    "latex",
    "csv",
    "json",
    text="How to print the table; CSV and JSON hold every digit, LaTeX needs the package booktabs.",
)
"""Format of a table of estimates."""
