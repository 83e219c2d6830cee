"""A trained team, explained in numbers: its value functions and self-model.

A study keeps its trained teams if its spec says so. Otherwise the training is repeated and compared
with the kept episodes. Either way, the explained team is the one that was measured.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...core.agents.fuzzy import FuzzyAgents
from ...core.interface.spaces import Variable
from ...core.numerics import FloatArray, pd
from ...core.values.rule_base import RuleBase
from ..errors import SpecError, refused
from ..presentation.figures import file_stems
from ..store.database import columns
from ..store.durable import TEAM
from ..store.store import Store
from ..trials.session import Session
from ..trials.trial import Trial
from .functions import Parts, decompose

WheelEffects = tuple[FloatArray, FloatArray, FloatArray]
"""Effects of the actuators of one body ``(3, w + 1)`` in its self-model: those of its geometry,
those after training, and their standard deviations."""


@dataclass(frozen=True)
class Explanation:
    """Explanation of a trained team as numbers."""

    trial: Trial
    """Trial of the team."""
    agents: tuple[str, ...]
    """Names of the agents."""
    actuators: tuple[str, ...]
    """Names of the actuators, which usually are the agents."""
    rules: RuleBase
    """Rule base of all agents."""
    variables: tuple[Variable, ...]
    """State variables of the rule base."""
    parts: tuple[Parts, ...]
    """Decomposition of the value function of each agent."""
    effects: tuple[WheelEffects, ...]
    """Effects by body as the self-model estimates them; empty without one."""

    @property
    def roles(self) -> dict[str, Parts]:
        """Value functions by the agents that share them, such as ``"agent1 = agent2"``."""
        names: dict[bytes, list[str]] = {}
        for name, part in zip(self.agents, self.parts, strict=True):
            names.setdefault(np.concatenate(part.singles).tobytes(), []).append(name)
        return {" = ".join(own): self.parts[self.agents.index(own[0])] for own in names.values()}


def explain(store: Store, trial: Trial) -> Explanation:
    """Explain the team of a trial: the one that is kept, else it is trained again.

    Raises
    ------
    SpecError
        If the trial cannot be built, its team cannot be read, or an episode of the training is not,
        to the last bit, the one that is kept.
    """
    arrays = store.recording(trial.identity, TEAM) if trial.keep_teams else None
    with trial.sources.active():
        with refused(f"{store.directory}: "):  # a file that settings name may not be what it was
            session = Session(trial)
            if not all(isinstance(part, FuzzyAgents) for part in session.team.parts):
                kind = trial.settings.learner.kind
                raise ValueError(f"learner.kind = {kind!r}: explain needs agents with rule bases")
        agents = session.team.only(FuzzyAgents)
        model = agents.model.self_model
        nominal = [effect.copy() for effect in model.effects] if model else []
        if arrays is None:
            _train(store, session)
        else:
            session.team.load_state_dict(arrays)
        effects = zip(nominal, model.effects, model.deviations, strict=True) if model else ()
        taken = [decompose(agents.rules, theta) for theta in agents.learner.theta]
        return Explanation(
            trial=trial,
            agents=session.scenario.agents,
            actuators=session.world.agents,
            rules=agents.rules,
            variables=agents.space.variables,
            parts=tuple(taken[row] for row in agents.rows),
            effects=tuple(effects),
        )


def _train(store: Store, session: Session) -> None:
    """Repeat the training of a trial; refuse a team that differs from the measured one."""
    trial = session.trial
    if trial.decisions is not None:
        session.train_until(trial.decisions)
    else:
        session.train(trial.episodes)
    measured = [measure.name for measure in store.measures()]
    if _kept_rows(store, trial) != [row.flat(measured) for row in session.result().rows]:
        raise SpecError(
            f"{store.directory}: training {trial.condition}, seed {trial.seed} again gives other "
            "episodes than those that are kept; this is not the software, or not the kind of "
            "machine, that ran the study"
        )


def _kept_rows(store: Store, trial: Trial) -> list[tuple[object, ...]]:
    """Return the training episodes of a trial as they are kept, those of a curriculum first."""
    names, every = store.episodes()
    rows = pd.DataFrame(list(every), columns=names, dtype=object)
    own = rows[(rows["condition"] == trial.condition) & (rows["seed"] == trial.seed)]
    is_training = own["phase"].str.startswith("training")
    kept = own.loc[is_training, list(columns(store.measures()))]
    return list(kept.itertuples(index=False, name=None))


def folder_of(directory: Path, trial: Trial, conditions: Sequence[str]) -> Path:
    """Return where the explanation of a trial is kept: one folder for each condition and seed."""
    stems = dict(zip(conditions, file_stems(conditions), strict=True))
    return directory / "explain" / f"{stems[trial.condition]}-seed{trial.seed}"
