"""Comparisons of conditions: all with one reference, or level by level of a swept key.

An `Estimate` is the mean of one condition, a `Difference` compares a condition with its reference,
a `ComparisonGroup` holds the differences from one reference, and a `ComparisonTable` holds all
groups, over which p-values are adjusted.
"""

from collections.abc import Collection, Mapping
from typing import NamedTuple

from ...core.interface.measures import RETURN, SUCCESS, Measure
from ...core.numerics import pd
from ...core.plugins.words import closest
from ..errors import SpecError
from ..spec.tables import SpecTable, aliases, key_named, label, named
from .analysis import (
    NOTHING,
    UNPAIRED,
    Summary,
    has_lower_bounds,
    identity_lines,
    mean_estimate,
    verdicts,
)
from .differences import (
    MIN_RUNS,
    BySeed,
    Difference,
    Pair,
    count_unpaired,
    differences,
    select_shared,
)
from .measured import default_measure, title_of, values_by_seed, values_of
from .notation import P_ADJUSTED, P_RAW, listed, wrapped
from .power_text import power_lines
from .recovery import LOWER_BOUND, RECOVERY, never_recovered, within
from .results import STEPS, Results, row_means
from .statistics import Array, Estimate, censored, exactly

DIFFERENCE_TITLES = {True: "difference", False: "difference (independent samples)"}
"""Headings of the column of differences, of paired and of independent runs."""
LIMITED_TIMES = "Differences and p are of times that end with training."
Members = dict[str, str]
"""Labels of the conditions of a group by their names within it."""


class ComparisonGroup(NamedTuple):
    """Conditions that are compared with one reference."""

    setting: str
    """Label of what the conditions have in common; empty if that is nothing."""
    reference: str
    differences: tuple[Difference, ...]
    table: tuple[Summary, ...]
    """A line for each condition, the reference first."""
    members: Mapping[str, str]
    """Label of each condition by its name in the group."""
    values: Mapping[str, Array]
    """Means of the seeds ``(n_seeds,)`` by name."""
    left_out: tuple[str, ...] = ()
    """For each condition, the number of runs or scores without a partner."""


class ComparisonTable(NamedTuple):
    """Conditions compared by one measure; p is adjusted over all groups."""

    measure: Measure
    phase: str
    """Phase of the episodes; empty for a number of whole trials."""
    groups: tuple[ComparisonGroup, ...]
    results: Results
    """The compared results."""

    @property
    def differences(self) -> tuple[Difference, ...]:
        """All differences."""
        return tuple(d for group in self.groups for d in group.differences)

    @property
    def title(self) -> str:
        """Title of the measure, as tables have it."""
        return title_of(self.measure, self.phase)

    @property
    def table(self) -> tuple[Summary, ...]:
        """A line for each condition: estimate, difference, effect sizes."""
        return tuple(line for group in self.groups for line in group.table)

    @property
    def notes(self) -> tuple[str, ...]:
        """Verdicts, and the differences that the comparisons detect, in lines."""
        groups = {}
        for group in self.groups:
            head = ": ".join(filter(None, (group.setting, self.title)))
            groups[f"{head}, minus that of {group.reference}"] = group.differences
        lines = verdicts(groups, self.measure, self.title)
        lines += listed(UNPAIRED, (text for group in self.groups for text in group.left_out))
        if self.measure.name in RECOVERY:
            lines += self._without_success()
        if has_lower_bounds(self.table):
            lines += wrapped(f"{LOWER_BOUND} {LIMITED_TIMES}")
        if self.measure.gathering == "sum" and self.measure.better == "lower":
            lines += wrapped(f"{self.title}: a sum, which is lower in episodes that end early.")
        compared = {c for group in self.groups for c in group.members.values()}
        others = [c for c in self.results.conditions if c not in compared]
        lines += listed(f"Not compared, because they have no {self.title}", others)
        values = [own for group in self.groups for own in group.values.values()]
        if self.measure.name == SUCCESS.name and not any(own.any() for own in values):
            lines += wrapped(f"No run has any {self.title}.")
        return (*(lines or [NOTHING]), *identity_lines(self.results.identical))

    def _without_success(self) -> list[str]:
        """Return how many seeds of each condition had no success before the failure, in lines."""
        texts = []
        for group in self.groups:
            for name, condition in group.members.items():
                total = len(self.results.seeds(condition))
                if missing := total - len(group.values[name]):
                    texts.append(f"{condition}, {missing} of {total}")
        return listed("Seeds without success before the failure, left out", texts)


