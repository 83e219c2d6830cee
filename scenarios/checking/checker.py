"""A check that a scenario keeps the promises on which learning and its measurement rest.

Whole episodes of random actions are played and compared to the last bit: states, reward, end of the
episode, twists and measurements of every step. Not compared are the measured times, ``seconds``.
What is said of variables is held against what is met (see `met_variables`). Predictions are held
against each other (see `predictions`), and, of scenarios that can be predicted exactly, against
what is then sensed (see `faults_of_sensing`); of others it is shown by how much they are off. What
a scenario need not have, such as measures or tables, is checked where it is there. A further check
is one function and one line in `CHECKS`; it yields what is wrong, a line each, of which the first
counts, and notes what it could not check. What a scenario raises is what is wrong with it.

Predictions need not come true, so that of most scenarios no more can be said than by how much they
are off. But one that is predicted exactly (``with_exact_prediction``) must sense what was
predicted. What differs then is a variable that is computed in two ways.
"""

import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product, zip_longest
from math import isnan
from pathlib import Path
from traceback import extract_tb
from typing import Any, NamedTuple

import numpy as np

from ...core.agents.loop import world_seed
from ...core.interface.plain import as_scenario
from ...core.interface.scenario import Scenario
from ...core.numerics import FloatArray, IntArray
from .frames import Examination, Frame, at, bits, differences, fields, measured, opening
from .predictions import apart, faults_of_prediction, faults_of_sharing, too_many

TOLERANCE = 1e-6
"""Difference of sensed and predicted variables that rounding may make, relative to their range."""
SMALL = 0.02
"""Error of prediction, in ranges of the variable, of which no word is lost."""
FAR = 10
"""Ranges beyond its own at which a variable looks as if it were in another unit."""


class MetVariable(NamedTuple):
    """The values met of a variable, or of the reward, beside what the scenario declares."""

    name: str
    """Of the variable, or ``reward``."""
    unit: str
    """In words of the SI."""
    low: float
    """Where its range begins; the reward has none: NaN."""
    high: float
    """Where it ends."""
    least: float
    """The least value that was sensed."""
    greatest: float
    """The greatest."""
    error: float
    """Root mean square error of what was predicted; NaN: it is not predicted."""
    persistence: float
    """The same, had it been predicted that all stays as it is."""


def predicted_steps(
    scenario: Scenario, seed: int, episode: int, joint_actions: IntArray, ahead: int = 1
) -> FloatArray:
    """Return states before some steps, as predicted, and after: ``(m, 3, n, d + 1)``.

    Behind the variables stands the reward, the mean of all agents: that of the step before, 0 at
    the start, that predicted, NaN if none is, and that received.

    Parameters
    ----------
    scenario
        Played; modified.
    seed, episode
        As in the control loop.
    joint_actions
        ``(steps, n)``; the episode may end earlier.
    ahead
        Decisions that predictions look ahead; after each joint action all are neutral for the rest,
        or do the same again in a scenario that ``repeats``.
    """
    steps, paid = [], 0.0
    repeats = scenario.repeats
    neutral: IntArray = np.full(len(scenario.agents), scenario.action_set.neutral)
    states = np.array(scenario.reset(world_seed(seed, episode), episode))
    for action in joint_actions:
        before = _with_reward(states, paid)
        predicted = _predicted(scenario, action, before)
        for joint in [action, *[action if repeats else neutral] * (ahead - 1)]:
            transition = scenario.step(joint)
            states, paid = np.array(transition.states), float(np.mean(transition.reward))
            if transition.terminated or transition.truncated:
                break
        steps.append([before, predicted, _with_reward(states, paid)])
        if transition.terminated or transition.truncated:
            break
    return np.array(steps)


