"""Conditions compared by any measure: all with one, or level by level within equal others."""

from collections.abc import Collection, Mapping
from typing import NamedTuple

from ...core.interface.measures import RETURN, Measure
from ...core.numerics import pd
from ...core.plugins.words import closest
from ..errors import SpecError
from ..spec.tables import aliases, label, named
from .analysis import (
    MIN_RUNS,
    NOTHING,
    BySeed,
    Difference,
    Summary,
    differences,
    identity_lines,
    select_shared,
    steps_estimate,
    verdicts,
)
from .notation import wrapped
from .power import power_lines
from .recovery import RECOVERY, recovery_by_seed
from .results import SECONDS, STEPS, Results, describe_number, row_means
from .series import LAST_STEP
from .statistics import Array, Estimate, bootstrap, rate


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
    left_out: tuple[str, ...] = ()
    """By condition, how many runs or scores have no partner in the reference, or it in them."""


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
        left_out = "; ".join(text for group in self.groups for text in group.left_out)
        if left_out:
            lines += wrapped(f"Without a partner and left out of the difference: {left_out}.")
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
    shown_as, values, phase = values_by_seed(results, measure, phase)
    groups = _groups([c for c in results.columns if c in values], results.columns, by, reference)
    pairs = {
        setting: [
            (name, measure, *_pair(values[c], values[members[0][1]], results.pairs_episodes))
            for name, c in members[1:]
        ]
        for setting, members in groups
    }
    compared = differences(pairs, shown_as)
    compared_groups = []
    for setting, members in groups:
        less = {d.condition: {DIFFERENCE[d.paired]: d.estimate} for d in compared[setting]}
        paired = {d.condition for d in compared[setting] if d.paired}
        left_out = [
            (", ".join(filter(None, (setting, name))), _left_out(results, values[c], base))
            for base in [values[members[0][1]]]
            for name, c in members[1:]
            if name in paired
        ]
        lines = []
        for name, c in members:
            own = {title_of(shown_as, phase): mean_estimate(shown_as, values[c])}
            whose = ", ".join(filter(None, (setting, name)))
            lines.append(Summary(whose, len(values[c]), own | less.get(name, {})))
        compared_groups.append(
            Group(
                setting=setting,
                reference=members[0][0],
                differences=compared[setting],
                table=tuple(lines),
                values={name: row_means(values[c]).to_numpy() for name, c in members},
                training={
                    name: results.by_seed(c, "training", shown_as.name).dropna(axis=1).to_numpy()
                    for name, c in members
                    if phase and results.has(c, "training", shown_as.name)
                },
                left_out=tuple(f"{name}, {text}" for name, text in left_out if text),
            )
        )
    return Contrasts(shown_as, phase, tuple(compared_groups), results.identical)


def missing_reference(results: Results) -> list[str]:
    """Return lines that say so if no trial of the first condition has finished.

    Another condition is the reference then.
    """
    present = [condition for condition in results.columns if condition in results.conditions]
    first = next(iter(results.columns), None)
    if len(present) < 2 or first is None or present[0] == first:
        return []
    return wrapped(
        f"No trial of {first}, the first condition, has finished: {present[0]} is the reference "
        "of all comparisons instead."
    )


def power_with_first(results: Results) -> tuple[str, ...]:
    """Return what comparisons with the first condition by `Results.main` can find, in lines.

    As `contrasts` of the same say it, whose tests take seconds where seeds are thousands.
    """
    measure, values, phase = values_of(results, results.main.name)
    base, *others = (values[c] for c in results.columns if c in values)
    pairs = [select_shared([own, base]) for own in others]
    samples = [own - reference for own, reference in pairs if len(own) >= 2]
    return tuple(power_lines(samples, title_of(measure, phase), of_rates=measure.is_rate))


def usual_phase(results: Results, measure: str) -> str:
    """Return the phase of evaluation, if all trained conditions have it, else that of training.

    Series of other tools that were not evaluated are compared at their last step.

    Raises
    ------
    SpecError
        If there are several other phases.
    """
    trained = {*results.of_phase("training")}
    for phase in ("evaluation", LAST_STEP):
        known = {c for c in results.of_phase(phase) if results.has_any(c, phase, measure)}
        if known and known >= trained:
            return phase
    if trained or len(results.phases) < 2:
        return next(iter(results.phases), "training")
    raise SpecError(f"phase: name one, known: {', '.join(results.phases)}")


