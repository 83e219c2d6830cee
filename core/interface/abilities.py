"""Optional abilities of scenarios, beyond what learning requires.

A scenario has an ability if it has all members of a protocol, inherited or its own. Each ability is
asked for in one place, which the protocol names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from ..numerics import BoolArray, FloatArray
from .environments import Environments
from .options import LeaderOptions
from .scenario import Scenario, unwrapped

if TYPE_CHECKING:
    pass


@runtime_checkable
class Embodiment(Protocol):
    """Bodies with actuators, for models that adapt an `EmbodiedPrediction`."""

    nominal_effects: tuple[FloatArray, ...]
    """Effect ``(3, w + 1)`` of the wheel speeds on the twist, by body."""
    constants: tuple[str, ...]
    """Names of the positive constants of the predictor that can be calibrated."""
    levers: FloatArray
    """``(K + M,)`` speed per turning rate of moved objects and of bodies [m], with constants
    only."""
    regression_shapes: tuple[tuple[int, int], ...]
    """Numbers of features and targets of the regressions that predict poses; empty if poses cannot
    be learned."""


@runtime_checkable
class PredictsAhead(Protocol):
    """Predictions cover several decisions, see `horizon_of`."""

    horizon: int
    """Number of decisions that a prediction covers. After the first decision it assumes that all
    agents take the neutral action, or the same action again if `Prediction.repeats` is true."""


@runtime_checkable
class PredictsExactly(Protocol):
    """Predictions can be exact, so that `check_scenario` compares them with the next states."""

    def with_exact_prediction(self) -> Scenario | None:
        """Return the scenario with a predictor that is exact up to rounding, or None.

        A scenario that predicts exactly returns itself.
        """


@runtime_checkable
class Interacting(Protocol):
    """Some agents interact, see `interactions_of`."""

    interactions: Sequence[tuple[int, int]]
    """Pairs of indices of interacting agents, the neighbors in a topology with ``shape =
    "scenario"``."""


@runtime_checkable
class PartiallyObserved(Protocol):
    """Every agent has sensors of its own, see `Prediction.of`. Agents then decide by own views."""

    perceived: BoolArray
    """``(n, G)`` whether an agent perceives the state of another body."""


@runtime_checkable
class MirrorSymmetric(Protocol):
    """The environment has mirror symmetry, see `partners_of`."""

    def partners(self) -> Sequence[int]:
        """Return the index of every agent's mirror image.

        Raises
        ------
        ValueError
            If an agent has no mirror image; one line.
        """


@runtime_checkable
class Led(Protocol):
    """A leader decides above the agents, see `options_of`."""

    options: LeaderOptions | None
    """Options of the leader; None without a leader."""


@runtime_checkable
class Batched(Protocol):
    """Many environments can step in one call, for learners with several environments."""

    def environments(self, count: int) -> Environments | None:
        """Return `count` environments that step in one call, or None if the settings prevent it."""


@runtime_checkable
class Recorded(Protocol):
    """Episodes are recorded, see `recording.EpisodeRecorder`."""

    recorded: tuple[str, ...]
    """Names of the recorded measurements, one array ``(T + 1, ...)`` each."""

    def measure(self) -> Mapping[str, Any]:
        """Return the measurements of the present state, as in `Transition.info`."""


@runtime_checkable
class Animated(Protocol):
    """Recordings are drawn, by replays and reports."""

    def constants_of_episode(self) -> Mapping[str, Any]:
        """Return recorded constants of the episode: numbers, texts, arrays."""

    def animate(self, recording: Mapping[str, Any], path: Path) -> None:
        """Write a recording, arrays by name, as GIF or MP4 according to the suffix of `path`.

        Raises
        ------
        ValueError
            If the settings prevent it; one line.
        """


def horizon_of(scenario: Scenario) -> int:
    """Return the number of decisions that predictions of a scenario cover, by default 1."""
    scenario = unwrapped(scenario)
    return scenario.horizon if isinstance(scenario, PredictsAhead) else 1


def interactions_of(scenario: Scenario) -> Sequence[tuple[int, int]] | None:
    """Return the pairs of interacting agents, or None if the scenario declares none."""
    scenario = unwrapped(scenario)
    return scenario.interactions if isinstance(scenario, Interacting) else None


def options_of(scenario: Scenario) -> LeaderOptions | None:
    """Return the options of the leader above the agents, or None without a leader."""
    return scenario.options if isinstance(scenario, Led) else None


def partners_of(scenario: Scenario) -> Sequence[int] | None:
    """Return the mirror image of every agent, or None without mirror symmetry."""
    scenario = unwrapped(scenario)
    return scenario.partners() if isinstance(scenario, MirrorSymmetric) else None


def measurements_of(scenario: Scenario) -> Mapping[str, Any]:
    """Return the measurements of the present state; none if the scenario is not recorded."""
    scenario = unwrapped(scenario)
    return scenario.measure() if isinstance(scenario, Recorded) else {}