def _predicted(scenario: Scenario, joint_action: IntArray, before: FloatArray) -> FloatArray:
    """Return states and reward after a joint action, NaN where they are not predicted."""
    prediction = scenario.predict()
    if prediction is None:
        return np.full_like(before, np.nan)
    action = joint_action[None]
    states = [prediction.states(i, action)[0] for i in range(len(joint_action))]
    rewards = prediction.rewards(action)
    return _with_reward(states, np.nan if rewards is None else rewards[0])


def _with_reward(states: FloatArray | list[FloatArray], reward: float) -> FloatArray:
    return np.column_stack([np.asarray(states), np.full(len(states), reward)])


def faults_of_sensing(scenario: Scenario, steps: FloatArray) -> Iterator[str]:
    """Yield which variable is not sensed as it was predicted, step by step the farthest off.

    Parameters
    ----------
    scenario
        Whose steps they are.
    steps
        ``(m, 3, n, d + 1)`` of an episode, see `predicted_steps`.
    """
    variables = scenario.state_space.variables
    _, predicted, after = np.moveaxis(steps[..., : len(variables)], 1, 0)
    allowed = TOLERANCE * np.array([variable.high - variable.low for variable in variables])
    off = np.abs(apart(scenario, after, predicted)) / allowed
    for step in np.flatnonzero((off > 1).any(axis=(1, 2))):
        i, j = np.unravel_index(off[step].argmax(), off[step].shape)
        yield (
            f"{variables[j].name} of agent {i} is {after[step, i, j]:.6g}, predicted "
            f"{predicted[step, i, j]:.6g}, {at(int(step) + 1)}"
        )


def met_variables(scenario: Scenario, steps: FloatArray) -> tuple[MetVariable, ...]:
    """Return what was met of every variable, and of the reward, in steps ``(m, 3, n, d + 1)``."""
    before, predicted, after = np.moveaxis(steps, 1, 0)
    squares = [apart(scenario, after, guess) ** 2 for guess in (predicted, before)]
    errors = np.sqrt(np.mean(squares, axis=(1, 2)))
    numbers = np.stack([after.min(axis=(0, 1)), after.max(axis=(0, 1)), *errors], axis=1)
    claims = [(v.name, v.unit, v.low, v.high) for v in scenario.state_space.variables]
    claims.append(("reward", "1", np.nan, np.nan))
    return tuple(MetVariable(*c, *row) for c, row in zip(claims, numbers.tolist(), strict=True))


class Findings(NamedTuple):
    """What came of a check that found no fault."""

    passed: tuple[str, ...]
    """Names of the checks that were passed."""
    unchecked: Mapping[str, str]
    """Why something was not checked, by its name."""
    variables: tuple[MetVariable, ...]
    """What was met of every variable and of the reward."""

    def warnings(self) -> Iterator[str]:
        """Yield what is allowed and looks wrong, a line each."""
        for v in self.variables:
            width = v.greatest - v.least if isnan(v.low) else v.high - v.low
            if v.error >= max(v.persistence, SMALL * width) > 0:
                yield f"{v.name} is predicted no better than if it stayed as it is"
            if max(v.low - v.least, v.greatest - v.high) > FAR * width:
                yield f"{v.name} goes more than {FAR} times its range beyond it"


STEPS = 5
"""Steps after which measurements are looked at, and predictions."""
LEAST_STEPS = 2
"""Steps of the shortest episodes by which equal and different seeds can be distinguished."""


class ScenarioError(ValueError):
    """What is wrong with a scenario: one line."""


