"""Growth of a study's results with the team size: laws by groups of conditions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from numbers import Real
from typing import NamedTuple

import numpy as np

from ...core.numerics import pd
from ...core.plugins.words import closest, expect, show
from ..errors import SpecError
from ..results.analysis import Summary
from ..results.differences import BySeed
from ..results.measured import title_of, values_of
from ..results.notation import format_estimate, format_number, format_p, wrapped
from ..results.permutation_tests import LEVEL, holm
from ..results.power import deviation_of
from ..results.power_text import power_text
from ..results.results import Results
from ..results.statistics import Array
from ..store.database import STAGE
from . import fitting
from .curves import POWER
from .fitting import Law
from .inference import mean_interval
from .samples import GEOMETRIC, Sample, of_numbers, of_rates, of_times
from .size_axis import SizeAxis, check_size

WINDOW = 5
"""Number of consecutive episodes over which mean success must reach a criterion."""


class ScalingLaw(NamedTuple):
    """Growth of one measure with size."""

    title: str
    """Title of the measure."""
    size: str
    """Name of the size: robots, joints, agents."""
    fits: Mapping[str, Law | str]
    """Law of each group of conditions, by the settings that they have in common; or the reason why
    there is none, in one sentence."""
    predicted: tuple[int, ...]
    """Sizes that are predicted besides those that were run."""
    remarks: tuple[str, ...] = ()
    """Reasons to doubt that one law holds for all sizes."""

    @property
    def laws(self) -> dict[str, Law]:
        """Laws by group, of the groups that have one."""
        return {group: law for group, law in self.fits.items() if isinstance(law, Law)}

    @property
    def table(self) -> tuple[Summary, ...]:
        """A line for each group that has a law: the meaning of its parameters, and predictions."""
        lines = []
        for group, law in self.laws.items():
            predicted = {f"at {n} (90%)": law.predict(n) for n in self.predicted}
            lines.append(Summary(group or "all", law.seeds, law.exponents() | predicted))
        return tuple(lines)

    @property
    def legend(self) -> tuple[str, ...]:
        """Computation of the table's values and intervals, in lines."""
        text = "Intervals of parameters: 95%, seeds resampled, Student's."
        if self.predicted:
            text += (
                " Predictions: the law at that size, with the 90% interval of the mean of as many "
                "seeds, which follows the drift of the largest sizes."
            )
        if any(law.sample.scale is GEOMETRIC for law in self.laws.values()):
            text += " Times to a criterion are geometric means."
        return tuple(wrapped(text))

    @property
    def notes(self) -> tuple[str, ...]:
        """Chosen laws, how they predicted sizes that were left out, how groups differ."""
        lines: list[str] = []
        for group, law in self.fits.items():
            head = f"{group}: " if group else ""
            if isinstance(law, str):
                lines += wrapped(f"{head}no law: {law}")
            else:
                for text in (_sentence(law, self.size), *self._limited(law)):
                    lines += wrapped(f"{head}{text}")
        lines += self._comparisons()
        for remark in self.remarks:
            lines += wrapped(remark)
        return tuple(lines)

    def _limited(self, law: Law) -> Iterator[str]:
        """Yield a sentence for each prediction that the range of the measure limits."""
        for n in self.predicted:
            value = float(law.curve_at(np.array([float(n)]))[0])
            limit = float(np.clip(value, *law.sample.bounds))
            if value != limit:
                yield (
                    f"at {n} the law gives {format_number(value)}, outside the range of "
                    f"{self.title}, so that {format_number(limit)} is predicted."
                )

    def _comparisons(self) -> list[str]:
        """Return how exponents differ from that of the first group, of equal seeds and sizes."""
        first, *others = self.laws or [""]
        base = self.laws.get(first)
        alike = {g: self.laws[g] for g in others if base and _are_alike(self.laws[g], base)}
        if base is None or not alike:
            return []
        lines = [f"Exponents of power laws, minus that of {first}:"]
        compared = [fitting.compare(law, base) for law in alike.values()]
        adjusted = holm([p for _, p in compared]).tolist()
        for group, (by_seed, _), p in zip(alike, compared, adjusted, strict=True):
            word = "differs" if p < LEVEL else "no significant difference"
            text = f"{word}: {group}, {format_estimate(mean_interval(by_seed))}, p {format_p(p)}"
            lines += wrapped(text, "  ")
        deviation = deviation_of([by_seed for by_seed, _ in compared], of_rates=False)
        return lines + power_text(base.seeds, len(compared), deviation, None, "exponents")


