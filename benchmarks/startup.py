"""How soon commands answer: ``python -m benchmarks.startup``.

Every command is a fresh interpreter, in turns with ``python -c "import numpy, pydantic"``, to which
its time is a ratio. It is processor time, user and system, the least of the rounds, since others
on the machine only add to it; a first round, in which Python caches its bytecode in a folder of our
own, is not counted. The study that is read has two conditions of two trials each.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from resource import struct_rusage
from typing import Any

from rich.console import Console

import nested_agents as na

from .tables import Row, show

BARE = ["-c", "import numpy, pydantic"]
STUDY = "STUDY"
COMMANDS = (
    ["--version"], ["--help"], ["presets"], ["results", STUDY], ["topology", "list"],
    ["topology", "show", "chain"], ["cost"], ["table", STUDY], ["status", STUDY],
)  # fmt: skip
COLUMNS = {"command": "command", "s": "processor\n\\[s]", "ratio": "to bare\nimports"}


def measure(study: Path, rounds: int, bytecode: Path) -> list[Row]:
    """Return what bare imports and every command take; Python keeps its bytecode in a folder."""
    caching = {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": str(bytecode)}
    lines = {"import numpy, pydantic": BARE}
    for command in COMMANDS:
        words = [str(study) if word == STUDY else word for word in command]
        lines[" ".join(command)] = ["-m", "nested_agents", *words]
    least = dict.fromkeys(lines, float("inf"))
    for round_ in range(rounds + 1):
        for name, line in lines.items():
            used = used_by(line, env=os.environ | caching)
            taken = used.ru_utime + used.ru_stime
            least[name] = min(least[name], taken) if round_ else least[name]
    bare = least["import numpy, pydantic"]
    return [{"command": n, "s": taken, "ratio": taken / bare} for n, taken in least.items()]


def used_by(line: list[str], **options: Any) -> struct_rusage:
    """Return what Python with arguments used, which must succeed; options are those of `Popen`."""
    process = subprocess.Popen([sys.executable, *line], stdout=subprocess.DEVNULL, **options)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, line)
    return used


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.startup", description=__doc__)
    parser.add_argument("--rounds", type=int, default=7, metavar="N")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write everything here")
    options = parser.parse_args()
    spec = na.Spec(
        study="learning-curve", seeds=2, episodes=2, steps=8, evaluation=1,
        scenario={"kind": "line-up"}, sweep={"preset": ["default", "frozen"]},
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        na.run(spec, Path(folder) / "study")
        rows = measure(Path(folder) / "study", options.rounds, Path(folder) / "bytecode")
    show(Console(width=80), "Processor time until a command has answered", COLUMNS, rows)
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
