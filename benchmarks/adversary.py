"""Attack studies and inputs, and count what survives: ``python -m benchmarks.adversary``.

Campaigns, each drawn from a seed:

- *kills*: the command that runs a study is killed (SIGKILL) at a random moment, the same command
  continues, and what it ends with must be equal byte by byte. Trials run in the process of the
  command and take no time, so that a hundred kills do not take an hour; `benchmarks.crashes` kills
  real workers;
- *kills of others*: explain, export, report, retry and tune are killed. What they have written is
  whole or not there; the study is as it was, or the same command goes on, with the same end;
- *edits* and *published files*, see `benchmarks.edits`: what somebody else has made of results;
- *environments*, see `benchmarks.environments`: refused, or perceived as they are;
- *circumstances*, see `benchmarks.circumstances`: clocks, disks, memory and signals;
- *flips*: one bit of one file of a finished study is flipped. Commands that read, and Python that
  loads a trained team, must give what they gave before, or name the file; a run must end with the
  rows and recordings of the sound study. `explain`, which draws, reads every tenth, and a run every
  fourth. A file may also be cut short or be a folder. With ``--every-byte`` every byte of a small
  database is tried;
- *hostile input*: specs, topologies in files and in Python, polygons, mutated or absurd. Each is
  accepted or refused in one line, within seconds;
- *scenarios* that misbehave, see `benchmarks.misbehaving`: they are told, and others go on.

Silence (other output, nothing said) and tracebacks are failures.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from nested_agents.studies.store import durable

from . import circumstances, edits, environments, flips, hostile, kills, misbehaving

Campaign = Callable[[int, random.Random, Path], Counter[str]]
"""Attacks so many times, drawn from a generator, in a folder; returns what happened."""
ATTEMPTS = (
    "kills", "edits", "published files", "environments", "commands", "flips", "files", "reads",
    "runs", "studies", "specs", "topologies", "polygons", "functions", "scenarios",
)  # fmt: skip
FINE = (
    "equal", "told", "run: equal", "run: refused", "studies: equal",
    "kills with trials kept, and others left", "accepted", "refused in one line", ": told",
    "right", "done", "not reached",
)  # fmt: skip


def _failures(tally: Counter[str]) -> int:
    return sum(n for name, n in tally.items() if name not in ATTEMPTS and not name.endswith(FINE))


def main() -> int:
    """Attack, print the table; 1 if anything failed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.adversary", description=__doc__)
    parser.add_argument("--kills", type=int, default=100, metavar="N", help="0: none")
    parser.add_argument("--flips", type=int, default=2000, metavar="N", help="0: none")
    parser.add_argument("--obstacles", type=int, default=100, metavar="N", help="0: none")
    parser.add_argument("--hostile", type=int, default=800, metavar="N", help="0: none")
    parser.add_argument("--others", type=int, default=60, metavar="N", help="kills; 0: none")
    parser.add_argument("--scenarios", type=int, default=100, metavar="N", help="0: none")
    parser.add_argument("--every-byte", action="store_true", help="takes a quarter of an hour")
    parser.add_argument("--seed", type=int, default=20)
    parser.add_argument("--edits", type=int, default=300, metavar="N", help="by SQL; 0: none")
    parser.add_argument("--published", type=int, default=100, metavar="N", help="0: none")
    parser.add_argument("--environments", type=int, default=200, metavar="N", help="0: none")
    parser.add_argument("--circumstances", action="store_true", help="takes some minutes")
    options = parser.parse_args()
    durable.os.fsync = lambda _: None  # type: ignore[attr-defined]  # no power fails here
    campaigns: dict[str, tuple[int, Campaign]] = {
        "kill -9": (options.kills, kills.kills),
        "kill -9 of others that write": (options.others, kills.kills_of_others),
        "flipped bits": (options.flips, flips.flips),
        "files cut short, folders in their place": (
            options.obstacles, flips.obstacles
        ),
        "edits by SQL": (options.edits, edits.sql),
        "published files": (options.published, edits.published),
        "hostile input": (options.hostile, hostile.hostile),
        "scenarios that misbehave": (options.scenarios, misbehaving.scenarios),
        "environments": (
            options.environments, lambda number, rng, _: environments.attack(number, rng)
        ),
        "circumstances": (
            options.circumstances, lambda _, rng, folder: circumstances.attack(rng, folder)
        ),
        "a bit of every byte of the database": (
            options.every_byte, lambda _, rng, folder: flips.every_byte(rng, folder)
        ),
    }  # fmt: skip
    begin, failed = time.process_time(), 0
    print("| attack | attempts | what became of them | failures |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        for title, (number, campaign) in campaigns.items():
            if not number:
                continue
            folder = Path(name) / title.replace(" ", "-")
            folder.mkdir()
            tally = campaign(number, random.Random(options.seed), folder)
            failed += _failures(tally)
            tried = ", ".join(f"{tally[what]} {what}" for what in ATTEMPTS if tally[what])
            became = ", ".join(
                f"{what} {n}" for what, n in sorted(tally.items()) if what not in ATTEMPTS
            )
            print(f"| {title} | {tried} | {became} | {_failures(tally)} |", flush=True)
    print(f"\nseed {options.seed}, {time.process_time() - begin:.0f} s of processor time, ", end="")
    print(f"{failed} failures")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