def check_scenario(
    factory: Callable[[], object],
    *,
    steps: int = 40,
    seeds: Sequence[int] = (0, 1),
    episodes: Sequence[int] = (0, 1),
) -> Findings:
    """Check a scenario and return what it passed, what could not be checked, and what was met.

    Parameters
    ----------
    factory
        Makes a new instance of the scenario, the same each time.
    steps
        Most steps of the episodes played, about twenty of them.
    seeds
        Seeds of worlds, at least two.
    episodes
        Numbers of the episodes played.

    Raises
    ------
    ScenarioError
        If it breaks a promise, or raises; the message is one line.

    Examples
    --------
    >>> from nested_agents.scenarios.line_up import LineUpSettings
    >>> findings = check_scenario(LineUpSettings(carts=2).build)
    >>> findings.passed == tuple(CHECKS), list(findings.unchecked)
    (True, ['roles'])
    >>> [(v.name, v.low, v.high) for v in findings.variables]
    [('distance', -1.0, 1.0), ('lead', -0.8, 0.8), ('reward', nan, nan)]
    """
    if steps < LEAST_STEPS:
        raise ValueError(f"steps = {steps}: must be at least {LEAST_STEPS}")
    for name, numbers, least in (("seeds", seeds, 2), ("episodes", episodes, 1)):
        if len(numbers) < least:
            raise ValueError(f"{name} = {list(numbers)}: must hold at least {least}")
    examination = Examination(lambda: as_scenario(factory()), steps, tuple(seeds), tuple(episodes))
    for name, check in CHECKS.items():
        try:
            fault = next(check(examination), None)
        except (Exception, SystemExit) as error:
            fault = _raised(error)
        if fault is not None:
            raise ScenarioError(f"{name}: {fault}")
    scenario = examination.factory()
    unchecked = examination.unchecked
    actions = examination.actions(scenario, seeds[0])
    ahead = scenario.horizon
    played = [predicted_steps(scenario, s, e, actions, ahead) for s, e in product(seeds, episodes)]
    passed = tuple(name for name in CHECKS if name not in unchecked)
    return Findings(passed, unchecked, met_variables(scenario, np.concatenate(played)))


def _raised(error: BaseException) -> str:
    """Return in one line what was raised, and where."""
    where = extract_tb(error.__traceback__)[-1]
    place = f"{where.name}, {Path(where.filename).name}:{where.lineno}"
    return f"{type(error).__name__} in {place}: {' '.join(str(error).split())}"


def _form(of: Examination) -> Iterator[str]:
    """Check names, groups, shapes and types."""
    scenario: Any = of.factory()
    n, d = len(scenario.agents), scenario.state_space.n_variables
    if not n or len(set(scenario.agents)) != n:
        yield f"agents {scenario.agents} must be at least one, of different names"
    groups, roles = scenario.groups, scenario.roles
    if [i for group in groups for i in group] != list(range(n)):
        yield f"groups {groups} must hold the {n} agents once each, in order"
    if len(roles) != n:
        yield f"roles {roles} must be one for each of the {n} agents"
    for step, frame in enumerate(of.play(scenario, of.seeds[0], of.episodes[0])):
        for name, shapes in (("states", [(n, d)]), ("reward", [(), (n,)]))[: step + 1]:
            value = np.asarray(frame[name])
            if value.shape not in shapes or value.dtype.kind not in "biuf":
                allowed = " or ".join(map(str, shapes))
                yield f"{name} of shape {value.shape} {at(step)}, must be numbers of {allowed}"
        if step and not all(isinstance(frame[e], bool) for e in ("terminated", "truncated")):
            yield f"terminated and truncated must be bool, {at(step)} they are not"
        twists = frame.get("twists")
        shape = (len(groups), 3) if twists is None else np.shape(twists)
        if shape[1:] != (3,) or shape[0] < len(groups):
            yield f"twists of shape {shape} {at(step)}, must be (bodies >= {len(groups)}, 3)"


