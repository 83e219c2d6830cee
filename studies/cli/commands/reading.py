"""Commands that read a study, or several: what it measured, how far it is, what was learned."""

import io
from pathlib import Path
from typing import Literal

import click

from ....core.shell import command_line
from ...api.status import failures, progress
from ...errors import SpecError
from ...presentation.progress import say
from ...spec.outline import StudyOutline, sources_of
from ...store import durable
from ...store.store import Store
from .. import options
from ..display import (
    Form,
    in_form,
    print_data,
    print_lines,
    print_study,
    print_table,
    print_text,
    save_plot,
)
from ..loading import (
    load_results,
    open_study,
    read_results,
    say_remarks,
    trust_files,
    untrusted,
)


@click.command()
@options.directory
def status(directory: Path) -> int:
    """Show progress, failures and remaining time.

    DIR is the folder of the study. Reading it does not disturb a run.
    """
    with Store.open(directory) as store:
        print_lines(progress(store).lines())
        failed = store.failed()
    for text in failures(failed):
        print_text(f"\n{text}")
    if failed:
        print_text(f"\nto run them again: {command_line('retry', directory)}")
    return 1 if failed else 0


@click.command()
@options.sources
@options.as_study
@options.where
@click.option(
    "--columns",
    multiple=True,
    metavar="TITLE...",
    help="Headings of the columns to print, in this order; by default all.",
)
@options.form
@options.trust
def table(
    sources: tuple[Path, ...],
    study: str | None,
    where: str | None,
    columns: tuple[str, ...],
    form: Form,
    trust: bool,
) -> int:
    """Print conditions against estimates with their 95% intervals, as at the end of a run.

    DIR is the folder of a study. Several studies are shown together, in the form of the first one.
    FILE.json is a file of results of this tool or of marl-eval.
    """
    results = load_results(sources, study=study, where=where, trust=trust)
    if form == "table":
        print_study(results, columns)
    else:
        print_data(in_form(results.table(columns), form))
    return 0


@click.command()
@options.sources
@click.option(
    "--by",
    metavar="KEY",
    help="Compare conditions that differ only in this swept key, such as topology; directory "
    "compares studies. By default (condition) all conditions are compared with the first.",
)
@options.measure
@options.phase
@click.option(
    "--reference", metavar="LABEL", help="Condition to compare with; by default the first."
)
@options.flag(
    "--statistics",
    "Add the interquartile mean and the probability of improvement over all tasks. The conditions "
    "that --by compares with each other form a task.",
)
@options.plot
@options.where
@options.columns
@options.better
@options.out("Write a page with the results, the table and a figure.", "FILE.html")
@options.form
@options.trust
def compare(
    sources: tuple[Path, ...],
    columns: tuple[str, ...],
    better: Literal["higher", "lower"] | None,
    out: Path | None,
    statistics: bool,
    plot: Path | None,
    where: str | None,
    form: Form,
    trust: bool,
    **compared: options.Checked,
) -> int:
    """Compare conditions by seed: differences, intervals, p-values, effect sizes and power.

    DIR is the folder of a study, FILE.json a file of results of this tool or of marl-eval.
    Conditions are compared on the seeds that both have, in the same environments.

    FILE may also be a table of scores of another tool, .csv, .jsonl or .parquet, with one score a
    row. A score belongs to a condition and to a run (seed), an item, or both.
    """
    loaded = read_results(sources, where=where, trust=trust, columns=columns, better=better)
    comparison = loaded.compare(**compared)
    if plot is not None:
        save_plot(comparison.figure, plot)
    if out is not None:
        comparison.report(out, ", ".join(map(str, sources)))
    if form != "table":
        say_remarks(loaded)
        print_data(in_form(comparison.table, form))
        if statistics:
            print_data(f"\n{in_form(comparison.aggregated[0], form)}")
        return 0
    print_table(comparison.table)
    print_text("", *comparison.notes)
    if statistics:
        print_text("")
        print_table(*comparison.aggregated)
    return 0


@click.command()
@options.directory
@options.formats(
    "table",
    "csv",
    "json",
    text="How to print the rows; CSV and JSON hold every digit, and a column for every swept key.",
)
@click.option(
    "--phase",
    metavar="PHASE",
    default="training",
    help="Episodes to print: training, evaluation (greedy, after training), training:NAME (a "
    "stage before it) or evaluation:NAME (another evaluation).",
)
def results(directory: Path, form: Literal["table", "csv", "json"], phase: str) -> int:
    """Print one row per trial and episode, as a table, CSV or JSON.

    DIR is the folder of the study.
    """
    from ....core.plugins.words import closest
    from ...presentation.tables import write_rows
    from ...results.results import read

    with open_study(directory) as store:
        store.verify()
        measured = read(store)
    if measured.phases and phase not in measured.phases:
        raise SpecError(f"--phase {phase!r}: {closest(phase, measured.phases)}")
    episodes = measured.episodes
    rows = io.StringIO()
    write_rows(episodes[episodes["phase"] == phase], measured.measures, form, rows)
    print_data(rows.getvalue())
    return 0


