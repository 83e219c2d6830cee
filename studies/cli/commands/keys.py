"""``nested-agents keys``: what may stand in a spec."""

from __future__ import annotations

import click

from ..arguments import Command, Text


@click.command(cls=Command)
@click.argument("prefix", type=Text(), metavar="[PREFIX]", required=False)
def command(prefix: str | None) -> int:
    """List the keys of a spec: type, default, what is allowed, meaning.

    PREFIX is a table or a key, such as learner.rule_base or scenario.box.mass.
    """
    from shutil import get_terminal_size
    from textwrap import fill

    from ....core.refusals import closest
    from ...spec.errors import SpecError
    from ...spec.keys import keys_below, tables

    found = keys_below(prefix or "")
    if not found:
        known = {name.partition(".")[0] for table in tables() for name in table.full_names}
        raise SpecError(f"{prefix}: there is no such key; {closest(prefix, known)}")
    width = get_terminal_size().columns
    for number, table in enumerate(found):
        print(*[""] * bool(number), table.heading, sep="\n")
        for key in table.keys:
            told = ", ".join(filter(None, [key.type, key.allowed, key.unit and f"[{key.unit}]"]))
            print(fill(f"{key.name} = {key.default}: {told}", width, subsequent_indent="    "))
            print(fill(key.meaning, width, initial_indent="    ", subsequent_indent="    "))
    return 0