def _measures(of: Examination) -> Iterator[str]:
    """Check that what a scenario declares to be measured and recorded is there."""
    scenario: Any = of.factory()
    measures = scenario.measures
    names = [measure.name for measure in measures]
    if len(set(names)) != len(names):
        yield f"names {names} must be distinct"
    opening(scenario, of.seeds[0], of.episodes[0])
    kept = scenario.recorded
    for step, action in enumerate(of.actions(scenario, of.seeds[0])[:STEPS], 1):
        transition = scenario.step(action)
        info, measurements = transition.info, measured(scenario)
        for measure in measures:
            source = measure.source
            if source != "terminated" and source not in info:
                yield f"{measure.name}: info has no {source!r} {at(step)}, has {', '.join(info)}"
            if source != "terminated" and np.ndim(info[source]):
                yield f"{measure.name}: info[{source!r}] must be one number"
        for name in kept:
            if name not in info or name not in measurements:
                lacking_it = "measure" if name in info else "info"
                yield f"recorded is {name!r}, which {lacking_it} has not"
            if bits(info[name]) != bits(measurements[name]):
                yield f"recorded is {name!r}, of which info and measure differ {at(step)}"
        if transition.terminated or transition.truncated:
            break


def _values(of: Examination) -> Iterator[str]:
    """Check that numbers are finite, variables within bounds, and alike where they are shared."""
    for seed, episode in product(of.seeds, of.episodes):
        scenario = of.factory()
        for step, frame in enumerate(of.play(scenario, seed, episode)):
            for fault in _wrong_values(scenario, frame):
                yield f"{fault} {at(step)} of seed {seed}"
    roles = of.factory().roles
    if len(set(roles)) < len(roles):
        of.unchecked["roles"] = "whether agents of one role are alike is not seen from outside"


def _wrong_values(scenario: Scenario, frame: Frame) -> Iterator[str]:
    """Yield what is not finite, leaves the ``bounds`` of its scenario, or is not shared."""
    for name, value in frame.items():
        array = np.asarray(value)
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            yield f"{name} is not finite"
    states, variables = np.asarray(frame["states"]), scenario.state_space.variables
    low, high = np.array(scenario.bounds).T
    for _, i in np.argwhere((states < low) | (states > high)):
        yield f"{variables[i].name} leaves [{low[i]}, {high[i]}]"
    yield from faults_of_sharing(scenario, states)


def _repeats(of: Examination) -> Iterator[str]:
    """Check that equal seeds give equal bits, also in an instance that has played before."""
    used = of.factory()
    for seed, episode in product(of.seeds, of.episodes):
        first = list(of.play(of.factory(), seed, episode))
        again = of.play(of.factory(), seed, episode)
        yield from differences(first, again, f"two runs with seed {seed} differ")
        list(of.play(used, of.seeds[-1], of.episodes[0]))
        again = of.play(used, seed, episode)
        yield from differences(first, again, f"seed {seed} after another episode differs")


def _varies(of: Examination) -> Iterator[str]:
    """Check that different seeds give different worlds."""
    actions = of.actions(of.factory(), of.seeds[0])
    runs = [list(of.play(of.factory(), seed, of.episodes[0], actions)) for seed in of.seeds]
    if not any(any(differences(runs[0], run)) for run in runs[1:]):
        yield f"seeds {', '.join(map(str, of.seeds))} give one and the same episode"


def _keeps_apart(of: Examination) -> Iterator[str]:
    """Check that two instances played in turns do not notice each other."""
    seeds = of.seeds[:2]
    for episode in of.episodes:
        runs = [of.play(of.factory(), seed, episode) for seed in seeds]
        in_turns = zip(*zip_longest(*runs), strict=True)
        for seed, frames in zip(seeds, in_turns, strict=True):
            alone = of.play(of.factory(), seed, episode)
            words = f"an instance with seed {seed} played in turns with another differs"
            yield from differences(alone, filter(None, frames), words)


def _only_looks(of: Examination) -> Iterator[str]:
    """Check that predicting and measuring change nothing."""
    for seed, episode in product(of.seeds, of.episodes):
        silent = of.play(of.factory(), seed, episode)
        predicting = of.play(of.factory(), seed, episode, predicting=True)
        words = "an episode in which predictions are asked for differs"
        yield from differences(list(silent), predicting, words)