Files = Literal["csv", "parquet", "json", "marl-eval"]


@click.command()
@options.directory
@options.formats(
    "csv",
    "parquet",
    "json",
    "marl-eval",
    text="Format of the files; json leaves out distances and returns.",
)
@options.out("Folder for the files; by default the subfolder export of DIR.", "PATH")
@click.option("--overwrite", is_flag=True, help="Replace existing files.")
@options.trust
def export(directory: Path, form: Files, out: Path | None, overwrite: bool, trust: bool) -> int:
    """Write one file with a row for every episode, and one with a row for every trial.

    DIR is the folder of the study. JSON is one small file of spec, seeds and rounded measures, to
    publish with a paper; the command table reads it. For LaTeX use table --format latex.
    """
    folder = directory / "export" if out is None else out
    if trust:
        trust_files(directory)
    with open_study(directory) as store:
        store.verify()
        contents = _contents(store, form, folder)
    paths = {folder / name: content for name, content in contents.items()}
    from ...results.headers import extends  # pandas takes its time

    there = [path for path in paths if path.exists()]
    # Of an export that was killed the first file is left, and is what would be written.
    is_rest = len(there) < len(paths) and all(
        path.is_file() and extends(path, paths[path]) for path in there
    )
    if there and not (overwrite or is_rest):
        raise SpecError(f"{there[0]}: exists; --overwrite replaces it, --out writes elsewhere")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SpecError(f"--out {folder}: {error.strerror or error}") from None
    for path, content in paths.items():
        durable.write(path, content)
    print_text(*paths)
    return 0


def _contents(store: Store, form: Files, folder: Path) -> dict[str, bytes]:
    """Return the content of each file by its name, see `results.published`."""
    from ...catalogue.study import select_published
    from ...presentation.tables import in_csv, in_parquet
    from ...results import headers, marl_eval, published, results_file
    from ...results.results import read
    from ...results.scores import PHASES

    results = read(store)
    outline = StudyOutline.kept(store)
    if form == "json":
        with sources_of(store).active():
            kept = select_published(outline.study, results)
        return {"results.json": published.dumps(outline, kept).encode()}
    frames = {"episodes": results.episodes, "trials": results.trials}
    if form == "marl-eval":
        if others := [name for name in results.phases if name not in PHASES]:
            allowed = " and ".join(PHASES)
            say(f"marl-eval: holds {allowed} only; left out: {', '.join(others)}")
        kinds = {c: own["scenario"]["kind"] for c, own in store.settings().items()}
        files = {"marl-eval.json": marl_eval.dumps(results, kinds, outline.study).encode()}
    elif form == "csv":
        files = {f"{name}.csv": in_csv(frame).encode() for name, frame in frames.items()}
    else:
        files = {f"{name}.parquet": in_parquet(frame) for name, frame in frames.items()}
    return files | {results_file.HEADER: headers.describe(outline, results, files, folder)}


@click.command()
@options.directory
@options.out("Where to write; by default report.html in the study's directory.", "FILE.html")
@options.trust
def report(directory: Path, out: Path | None, trust: bool) -> int:
    """Write a study as one self-contained HTML file: verdict, table, figures, replays, spec.

    DIR is the folder of the study, which may be unfinished.
    """
    path = load_results([directory], trust=trust).report(out)
    if left_out := untrusted(directory):
        say(
            f"{' '.join(left_out)} is not trusted: hierarchies and films that it makes are left "
            "out; --trust shows them"
        )
    print_text(f"{path}: {path.stat().st_size / 1e6:.1f} MB, nothing outside it is needed")
    return 0


@click.command()
@options.directory
@click.option(
    "--condition", metavar="LABEL", help="Label of the condition; by default the first one."
)
@click.option("--seed", type=int, metavar="SEED", help="The seed; by default the first one.")
@click.option("--full", is_flag=True, help="Print all rules and tables, not only the summary.")
@options.trust
def explain(directory: Path, full: bool, trust: bool, **trial: options.Checked) -> int:
    """Explain a trained team: its rules in words and its self-model.

    DIR is the folder of the study. The text with all rules and the figures are written to its
    folder explain. Unless the study keeps its teams (keep_teams = true in its spec), the training
    is repeated, which takes seconds, and must give the same episodes.
    """
    from ...api.explaining import explain_team
    from ...presentation.figures import save

    if trust:
        trust_files(directory)
    with open_study(directory):
        explained = explain_team(directory, **trial)
    explained.folder.mkdir(parents=True, exist_ok=True)
    written = explained.folder / "explanation.txt"
    durable.write(written, explained.text.encode())
    figures = save(explained.figures, explained.folder)
    print_text(explained.text if full else str(explained))
    print_text(written, *figures)
    return 0
