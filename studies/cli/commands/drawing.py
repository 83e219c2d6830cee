"""Command ``draw``: pictures of environments before anything runs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...errors import SpecError, refused
from .. import options
from ..display import print_text

if TYPE_CHECKING:
    from ....core.plugins.settings import ScenarioSettings
    from ...spec.spec import Spec


@click.command()
@click.argument("source", metavar="SPEC.toml|KIND")
@click.option(
    "--plot",
    type=options.PATH,
    metavar="PATH",
    default="environment.png",
    show_default=True,
    help="The picture to write: SVG, PNG or PDF by suffix.",
)
@options.number("--seed", "N", 0, "Seed of the drawn start.")
@options.changes
def draw(source: str, plot: Path, seed: int, changes: tuple[str, ...]) -> int:
    """Draw environments at the start of an episode; nothing is trained.

    With SPEC.toml, each distinct scenario of its conditions and evaluations is drawn. With KIND, as
    line-up or matrix-game, a scenario with its default settings.
    """
    from ....scenarios.movies import Drawable
    from ...spec.spec import Spec

    if source.endswith(".toml"):
        spec = Spec.load(Path(source), changes)
    else:
        spec = Spec.of({"scenario": {"kind": source}})
    with refused(), spec.sources.active():
        scenarios = [*_distinct(spec)]
        for number, (label, settings) in enumerate(scenarios, 1):
            scenario = settings.build()
            scenario.reset(seed)
            if not isinstance(scenario, Drawable):
                raise SpecError(f"scenario.kind = {settings.kind!r}: has no method draw")
            several = f"-{number}" if len(scenarios) > 1 else ""
            path = plot.with_name(f"{plot.stem}{several}{plot.suffix}")
            scenario.draw(path)
            print_text(f"{path}: {label}")
    return 0


def _distinct(spec: Spec) -> Iterator[tuple[str, ScenarioSettings]]:
    """Yield the distinct scenarios of conditions and evaluations, each with its first label."""
    seen = set[str]()
    for condition in spec.conditions():
        for label, settings in condition.labeled.items():
            content = settings.scenario.model_dump_json()
            if content not in seen:
                seen.add(content)
                yield label, settings.scenario
