"""Checks of a scenario's contract, one function each.

A check yields its faults, of which the first is reported, and writes to `CheckPlan.skipped` what it
could not check. Optional parts, such as measures or tables, are checked if a scenario has them.
"""

import pickle
import random
from collections.abc import Iterator, Mapping
from itertools import zip_longest

import numpy as np

from ...core.interface.abilities import PredictsExactly, Recorded, measurements_of
from ...core.interface.measures import Measure
from ...core.interface.prediction import Prediction
from ...core.interface.scenario import Scenario, checked_scenario
from .episodes import CheckPlan, StepRecord, bits, differences, start, transition_fields, when
from .predictions import faults_of_prediction, faults_of_sharing
from .sensing import faults_of_sensing, predicted_steps

STEPS = 5
"""Number of steps after which measurements and predictions are checked."""
FURTHER_SEEDS = 30
"""Number of seeds tried if the given ones lead to the same episode."""


def check_form(plan: CheckPlan) -> Iterator[str]:
    """Check names, groups, shapes and types."""
    try:
        scenario = checked_scenario(plan.factory())
    except ValueError as error:
        yield str(error).removeprefix("scenario.kind: ")
        return
    n = len(scenario.agents)
    if not n or len(set(scenario.agents)) != n:
        yield f"agents {scenario.agents} must be at least one, of different names"
    if [i for group in scenario.groups for i in group] != list(range(n)):
        yield f"groups {scenario.groups} must hold the {n} agents once each, in order"
    if len(scenario.roles) != n:
        yield f"roles {scenario.roles} must be one for each of the {n} agents"
    for step, record in enumerate(plan.play(scenario, plan.seeds[0], plan.episodes[0])):
        yield from _wrong_form(scenario, record, step)
        if step == 0:
            prediction: object = scenario.predict()
            if prediction is not None and not isinstance(prediction, Prediction):
                yield f"predict returns {type(prediction).__name__}, must inherit Prediction"


def _wrong_form(scenario: Scenario, record: StepRecord, step: int) -> Iterator[str]:
    """Yield the values of a record with a wrong shape or type."""
    n = len(scenario.agents)
    shapes: dict[str, list[tuple[int, ...]]] = {"states": [(n, scenario.state_space.n_variables)]}
    if step > 0:
        shapes["reward"] = [(), (n,)]
        if not all(isinstance(record[end], bool) for end in ("terminated", "truncated")):
            yield f"terminated and truncated must be bool, {when(step)} they are not"
    for name, allowed in shapes.items():
        value = np.asarray(record[name])
        if value.shape not in allowed or value.dtype.kind not in "biuf":
            text = " or ".join(map(str, allowed))
            yield f"{name} of shape {value.shape} {when(step)}, must be numbers of {text}"
    bodies = len(scenario.groups)
    twists = record.get("twists")
    shape = (bodies, 3) if twists is None else np.shape(np.asarray(twists))
    if shape[1:] != (3,) or shape[0] < bodies:
        yield f"twists of shape {shape} {when(step)}, must be (bodies >= {bodies}, 3)"


def check_measures(plan: CheckPlan) -> Iterator[str]:
    """Check that declared measures and recordings are in the info of every step."""
    scenario = plan.make()
    names = [measure.name for measure in scenario.measures]
    if len(set(names)) != len(names):
        yield f"names {names} must be distinct"
    start(scenario, plan.seeds[0], plan.episodes[0])
    for step, action in enumerate(plan.actions(scenario, plan.seeds[0])[:STEPS], 1):
        transition = scenario.step(action)
        for measure in scenario.measures:
            if measure.source != "terminated":
                yield from _wrong_source(measure, transition.info, step)
        measurements = measurements_of(scenario)
        for name in scenario.recorded if isinstance(scenario, Recorded) else ():
            if name not in transition.info or name not in measurements:
                place = "measure" if name in transition.info else "info"
                yield f"recorded is {name!r}, which {place} has not"
            if bits(transition.info[name]) != bits(measurements[name]):
                yield f"recorded is {name!r}, of which info and measure differ {when(step)}"
        if transition.terminated or transition.truncated:
            break


def _wrong_source(measure: Measure, info: Mapping[str, object], step: int) -> Iterator[str]:
    source = measure.source
    if source not in info:
        yield f"{measure.name}: info has no {source!r} {when(step)}, has {', '.join(info)}"
    if np.asarray(info[source]).ndim:
        yield f"{measure.name}: info[{source!r}] must be one number"


def check_values(plan: CheckPlan) -> Iterator[str]:
    """Check that values are finite and within bounds, and that shared variables are equal."""
    scenario = plan.make()
    low, high = scenario.state_space.bounds.T
    for seed, episode in plan.runs:
        for step, record in enumerate(plan.play(plan.make(), seed, episode)):
            place = f"{when(step)} of seed {seed}"
            for name, value in record.items():
                array = np.asarray(value)
                if array.dtype.kind == "f" and not np.isfinite(array).all():
                    yield f"{name} is not finite {place}"
            states = np.asarray(record["states"])
            for _, i in np.argwhere((states < low) | (states > high)):
                variable = scenario.state_space.variables[i]
                yield f"{variable.name} leaves [{low[i]}, {high[i]}] {place}"
            for fault in faults_of_sharing(scenario, states):
                yield f"{fault} {place}"
    if len(set(scenario.roles)) < len(scenario.roles):
        plan.skipped["roles"] = "whether agents of one role are alike cannot be observed"