def _are_alike(*laws: Law) -> bool:
    """Return whether the exponents of laws can be compared seed by seed."""
    are_lines = all(law.curve.of is POWER.of and not law.sample.censored.any() for law in laws)
    own, base = (law.sample for law in laws)
    same_shape = own.values.shape == base.values.shape
    return are_lines and same_shape and bool((own.sizes == base.sizes).all())


def _sentence(law: Law, size: str) -> str:
    sizes = law.sample.sizes
    counted = f"{law.seeds} seeds, {len(sizes)} sizes from {sizes[0]:g} to {sizes[-1]:g} {size}"
    if law.sample.censored.any():
        counted += f", {law.sample.censored.sum()} runs censored"
    if law.left_out:
        counted += f"; {law.left_out} runs left out because their seeds lack another size"
    text = f"{law.curve.name}, {law.formula} ({counted})"
    for n, measured, e in law.held_out:
        inside = "inside" if e.low <= measured <= e.high else "outside"
        text += f"; {n:g} left out: predicted {format_estimate(e)}, "
        text += f"measured {format_number(measured)}, {inside}"
    if law.is_exact:
        text += "; all seeds agree, and the law passes through all values"
    elif law.sample.is_flat:
        text += "; all seeds agree, so that intervals of parameters do not show how well it fits"
    return f"{text}."


def scaling_law(
    results: Results,
    measure: str,
    *,
    phase: str | None = None,
    size: str | None = None,
    criterion: float | None = None,
    predict: Sequence[int] = (),
) -> ScalingLaw:
    """Fit how a measure grows with the size of teams, in each group of conditions.

    Parameters
    ----------
    results
        Results of any studies.
    measure
        Name of a measure of episodes, ``steps``, ``return``, or a number of whole trials; with a
        criterion the name of a rate.
    phase
        Phase of the episodes; by default the one that `compare_conditions` takes.
    size
        A swept key that is a number, or the last part of it; by default the only one there is.
    criterion
        Fit the decisions of training until this share of `WINDOW` episodes in a row has the
        measure.
    predict
        Sizes for which the mean of as many seeds is predicted.

    Raises
    ------
    SpecError
        If there is no such measure, phase or key, the key is no number, a size is below 1 or not
        finite, or the criterion is no share.
    """
    axis = SizeAxis.of(results, size)
    for n in predict:
        check_size("predict", n)
    if criterion is None:
        title, values, sample_of = _measured(results, measure, phase)
    else:
        title, values, sample_of = _until_criterion(results, measure, criterion)
    fits = {}
    for group, sizes in axis.groups().items():
        own = {condition: n for condition, n in sizes.items() if condition in values}
        if own:
            fits[group] = _fit(own, values, sample_of)
    return ScalingLaw(title, axis.name, fits, tuple(predict))


Measured = tuple[str, Mapping[str, BySeed], Callable[[Array, pd.DataFrame], Sample]]
"""Title of a measure, its values by condition and seed, and a function that returns the sample of
sizes and of values with a row for each seed and a column for each condition."""