DIFFERENCE = {True: "difference", False: "difference (independent samples)"}
"""Headings of the column of differences, of paired and of independent runs."""


def _pair(own: pd.DataFrame, base: pd.DataFrame, pairs_episodes: bool) -> tuple[BySeed, BySeed]:
    """Return the means of two conditions by seed, over common episodes if these are paired."""
    if pairs_episodes:
        seeds = own.index.intersection(base.index, sort=False)
        episodes = own.columns.intersection(base.columns)
        shared = [values.loc[seeds, episodes] for values in (own, base)]
        both = shared[0].notna() & shared[1].notna()
        shared = [values.where(both).dropna(how="all") for values in shared]
        if len(shared[0]) >= MIN_RUNS:
            own, base = shared
    return row_means(own), row_means(base)


def _left_out(results: Results, own: pd.DataFrame, base: pd.DataFrame) -> str:
    """Return how many runs, or scores if these are paired, only one of two conditions has."""
    index, other = own.index, base.index
    unit = "runs"
    if results.pairs_episodes:
        index, other = own.stack().dropna().index, base.stack().dropna().index
        unit = "scores"
    total = len(index) + len(other)
    count = total - 2 * len(index.intersection(other))
    return f"{count} of {total} {unit}" if count else ""


def mean_estimate(measure: Measure, values: pd.DataFrame) -> Estimate:
    """Return the mean over seeds of a measure's values, a row for each seed, with its interval."""
    means = row_means(values).to_numpy()
    if measure.name == STEPS.name:
        return steps_estimate(means, measure)
    if measure.is_rate and values.notna().all(axis=None):
        return rate(values.to_numpy(dtype=float))
    return bootstrap(means, bounds=measure.bounds)


_Pairs = list[tuple[str, str]]
"""Names of the conditions of a group, and their labels; the reference first."""


def values_of(
    results: Results, name: str, phase: str | None = None
) -> tuple[Measure, dict[str, BySeed], str]:
    """Return a measure, its means of seeds by condition, and the phase that they are of."""
    measure, values, phase = values_by_seed(results, name, phase)
    return measure, {condition: row_means(own) for condition, own in values.items()}, phase


def values_by_seed(
    results: Results, name: str, phase: str | None = None
) -> tuple[Measure, dict[str, pd.DataFrame], str]:
    """Return a measure, its values by condition, and the phase that they are of.

    Values have a row for each seed and a column for each episode, or one for a number of trials.
    The phase is by default the usual one; it is empty for a number of trials, and for a measure of
    recovery from a failure.
    """
    has_failed = any("onset" in results.numbers(condition) for condition in results.conditions)
    recovery = RECOVERY if has_failed else {}
    name = next((m.name for m in recovery.values() if name in (m.heading, m.title)), name)
    measures = {m.name: m for m in (*results.measures, STEPS, RETURN)} if results.phases else {}
    name = next((m.name for m in measures.values() if m.heading == name), name)
    if not results.conditions:
        raise SpecError("no trial has finished")
    if phase is not None and phase not in results.phases:
        raise SpecError(f"phase = {phase!r}: {closest(phase, results.phases)}")
    if name in recovery:
        measure, values = recovery_by_seed(results, name, phase or "training")
        return measure, {c: own.to_frame() for c, own in values.items()}, ""
    if name in measures:
        phase = phase or usual_phase(results, name)
        measure = results.steps(phase) if name == STEPS.name else measures[name]
        of_phase = {c: results.by_seed(c, phase, name) for c in results.of_phase(phase)}
        known = {c: own for c, own in of_phase.items() if own.size}
        if not known:
            raise SpecError(f"measure = {name!r}: no condition has it in the phase {phase!r}")
        return measure, known, phase
    numbers = {c: results.numbers(c) for c in results.conditions}
    columns = dict.fromkeys(n for own in numbers.values() for n in own)
    names = {c: (c, c.removeprefix(SECONDS), describe_number(c)[0].heading) for c in columns}
    column = next((c for c in columns if name in names[c]), None)
    if column is None:
        raise SpecError(f"measure = {name!r}: {closest(name, {*measures, *recovery, *columns})}")
    measure, factor = describe_number(column)
    of_trials = {
        c: pd.DataFrame(factor * own[column], results.seeds(c))
        for c, own in numbers.items()
        if column in own
    }
    return measure, of_trials, ""


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
