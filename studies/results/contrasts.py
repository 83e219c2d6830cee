"""Conditions compared by any measure: all with one, or level by level within equal others."""

from collections.abc import Collection, Mapping
from typing import NamedTuple

from ...core.interface.measures import RETURN, Measure
from ...core.numerics import pd
from ...core.plugins.words import closest
from ..errors import SpecError
from ..spec.tables import aliases, label, named
from .analysis import (
    NOTHING,
    BySeed,
    Difference,
    Summary,
    differences,
    estimate_of,
    estimate_over_seeds,
    identity_lines,
    select_shared,
    verdicts,
)
from .power import power_lines
from .recovery import RECOVERY, recovery_by_seed
from .results import SECONDS, Results, describe_number
from .statistics import Array, Estimate


class Group(NamedTuple):
    """Conditions that are compared with each other."""

    setting: str
    """What they have in common, as a label; empty if there is nothing in common."""
    reference: str
    """The label of the one that the others are compared with."""
    differences: tuple[Difference, ...]
    """Of the others from it."""
    table: tuple[Summary, ...]
    """A line for each, the reference first."""
    values: Mapping[str, Array]
    """By the name of each, the means of its seeds ``(n_seeds,)``."""
    training: Mapping[str, Array]
    """Values of each episode of training ``(n_seeds, n_episodes)``, if it is measured there."""


class Contrasts(NamedTuple):
    """Conditions against references by one measure; p is adjusted over all of them."""

    measure: Measure
    """By what they are compared."""
    phase: str
    """In which episodes; empty if it is a number of whole trials."""
    groups: tuple[Group, ...]
    """The comparisons."""
    identical: tuple[tuple[str, ...], ...] = ()
    """Conditions of which there is nothing to tell apart, see `Results.identical`."""

    @property
    def differences(self) -> tuple[Difference, ...]:
        """All differences."""
        return tuple(d for group in self.groups for d in group.differences)

    @property
    def title(self) -> str:
        """What is compared, as columns of tables are called."""
        return title_of(self.measure, self.phase)

    @property
    def table(self) -> tuple[Summary, ...]:
        """A line for every condition: estimate, and difference from its reference."""
        return tuple(line for group in self.groups for line in group.table)

    @property
    def notes(self) -> tuple[str, ...]:
        """The verdicts, and what the comparisons could have detected."""
        groups = {}
        for group in self.groups:
            head = ": ".join(filter(None, (group.setting, self.title)))
            groups[f"{head}, less that of {group.reference}"] = group.differences
        lines = verdicts(groups, self.measure, self.title)
        return (*(lines or [NOTHING]), *identity_lines(self.identical))


def title_of(measure: Measure, phase: str) -> str:
    """Return what a measure of a phase is called, ``evaluation success``, ``success, eight``."""
    kind, _, name = phase.partition(":")
    return f"{measure.heading}, {name}" if name else f"{kind} {measure.heading}".lstrip()


def contrasts(
    results: Results,
    measure: str = "success",
    phase: str | None = None,
    by: str | None = None,
    reference: str | None = None,
) -> Contrasts:
    """Compare conditions by the means of their seeds.

    Parameters
    ----------
    results
        Of any studies.
    measure
        A measure of episodes, ``steps``, ``return``, or a number of whole trials, by name.
    phase
        Which episodes: by default ``evaluation``, or where there is none, ``training``.
    by
        A swept key, or the last part of it: conditions that agree in all others are compared, each
        with that of the first value. None: all conditions with the first one.
    reference
        Another one to compare with, or with `by` another value; by any of its `aliases`.

    Raises
    ------
    SpecError
        If the results have no such measure, phase, key or reference.
    """
    shown_as, values, phase = values_of(results, measure, phase)
    groups = _groups([c for c in results.columns if c in values], results.columns, by, reference)
    pairs = {
        setting: [(name, measure, values[c], values[members[0][1]]) for name, c in members[1:]]
        for setting, members in groups
    }
    compared = differences(pairs, shown_as)
    compared_groups = []
    for setting, members in groups:
        less = {d.condition: {"difference": d.estimate} for d in compared[setting]}
        lines = []
        for name, c in members:
            own = {title_of(shown_as, phase): _estimate(results, shown_as, phase, c, values[c])}
            whose = ", ".join(filter(None, (setting, name)))
            lines.append(Summary(whose, len(values[c]), own | less.get(name, {})))
        compared_groups.append(
            Group(
                setting=setting,
                reference=members[0][0],
                differences=compared[setting],
                table=tuple(lines),
                values={name: values[c].to_numpy() for name, c in members},
                training={
                    name: results.values(c, shown_as.name)
                    for name, c in members
                    if phase and results.has(c, "training", shown_as.name)
                },
            )
        )
    return Contrasts(shown_as, phase, tuple(compared_groups), results.identical)


