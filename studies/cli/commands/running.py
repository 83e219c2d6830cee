"""Commands that run trials: ``demo``, ``run``, ``tune``, ``plan`` and ``retry``."""

import os
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import click

from ....core.shell import command_line
from .. import options
from ..display import print_data, print_table, print_text, show_results


@click.command()
@options.out(
    "Folder of the study, created if it does not exist. The same command resumes the study.",
    default="nested-agents-demo",
)
@options.jobs
@click.option("--print-spec", is_flag=True, help="Print the spec that would be run, and stop.")
def demo(out: Path, jobs: int | None, print_spec: bool) -> int:
    """Train two e-Pucks to push a box: table, figures, report and replay within minutes."""
    file = Path(__file__).parents[2] / "catalogue/learning_curve/demo.toml"
    text = file.read_text(encoding="utf-8")
    if print_spec:
        print_data(text)
        return 0
    from ...api.loading import load
    from ...api.running import run
    from ...presentation.progress import Terminal
    from ...spec.spec import Spec
    from ...workers.runner import Outcome

    spec = Spec.parse(text)
    condition = spec.conditions()[0].label
    seed = spec.seeds[0]
    replays: dict[str, Future[Path]] = {}

    def draw(episode: str) -> Path:
        path = out / "replay" / f"{episode}-episode.gif"
        path.parent.mkdir(exist_ok=True)
        return load(out).replay(condition, seed, episode, path).path

    def draw_first(outcome: Outcome) -> None:
        is_first = (outcome.trial.condition, outcome.trial.seed) == (condition, seed)
        if is_first and outcome.error is None:
            replays.update((name, drawing.submit(draw, name)) for name in ("last", "first"))
            terminal.note(f"what the first trial has learned: {replays['last'].result()}")

    terminal = Terminal(draw_first)
    with ThreadPoolExecutor(1) as drawing:  # trials go on while the first episode is drawn
        study = run(spec, out, jobs=jobs, observer=terminal)
    status = show_results(study, report=study.report())
    for name in ("first", "last") if not study.failed else ():
        print_text(f"replay  {replays[name].result() if name in replays else draw(name)}")
    return status


@click.command()
@click.argument("spec", type=options.PATH, metavar="SPEC.toml")
@options.out(
    "Folder of the study, created if it does not exist. Every trial is saved as soon as it ends, "
    "so an interruption costs only the trials that are running.",
    required=True,
)
@options.running
@options.checkpoint
@options.trust
@options.figures
@options.changes
def run(
    spec: Path,
    out: Path,
    trust: bool,
    figures: tuple[str, ...],
    changes: tuple[str, ...],
    **running: options.Checked,
) -> int:
    """Run the study of a spec, or resume it: the same command runs the missing trials.

    SPEC.toml says what to run; the command demo prints an example with --print-spec.
    """
    from ...api.running import run
    from ...errors import SpecError
    from ...presentation.progress import Terminal
    from ...store.database import DATABASE, SPEC_FILE
    from ..loading import load_spec

    try:
        changed = load_spec(spec, changes, trust=trust, out=out)
    except SpecError as error:
        own = os.path.realpath(out / SPEC_FILE)
        if not (out / DATABASE).exists() or os.path.realpath(spec) != own:
            raise
        raise SpecError(
            f"{error}; if {spec} is damaged, {command_line('retry', out)} continues from the "
            "database"
        ) from None
    return show_results(run(changed, out, observer=Terminal(), **running), figures)


@click.command()
@click.argument("spec", type=options.PATH, metavar="SPEC.toml")
@options.out(
    "Folder for the study of all configurations, best.toml and configurations.csv.",
    required=True,
)
@options.number("--trials", "N", 20, "Configurations to try, the spec's own among them.")
@options.number("--seeds", "N", 16, "Number of seeds that compare the last configurations.")
@options.number("--first-seed", "N", 10_000, "First of these seeds; at least 10000.")
@options.number("--draw", "N", 0, "Seed with which configurations are drawn.")
@options.running
@options.trust
@options.changes
def tune(
    spec: Path, out: Path, trust: bool, changes: tuple[str, ...], **choice: options.Checked
) -> int:
    """Search for better settings of a spec on separate seeds; the same command resumes it.

    SPEC.toml has one condition, and may have a table [tune] with lists of values by key. All
    configurations are tried on two seeds, the better half on four, and so on.
    """
    from ...api import tuning
    from ..loading import load_spec

    tuned = tuning.tune(load_spec(spec, changes, trust=trust, out=out), out, **choice)
    print_table(tuned.study.table(tuned.columns))
    print_text("", *tuned.lines, "")
    print_text(f"spec    {out / tuning.BEST_FILE}")
    print_text(f"table   {out / tuning.TABLE_FILE}")
    return 0


@click.command()
@click.argument("spec", type=options.PATH, metavar="SPEC.toml")
@options.jobs
@click.option(
    "--deviation",
    type=float,
    metavar="SD",
    help="Assumed standard deviation of differences of seeds; default: 0.25 for success rates, "
    "0.5 in a study of recovery.",
)
@click.option(
    "--smallest",
    type=float,
    metavar="D",
    help="Smallest difference of interest; default: 0.2 for success rates.",
)
@click.option("--timed/--no-timed", default=True, help="Run pilot episodes of every condition.")
@options.trust
@options.changes
def plan(spec: Path, trust: bool, changes: tuple[str, ...], **supposed: options.Checked) -> int:
    """Estimate the time of a study, and the differences that it can detect.

    SPEC.toml is the spec of the study. Every condition runs some pilot episodes; nothing is kept.
    """
    from ...api import planning
    from ..loading import load_spec

    print_text(planning.plan(load_spec(spec, changes, trust=trust), **supposed))
    return 0


@click.command()
@options.directory
@options.running
@options.checkpoint
@options.trust
def retry(directory: Path, trust: bool, **running: options.Checked) -> int:
    """Run the failed trials of a study again, and whatever is left of it.

    DIR is the folder of the study.
    """
    from ...api.running import run
    from ...presentation.progress import Terminal
    from ...store.store import Store
    from ...trials.keeping import spec_of
    from ..loading import trust_files

    if trust:
        trust_files(directory)
    with Store.open(directory) as store:
        spec = spec_of(store)
    study = run(spec, directory, retry_failed=True, observer=Terminal(), **running)
    return show_results(study)
