"""Predictions for team sizes that were not run, and their comparison with later results.

The laws and intervals are those of `nested_agents.studies.laws`. A prediction file holds
the spec of the study and a hash, so that a later change of the file is found.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydantic import TypeAdapter, ValidationError

from ..errors import SpecError
from ..laws.scaling import scaling_law
from ..laws.size_axis import SizeAxis, check_size, columns_of
from ..presentation.reports import Report
from ..presentation.tables import SummaryTable, tabulate
from ..results.analysis import Summary, mean_estimate
from ..results.json_files import CHECKSUM, checksum
from ..results.measured import values_by_seed
from ..results.notation import format_estimate, format_number
from ..results.results import Results
from ..results.statistics import Estimate
from ..spec.tables import SpecTable, flat
from ..store import durable
from .data import ALL_TEAMS, HEADINGS, NUMBERS, TIME

LEVEL = 0.9
"""Coverage of the intervals, for the mean of as many seeds as were fitted."""
PREDICTED = f"predicted ({LEVEL:.0%})"
"""Heading of predicted means."""
FREE_KEYS = ("seeds", "title", "keep_teams")
"""Keys besides the size in which the spec of later results may differ."""


class SizePrediction(NamedTuple):
    """The predicted mean of a measure for one hierarchy at one size."""

    measure: str
    title: str
    hierarchy: str
    size: float
    value: float
    low: float
    high: float

    @property
    def name(self) -> str:
        """Hierarchy, size and measure."""
        return f"{self.hierarchy}, {self.size:g}: {self.title}"

    @property
    def estimate(self) -> Estimate:
        """The predicted mean with its interval."""
        return Estimate(*map(np.asarray, (self.value, self.low, self.high)))

    def holds(self, measured: Estimate) -> bool:
        """Return whether the measured mean is within the interval."""
        return self.low <= float(measured.value) <= self.high


class PredictionFile(NamedTuple):
    """Content of a prediction file."""

    size: str
    """Swept key that is the size."""
    seeds: int
    """Smallest number of seeds that a law was fitted to."""
    spec: dict[str, object]
    """Spec of the study that the predictions are based on."""
    predictions: tuple[SizePrediction, ...]
    sha256: str = ""
    """Hash of everything else."""

    @property
    def digest(self) -> str:
        """Hash of everything but the hash."""
        return checksum(self._to_dict())

    def write(self, path: Path) -> None:
        """Write the file with its hash."""
        table = {**self._to_dict(), CHECKSUM: self.digest}
        durable.write(path, json.dumps(table, indent=1).encode())

    def _to_dict(self) -> dict[str, object]:
        return {**self._asdict(), "predictions": [p._asdict() for p in self.predictions]}

    @classmethod
    def read(cls, path: Path) -> PredictionFile:
        """Read a file.

        Raises
        ------
        SpecError
            If it is no prediction file, or was changed after it was written; one line.
        """
        try:
            content = TypeAdapter(cls).validate_json(durable.read_text(path))
        except (ValidationError, ValueError):
            raise SpecError(
                f"{path}: is no prediction file; scalability --predict N --out FILE writes one"
            ) from None
        if content.sha256 != content.digest:
            raise SpecError(f"{path}: was changed after it was written: its hash does not match")
        return content


def predict(
    results: Results, spec: SpecTable, measure: str, size: str | None, sizes: Sequence[int]
) -> tuple[PredictionFile, tuple[str, ...]]:
    """Return predictions of performance, time and costs, and remarks on measures without a law.

    Parameters
    ----------
    results, spec
        The study.
    measure
        Measure of performance.
    size
        The swept key that is the size; by default the number of robots or agents.
    sizes
        Sizes to predict, none of which was run.

    Raises
    ------
    SpecError
        If a size was run, or nothing has a law; one line.
    """
    axis = SizeAxis.of(results, size)
    run = {n for _, n in axis.places.values()}
    for n in sizes:
        check_size("predict", n)
        if n in run:
            raise SpecError(f"predict = {n}: was run; name sizes that were not")
    headings = {number: HEADINGS[cost] for cost, number in NUMBERS.items()}
    predictions: list[SizePrediction] = []
    remarks: list[str] = []
    seeds: list[int] = []
    for name in dict.fromkeys((measure, TIME, *headings)):
        try:
            growth = scaling_law(results, name, size=axis.key, predict=sizes)
        except SpecError:
            if name == measure:
                raise
            continue  # was not measured
        title = headings.get(name, growth.title)
        for group, law in growth.fits.items():
            hierarchy = group or ALL_TEAMS
            if isinstance(law, str):
                remarks.append(f"{hierarchy}: {title} is not predicted: {law}.")
                continue
            seeds.append(law.seeds)
            for n in sizes:
                ends = map(float, law.predict(n, LEVEL))
                predictions.append(SizePrediction(name, title, hierarchy, float(n), *ends))
    if not predictions:
        raise SpecError(f"predict: no measure has a law; {' '.join(remarks)}")
    plain = json.loads(json.dumps(spec))
    return PredictionFile(axis.key, min(seeds), plain, tuple(predictions)), tuple(remarks)


@dataclass(frozen=True, repr=False)
class Predictions(Report):
    """Predictions that were written to a file."""

    file: PredictionFile
    notes: tuple[str, ...] = ()

    @property
    def table(self) -> SummaryTable:
        """The predicted means."""
        seeds = self.file.seeds
        own = self.file.predictions
        return tabulate([Summary(p.name, seeds, {PREDICTED: p.estimate}) for p in own])


@dataclass(frozen=True, repr=False)
class PredictionCheck(Report):
    """Predictions compared with later results."""

    file: PredictionFile
    checked: tuple[tuple[SizePrediction, int, Estimate], ...]
    """Predictions, and what was measured later: number of seeds and mean."""

    @property
    def table(self) -> SummaryTable:
        """Predicted and measured means."""
        return tabulate(
            [
                Summary(own.name, seeds, {PREDICTED: own.estimate, "measured": measured})
                for own, seeds, measured in self.checked
            ]
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """The number of predictions that held, and those that did not."""
        failed = [(own, measured) for own, _, measured in self.checked if not own.holds(measured)]
        total = len(self.checked)
        expected = format_number(LEVEL * total)
        lines = [
            f"{total - len(failed)} of {total} predictions held; {expected} are expected at "
            f"{LEVEL:.0%}."
        ]
        for own, measured in failed:
            both = (
                f"predicted {format_estimate(own.estimate)}, measured {format_estimate(measured)}"
            )
            lines.append(f"Not held: {own.name}, {both}.")
        if {seeds for _, seeds, _ in self.checked} != {self.file.seeds}:
            lines.append(
                f"Intervals are for means of {self.file.seeds} seeds; other numbers of seeds were "
                "measured."
            )
        return tuple(lines)

    def to_dict(self) -> dict[str, object]:
        """Return everything as plain data, which JSON can hold."""
        rows = [
            {"seeds": seeds, "measured": float(measured.value), "held": own.holds(measured)}
            for own, seeds, measured in self.checked
        ]
        checked = [own._asdict() | row for (own, *_), row in zip(self.checked, rows, strict=True)]
        return {"sha256": self.file.sha256, "checked": checked, "sentences": list(self.notes)}


def check(file: PredictionFile, results: Results, spec: SpecTable) -> PredictionCheck:
    """Compare predictions with results of a study that differs in its sizes and seeds alone.

    Raises
    ------
    SpecError
        If the specs differ in another key, or no predicted size was measured; one line.
    """
    _check_spec(file, spec)
    swept = {c: own for c, own in columns_of(results).items() if file.size in own}
    condition_at = {
        (group or ALL_TEAMS, n): condition
        for condition, (group, n) in SizeAxis.by(file.size, swept).places.items()
    }
    measured = {
        name: values_by_seed(results, name) for name in {p.measure for p in file.predictions}
    }
    checked: list[tuple[SizePrediction, int, Estimate]] = []
    for prediction in file.predictions:
        measure, values, _ = measured[prediction.measure]
        condition = condition_at.get((prediction.hierarchy, prediction.size))
        if condition in values:
            own = values[condition]
            checked.append((prediction, len(own), mean_estimate(measure, own)))
    if not checked:
        predicted = ", ".join(f"{n:g}" for n in sorted({p.size for p in file.predictions}))
        raise SpecError(
            f"check: none of the predicted sizes was measured: {file.size} = {predicted}; the "
            "study must sweep this key"
        )
    return PredictionCheck(file, tuple(checked))


def _check_spec(file: PredictionFile, spec: SpecTable) -> None:
    free = (file.size, *FREE_KEYS)
    predicted, measured = (
        {key: value for key, value in flat(own) if key.removeprefix("sweep.") not in free}
        for own in (file.spec, json.loads(json.dumps(spec)))
    )
    for key in dict.fromkeys((*predicted, *measured)):
        if predicted.get(key) != measured.get(key):
            raise SpecError(
                f"check: {key} = {measured.get(key, 'absent')}, but "
                f"{predicted.get(key, 'absent')} in the prediction: specs must be equal except "
                f"for {file.size} and seeds"
            )
