"""``nested-agents demo``: a small learning-curve study, from nothing to figures and a replay."""

from pathlib import Path

import click

from .. import options


@click.command()
@options.out(
    "Where to keep the study; made if it does not exist. The same command again continues it.",
    default="nested-agents-demo",
)
@options.jobs
@click.option("--print-spec", is_flag=True, help="Print the spec that would be run, and stop.")
def command(out: Path, jobs: int | None, print_spec: bool) -> int:
    """Train two e-Pucks to push a box: table, figures and replay within minutes."""
    text = (Path(__file__).parents[2] / "catalogue/learning_curve/demo.toml").read_text(
        encoding="utf-8"
    )
    if print_spec:
        print(text, end="")
        return 0
    from ...api.study import run
    from ...presentation.progress import Terminal
    from ...spec.spec import Spec
    from ..display import show_results

    study = run(Spec.parse(text), out, jobs=jobs, observer=Terminal())
    status = show_results(study)
    for episode in ("first", "last") if not study.failed else ():
        path = out / "replay" / f"{episode}-episode.gif"
        path.parent.mkdir(exist_ok=True)
        print(f"replay  {study.replay(episode=episode, path=path).path}")
    return status
