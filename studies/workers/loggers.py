"""Who else is told of every trial that has finished: TensorBoard, MLflow, or a tool of one's own.

A logger is a class that is called with the spec and the study's directory, and has the methods of
`TrialLogger`. It is named as ``"file.py:Name"``, relative to the working directory, or is offered
by an installed package in the group ``nested_agents.loggers``. None is built in, and none is used
unless asked for. A logger that raises loses nothing: every result is in the store before it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Protocol

from ...core.plugins.registry import Registry
from ..errors import SpecError
from ..spec.spec import Spec
from ..trials.trial import Trial, TrialResult
from .worker import Outcome

LOGGERS = Registry("logger", {})
"""Loggers by name."""


class TrialLogger(Protocol):
    """Is told of trials, in the order in which they finish."""

    def trial(self, trial: Trial, result: TrialResult) -> None:
        """Learn what a trial has measured: ``result.rows`` are its episodes."""

    def close(self) -> None:
        """Learn that no trial will follow."""


def make(name: str, spec: Spec, directory: Path) -> TrialLogger:
    """Return the logger of a name.

    Raises
    ------
    SpecError
        If there is none, or it cannot be made; one line.
    """
    try:
        found: TrialLogger = LOGGERS.find(name)(spec, directory)
    except Exception as error:
        raise SpecError(f"--log {name}: {error}") from None
    missing = [part for part in ("trial", "close") if not callable(getattr(found, part, None))]
    if missing:
        raise SpecError(f"--log {name}: has no {missing[0]}, needs trial and close")
    return found


def logged(
    outcomes: Iterable[Outcome], loggers: Sequence[TrialLogger], note: Callable[[str], None]
) -> Iterator[Outcome]:
    """Yield outcomes after telling loggers of them; one that raises is told no more."""
    left = list(loggers)
    try:
        for outcome in outcomes:
            for logger in tuple(left) if outcome.result is not None else ():
                assert outcome.result is not None
                try:
                    logger.trial(outcome.trial, outcome.result)
                except Exception as error:
                    left.remove(logger)
                    named = type(logger).__name__
                    note(f"{named} is told no more: {type(error).__name__}: {error}")
            yield outcome
    finally:
        for logger in left:
            with suppress(Exception):
                logger.close()
