"""The command line: finds the command, runs it, and turns what went wrong into an exit status.

Statuses: 0 success, 1 a trial failed, 2 a mistake of the user (one line on standard error), 130
interrupted, 141 closed output. A command is one line in `COMMANDS` and a
click command of that name in a module of `commands`.
"""

import os
import sys
import warnings
from collections.abc import Callable, Sequence
from importlib import import_module
from io import TextIOWrapper

import click

from ...core.plugins.printing import printable
from ...core.plugins.words import closest
from ...core.shell import command_line
from ..errors import SpecError
from .options import complete

PROGRAM = "nested-agents"
STRICT = ("strict", "surrogateescape")
"""Error handlers of streams that raise for characters that the terminal lacks."""

MIN_ADDRESS_SPACE = 10**9
"""Minimum address space [bytes]; with less, libraries of linear algebra crash or hang."""

GROUPS: dict[str, dict[str, tuple[str, str]]] = {
    "Run": {
        "demo": (".commands.running", "Train two robots to push a box: table, figures, report."),
        "plan": (".commands.running", "Estimate the time of a study and its statistical power."),
        "run": (".commands.running", "Run the study of a spec, or resume it."),
        "status": (".commands.reading", "Show progress, failures and remaining time."),
        "retry": (".commands.running", "Run the failed trials of a study again."),
        "tune": (".commands.running", "Search for better settings on separate seeds."),
    },
    "Analyze": {
        "table": (".commands.reading", "Print the results of a study, one row per condition."),
        "compare": (".commands.reading", "Compare conditions of one or more studies by seed."),
        "fit": (".commands.fitting", "Fit scaling laws over team sizes, and predict."),
        "scalability": (".commands.scalability", "Show which hierarchy scales, and its cost."),
        "resilience": (".commands.resilience", "Measure what losses of agents cost trained teams."),
        "results": (".commands.reading", "Print the measures of every episode."),
        "report": (".commands.reading", "Write the study as one self-contained HTML file."),
        "explain": (".commands.reading", "Explain a trained team in words and figures."),
        "export": (".commands.reading", "Write results as files for other programs."),
    },
    "Describe": {
        "presets": (".commands.describing", "List the presets, or print one in full."),
        "keys": (".commands.describing", "List the tables of a spec, or the keys of one table."),
        "schema": (".commands.describing", "Write the JSON schema of specs, for editors."),
        "topology": (".commands.describing", "List the topologies, or show one of them."),
        "draw": (".commands.drawing", "Draw environments before anything runs."),
        "check": (".commands.checking", "Check that scenarios satisfy their interface."),
        "cost": (".commands.describing", "Print the cost of hierarchies, by formula or measured."),
        "profile": (".commands.describing", "Show the time of a decision, part by part."),
    },
}
"""Groups of commands as `--help` shows them: the module of each command, imported on first use,
and its summary."""
COMMANDS = {name: entry for group in GROUPS.values() for name, entry in group.items()}


def load_command(name: str) -> click.Command:
    """Return one of `COMMANDS`."""
    command = vars(import_module(COMMANDS[name][0], __package__))[name]
    assert isinstance(command, click.Command)
    return command


class _Commands(click.Group):
    """The commands, each of which is imported when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        return load_command(cmd_name) if cmd_name in COMMANDS else None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str, click.Command, list[str]]:
        _check_address_space()
        command = self.get_command(ctx, args[0])
        if command is None:
            raise SpecError(f"{args[0]}: unknown command; {closest(args[0], COMMANDS)}")
        parts = command.commands if isinstance(command, click.Group) else {}
        owner = parts.get(args[1], command) if args[1:] else command
        return args[0], command, list(complete(owner, args[1:]))

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        for title, group in GROUPS.items():
            with formatter.section(title):
                formatter.write_dl([(name, text) for name, (_, text) in group.items()])


@click.group(
    cls=_Commands,
    help="Define hierarchies of learning agents and measure how learning, failure recovery and "
    "cost scale.",
    epilog=f"To begin with: {command_line('demo')}",
    context_settings={"help_option_names": ["-h", "--help"], "show_default": True},
)
@click.version_option(
    None, "-V", "--version", package_name=PROGRAM, message=f"{PROGRAM} %(version)s"
)
def nested_agents() -> None:
    """Parse the options that all commands share."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    warnings.formatwarning = _format_warning
    warnings.filterwarnings("ignore", message=r".*joblib will operate in serial mode")  # never used
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper) and stream.errors in STRICT:
            stream.reconfigure(errors="replace")
    return run_to_status(PROGRAM, lambda: _run(arguments or ["--help"]))


def _format_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    line: str | None = None,
) -> str:
    """Return a warning in one line, without the place in the code that raises it."""
    return printable(f"{PROGRAM}: warning: {' '.join(str(message).split())}\n")


def _check_address_space() -> None:
    """Refuse a limit of the shell under which libraries crash or hang."""
    if sys.platform == "win32":
        return
    import resource

    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY and limit < MIN_ADDRESS_SPACE:
        least = MIN_ADDRESS_SPACE // 1024
        raise SpecError(f"ulimit -v {limit // 1024}: must be at least {least}, or unlimited")


def run_to_status(program: str, run: Callable[[], int]) -> int:
    """Return the exit status of a program; what goes wrong is one line on standard error."""
    try:
        status = run()
        sys.stdout.flush()
        return status
    except SpecError as error:
        message = str(error)
    except BrokenPipeError:
        # The reader went away, as `head` does; Python would complain again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
    except MemoryError as error:
        message = f"not enough memory: {error}".rstrip(": ")
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        message = f"{where}{error.strerror or error}"
    except KeyboardInterrupt as error:
        from ...core.plugins.sources import place

        if where := place(error):  # in code of a file of the user, or raised by it
            print(printable(f"{program}: interrupted{where}"), file=sys.stderr)
        return 130
    print(printable(f"{program}: error: {' '.join(message.split())}"), file=sys.stderr)
    return 2


def _run(arguments: list[str]) -> int:
    # Not `nested_agents.main`, which has its own answers to a closed pipe and to Ctrl-C.
    try:
        with nested_agents.make_context(command_line(), arguments) as context:
            return int(nested_agents.invoke(context))
    except click.exceptions.Exit as exit_:
        return exit_.exit_code
    except click.UsageError as error:
        command = error.ctx.command_path if error.ctx else command_line(arguments[0])
        raise SpecError(f"{error.format_message().rstrip('.')}; see {command} --help") from None
    except SystemExit as error:
        if isinstance(error.__context__, BrokenPipeError):  # a table of rich ends the program so
            raise error.__context__ from None
        # No command of ours does: it is code of a file of the user.
        raise SpecError(
            f"code of a file that the spec names calls sys.exit({error.code})"
        ) from None
