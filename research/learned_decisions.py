"""Whether values or decisions fail by which eight robots act that have learned their predictor.

``python -m research.learned_decisions`` trains two teams a seed, one with the given predictor and
one with a learned one (the conditions of ``research/specs/predictors-eight.toml``), and
evaluates each with the predictor of either. Then the team that has learned its predictor decides by
it again, but with some variables as the given one predicts them, as far ahead. Below stand the
errors of what it has learned, beside those of predicting that nothing changes. A seed takes a core
three minutes.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np
import pandas as pd

from nested_agents.core.adaptation.adaptive import DynamicsModel
from nested_agents.core.adaptation.learned_prediction import LearnedPrediction
from nested_agents.core.adaptation.learned_predictor import LearnedPredictor
from nested_agents.core.agents.fuzzy import FuzzyAgents
from nested_agents.core.interface.measures import SUCCESS
from nested_agents.core.interface.plain import as_prediction
from nested_agents.core.interface.prediction import Prediction, states_by_group
from nested_agents.core.interface.scenario import Scenario
from nested_agents.core.numerics import FloatArray, IntArray
from nested_agents.research import SPECS
from nested_agents.studies.explain.team import errors_of
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import Session
from nested_agents.studies.trials.trial import trials_of

PARTS = {
    "push": ("contact_push_bearing", "contact_cross_track_error"),
    "way": ("box_distance", "approach"),
    "robots": ("gap", "face_bearing", "side", "others_away"),
}
"""Variables by what they are of."""


class PartlyGiven(LearnedPrediction):
    """A learned prediction, some of whose shared variables are those of another one."""

    def __init__(
        self, predictor: LearnedPredictor, present: FloatArray, given: Prediction, columns: IntArray
    ) -> None:
        super().__init__(predictor, present)
        self._given = given
        self._columns = columns

    def states_by_group(self, joint_actions: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return own variables and shared ones, see `LearnedPrediction`."""
        own, shared = super().states_by_group(joint_actions)
        groups = self._predictor.groups
        _, given = states_by_group(self._given, joint_actions, groups, own.shape[2])
        shared = shared.copy()
        shared[..., self._columns] = given[..., self._columns]
        return own, shared


class PartlyGivenModel(DynamicsModel):
    """A learned predictor that is given some variables by the scenario."""

    def __init__(self, learned: LearnedPredictor, scenario: Scenario, part: str) -> None:
        space = scenario.state_space
        self._learned = learned
        self._scenario = scenario
        named = [v.name in PARTS[part] for v in space.variables[space.n_own :]]
        self._columns = np.flatnonzero(named)

    def predict(self, states: FloatArray) -> Prediction:
        """Predict from states ``(n, d)``."""
        given = as_prediction(self._scenario.predict())
        assert given is not None
        return PartlyGiven(self._learned, states, given, self._columns)


def success(session: Session, predictor: DynamicsModel | None, phase: str) -> float:
    """Return the success rate of a trained team that decides by a predictor; none: the given."""
    session.team.only(FuzzyAgents).foresight.predictor = predictor
    session.evaluate(phase=phase)
    rows = [row for row in session.result().rows if row.phase == phase]
    return float(np.mean([row.measures[SUCCESS.name] for row in rows]))


def crossed(seed: int, changes: Sequence[str]) -> tuple[dict[str, float], pd.DataFrame]:
    """Return success rates of a seed, by whose values decide and by which predictions; errors."""
    spec = SPECS / "predictors-eight.toml"
    changes = [f"seeds=[{seed}]", *changes]
    trials = trials_of(Spec.load(spec, changes))
    given, learned = map(Session, trials)
    for session in (given, learned):
        session.train(session.trial.episodes)
    predictor = learned.team.only(FuzzyAgents).foresight.predictor
    assert isinstance(predictor, LearnedPredictor)
    rates = {
        "values learned, learned": success(learned, predictor, "evaluation:learned"),
        "values learned, given": success(learned, None, "evaluation:given"),
        "values given, learned": success(given, predictor, "evaluation:learned"),
        "values given, given": success(given, None, "evaluation:given"),
    }
    learned.team.only(FuzzyAgents).foresight.predictor = predictor
    errors = errors_of(learned.team, learned.scenario, seed)
    assert errors is not None
    near = f"scenario.prediction_horizon={8 * predictor.horizon}"
    (_, trial) = trials_of(Spec.load(spec, [*changes, near]))
    other = Session.restored(trial, learned.team.arrays())
    for part in PARTS:
        model = PartlyGivenModel(predictor, other.scenario, part)
        rates[f"values learned, {part} given"] = success(other, model, f"evaluation:{part}")
    return rates, errors


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m research.learned_decisions")
    parser.add_argument("--seeds", type=int, nargs="+", default=range(6), help="of trials")
    parser.add_argument("--set", nargs="+", default=(), metavar="KEY=VALUE", help="of the spec")
    options = parser.parse_args()
    rows, errors = zip(*(crossed(seed, options.set) for seed in options.seeds), strict=True)
    rates = pd.DataFrame(rows, options.seeds)
    print(rates.T.assign(mean=rates.mean()).round(2).to_string())
    squares = pd.concat(errors).pow(2).groupby(level=0, sort=False).mean()
    print(squares.pow(0.5).round(4).to_string())


if __name__ == "__main__":
    main()