def _predicts(of: Examination) -> Iterator[str]:
    """Check that predictions have their shapes, are finite, and that their tables agree."""
    scenario: Any = of.factory()
    rng = np.random.default_rng(of.seeds[0])
    if not scenario.predicts:
        of.unchecked["predictions"] = "the scenario has no method predict"
        return
    opening(scenario, of.seeds[0], of.episodes[0])
    actions = of.actions(scenario, of.seeds[0])
    for action in actions[:STEPS]:
        yield from faults_of_prediction(scenario, actions, rng)
        scenario.step(action)
    prediction = scenario.predict()
    tables = None if prediction is None else prediction.tables()
    if tables is not None and (why := too_many(scenario)):
        of.unchecked["tables"] = why


def _senses(of: Examination) -> Iterator[str]:
    """Check that variables mean the same in sensing and prediction, where that can be checked."""
    for seed, episode in product(of.seeds, of.episodes):
        scenario = of.factory()
        exact = scenario.with_exact_prediction()
        if exact is None:
            why = "without with_exact_prediction, predictions may be off; see their errors"
            of.unchecked["sensed and predicted"] = why
            return
        actions = of.actions(scenario, seed)
        for fault in faults_of_sensing(exact, predicted_steps(exact, seed, episode, actions)):
            yield f"{fault} of seed {seed}"


def _leaves_alone(of: Examination) -> Iterator[str]:
    """Check that returned arrays stay as they are, and seeds and actions, too."""
    scenario = of.factory()
    seed = np.random.SeedSequence(of.seeds[0])
    given: list[tuple[str, Any, Any]] = []
    states = scenario.reset(seed, of.episodes[0])
    if seed.n_children_spawned:
        yield "reset spawns from the seed it is given, so that using it twice gives two worlds"
    given.append(("states at the start", states, np.array(states)))
    for step, action in enumerate(of.actions(scenario, of.seeds[0])):
        joint = action.copy()
        transition = scenario.step(joint)
        if not np.array_equal(joint, action):
            yield f"step changes the joint action it is given, {at(step + 1)}"
        for name, value in fields(transition):
            if isinstance(value, np.ndarray):
                given.append((f"{name} {at(step + 1)}", value, value.copy()))
        if transition.terminated or transition.truncated:
            break
    for name, now, then in given:
        if bits(now) != bits(then):
            yield f"{name}: the returned array was changed later"


def _keeps_off_globals(of: Examination) -> Iterator[str]:
    """Check that the global random numbers of Python and NumPy are neither drawn nor set."""
    before = random.getstate(), np.random.get_state()  # noqa: NPY002
    try:
        # From a state that no scenario sets, lest one that always sets the same goes unnoticed.
        random.seed(2**40 + 1)
        np.random.seed(2**31 + 1)  # noqa: NPY002
        python, numpy = random.getstate(), np.random.get_state()  # noqa: NPY002
        list(of.play(of.factory(), of.seeds[0], of.episodes[0], predicting=True))
        changed = [] if random.getstate() == python else ["random"]
        now = np.random.get_state()  # noqa: NPY002
        if not all(np.array_equal(a, b) for a, b in zip(now, numpy, strict=True)):
            changed.append("numpy.random")
    finally:
        random.setstate(before[0])
        np.random.set_state(before[1])  # noqa: NPY002
    if changed:
        yield f"the global state of {' and '.join(changed)} is changed"


CHECKS: dict[str, Callable[[Examination], Iterator[str]]] = {
    "form": _form,
    "measures": _measures,
    "values": _values,
    "equal seeds": _repeats,
    "different seeds": _varies,
    "two instances": _keeps_apart,
    "predicting": _only_looks,
    "predictions": _predicts,
    "sensed and predicted": _senses,
    "returned arrays": _leaves_alone,
    "global random numbers": _keeps_off_globals,
}
"""The checks by name, in their order: later ones rely on earlier ones."""
