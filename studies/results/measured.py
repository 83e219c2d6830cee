"""Values of a measure by condition and seed, for comparisons and laws of growth."""

from collections.abc import Collection
from contextlib import suppress
from dataclasses import replace

import numpy as np

from ...core.interface.measures import RETURN, SUCCESS, Measure
from ...core.numerics import pd
from ...core.plugins.words import closest, near
from ..errors import SpecError
from .differences import BySeed
from .notation import MIN_LARGEST
from .recovery import LOSS, RECOVERED, RECOVERY, never_recovered, recovery_by_seed
from .results import SECONDS, STEPS, Results, describe_number, row_means
from .scores import LAST_STEP


def title_of(measure: Measure, phase: str) -> str:
    """Return the title of a measure in a phase.

    >>> title_of(SUCCESS, "evaluation"), title_of(SUCCESS, "evaluation:eight")
    ('evaluation success', 'success, eight')
    >>> title_of(SUCCESS, "training:first stage")
    'training success, first stage'
    """
    kind, _, name = phase.partition(":")
    title = f"{'' if name and kind == 'evaluation' else kind} {measure.heading}".lstrip()
    return f"{title}, {name}" if name else title


def usual_phase(results: Results, measure: str) -> str:
    """Return the phase of evaluation if all trained conditions have it, else that of training.

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
    if LAST_STEP not in results.phases and (trained or len(results.phases) < 2):
        return next(iter(results.phases), "training")
    raise SpecError(f"phase: name one, known: {', '.join(results.phases)}")


def default_measure(results: Results) -> str:
    """Return the measure that is compared by default: recovery, or without it `Results.main`.

    Training with a failure has episodes before and after it, of which `Results.main` is the mean.
    """
    if _has_failed(results):
        with suppress(SpecError):  # no seed succeeded before the failure
            recovery_by_seed(results, RECOVERED.name, "training")
            return RECOVERED.name
    return results.main.name


def _has_failed(results: Results) -> bool:
    """Return whether a trained condition has a failure during training."""
    return any("onset" in results.numbers(c) for c in results.of_phase("training"))


def values_of(
    results: Results, name: str, phase: str | None = None
) -> tuple[Measure, dict[str, BySeed], str]:
    """Return a measure, its means by condition and seed, and their phase.

    Raises
    ------
    SpecError
        As `values_by_seed`, and if a seed never recovers, whose time to recovery is unknown.
    """
    measure, values, own_phase = values_by_seed(results, name, phase)
    if bounds := never_recovered(results, measure, phase):
        raise SpecError(
            f"measure = {name!r}: unknown where a seed never recovers, as of {min(bounds)!r}; "
            f"allowed: {RECOVERED.name}, {LOSS.name}"
        )
    return measure, {condition: row_means(own) for condition, own in values.items()}, own_phase


def values_by_seed(
    results: Results, name: str, phase: str | None = None
) -> tuple[Measure, dict[str, pd.DataFrame], str]:
    """Return a measure, its values by condition, and their phase.

    Values have a row for each seed and a column for each episode, or one column for a number of
    trials or a measure of recovery, which have an empty phase.

    Raises
    ------
    SpecError
        If no trial has finished, or the results have no such measure or phase.
    """
    if not results.conditions:
        raise SpecError("no trial has finished")
    if phase is not None and phase not in results.phases:
        raise SpecError(f"phase = {phase!r}: {closest(phase, results.phases)}")
    recovery = RECOVERY if _has_failed(results) else {}
    measures = {m.name: m for m in (*results.measures, STEPS, RETURN)} if results.phases else {}
    titles = {m.heading: m.name for m in reversed([*measures.values()])}
    titles |= {title: m.name for m in recovery.values() for title in (m.heading, m.title)}
    name = name if name in measures else titles.get(name, name)
    if name in RECOVERY and not recovery:
        raise SpecError(
            f"measure = {name!r}: needs episodes and a failure (onset) in training; the two tables "
            "of an exported study, episodes and trials, must be in one folder"
        )
    if name in recovery:
        measure, values = recovery_by_seed(results, name, phase or "training")
        return measure, {c: own.to_frame() for c, own in values.items()}, ""
    if name in measures:
        phase = phase or usual_phase(results, name)
        of_phase = {c: results.by_seed(c, phase, name) for c in results.of_phase(phase)}
        known = {c: own for c, own in of_phase.items() if own.size}
        if not known:
            raise SpecError(f"measure = {name!r}: no condition has it in the phase {phase!r}")
        measure = measures[name]
        if name == STEPS.name:
            measure, known = _until_success(results, known, phase)
        largest = max(float(own.abs().max(axis=None)) for own in known.values())
        if 0.0 < largest < MIN_LARGEST:
            raise SpecError(
                f"measure = {name!r}: the largest value is {largest:.3g}, allowed: at least "
                f"{MIN_LARGEST:g}, or 0; use a smaller unit"
            )
        return measure, known, phase
    present = {*results.episodes.dropna(axis=1, how="all")}.intersection(measures)
    return trial_numbers(results, name, present | {*recovery})


def _until_success(
    results: Results, lengths: dict[str, pd.DataFrame], phase: str
) -> tuple[Measure, dict[str, pd.DataFrame]]:
    """Return decisions until success: failed episodes count with the longest that is allowed.

    Where success is unknown or impossible, the lengths of episodes are returned unchanged, as a
    measure of which neither higher nor lower values are better.

    Raises
    ------
    SpecError
        If episodes failed and the longest that is allowed is unknown.
    """
    steps = results.steps(phase)
    success = next((m for m in results.measures if m.name == SUCCESS.name and m.is_rate), None)
    is_known = all(results.has(c, phase, SUCCESS.name) for c in lengths)
    if success is None or success.greatest == 0.0 or not is_known:
        return steps, lengths
    longest = steps.bounds[1]
    values = {c: own.mask(results.by_seed(c, phase) == 0.0, longest) for c, own in lengths.items()}
    if any(np.isinf(own).any(axis=None) for own in values.values()):
        raise SpecError(
            f"measure = {STEPS.name!r}: failed episodes count with the longest that is allowed, "
            "which is unknown or differs; compare success"
        )
    return replace(steps, title="steps to success", better="lower"), values


def trial_numbers(
    results: Results, name: str, others: Collection[str] = ()
) -> tuple[Measure, dict[str, pd.DataFrame], str]:
    """Return a number of whole trials as `values_by_seed` does.

    `others` are further measures, which a message names. A measure of episodes may have the same
    name as the number.
    """
    numbers = {c: results.numbers(c) for c in results.conditions}
    columns = dict.fromkeys(n for own in numbers.values() for n in own)
    shown = {c: describe_number(c)[0] for c in columns}
    names = {c: (c, c.removeprefix(SECONDS), m.name, m.heading) for c, m in shown.items()}
    column = next((c for c in columns if name in names[c]), None)
    if column is None:
        named = sorted({*others, *(m.name for m in shown.values())})
        spellings = [*named, *(m.heading for m in shown.values())]
        known = f"{near(name, spellings)} known: {', '.join(named)}".lstrip()
        if not results.phases and name == RETURN.name:  # the measure by default
            raise SpecError(f"measure: name one, because there are no episodes; {known}")
        raise SpecError(f"measure = {name!r}: {known}")
    measure, factor = describe_number(column)
    of_trials = {
        c: pd.DataFrame(factor * own[column], results.seeds(c))
        for c, own in numbers.items()
        if column in own
    }
    return measure, of_trials, ""
