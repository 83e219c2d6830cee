"""The promises of a scenario, each checked by one function.

A check yields what is wrong, a line each, of which the first counts, and notes what it could not
check. What a scenario need not have, such as measures or tables, is checked where it is there.
"""

import random
from collections.abc import Iterator, Mapping
from itertools import product, zip_longest

import numpy as np

from ...core.interface.measures import Measure
from ...core.interface.plain import as_scenario
from ...core.interface.prediction import Prediction
from ...core.interface.scenario import Scenario
from .frames import Examination, Frame, at, bits, differences, fields, opening
from .predictions import faults_of_prediction, faults_of_sharing, too_many
from .sensing import faults_of_sensing, predicted_steps

STEPS = 5
"""Steps after which measurements are looked at, and predictions."""
FURTHER_SEEDS = 30
"""Seeds that are tried if those given make one and the same world: it may be one of few."""


def check_form(of: Examination) -> Iterator[str]:
    """Check names, groups, shapes and types."""
    thing = of.make()
    try:
        scenario = as_scenario(thing)
    except ValueError as error:
        yield str(error).removeprefix("scenario.kind: ")
        return
    n = len(scenario.agents)
    if not n or len(set(scenario.agents)) != n:
        yield f"agents {scenario.agents} must be at least one, of different names"
    groups = scenario.groups
    roles = scenario.roles
    if [i for group in groups for i in group] != list(range(n)):
        yield f"groups {groups} must hold the {n} agents once each, in order"
    if len(roles) != n:
        yield f"roles {roles} must be one for each of the {n} agents"
    for step, frame in enumerate(of.play(scenario, of.seeds[0], of.episodes[0])):
        yield from _misformed(scenario, frame, step)
        if step == 0:
            yield from _no_prediction(scenario.predict())


def _no_prediction(predicted: object) -> Iterator[str]:
    """Yield that a scenario that inherits ours predicts by what does not."""
    if predicted is not None and not isinstance(predicted, Prediction):
        kind = type(predicted).__name__
        yield f"predict returns {kind}, must inherit Prediction, as its scenario inherits Scenario"


def _misformed(scenario: Scenario, frame: Frame, step: int) -> Iterator[str]:
    """Yield what of a frame has a wrong shape or type; at the start it has states alone."""
    n = len(scenario.agents)
    shapes: dict[str, list[tuple[int, ...]]] = {"states": [(n, scenario.state_space.n_variables)]}
    if step > 0:
        shapes["reward"] = [(), (n,)]
    for name, allowed in shapes.items():
        value = np.asarray(frame[name])
        if value.shape not in allowed or value.dtype.kind not in "biuf":
            numbers = " or ".join(map(str, allowed))
            yield f"{name} of shape {value.shape} {at(step)}, must be numbers of {numbers}"
    endings = [frame["terminated"], frame["truncated"]] if step > 0 else []
    if not all(isinstance(ending, bool) for ending in endings):
        yield f"terminated and truncated must be bool, {at(step)} they are not"
    bodies = len(scenario.groups)
    twists = frame.get("twists")
    shape = (bodies, 3) if twists is None else np.asarray(twists).shape
    if shape[1:] != (3,) or shape[0] < bodies:
        yield f"twists of shape {shape} {at(step)}, must be (bodies >= {bodies}, 3)"


def check_measures(of: Examination) -> Iterator[str]:
    """Check that what a scenario declares to be measured and recorded is there."""
    scenario = of.factory()
    measures = scenario.measures
    names = [measure.name for measure in measures]
    if len(set(names)) != len(names):
        yield f"names {names} must be distinct"
    opening(scenario, of.seeds[0], of.episodes[0])
    for step, action in enumerate(of.actions(scenario, of.seeds[0])[:STEPS], 1):
        transition = scenario.step(action)
        for measure in measures:
            if measure.source != "terminated":
                yield from _wrong_source(measure, transition.info, step)
        yield from _wrong_record(scenario, transition.info, step)
        if transition.terminated or transition.truncated:
            break


def _wrong_source(measure: Measure, info: Mapping[str, object], step: int) -> Iterator[str]:
    """Yield why a measure cannot be taken from what a step tells."""
    source = measure.source
    if source not in info:
        yield f"{measure.name}: info has no {source!r} {at(step)}, has {', '.join(info)}"
    if np.asarray(info[source]).ndim:
        yield f"{measure.name}: info[{source!r}] must be one number"


def _wrong_record(scenario: Scenario, info: Mapping[str, object], step: int) -> Iterator[str]:
    """Yield what is to be recorded and is not told, or told in two ways."""
    measurements = scenario.measure()
    for name in scenario.recorded:
        if name not in info or name not in measurements:
            lacking_it = "measure" if name in info else "info"
            yield f"recorded is {name!r}, which {lacking_it} has not"
        if bits(info[name]) != bits(measurements[name]):
            yield f"recorded is {name!r}, of which info and measure differ {at(step)}"


