"""Growth of a study's results with the team size: laws by groups of conditions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...core.numerics import pd
from ...core.plugins.words import closest, show
from ..errors import SpecError
from ..results.analysis import Summary
from ..results.comparison import title_of, values_of
from ..results.notation import format_estimate, format_number, format_p, wrapped
from ..results.permutation_tests import LEVEL, holm
from ..results.power import seeds_for
from ..results.power_text import APART
from ..results.results import Results
from ..results.statistics import NOT_NEGATIVE, bootstrap
from . import fitting
from .samples import GEOMETRIC, of_numbers, of_rates, of_times
from .size_axis import SizeAxis, check_size

WINDOW = 5
"""Number of consecutive episodes over which mean success must reach a criterion."""


class Fitted(NamedTuple):
    """The law of a group of conditions."""

    group: str
    """Settings that the conditions have in common; empty if there are none."""
    law: fitting.Law | None
    """None if there is no law, see `why`."""
    why: str = ""
    """Reason why there is no law, in one sentence."""
    censored: int = 0
    """Number of runs that did not reach the criterion."""
    left_out: int = 0
    """Number of runs of seeds that lack another size."""


class ScalingLaw(NamedTuple):
    """Growth of one measure with size."""

    title: str
    """Title of the measure."""
    size: str
    """Name of the size: robots, joints, agents."""
    fits: tuple[Fitted, ...]
    """Laws by group."""
    predicted: tuple[int, ...]
    """Sizes that are predicted besides those that were run."""
    remarks: tuple[str, ...] = ()
    """Reasons to doubt that one law holds for all sizes."""

    @property
    def table(self) -> tuple[Summary, ...]:
        """A line for each group that has a law: the meaning of its parameters, and predictions."""
        lines = []
        for group, law, *_ in self.fits:
            if law is not None:
                estimates = {**law.exponents()}
                estimates |= {f"at {n} (90%)": law.predict(n) for n in self.predicted}
                lines.append(Summary(group or "all", law.seeds, estimates))
        return tuple(lines)

    @property
    def legend(self) -> tuple[str, ...]:
        """Computation of the table's values and intervals, in lines."""
        text = "Intervals of parameters: 95%, seeds resampled, Student's."
        scales = {law.sample.scale for _, law, *_ in self.fits if law is not None}
        if self.predicted:
            text += (
                " Predictions: the law at that size, with the 90% interval of the mean of as many "
                "seeds, which follows the drift of the largest sizes."
            )
        if GEOMETRIC in scales:
            text += " Times to a criterion are geometric means."
        return tuple(wrapped(text))

    @property
    def notes(self) -> tuple[str, ...]:
        """Chosen laws, how they predicted sizes that were left out, how groups differ."""
        lines: list[str] = []
        for fitted in self.fits:
            lines += wrapped(_sentence(fitted, self.size))
            lines += self._limited(fitted)
        lines += self._comparisons()
        for remark in self.remarks:
            lines += wrapped(remark)
        return tuple(lines)

    def _limited(self, fitted: Fitted) -> list[str]:
        """Return a sentence for each prediction that the range of the measure limits."""
        if fitted.law is None:
            return []
        head = f"{fitted.group}: " if fitted.group else ""
        lines = []
        for n in self.predicted:
            value = float(fitted.law.curve_at(np.array([float(n)]))[0])
            limit = float(np.clip(value, *fitted.law.sample.bounds))
            if value != limit:
                lines += wrapped(
                    f"{head}at {n} the law gives {format_number(value)}, outside "
                    f"the range of {self.title}, so that {format_number(limit)} is predicted."
                )
        return lines

    def _comparisons(self) -> list[str]:
        """Return how exponents differ from that of the first group, of equal seeds and sizes."""
        known = [(f.group, f.law) for f in self.fits if f.law is not None]
        base = known[0] if known else None
        if base is None or not _is_line(base[1]):
            return []
        pairs = [(g, fitting.compare(law, base[1])) for g, law in known[1:] if _alike(law, base[1])]
        if not pairs:
            return []
        lines = [f"Exponents, minus that of {base[0]}:"]
        ps = holm([contrast.p for _, contrast in pairs]).tolist()
        for (group, contrast), p in zip(pairs, ps, strict=True):
            word = "differs" if p < LEVEL else "no significant difference"
            shown = format_estimate(contrast.difference)
            lines += wrapped(f"{word}: {group}, {shown}, p {format_p(p)}", "  ")
        spread = max(contrast.deviation for _, contrast in pairs)
        seeds = seeds_for(APART, spread, len(pairs)) if spread > 0.0 else None
        if seeds is not None:
            lines += wrapped(
                f"Power: about {seeds} seeds at these sizes detect a difference of exponents of "
                f"{format_number(APART)} with power 0.80."
            )
        return lines


def _is_line(law: fitting.Law) -> bool:
    return law.curve.n_parameters == 2 and not law.sample.censored.any()


def _alike(law: fitting.Law, base: fitting.Law) -> bool:
    """Return whether exponents can be compared seed by seed."""
    same_shape = law.sample.values.shape == base.sample.values.shape
    return _is_line(law) and same_shape and bool((law.sample.sizes == base.sample.sizes).all())


