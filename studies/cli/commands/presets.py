"""``nested-agents presets``: the named starting points of a spec."""

import click


@click.command()
@click.argument("name", metavar="[NAME]", required=False)
def command(name: str | None) -> int:
    """List the presets, or print one in full.

    NAME is a preset to print as the tables of a spec, defaults included.
    """
    from ...spec.presets import PRESETS
    from ..display import print_wrapped

    if name is None:
        left = max(map(len, PRESETS)) + 2
        for key, preset in PRESETS.items():
            print_wrapped(preset.summary, f"{key:<{left}}", left)
        return 0
    from ...spec.conditions import resolve
    from ...spec.overlay import dumps

    settings = resolve(name, {}, {})
    if defaults := settings.scenario.scenario_defaults(name):
        print("# What this scenario lays over the preset, as it is set here:")
        print(*(f"# {line}" for line in dumps(defaults).splitlines() if line), sep="\n", end="\n\n")
    print(dumps(settings.model_dump()), end="")
    return 0
