"""Trackers of experiments that are told of every finished trial: TensorBoard, MLflow, W&B.

None of their packages is needed by anything else. A trial is written once its result is kept in the
study; those of earlier runs are not written again.
"""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from ...core.plugins.words import closest
from ..errors import SpecError
from ..spec.spec import Spec
from ..spec.tables import flat
from ..trials.episodes import EpisodeRow
from ..trials.trial import Trial, TrialResult
from ..workers.runner import Observer, Outcome


class Tracker(ABC):
    """Writes finished trials to a tool; a subclass says how.

    Parameters
    ----------
    directory
        Of the study.

    Raises
    ------
    ImportError
        If its package is not installed.
    """

    package = ""
    """What must be installed."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self.module: Any = import_module(self.package)

    @abstractmethod
    def write(self, trial: Trial, result: TrialResult) -> None:
        """Write what a trial has measured."""


class TensorBoard(Tracker):
    """Curves of every measure, a run for each trial, below ``tensorboard`` in the study."""

    package = "tensorboard.summary"

    def write(self, trial: Trial, result: TrialResult) -> None:
        """Write a scalar for each measure of each episode."""
        folder = trial.condition.replace(os.sep, "_")
        place = self.directory / "tensorboard" / folder / f"seed {trial.seed}"
        writer = self.module.Writer(str(place))
        for row in result.rows:
            for name, value in _scalars(row).items():
                writer.add_scalar(f"{row.phase}/{name}", value, row.episode)
        writer.close()


class MLflow(Tracker):
    """A run for each trial in an experiment of the study's name: settings, curves, seconds."""

    package = "mlflow"

    def write(self, trial: Trial, result: TrialResult) -> None:
        """Write a run; where, is for ``MLFLOW_TRACKING_URI`` to say."""
        mlflow = self.module
        mlflow.set_experiment(self.directory.resolve().name)
        with mlflow.start_run(run_name=f"{trial.condition}, seed {trial.seed}"):
            mlflow.log_params(_settings(trial))
            for row in result.rows:
                phase = row.phase.replace(":", "/")
                values = {f"{phase}/{name}": value for name, value in _scalars(row).items()}
                mlflow.log_metrics(values, step=row.episode)
            mlflow.log_metrics({f"seconds/{part}": s for part, s in result.seconds.items()})


class WandB(Tracker):
    """A run for each trial in a project of the study's name, grouped by condition."""

    package = "wandb"

    def write(self, trial: Trial, result: TrialResult) -> None:
        """Write a run; ``WANDB_MODE=offline`` keeps it here."""
        run = self.module.init(
            project=self.directory.resolve().name,
            dir=str(self.directory),
            group=trial.condition,
            name=f"{trial.condition}, seed {trial.seed}",
            config=_settings(trial),
            settings=self.module.Settings(silent=True, console="off"),
        )
        for row in result.rows:
            values = {f"{row.phase}/{name}": value for name, value in _scalars(row).items()}
            run.log({**values, "episode": row.episode})
        run.summary.update({f"seconds/{part}": s for part, s in result.seconds.items()})
        run.finish()


TRACKERS: dict[str, type[Tracker]] = {"tensorboard": TensorBoard, "mlflow": MLflow, "wandb": WandB}
"""By the name that ``--track`` takes."""


def _scalars(row: EpisodeRow) -> dict[str, float]:
    """Return what was measured of an episode, by name."""
    measured = {name: float(value) for name, value in row.measures.items()}
    return {**measured, "steps": float(row.steps), "return": row.return_}


def _settings(trial: Trial) -> dict[str, Any]:
    """Return what a trial depends on, by dotted key; lists as text."""
    settings = dict(flat(trial.settings.model_dump(mode="json")))
    plain = {k: v if isinstance(v, int | float | str) else str(v) for k, v in settings.items()}
    return {"condition": trial.condition, "seed": trial.seed, **plain}


class Tracking(Observer):
    """Tells trackers of every finished trial, and another observer of everything.

    Parameters
    ----------
    names
        Of `TRACKERS`.
    directory
        Of the study.
    observer
        The other one.

    Raises
    ------
    SpecError
        If there is no such tracker, or it is not installed; one line.
    """

    def __init__(self, names: Sequence[str], directory: Path, observer: Observer) -> None:
        self._observer = observer
        self._trackers = [_tracker(name, directory) for name in dict.fromkeys(names)]

    def announce(self, spec: Spec, directory: Path, processes: int) -> None:
        """See `Observer.announce`."""
        self._observer.announce(spec, directory, processes)

    def note(self, line: str) -> None:
        """See `Observer.note`."""
        self._observer.note(line)

    def follow(self, outcomes: Iterable[Outcome], total: int, done: int) -> None:
        """Let the other observer ask for the outcomes, each of which is written first."""
        self._observer.follow(self._written(outcomes), total, done)

    def _written(self, outcomes: Iterable[Outcome]) -> Iterator[Outcome]:
        for outcome in outcomes:
            if outcome.result is not None:
                for tracker in self._trackers:
                    tracker.write(outcome.trial, outcome.result)
            yield outcome


def _tracker(name: str, directory: Path) -> Tracker:
    if name not in TRACKERS:
        raise SpecError(f"track = {name!r}: {closest(name, TRACKERS)}")
    try:
        return TRACKERS[name](directory)
    except ImportError as error:
        raise SpecError(
            f"track = {name!r}: {error.name or name} is not installed; pip install {name}"
        ) from None
