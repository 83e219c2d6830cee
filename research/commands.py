"""Commands on published results: claims of a paper, and entries of the benchmark push-n."""

import json
from pathlib import Path
from typing import get_args

import click

from ..core.plugins.words import closest, command_line
from ..studies import catalogue
from ..studies.api.running import run as run_study
from ..studies.api.study import StudyResults
from ..studies.cli import options
from ..studies.cli.display import (
    Form,
    in_form,
    print_data,
    print_lines,
    print_table,
    print_text,
    print_wrapped,
)
from ..studies.errors import SpecError
from ..studies.presentation.progress import Terminal, say
from ..studies.presentation.tables import tabulate
from ..studies.results import published
from ..studies.store import durable
from . import QUICK, ROWS, SPECS
from .claims import OWN, PAPERS, Finding, Format, judge, print_claims, studies_of
from .push_n import SIZES, Entry, Given, committed_entries, load_entry, run_spec, table_of

NETWORKS = "networks"
"""Of what claims are decided by the rows of docs/peers.md."""
CATALOGUE = Path(catalogue.__file__).parent
"""Where the specs of the installed studies are, one folder for each."""


def spec_of_study(study: str) -> Path:
    """Return the spec of a study, of this folder or of the catalog."""
    name = study.replace("-", "_")
    own = SPECS / f"{study}.toml"
    return own if own.exists() else CATALOGUE / name / f"{name}.toml"


@click.command()
@options.out(
    "Run the studies that the claims rest on, each in a directory of its own below this one; "
    "what has been run before is read."
)
@options.flag(
    "--quick", "Small versions of the studies, of 5 or 6 seeds: minutes, and wide intervals."
)
@click.option(
    "--of",
    default=OWN,
    metavar="PAPER",
    help="Whose claims: this paper's, those of action-dependency-graphs (arXiv 2506.00797), or "
    "networks: whether edges help them at budgets of up to a million decisions.",
)
@options.jobs
@options.formats("table", "json", "markdown")
def claims(out: Path | None, quick: bool, of: str, jobs: int | None, form: Format) -> int:
    """Print one table: each claim of a paper, its measure, the result, the verdict.

    Without --out the table is made from the results that are committed in the repository.
    """
    if of not in (*PAPERS, NETWORKS):
        raise SpecError(f"--of = {of!r}: {closest(of, (*PAPERS, NETWORKS))}")
    if out is None and (quick or jobs is not None):
        raise SpecError(
            f"{'--quick' if quick else '--jobs'}: needs --out, where to run the studies"
        )
    if of == NETWORKS:
        print_claims(_of_networks(out, quick=quick, jobs=jobs), form)
        return 0
    if out is not None:
        results = _run(out, of, quick=quick, jobs=jobs)
    else:
        results = published.read(ROWS, studies_of(of))
    for study, of_study in results.items():
        if of_study.note:
            say(f"{study}: {of_study.note}")
    print_claims(judge({study: p.results for study, p in results.items()}, of), form)
    return 0


def _run(out: Path, of: str, *, quick: bool, jobs: int | None) -> dict[str, published.Published]:
    """Run the studies of the claims, or what is left of them; return the results by study."""
    results = {}
    for study in studies_of(of):
        name = study.replace("-", "_")
        path = QUICK / f"{name}.toml" if quick else spec_of_study(study)
        ran = _run_one(path, out / study, jobs)
        results[study] = published.loads(published.dumps(ran.outline, ran.results))
    return results


def _run_one(spec: Path, folder: Path, jobs: int | None) -> StudyResults:
    """Run a study, or what is left of it, of which no trial may fail."""
    ran = run_study(spec, folder, jobs=jobs, observer=Terminal())
    if ran.failed:
        raise SpecError(
            f"{folder}: {len(ran.failed)} trials failed: {command_line('status', folder)}"
        )
    return ran


def _of_networks(out: Path | None, *, quick: bool, jobs: int | None) -> list[Finding]:
    """Decide whether edges help networks, by committed rows or by studies run for it."""
    from .experience import TASKS, edge, edges, read, rows_of, spec_of

    if out is None:
        return [worth.finding for worth in edges()]
    if quick:
        raise SpecError(f"--quick: --of {NETWORKS} has no small versions")
    findings = []
    for name, task in TASKS.items():
        ran = _run_one(spec_of(name), out / f"{name}-experience", jobs)
        rows = rows_of(ran.results, task.shown[-1], read(name).columns[-1])
        findings.append(edge(name, rows).finding)
    return findings


