"""``nested-agents explain``: what a trained team has learned, in words and figures."""

from pathlib import Path

import click

from .. import options


@click.command()
@options.directory
@click.option(
    "--condition", metavar="LABEL", help="Label of the condition; by default the first one."
)
@click.option("--seed", type=int, metavar="SEED", help="The seed; by default the first one.")
@options.trust
def command(directory: Path, condition: str | None, seed: int | None, trust: bool) -> int:
    """Explain a trained team: its rules in words, its policy, its self-model.

    DIR is where the study is kept. Text and figures go into its folder explain. Unless the study
    keeps its teams (keep_teams = true in its spec), training is run again, which takes seconds, and
    must give the episodes that are kept.
    """
    from ...explain import team
    from ...explain.text import MOST_AGENTS, draw, text
    from ...presentation.figures import save
    from ...store import durable
    from ...trials.keeping import finished_trial
    from ..loading import opened, trust_files

    if trust:
        trust_files(directory)
    with opened(directory) as store:
        trial = finished_trial(store, condition, seed)
        conditions = list(store.columns())
        explanation = team.explain(store, trial)
    folder = team.folder_of(directory, trial, conditions)
    folder.mkdir(parents=True, exist_ok=True)
    written = folder / "explanation.txt"
    durable.write(written, text(explanation).encode())
    figures = save(draw(explanation), folder)
    print(text(explanation, MOST_AGENTS))
    for path in (written, *figures):
        print(path)
    return 0
