"""``nested-agents benchmark``: enter a learner in the benchmark push-n, and compare the entries."""

from pathlib import Path
from typing import Any

import click

from .. import options

entries = click.argument("entries", type=options.PATH, metavar="ENTRY.json...", nargs=-1)
sizes = click.Choice(["2", "4", "8", "16", "32", "64"])
given = click.Choice(["nothing", "predictor", "predictor and reward"])
measures = click.Choice(["success", "decisions"])


@click.group(no_args_is_help=False)
def benchmark() -> None:
    """Teams of 2 to 64 robots in fixed worlds: enter a learner, compare it with others."""


@benchmark.command()
@click.argument("spec", type=options.PATH, metavar="SPEC.toml")
@options.out("Where to keep the study.", required=True)
@click.option("--robots", type=sizes, multiple=True, default=["2", "4", "8"], help="How many.")
@click.option("--seeds", type=click.IntRange(5), default=5, metavar="N", help="From seed 0 on.")
@click.option("--name", metavar="TEXT", required=True, help="What tables call the entry.")
@click.option("--about", metavar="TEXT", required=True, help="How it learns, in a line.")
@click.option("--given", type=given, default="predictor", help="What it is given of the world.")
@options.jobs
def run(
    spec: Path, out: Path, robots: tuple[str, ...], seeds: int, jobs: int | None, **entry: Any
) -> int:
    """Train and evaluate a spec by the rules.

    It has one condition. Its entry is DIR/entry.json; the same command again goes on with what is
    missing.
    """
    from ...benchmark.push_n import Entry, run_spec
    from ...store import durable

    teams = run_spec(spec, out, list(dict.fromkeys(map(int, robots))), seeds, jobs)
    text = Entry(teams=teams, **entry).model_dump_json(indent=1)
    durable.write(out / "entry.json", f"{text}\n".encode())
    print(out / "entry.json")
    return 0


@benchmark.command()
@entries
@click.option("--schema", is_flag=True, help="Print the JSON schema of entries.")
def check(entries: tuple[Path, ...], schema: bool) -> int:
    """Check the rules that a file can show."""
    import json

    from ...benchmark.push_n import Entry, load_entry

    if schema:
        print(json.dumps(Entry.model_json_schema(), indent=1))
    for path in entries:
        entry = load_entry(path)
        teams = ", ".join(f"{t.robots} robots x {len(t.success)} seeds" for t in entry.teams)
        print(f"passed  {path}: {entry.name}, {teams}")
    return 0


@benchmark.command()
@entries
@click.option("--measure", type=measures, default="success", help="In evaluation, or of training.")
@options.form
def table(entries: tuple[Path, ...], measure: str, form: str) -> int:
    """Print entries by number of robots: the committed ones, then others."""
    from ...benchmark.push_n import committed_entries, load_entry, table_of
    from ...presentation.tables import tabulate
    from ..display import print_table, print_wrapped

    shown = [*committed_entries(), *map(load_entry, entries)]
    printed = tabulate(table_of(shown, measure))
    if form != "table":
        print(getattr(printed, form), end="")
        return 0
    print_table(printed)
    print()
    for entry in shown:
        print_wrapped(f"{entry.name}: {entry.about}; is given {entry.given}")
    return 0
