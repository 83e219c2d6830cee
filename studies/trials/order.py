"""Whether a trial gives the same rows whatever its process ran before.

Trials run in any order and on any number of workers, so what users' files keep in a module or a
class from one trial to the next must not matter. Two short trials are run one after the other, and
then again the other way round.
"""

from collections.abc import Sequence
from dataclasses import replace

from .session import run_trial
from .trial import Trial

EPISODES = 2
"""Episodes of training: in the second one acts by what the first has taught."""


def fault_of_order(trials: Sequence[Trial], steps: int) -> str:
    """Return that trials depend on what ran before them, in words; nothing if they do not.

    Parameters
    ----------
    trials
        Of a study; the first and the last are run, or the first with two seeds.
    steps
        Most steps of an episode.
    """
    first = _shortened(trials[0], steps)
    last = _shortened(trials[-1], steps) if len(trials) > 1 else first.with_seed(first.seed + 1)
    rows: dict[str, str] = {}
    for trial in (first, last, last, first):
        now = repr(run_trial(trial).rows)
        if rows.setdefault(trial.identity, now) != now:
            return (
                f"seed {trial.seed} gives other rows when another trial has run before it: what "
                f"{', '.join(_programs(trial))} keeps in a module or class must not matter"
            )
    return ""


def has_programs(trial: Trial) -> bool:
    """Return whether a trial runs what users wrote."""
    return bool(_programs(trial))


def _programs(trial: Trial) -> list[str]:
    return [name for name in trial.sources.texts if name.endswith(".py")]


def _shortened(trial: Trial, steps: int) -> Trial:
    """Return a short trial in one environment, as a budget of episodes needs."""
    learner = trial.settings.learner
    if learner.n_environments > 1:
        learner = learner.model_copy(update={"environments": 1})
    return replace(
        trial,
        settings=trial.settings.model_copy(update={"learner": learner}),
        episodes=EPISODES,
        steps=min(steps, trial.steps),
        evaluation=1,
        evaluation_steps=None,
        evaluations=(),
        curriculum=(),
        keep_teams=False,
    )