def compare_conditions(
    results: Results,
    measure: str = "success",
    phase: str | None = None,
    by: str | None = None,
    reference: str | None = None,
) -> ComparisonTable:
    """Compare conditions by the means of their seeds.

    Parameters
    ----------
    results
        Results of any studies.
    measure
        Name of a measure of episodes, ``steps``, ``return``, or a number of whole trials. In
        ``steps``, failed episodes count with the longest that is allowed.
    phase
        Phase of the episodes; by default ``evaluation``, or ``training`` if there is none.
    by
        A swept key, or its last part. Conditions that agree in all other keys are compared with
        the one of the first value. By default all conditions are compared with the first one.
    reference
        Another condition, or with `by` another value, to compare with.

    Raises
    ------
    SpecError
        If the results have no such measure, phase, key or reference, or nothing can be a success.
    """
    asked = phase
    shown, values, phase = values_by_seed(results, measure, asked)
    if shown.is_rate and shown.greatest == 0.0:
        others = [m.name for m in results.measures if m != shown]
        raise SpecError(
            f"measure = {measure!r}: nothing is a success in these results; known: "
            f"{', '.join([*others, STEPS.name, RETURN.name])}"
        )
    groups = _groups([c for c in results.columns if c in values], results.columns, by, reference)
    title = title_of(shown, phase)
    pairs: dict[str, list[Pair]] = {}
    for setting, members in groups.items():
        base, *others = members
        pairs[setting] = [
            (n, title, *_pair(values[members[n]], values[members[base]], results.pairs_episodes))
            for n in others
        ]
    compared = differences(pairs, shown)
    bounds = never_recovered(results, shown, asked)
    means = {
        c: censored(mean_estimate(within(results, c, shown), own), c in bounds)
        for c, own in values.items()
    }
    compared_groups = [
        _group(results, setting, members, (values, means), compared[setting], (shown, phase))
        for setting, members in groups.items()
    ]
    return ComparisonTable(shown, phase, tuple(compared_groups), results)


def _group(
    results: Results,
    setting: str,
    members: Members,
    measured: tuple[Mapping[str, pd.DataFrame], Mapping[str, Estimate]],
    compared: tuple[Difference, ...],
    measure_in_phase: tuple[Measure, str],
) -> ComparisonGroup:
    """Return the group of some conditions, the reference first."""
    values, means = measured
    measure, phase = measure_in_phase
    by_name = {d.condition: d for d in compared}
    reference = next(iter(members))
    lines = []
    left_out = []
    for name, condition in members.items():
        title = ", ".join(filter(None, (setting, name)))
        own = values[condition]
        estimates = {title_of(measure, phase): means[condition]}
        if name in by_name:
            estimates |= _difference_columns(by_name[name], measure)
            count = _left_out(results, own, values[members[reference]], paired=by_name[name].paired)
            left_out += [f"{count} of {reference} and {title}"] if count else []
        lines.append(Summary(title, len(own), estimates))
    return ComparisonGroup(
        setting=setting,
        reference=reference,
        differences=compared,
        table=tuple(lines),
        members=members,
        values={name: row_means(values[c]).to_numpy() for name, c in members.items()},
        left_out=tuple(left_out),
    )


def _difference_columns(difference: Difference, measure: Measure) -> dict[str, Estimate]:
    """Return the columns of a difference: the difference, two effect sizes, and p."""
    title = "P(improvement)" if measure.better else "P(higher)"
    return {
        DIFFERENCE_TITLES[difference.paired]: difference.estimate,
        title: difference.improvement(measure.better),
        "Cliff's delta": exactly(difference.cliffs_delta),
        P_ADJUSTED: exactly(difference.p),
        P_RAW: exactly(difference.raw),
    }