def check_values(of: Examination) -> Iterator[str]:
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
    states = np.asarray(frame["states"])
    variables = scenario.state_space.variables
    low, high = np.array(scenario.bounds).T
    for _, i in np.argwhere((states < low) | (states > high)):
        yield f"{variables[i].name} leaves [{low[i]}, {high[i]}]"
    yield from faults_of_sharing(scenario, states)


def check_repetition(of: Examination) -> Iterator[str]:
    """Check that equal seeds give equal bits, also in an instance that has played before."""
    used = of.factory()
    for seed, episode in product(of.seeds, of.episodes):
        first = list(of.play(of.factory(), seed, episode))
        again = of.play(of.factory(), seed, episode)
        yield from differences(first, again, f"two runs with seed {seed} differ")
        list(of.play(used, of.seeds[-1], of.episodes[0]))
        again = of.play(used, seed, episode)
        yield from differences(first, again, f"seed {seed} after another episode differs")


def check_variety(of: Examination) -> Iterator[str]:
    """Check that different seeds give different worlds, of which there may be few."""
    actions = of.actions(of.factory(), of.seeds[0])
    first = list(of.play(of.factory(), of.seeds[0], of.episodes[0], actions))
    most = max(of.seeds)
    for seed in (*of.seeds[1:], *range(most + 1, most + 1 + FURTHER_SEEDS)):
        if any(differences(first, of.play(of.factory(), seed, of.episodes[0], actions))):
            return
    seeds = ", ".join(map(str, of.seeds))
    yield f"seeds {seeds} give one and the same episode, and so do {FURTHER_SEEDS} others"


def check_two_instances(of: Examination) -> Iterator[str]:
    """Check that two instances played in turns do not notice each other."""
    seeds = of.seeds[:2]
    for episode in of.episodes:
        runs = [of.play(of.factory(), seed, episode) for seed in seeds]
        in_turns = zip(*zip_longest(*runs), strict=True)
        for seed, frames in zip(seeds, in_turns, strict=True):
            alone = of.play(of.factory(), seed, episode)
            words = f"an instance with seed {seed} played in turns with another differs"
            yield from differences(alone, filter(None, frames), words)


def check_looking(of: Examination) -> Iterator[str]:
    """Check that predicting and measuring change nothing."""
    for seed, episode in product(of.seeds, of.episodes):
        silent = of.play(of.factory(), seed, episode)
        predicting = of.play(of.factory(), seed, episode, predicting=True)
        words = "an episode in which predictions are asked for differs"
        yield from differences(list(silent), predicting, words)


def check_predictions(of: Examination) -> Iterator[str]:
    """Check that predictions have their shapes, are finite, and that their tables agree."""
    scenario = of.factory()
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


def check_sensing(of: Examination) -> Iterator[str]:
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


def check_returned_arrays(of: Examination) -> Iterator[str]:
    """Check that returned arrays stay as they are, and seeds and actions, too."""
    scenario = of.factory()
    seed = np.random.SeedSequence(of.seeds[0])
    returned: list[tuple[str, object, object]] = []
    states = scenario.reset(seed, of.episodes[0])
    if seed.n_children_spawned:
        yield "reset spawns from the seed it is given, so that using it twice gives two worlds"
    returned.append(("states at the start", states, np.array(states)))
    for step, action in enumerate(of.actions(scenario, of.seeds[0])):
        joint = action.copy()
        transition = scenario.step(joint)
        if not np.array_equal(joint, action):
            yield f"step changes the joint action it is given, {at(step + 1)}"
        for name, value in fields(transition):
            if isinstance(value, np.ndarray):
                returned.append((f"{name} {at(step + 1)}", value, value.copy()))
        if transition.terminated or transition.truncated:
            break
    for name, now, then in returned:
        if bits(now) != bits(then):
            yield f"{name}: the returned array was changed later"


def check_global_numbers(of: Examination) -> Iterator[str]:
    """Check that the global random numbers of Python and NumPy are neither drawn nor set."""
    python_before = random.getstate()
    numpy_before = np.random.get_state()  # noqa: NPY002
    try:
        # From a state that no scenario sets, lest one that always sets the same goes unnoticed.
        random.seed(2**40 + 1)
        np.random.seed(2**31 + 1)  # noqa: NPY002
        python = random.getstate()
        numpy = np.random.get_state()  # noqa: NPY002
        list(of.play(of.factory(), of.seeds[0], of.episodes[0], predicting=True))
        changed = [] if random.getstate() == python else ["random"]
        now = np.random.get_state()  # noqa: NPY002
        if not all(np.array_equal(a, b) for a, b in zip(now, numpy, strict=True)):
            changed.append("numpy.random")
    finally:
        random.setstate(python_before)
        np.random.set_state(numpy_before)  # noqa: NPY002
    if changed:
        yield f"the global state of {' and '.join(changed)} is changed"