@click.command()
@options.out("Run the tasks of the atlas below this directory, or what is left of them.")
@click.option(
    "--task",
    "tasks",
    multiple=True,
    metavar="NAME...",
    help="Those of the tasks that are run; published: rows that have been published already.",
)
@click.option("--rows", type=options.PATH, metavar="DIR", help="Rows; by default the committed.")
@click.option("--figures", type=options.PATH, metavar="DIR", help="Draw the figures into it.")
@options.jobs
def atlas(
    out: Path | None,
    tasks: tuple[str, ...],
    rows: Path | None,
    figures: Path | None,
    jobs: int | None,
) -> int:
    """Print what teams of few agents tell of larger ones, over tasks and hierarchies.

    Laws are fitted to teams of at most 16 agents, and of at most 8, and larger ones of the same
    rows are predicted. Without --out the rows are the committed ones.
    """
    from .atlas import ALREADY, COMMITTED, SEEN, UNSEEN, read_rows, run_tasks
    from .atlas_choices import choices, shares_right
    from .atlas_faults import fault_costs, thresholds
    from .atlas_predictions import SMALL, checks, coverage

    if out is None and (tasks or jobs is not None):
        raise SpecError(f"{'--task' if tasks else '--jobs'}: needs --out, where to run the tasks")
    folder = run_tasks(out, jobs, tasks) if out is not None else rows or COMMITTED
    frame = read_rows(folder)
    print_text(f"{len(frame):,} trials of {frame.groupby(TEAM_AND_SIZE).ngroups} conditions")
    seen = frame["source"].isin(SEEN)
    groups = {
        "Tasks looked at after the rule": (frame[~seen], SMALL),
        "Signals, on which it was chosen": (frame[seen & (frame["source"] != ALREADY)], SMALL),
        "Published studies, on which it was chosen": (frame[frame["source"] == ALREADY], SMALL),
        "Published studies, of half the size": (frame[frame["source"] == ALREADY], SMALL // 2),
    }
    for title, (own, most) in groups.items():
        if own.empty:
            continue
        print_text("", f"{title}: teams larger than {most} in 90% intervals")
        print_lines(coverage(checks(own, most)))
    of_tasks = frame[frame["source"] != ALREADY]
    chosen = choices(of_tasks)
    for title, is_unseen in {"not seen before": True, "seen": False}.items():
        cases = [choice for choice in chosen if (choice.case[0] in UNSEEN) == is_unseen]
        print_text("", f"Best hierarchy of the largest teams, tasks {title}")
        print_lines([*shares_right(cases), *map(str, cases)])
    print_text("", "Best hierarchy of the largest teams, all tasks")
    print_lines(shares_right(chosen))
    costs = fault_costs(of_tasks)
    if costs:
        print_text("", "What faults cost")
        print_lines([*map(str, costs), *thresholds(costs)])
    if figures is not None:
        from ..studies.presentation.figures import apply_style, write
        from .atlas_figures import FIGURES

        before = frame["source"] == ALREADY  # a task of both has two sets of seeds
        frame["task"] = frame["task"].mask(before, frame["task"] + ", published")
        figures.mkdir(parents=True, exist_ok=True)
        for name, draw in FIGURES.items():
            with apply_style():
                write(draw(frame), figures / f"{name}.png")
    return 0


TEAM_AND_SIZE = ["source", "task", "hierarchy", "learner", "fault", "size"]


entries = click.argument("entries", type=options.PATH, metavar="ENTRY.json...", nargs=-1)
sizes = [str(robots) for robots in SIZES]


@click.group(no_args_is_help=False)
def benchmark() -> None:
    """Teams of 2 to 64 robots in fixed worlds: enter a learner, compare it with others."""


@benchmark.command()
@click.argument("spec", type=options.PATH, metavar="SPEC.toml")
@options.out("Where to keep the study.", required=True)
@click.option(
    "--robots",
    type=click.Choice(sizes),
    multiple=True,
    default=sizes[:3],
    help="How many.",
)
@click.option("--seeds", type=click.IntRange(5), default=5, metavar="N", help="From seed 0 on.")
@click.option("--name", metavar="TEXT", required=True, help="What tables call the entry.")
@click.option("--about", metavar="TEXT", required=True, help="How it learns, in a line.")
@click.option(
    "--given",
    type=click.Choice(get_args(Given)),
    default="predictor",
    help="What it is given of the world.",
)
@options.jobs
def run(
    spec: Path,
    out: Path,
    robots: tuple[str, ...],
    seeds: int,
    name: str,
    about: str,
    given: Given,
    jobs: int | None,
) -> int:
    """Train and evaluate a spec by the rules.

    It has one condition. Its entry is DIR/entry.json; the same command again goes on with what is
    missing.
    """
    teams = run_spec(spec, out, list(dict.fromkeys(map(int, robots))), seeds, jobs)
    entry = Entry(name=name, about=about, given=given, teams=teams)
    text = entry.model_dump_json(indent=1)
    durable.write(out / "entry.json", f"{text}\n".encode())
    print_text(out / "entry.json")
    return 0


@benchmark.command()
@entries
@click.option("--schema", is_flag=True, help="Print the JSON schema of entries.")
def check(entries: tuple[Path, ...], schema: bool) -> int:
    """Check the rules that a file can show."""
    if schema:
        print_text(json.dumps(Entry.model_json_schema(), indent=1))
    for path in entries:
        entry = load_entry(path)
        teams = ", ".join(f"{t.robots} robots x {len(t.success)} seeds" for t in entry.teams)
        print_text(f"passed  {path}: {entry.name}, {teams}")
    return 0


@benchmark.command()
@entries
@click.option(
    "--measure",
    type=click.Choice(["success", "decisions"]),
    default="success",
    help="In evaluation, or of training.",
)
@options.form
def table(entries: tuple[Path, ...], measure: str, form: Form) -> int:
    """Print entries by number of robots: the committed ones, then others."""
    compared = [*committed_entries(), *map(load_entry, entries)]
    estimates = tabulate(table_of(compared, measure))
    if form != "table":
        print_data(in_form(estimates, form))
        return 0
    print_table(estimates)
    print_text("")
    for entry in compared:
        print_wrapped(f"{entry.name}: {entry.about}; is given {entry.given}")
    return 0
