"""``nested-agents presets``: the named starting points of a spec."""

from __future__ import annotations

from typing import Annotated

import tyro


def command(
    name: Annotated[
        str | None,
        tyro.conf.Positional,
        tyro.conf.arg(metavar="[NAME]", help_behavior_hint=""),
    ] = None,
) -> int:
    """List the presets, or print one in full.

    Parameters
    ----------
    name
        A preset to print as the tables of a spec, defaults included.
    """
    from shutil import get_terminal_size
    from textwrap import fill

    from ...spec.presets import PRESETS

    if name is None:
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
        return 0
    from ...spec.conditions import resolve
    from ...spec.toml import dumps

    print(dumps(resolve(name, {}, {}).model_dump()), end="")
    return 0
