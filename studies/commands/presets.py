"""``nested-agents presets``: the named starting points of a spec."""

from __future__ import annotations

from typing import Annotated

import tyro


def command(
    name: Annotated[str | None, tyro.conf.Positional, tyro.conf.arg(metavar="[NAME]")] = None,
) -> int:
    """List the presets, or print one in full.

    Parameters
    ----------
    name
        A preset to print as the tables of a spec, defaults included.
    """
    from ..presets import PRESETS

    if name is None:
        width = max(map(len, PRESETS))
        for key, preset in PRESETS.items():
            print(f"{key:<{width}}  {preset.summary}")
        return 0
    from ..conditions import resolve
    from ..spec_toml import dumps

    print(dumps(resolve(name, {}, {}).model_dump()), end="")
    return 0
