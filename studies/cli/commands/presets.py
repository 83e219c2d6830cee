"""``nested-agents presets``: the named starting points of a spec."""

from __future__ import annotations

import click

from .. import options


@click.command()
@click.argument("name", type=options.text, metavar="[NAME]", required=False)
def command(name: str | None) -> int:
    """List the presets, or print one in full.

    NAME is a preset to print as the tables of a spec, defaults included.
    """
    if name is None:
        _list()
        return 0
    from ...spec.conditions import resolve
    from ...spec.toml import dumps

    settings = resolve(name, {}, {})
    if suited := settings.scenario.suited(name):
        print("# What this scenario lays over the preset, as it is set here:")
        print(*(f"# {line}" for line in dumps(suited).splitlines() if line), sep="\n", end="\n\n")
    print(dumps(settings.model_dump()), end="")
    return 0


def _list() -> None:
    from shutil import get_terminal_size
    from textwrap import fill

    from ...spec.presets import PRESETS

    left, width = max(map(len, PRESETS)) + 2, get_terminal_size().columns
    for key, preset in PRESETS.items():
        print(
            fill(
                preset.summary,
                width,
                initial_indent=f"{key:<{left}}",
                subsequent_indent=" " * left,
            )
        )
