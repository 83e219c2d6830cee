"""Commands as a user types them in a shell."""

import os
import shlex
from pathlib import Path

DEV = "NESTED_AGENTS_DEV"
"""Environment variable by which ``./dev`` of a checkout passes on how it was called."""


def command_line(*arguments: object, program: str = "nested-agents") -> str:
    """Return a command as it can be typed where this program was started.

    In a checkout, the programs of its environment are started by ``./dev exec``. A path that
    begins with a dash is written such that it is no option.

    Examples
    --------
    >>> command_line("report", "out/my study")
    "nested-agents report 'out/my study'"
    >>> command_line("report", Path("-out"))
    'nested-agents report ./-out'
    >>> command_line("install", "pyarrow", program="pip")
    'pip install pyarrow'
    """
    dev = os.environ.get(DEV)
    prefix = [dev, "exec"] if dev else []
    written = [
        f"./{argument}" if isinstance(argument, Path) and str(argument)[0] == "-" else str(argument)
        for argument in arguments
    ]
    return shlex.join([*prefix, program, *written])