def _measured(results: Results, measure: str, phase: str | None) -> Measured:
    """Return the means of seeds of a measure."""
    shown_as, values, own = values_of(results, measure, phase)
    title = title_of(shown_as, own)
    if not shown_as.is_rate:
        return (
            title,
            values,
            lambda sizes, frame: of_numbers(sizes, _varied(frame), shown_as.bounds),
        )
    episodes = results.episodes[results.episodes["phase"] == own]
    counts = episodes.groupby("condition", sort=False)["seed"].agg(["size", "nunique"])
    of_seed = (counts["size"] / counts["nunique"]).reindex([*values], fill_value=1.0)
    return (
        title,
        values,
        lambda sizes, frame: of_rates(sizes, _varied(frame), of_seed[frame.columns].to_numpy()),
    )


def _until_criterion(results: Results, measure: str, criterion: float) -> Measured:
    """Return the decisions of seeds until a criterion."""
    reached = decisions_to_criterion(results, measure, criterion)
    title = f"decisions to {format_number(criterion)} of {measure}"

    def sample_of(sizes: Array, frame: pd.DataFrame) -> Sample:
        marks = pd.DataFrame({condition: reached[condition][1] for condition in frame})
        censored = marks.loc[frame.index].to_numpy(dtype=bool)
        values = frame.to_numpy(dtype=float) if censored.any() else _varied(frame)
        return of_times(sizes, values, censored)

    return title, {condition: decisions for condition, (decisions, _) in reached.items()}, sample_of


def _varied(frame: pd.DataFrame) -> Array:
    """Return values as an array; refuse values that are all equal."""
    values = frame.to_numpy(dtype=float)
    if values.size and np.ptp(values) == 0.0:
        raise ValueError(f"every run has {format_number(values[0, 0])}")
    return values


def decisions_to_criterion(
    results: Results, measure: str, criterion: float
) -> dict[str, tuple[pd.Series, pd.Series]]:
    """Return by condition decisions until the criterion, or all, and whether it was not reached.

    Those of a curriculum before are counted, too.
    """
    rates = {m.name for m in results.measures if m.is_rate}
    if measure not in rates:
        raise SpecError(f"measure = {measure!r}: {closest(measure, rates)}; a rate has a criterion")
    expect("a share", Real, criterion=criterion)
    if not 0.0 < criterion <= 1.0:
        raise SpecError(f"criterion = {show(criterion)}: must be above 0 and at most 1")
    samples = {}
    for condition in results.of_phase("training"):
        if not results.has(condition, "training", measure):
            continue
        reached = results.values(condition, measure).astype(float)
        spent = np.nancumsum(results.values(condition, "steps"), axis=1)  # rows may be padded
        width = min(WINDOW, reached.shape[1])
        means = np.lib.stride_tricks.sliding_window_view(reached, width, axis=1).mean(axis=2)
        is_there = means >= criterion - 1e-12
        is_censored = ~is_there.any(axis=1)
        first = np.where(is_censored, means.shape[1] - 1, is_there.argmax(axis=1))
        seeds = results.seeds(condition)
        decisions = spent[np.arange(len(spent)), first + width - 1] + sum(
            results.by_seed(condition, stage, "steps").sum(axis=1).reindex(seeds).to_numpy()
            for stage in results.phases
            if stage.startswith(STAGE) and results.has(condition, stage)
        )
        samples[condition] = pd.Series(decisions, seeds, float), pd.Series(is_censored, seeds)
    return samples


def _fit(
    sizes_of: Mapping[str, float],
    values: Mapping[str, BySeed],
    sample_of: Callable[[Array, pd.DataFrame], Sample],
) -> Law | str:
    """Return the law of the seeds that ran at all sizes, which are in order; or why it has none."""
    sizes = np.array(list(sizes_of.values()))
    if not (np.diff(sizes) > 0.0).all():
        return "a size occurs twice; conditions differ in something else"
    every = pd.DataFrame({condition: values[condition] for condition in sizes_of})
    frame = every.dropna()
    if frame.empty:
        return "no seed has a value at every size"
    try:
        law = fitting.choose(sample_of(sizes, frame))
    except ValueError as error:
        return str(error)
    return law._replace(left_out=int(every.count().sum()) - frame.size)
