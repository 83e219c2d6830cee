"""``nested-agents keys``: what may stand in a spec."""

from __future__ import annotations

import click

from .. import options


@click.command()
@click.argument("prefix", type=options.text, metavar="[PREFIX]", required=False)
def command(prefix: str | None) -> int:
    """List the keys of a spec: default, type, what is allowed, meaning.

    A spec begins from the preset default; where that has another value than the key, both are told.

    PREFIX is a table or a key, such as learner.rule_base or scenario.box.mass.
    """
    from shutil import get_terminal_size
    from textwrap import fill

    from ...spec.errors import SpecError
    from ...spec.keys import keys_below, nearest

    found = keys_below(prefix or "")
    if not found:
        raise SpecError(f"{prefix}: there is no such key; {nearest(prefix or '')}")
    width = get_terminal_size().columns
    for number, table in enumerate(found):
        print(*[""] * bool(number), table.heading, sep="\n")
        for key in table.keys:
            told = ", ".join(filter(None, [key.type, key.allowed, key.unit and f"[{key.unit}]"]))
            print(fill(f"{key.name} = {key.value}: {told}", width, subsequent_indent="    "))
            print(fill(key.meaning, width, initial_indent="    ", subsequent_indent="    "))
    return 0