def check_equal_seeds(plan: CheckPlan) -> Iterator[str]:
    """Check that equal seeds give equal bits, also in an instance that was used before."""
    used = plan.make()
    for seed, episode in plan.runs:
        first = list(plan.play(plan.make(), seed, episode))
        again = plan.play(plan.make(), seed, episode)
        yield from differences(first, again, f"two runs with seed {seed} differ")
        list(plan.play(used, plan.seeds[-1], plan.episodes[0]))
        again = plan.play(used, seed, episode)
        yield from differences(first, again, f"seed {seed} after another episode differs")


def check_different_seeds(plan: CheckPlan) -> Iterator[str]:
    """Check that different seeds give different episodes, of which there may be few."""
    actions = plan.actions(plan.make(), plan.seeds[0])
    first = list(plan.play(plan.make(), plan.seeds[0], plan.episodes[0], actions))
    next_seed = max(plan.seeds) + 1
    for seed in (*plan.seeds[1:], *range(next_seed, next_seed + FURTHER_SEEDS)):
        other = plan.play(plan.make(), seed, plan.episodes[0], actions)
        if any(differences(first, other, "")):
            return
    seeds = ", ".join(map(str, plan.seeds))
    yield f"seeds {seeds} give one and the same episode, and so do {FURTHER_SEEDS} others"


def check_two_instances(plan: CheckPlan) -> Iterator[str]:
    """Check that two instances that are stepped alternately do not affect each other."""
    seeds = plan.seeds[:2]
    for episode in plan.episodes:
        runs = [plan.play(plan.make(), seed, episode) for seed in seeds]
        alternating = zip(*zip_longest(*runs), strict=True)
        for seed, records in zip(seeds, alternating, strict=True):
            alone = plan.play(plan.make(), seed, episode)
            claim = f"an instance with seed {seed} played in turns with another differs"
            yield from differences(alone, filter(None, records), claim)


def check_predicting_changes_nothing(plan: CheckPlan) -> Iterator[str]:
    """Check that predicting and measuring change nothing."""
    for seed, episode in plan.runs:
        expected = plan.play(plan.make(), seed, episode)
        actual = plan.play(plan.make(), seed, episode, predicting=True)
        claim = "an episode in which predictions are asked for differs"
        yield from differences(list(expected), actual, claim)


def check_predictions(plan: CheckPlan) -> Iterator[str]:
    """Check shapes and values of predictions."""
    scenario = plan.make()
    rng = np.random.default_rng(plan.seeds[0])
    if scenario.lacks_prediction:
        plan.skipped["predictions"] = scenario.lacks_prediction
        return
    start(scenario, plan.seeds[0], plan.episodes[0])
    actions = plan.actions(scenario, plan.seeds[0])
    for action in actions[:STEPS]:
        yield from faults_of_prediction(scenario, actions, rng)
        scenario.step(action)


def check_sensed_and_predicted(plan: CheckPlan) -> Iterator[str]:
    """Check that exact predictions equal the states that follow."""
    for seed, episode in plan.runs:
        scenario = plan.make()
        exact = None
        if isinstance(scenario, PredictsExactly):
            exact = scenario.with_exact_prediction()
        if exact is None:
            plan.skipped["sensed and predicted"] = (
                "without with_exact_prediction, predictions may be off; see their errors"
            )
            return
        actions = plan.actions(scenario, seed)
        for fault in faults_of_sensing(exact, predicted_steps(exact, seed, episode, actions)):
            yield f"{fault} of seed {seed}"


def check_returned_arrays(plan: CheckPlan) -> Iterator[str]:
    """Check that returned arrays, the seed and joint actions are not modified later."""
    scenario = plan.make()
    seed = np.random.SeedSequence(plan.seeds[0])
    states = scenario.reset(seed, plan.episodes[0])
    if seed.n_children_spawned:
        yield "reset spawns from the seed it is given, so that using it twice gives two worlds"
    returned: list[tuple[str, object, object]] = [
        ("states at the start", states, np.array(states)),
    ]
    for step, action in enumerate(plan.actions(scenario, plan.seeds[0]), 1):
        joint_action = action.copy()
        transition = scenario.step(joint_action)
        if not np.array_equal(joint_action, action):
            yield f"step changes the joint action it is given, {when(step)}"
        for name, value in transition_fields(transition):
            if isinstance(value, np.ndarray):
                returned.append((f"{name} {when(step)}", value, value.copy()))
        if transition.terminated or transition.truncated:
            break
    for name, array, copied in returned:
        if bits(array) != bits(copied):
            yield f"{name}: the returned array was changed later"


def check_global_random_numbers(plan: CheckPlan) -> Iterator[str]:
    """Check that the global random numbers of Python and NumPy are neither used nor seeded."""
    python_before = random.getstate()
    numpy_before = np.random.get_state()  # noqa: NPY002
    try:
        # Unusual seeds, so that a scenario that seeds with a constant is noticed, too.
        random.seed(2**40 + 1)
        np.random.seed(2**31 + 1)  # noqa: NPY002
        python_state = random.getstate()
        numpy_state = pickle.dumps(np.random.get_state())  # noqa: NPY002
        list(plan.play(plan.make(), plan.seeds[0], plan.episodes[0], predicting=True))
        changed = [] if random.getstate() == python_state else ["random"]
        if pickle.dumps(np.random.get_state()) != numpy_state:  # noqa: NPY002
            changed.append("numpy.random")
    finally:
        random.setstate(python_before)
        np.random.set_state(numpy_before)  # noqa: NPY002
    if changed:
        yield f"the global state of {' and '.join(changed)} is changed"