def power_with_first(results: Results) -> tuple[str, ...]:
    """Return what comparisons with the first condition by `Results.main` can find, in lines.

    As `contrasts` of the same say it, whose tests take seconds where seeds are thousands.
    """
    measure, values, phase = values_of(results, results.main.name)
    base, *others = (values[c] for c in results.columns if c in values)
    pairs = [select_shared([own, base]) for own in others]
    samples = [own - reference for own, reference in pairs if len(own) >= 2]
    return tuple(power_lines(samples, title_of(measure, phase), of_rates=measure.is_rate))


def _usual_phase(results: Results) -> str:
    """Return the phase of evaluation, if all trained conditions have it, else that of training."""
    evaluated = {*results.of_phase("evaluation")}
    is_whole = evaluated and evaluated >= {*results.of_phase("training")}
    return "evaluation" if is_whole else "training"


def _estimate(
    results: Results, measure: Measure, phase: str, condition: str, means: BySeed
) -> Estimate:
    """Return the mean over seeds of a measure, or of a number of trials, with its interval."""
    if phase:
        return estimate_of(results, condition, phase, measure)
    return estimate_over_seeds(means.to_numpy().astype(float), measure)


_Pairs = list[tuple[str, str]]
"""Names of the conditions of a group, and their labels; the reference first."""


def values_of(
    results: Results, name: str, phase: str | None = None
) -> tuple[Measure, dict[str, BySeed], str]:
    """Return a measure, its means of seeds by condition, and the phase that they are of.

    The phase is empty if the measure is one of whole trials, or of recovery from a failure.
    """
    has_failed = any("onset" in results.numbers(condition) for condition in results.conditions)
    recovery = RECOVERY if has_failed else {}
    name = next((m.name for m in recovery.values() if name in (m.heading, m.title)), name)
    is_recovery = name in recovery
    phase = phase or ("training" if is_recovery else _usual_phase(results))
    measures = {m.name: m for m in (*results.measures, results.steps(phase), RETURN)}
    name = next((m.name for m in measures.values() if m.heading == name), name)
    if not results.phases:
        raise SpecError("no trial has finished")
    if (name in measures or is_recovery) and phase not in results.phases:
        raise SpecError(f"phase = {phase!r}: {closest(phase, results.phases)}")
    if is_recovery:
        measure, values = recovery_by_seed(results, name, phase)
        return measure, {**values}, ""
    if name in measures:
        of_phase = (c for c in results.of_phase(phase) if results.has(c, phase, name))
        return measures[name], {c: results.means(c, phase, name) for c in of_phase}, phase
    numbers = {c: results.numbers(c) for c in results.conditions}
    columns = dict.fromkeys(n for own in numbers.values() for n in own)
    names = {c: (c, c.removeprefix(SECONDS), describe_number(c)[0].heading) for c in columns}
    column = next((c for c in columns if name in names[c]), None)
    if column is None:
        raise SpecError(f"measure = {name!r}: {closest(name, {*measures, *recovery, *columns})}")
    measure, factor = describe_number(column)
    of_trials = {c: factor * own[column] for c, own in numbers.items() if column in own}
    return measure, {c: pd.Series(own, results.seeds(c)) for c, own in of_trials.items()}, ""


def _groups(
    conditions: list[str],
    columns: Mapping[str, Mapping[str, object]],
    by: str | None,
    reference: str | None,
) -> list[tuple[str, _Pairs]]:
    if by is None:
        members = [(c, c) for c in conditions]
        known = {c: aliases(c, columns[c]) for c in conditions}
        return [("", _put_first(members, reference, known))] if members else []
    keys = dict.fromkeys(key for c in conditions for key in columns[c])
    key = next((k for k in keys if by in (k, k.rpartition(".")[2])), None)
    if key is None:
        raise SpecError(f"by = {by!r}: {closest(by, keys)}")
    groups: dict[str, _Pairs] = {}
    for c in conditions:
        level = _level(key, columns[c][key])
        rest = ", ".join(_level(k, v) for k, v in columns[c].items() if k != key and v != "")
        groups.setdefault(rest, []).append((level, c))
    known = {c: aliases(c, {key: columns[c][key]}) for c in conditions}
    return [(setting, _put_first(members, reference, known)) for setting, members in groups.items()]


def _level(key: str, value: object) -> str:
    """Return a value of a column as a label: a name stands for itself.

    >>> _level("scenario.robots", 8), _level("topology", "chain")
    ('robots=8', 'chain')
    """
    return value if isinstance(value, str) else f"{key.rpartition('.')[2]}={label({key: value})}"


def _put_first(
    members: _Pairs, reference: str | None, known: Mapping[str, Collection[str]]
) -> _Pairs:
    """Return the members of a group, the reference first, by a name or another `known` one."""
    if reference is None:
        return members
    first = named(reference, {name: known[c] for name, c in members})
    if first is None:
        raise SpecError(f"reference = {reference!r}: {closest(reference, dict(members))}")
    return sorted(members, key=lambda member: member[0] != first)
