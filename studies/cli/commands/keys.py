"""``nested-agents keys``: what may stand in a spec."""

import click


@click.command()
@click.argument("prefix", metavar="[PREFIX]", required=False)
def command(prefix: str | None) -> int:
    """List the keys of a spec: default, type, what is allowed, meaning.

    A spec begins from the preset default; where that has another value, both are listed.

    PREFIX is a table or a key, such as learner.rule_base or scenario.box.mass.
    """
    from ...errors import SpecError
    from ...spec.keys import keys_below, nearest
    from ..display import print_wrapped

    tables = keys_below(prefix or "")
    if not tables:
        raise SpecError(f"{prefix}: there is no such key; {nearest(prefix or '')}")
    for number, table in enumerate(tables):
        print(*[""] * bool(number), table.heading, sep="\n")
        for key in table.keys:
            words = ", ".join(filter(None, [key.type, key.allowed, key.unit and f"[{key.unit}]"]))
            print_wrapped(f"{key.name} = {key.value}: {words}")
            print_wrapped(key.meaning, "    ")
    return 0