def _sentence(fitted: Fitted, size: str) -> str:
    head = f"{fitted.group}: " if fitted.group else ""
    law = fitted.law
    if law is None:
        return f"{head}no law: {fitted.why}"
    sizes = law.sample.sizes
    counted = f"{law.seeds} seeds, {len(sizes)} sizes from {sizes[0]:g} to {sizes[-1]:g} {size}"
    if fitted.censored:
        counted += f", {fitted.censored} runs censored"
    if fitted.left_out:
        counted += f"; {fitted.left_out} runs left out because their seeds lack another size"
    text = f"{head}{law.curve.name}, {law.formula} ({counted})"
    for n, measured, e in law.held_out:
        inside = "inside" if e.low <= measured <= e.high else "outside"
        text += f"; {n:g} left out: predicted {format_estimate(e)}, "
        text += f"measured {format_number(measured)}, {inside}"
    if law.sample.values.var(axis=0).max() <= fitting.FLAT:
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
        Phase of the episodes; by default ``evaluation``, or ``training`` if there is none.
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
    measured = (
        _measured(results, measure, phase)
        if criterion is None
        else _until_criterion(results, measure, criterion)
    )
    fits = []
    for group, sizes in axis.groups().items():
        own = {condition: n for condition, n in sizes.items() if condition in measured.values}
        if own:
            fits.append(_fit(group, own, measured))
    return ScalingLaw(measured.title, axis.name, tuple(fits), tuple(predict))


class SizedValues(NamedTuple):
    """Values that laws are fitted to, by condition."""

    title: str
    values: Mapping[str, pd.Series]
    """By seed."""
    bounds: tuple[float, float]
    """Minimum and maximum of the measure."""
    episodes: Mapping[str, float] = {}
    """Number of episodes of a seed, if the values are rates."""
    censored: Mapping[str, pd.Series] = {}
    """For times to a criterion: whether each seed has not reached it."""


def _measured(results: Results, measure: str, phase: str | None) -> SizedValues:
    """Return the means of seeds of a measure."""
    phases = [phase] if phase else ["evaluation", "training"]
    own = next((p for p in phases if p in results.phases), phases[0])
    shown_as, values, own = values_of(results, measure, own)
    series = {condition: pd.Series(each) for condition, each in values.items()}
    episodes = _episodes(results, own) if shown_as.is_rate else {}
    return SizedValues(title_of(shown_as, own), series, shown_as.bounds, episodes)


def _until_criterion(results: Results, measure: str, criterion: float) -> SizedValues:
    """Return the decisions of seeds until a criterion."""
    samples = decisions_to_criterion(results, measure, criterion)
    values, censored = ({c: own[k] for c, own in samples.items()} for k in (0, 1))
    title = f"decisions to {format_number(criterion)} of {measure}"
    return SizedValues(title, values, NOT_NEGATIVE, censored=censored)


def _episodes(results: Results, phase: str) -> dict[str, float]:
    """Return the mean number of episodes of a seed by condition."""
    own = results.episodes[results.episodes["phase"] == phase]
    counts = own.groupby("condition", sort=False)["seed"].agg(["size", "nunique"])
    return dict(counts["size"] / counts["nunique"])


def decisions_to_criterion(
    results: Results, measure: str, criterion: float
) -> dict[str, tuple[pd.Series, pd.Series]]:
    """Return by condition decisions until the criterion, or all, and whether it was not reached."""
    rates = {m.name for m in results.measures if m.is_rate}
    if measure not in rates:
        raise SpecError(f"measure = {measure!r}: {closest(measure, rates)}; a rate has a criterion")
    if not 0.0 < criterion <= 1.0:
        raise SpecError(f"criterion = {show(criterion)}: must be above 0 and at most 1")
    samples = {}
    for condition in results.of_phase("training"):
        if not results.has(condition, "training", measure):
            continue
        reached = results.values(condition, measure).astype(float)
        spent = results.values(condition, "steps").cumsum(axis=1)
        width = min(WINDOW, reached.shape[1])
        sums = np.cumsum(np.pad(reached, ((0, 0), (1, 0))), axis=1)
        means = (sums[:, width:] - sums[:, :-width]) / width
        is_there = means >= criterion - 1e-12
        first = np.where(is_there.any(axis=1), is_there.argmax(axis=1), means.shape[1] - 1)
        decisions = spent[np.arange(len(spent)), first + width - 1]
        seeds = results.seeds(condition)
        unreached = pd.Series(~is_there.any(axis=1), seeds)
        samples[condition] = pd.Series(decisions.astype(float), seeds), unreached
    return samples


def _fit(group: str, sizes_of: Mapping[str, float], measured: SizedValues) -> Fitted:
    """Return the law of a group, from the seeds that ran at all sizes, which are in order."""
    sizes = np.array(list(sizes_of.values()))
    if not (np.diff(sizes) > 0.0).all():
        return Fitted(group, None, "a size occurs twice; conditions differ in something else")
    every = pd.DataFrame({c: measured.values[c] for c in sizes_of})
    frame = every.dropna()
    values = frame.to_numpy(dtype=float)
    left_out = int(every.count().sum()) - values.size
    censored = np.zeros(values.shape, dtype=bool)
    if measured.censored:
        marks = pd.DataFrame({c: measured.censored[c] for c in sizes_of})
        censored = marks.loc[frame.index].to_numpy(dtype=bool)
    if values.size and not censored.any() and np.ptp(values) == 0.0:
        return Fitted(group, None, f"every run has {format_number(values[0, 0])}")
    try:
        if measured.episodes:
            counts = np.array([measured.episodes[c] for c in sizes_of])
            sample = of_rates(sizes, values, counts)
        elif measured.censored:
            sample = of_times(sizes, values, censored)
        else:
            sample = of_numbers(sizes, values, measured.bounds)
        law = fitting.choose(sample)
        return Fitted(group, law, censored=int(censored.sum()), left_out=left_out)
    except ValueError as error:
        is_pair = values.shape[1] == 2 and len(values) > 1 and not censored.any()
        if not is_pair:
            return Fitted(group, None, str(error))
        most = 1.0 if measured.episodes else np.inf
        less = bootstrap(values[:, 1] - values[:, 0], bounds=(-most, most))
        return Fitted(group, None, f"{error}; the larger less the smaller: {format_estimate(less)}")
