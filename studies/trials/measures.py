"""The measures of a study: those of its scenarios, joined."""

from collections.abc import Iterable, Sequence

from ...core.interface.measures import Measure
from ..errors import SpecError
from ..store.schema import AFTER, BEFORE

RESERVED = ("identity", "condition", "seed", "position", *BEFORE, *AFTER)
"""What no measure may be called, as columns of results are called so."""


def joined(
    by_scenario: Iterable[Sequence[Measure]], taken: Iterable[str] = ()
) -> tuple[Measure, ...]:
    """Return the measures of several scenarios, each once, in the order in which they come.

    Parameters
    ----------
    by_scenario
        What each scenario declares.
    taken
        Names of further columns, which no measure may have.

    Raises
    ------
    SpecError
        If a name is reserved, or two scenarios mean different things by it.

    Examples
    --------
    >>> one, other = Measure("energy_j", "energy", "J"), Measure("spread_m", "spread", "m")
    >>> [measure.name for measure in joined([(one,), (other, one)])]
    ['energy_j', 'spread_m']
    """
    reserved = {name.lower() for name in (*RESERVED, *taken)}
    by_name: dict[str, Measure] = {}
    for measures in by_scenario:
        for measure in measures:
            if measure.name.lower() in reserved:
                raise SpecError(f"measure {measure.name!r}: a column of results is called so")
            known = by_name.setdefault(measure.name.lower(), measure)
            if column_of(known) != column_of(measure):
                raise SpecError(
                    f"measure {measure.name!r}: is declared as {_describe(known)}, and by another "
                    f"scenario of this study as {_describe(measure)}"
                )
    return tuple(by_name.values())


def column_of(measure: Measure) -> tuple[str, str, str, bool]:
    """Return what equal columns have in common: name, unit, gathering, whether it is a rate."""
    return measure.name, measure.unit, measure.gathering, measure.is_rate


def _describe(measure: Measure) -> str:
    kind = "rate" if measure.is_rate else "number"
    return f"{measure.name!r}, {measure.gathering} {kind} in {measure.unit!r}"
