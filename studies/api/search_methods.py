"""Search methods of the teams of a study that change with size, and sizes that cannot run."""

from collections.abc import Mapping, Sequence
from contextlib import suppress

from ...core.search.budget import BudgetError
from ..cost.profile import search_method
from ..laws.size_axis import SizeAxis
from ..results.results import Results
from ..spec.conditions import ConditionSettings
from ..spec.tables import merge, nested
from ..trials.arrangement import arrange

MAX_BUILT = 512
"""Largest size of a team that is built to find its method; building it takes about a second."""


def method_remarks(
    settings: Mapping[str, ConditionSettings],
    results: Results,
    size: str | None,
    predict: Sequence[int],
) -> tuple[str, ...]:
    """Return sentences if a search method changes with size, or a predicted size cannot run.

    A team of each condition and of each predicted size is built to find its method. A study with
    untrusted files, or one that is known by its table alone, has no methods.
    """
    axis = SizeAxis.of(results, size)
    groups = axis.groups()
    steps: list[tuple[float, str, str]] = []
    changing: list[str] = []
    refused: dict[str, str] = {}
    for group, sizes in groups.items():
        teams = {n: settings[condition] for condition, n in sizes.items() if condition in settings}
        for n in map(float, predict if teams else ()):
            with suppress(ValueError):
                largest = teams[max(teams)]
                teams.setdefault(n, _resized(largest, axis.key, min(int(n), MAX_BUILT)))
        smallest: dict[str, float] = {}
        for n in sorted(teams):
            try:
                smallest.setdefault(search_method(arrange(teams[n], 0).team), n)
            except BudgetError as error:
                refused.setdefault(f"{n:g}", str(error))
            except (ValueError, ImportError):
                continue
        if len(smallest) > 1:
            changing.append(group)
            steps += [(n, group, method) for method, n in smallest.items()]
    remarks = tuple(
        f"{n} {axis.name} cannot run, so that a prediction has no meaning there: {error}."
        for n, error in refused.items()
    )
    if not changing:
        return remarks
    changes = dict.fromkeys(f"{method} from {n:g} {axis.name}" for n, _, method in sorted(steps))
    head = "" if len(changing) == len(groups) else f"{', '.join(changing)}: "
    return (
        f"{head}The search method changes with size ({', '.join(changes)}), so that one law "
        "describes several methods; learner.decision.evaluator sets one for all.",
        *remarks,
    )


def _resized(settings: ConditionSettings, key: str, n: int) -> ConditionSettings:
    """Return settings with another size; `ValueError` if they do not allow it."""
    table = merge(settings.model_dump(mode="json"), nested(key, n))
    return ConditionSettings.model_validate(table)