def missing_reference(results: Results) -> list[str]:
    """Return lines that say which condition is the reference if the first one has no trial."""
    present = [condition for condition in results.columns if condition in results.conditions]
    first = next(iter(results.columns), None)
    if len(present) < 2 or present[0] == first:
        return []
    return wrapped(
        f"No trial of {first}, the first condition, has finished: {present[0]} is the reference "
        "of all comparisons instead."
    )


def power_of_seeds(results: Results, by: str | None) -> tuple[str, ...]:
    """Return lines on which differences the seeds detect.

    They agree with those of `compare_conditions`, which takes seconds for thousands of seeds.
    """
    measure, values, phase = values_of(results, default_measure(results))
    groups = _groups([c for c in results.columns if c in values], results.columns, by, None)
    pairs = [
        select_shared([values[condition], values[reference]])
        for reference, *others in (list(members.values()) for members in groups.values())
        for condition in others
    ]
    samples = [own - base for own, base in pairs if len(own) >= MIN_RUNS]
    return tuple(power_lines(samples, len(samples), measure, title_of(measure, phase)))


def _pair(own: pd.DataFrame, base: pd.DataFrame, pairs_episodes: bool) -> tuple[BySeed, BySeed]:
    """Return the means of two conditions by seed, over common episodes if these are paired."""
    if pairs_episodes:
        seeds = own.index.intersection(base.index, sort=False)
        episodes = own.columns.intersection(base.columns)
        own, base = own[episodes], base[episodes]
        if len(seeds) >= MIN_RUNS:
            own, base = own.loc[seeds], base.loc[seeds]
            both = own.notna() & base.notna()
            own, base = own.where(both), base.where(both)
        own, base = own.dropna(how="all"), base.dropna(how="all")
    return row_means(own), row_means(base)


def _left_out(results: Results, own: pd.DataFrame, base: pd.DataFrame, *, paired: bool) -> str:
    """Return the number of runs or scores without a partner in the other condition.

    Independent samples need no partners, except that both have scores on the same items.
    """
    index, other = own.index, base.index
    unit = "runs"
    if results.pairs_episodes:
        index, other = own.stack().dropna().index, base.stack().dropna().index
        unit = "scores"
    if not paired:
        index, other = (keys.get_level_values(-1) for keys in (index, other))
    count = count_unpaired(index, other) if paired or results.pairs_episodes else ""
    return f"{count} {unit}" if count else ""


def _groups(
    conditions: list[str],
    columns: Mapping[str, SpecTable],
    by: str | None,
    reference: str | None,
) -> dict[str, Members]:
    """Return the members of each group by its setting, the reference first."""
    keys = dict.fromkeys(key for c in conditions for key in columns[c])
    key = None if by is None else key_named("by", by, keys)
    groups: dict[str, Members] = {}
    known = {}
    for c in conditions:
        row = columns[c]
        name, setting = c, ""
        if key is not None:
            name = _level(key, row[key])
            setting = ", ".join(_level(k, v) for k, v in row.items() if k != key and v != "")
        known[c] = aliases(c, row if key is None else {key: row[key]})
        same = groups.setdefault(setting, {}).setdefault(name, c)
        if same != c:
            raise SpecError(f"by = {by!r}: conditions {same!r} and {c!r} differ in no key")
    return {setting: _put_first(own, reference, known, setting) for setting, own in groups.items()}


def _level(key: str, value: object) -> str:
    """Return a value of a column as a label; text is its own label, except a truth value.

    >>> _level("scenario.robots", 8), _level("topology", "chain"), _level("numbered", "true")
    ('robots=8', 'chain', 'numbered=true')
    """
    own = label({key: value})
    return own if isinstance(value, str) else f"{key.rpartition('.')[2]}={own}"


def _put_first(
    members: Members, reference: str | None, known: Mapping[str, Collection[str]], setting: str
) -> Members:
    """Return the members of a group, the reference first; `known` has the aliases of labels."""
    if reference is None:
        return members
    first = named(reference, {name: known[c] for name, c in members.items()})
    if first is None:
        where = f" (with {setting})" if setting else ""
        raise SpecError(f"reference = {reference!r}: {closest(reference, members)}{where}")
    return {first: members[first]} | members
