"""Programs of research/ and commands of the toolkit, run in this process."""

from nested_agents.studies.cli import main as command_line
from nested_agents.terminal import run_to_status
from research import atlas, claims, push_n

PROGRAMS = {"claims": claims.main, "push_n": push_n.main, "atlas": atlas.main}


def main(arguments: list[str]) -> int:
    """Run ``python -m research.NAME`` or ``nested-agents COMMAND``; return the exit status.

    Studies that published results name are trusted.
    """
    name, *rest = arguments
    if name not in PROGRAMS:
        return command_line.main([*arguments, *["--trust"] * (name == "table")])
    try:
        return run_to_status(f"research.{name}", lambda: PROGRAMS[name](rest))
    except SystemExit as error:  # by argparse
        return int(error.code or 0)
