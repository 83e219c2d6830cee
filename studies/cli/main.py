"""The command line: finds the command, runs it, and turns what went wrong into an exit status.

Statuses: 0 done, 1 a trial failed, 2 something the user can mend (one line on standard error),
130 interrupted. A command is a module in `commands` with a function `command`, whose signature and
docstring are its options and its help, and one line in `COMMANDS`.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from importlib.metadata import version
from shutil import get_terminal_size
from textwrap import wrap

from ..spec.errors import SpecError

COMMANDS: dict[str, str] = {
    "demo": "demo",
    "run": "run",
    "table": "table",
    "results": "results",
    "status": "status",
    "retry": "retry",
    "export": "export",
    "report": "report",
    "explain": "explain",
    "presets": "presets",
    "topology": "topology",
    "check": "check",
    "cost": "cost",
    "claims": "claims",
}
"""The module of every command by name, in the order of the help."""

PROGRAM = "nested-agents"
DESCRIPTION = """How learning scales in hierarchies of fuzzy reinforcement-learning agents.

To begin with: nested-agents demo

For the version: nested-agents --version"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    if arguments in (["--version"], ["-V"]):
        print(f"{PROGRAM} {version(PROGRAM)}")
        return 0
    # SVG files keep names as text, in any script; PNG files have boxes for what the font lacks.
    warnings.filterwarnings("ignore", message=r"Glyph .* missing from font")
    try:
        status = _call(arguments)
        sys.stdout.flush()
        return status
    except SpecError as error:
        return _complain(str(error))
    except BrokenPipeError:
        # The reader went away, as `head` does; Python would complain again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        return _complain(f"{where}{error.strerror or error}")
    except KeyboardInterrupt:
        return 130


def _call(arguments: Sequence[str]) -> int:
    import tyro

    from .arguments import registry

    commands: dict[str, Callable[..., int]] = {
        name: import_module(f".commands.{module}", __package__).command
        for name, module in COMMANDS.items()
    }
    complaint, page = io.StringIO(), _Page()
    try:
        with contextlib.redirect_stderr(complaint), contextlib.redirect_stdout(page):
            chosen = tyro.extras.subcommand_cli_from_dict(
                {name: _deferred(command) for name, command in commands.items()},
                prog=PROGRAM,
                description=DESCRIPTION,
                args=list(_separate_sets(arguments)) or ["--help"],
                registry=registry(),
            )
    except SystemExit as exit_:
        if exit_.code in (0, None):
            print(_folded(page.getvalue()), end="")
            return 0
        raise SpecError(_one_line(complaint.getvalue())) from None
    return int(chosen())


class _Page(io.StringIO):
    """What the parser prints, kept; styled as for the output that it is meant for."""

    def __init__(self) -> None:
        super().__init__()
        self._output = sys.stdout

    @property
    def encoding(self) -> str:  # type: ignore[override]
        return self._output.encoding

    def isatty(self) -> bool:
        return self._output.isatty()


def _folded(page: str) -> str:
    """Return a help page with usage and description folded as its boxes are; else as it is."""
    if not _plain(page).startswith("usage:"):
        return page
    usage, *rest = page.split("\n")
    usage = usage.replace("{" + ",".join(COMMANDS) + "}", "COMMAND")
    width = get_terminal_size().columns
    lines = []
    for line in (usage, *rest):
        lines += [line] if len(_plain(line)) <= width else wrap(line, width)
    return "\n".join(lines)


def _plain(text: str) -> str:
    """Return a text without colours."""
    return re.sub(r"\x1b\[[0-9;]*m", "", text)


def _deferred(command: Callable[..., int]) -> Callable[..., Callable[[], int]]:
    """Return a function of the same signature and help that only notes its arguments.

    The command then runs outside the capture of what the parser complains of.
    """
    from functools import partial, wraps

    @wraps(command)
    def note(*args: object, **kwargs: object) -> Callable[[], int]:
        return partial(command, *args, **kwargs)

    return note


def _separate_sets(arguments: Sequence[str]) -> Iterator[str]:
    """Let one ``--set`` take several assignments: each gets a ``--set`` of its own."""
    seen = 0
    for argument in arguments:
        if argument == "--set":
            seen = 1
        elif seen == 2 and "=" in argument and not argument.startswith("-"):
            yield "--set"
        else:
            seen = 2 if seen == 1 else 0
        yield argument


def _one_line(box: str) -> str:
    """Reduce the parser's box to one line: what is wrong, and what was perhaps meant."""
    lines = [line.strip("│╭╮╰╯ ") for line in _plain(box).splitlines()][1:]
    said = " ".join("; " if line and not line.strip("─-") else line for line in lines)
    said = re.split(r"[; ]*(For full helptext|Argument helptext|in nested-agents)", said)[0]
    said = re.sub(r"^[; ]*Error parsing \[?(\S+?)\]?: (.*): must ", r"\1 \2: must ", said)
    return re.sub(r" *; *(; *)*", "; ", " ".join(said.split())).strip("; ") or (
        "the arguments are not understood; see --help"
    )


def _complain(message: str) -> int:
    print(f"{PROGRAM}: error: {' '.join(message.split())}", file=sys.stderr)
    return 2
