"""Settings of predictors, ``[learner] predictor`` of a spec, and what learned predictors rest on.

Mirrored experience is what the image of a team would have met in the mirror image of its world. An
agent that learns which way to turn with the goal on the left has learned it for the right, too, if
it is told that the two are mirror images. In a mirror every agent stands where its partner stood
(the left wheel of a robot where the right one was), some state variables change their sign, and
rewards stay. So a step is two steps of experience, to learners that regress on after-states.

Bodies are driven: how much a driver moves what is a function of the present state of its body: a
sum over the active rules of a rule base. It moves the variables of its own body and those of all
others::

    x_b(t + 1) = keep * x_b(t) + sum_k d_bk W_k phi(x_b(t)) + sum_(j != b, k) d_jk V_k phi(x_j(t))
"""

from __future__ import annotations

from itertools import combinations
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..interface.prediction import Prediction
from ..interface.scenario import Scenario
from ..numerics import FloatArray, IntArray, njit
from ..plugins.settings import PartSettings, Positive, unwritten
from ..values.partitions import Partition
from ..values.rule_base import RuleBase
from ..values.triangular import Layout, active_rules
from .adaptive import DynamicsModel


class GivenPredictor(PartSettings):
    """What the scenario itself predicts."""

    kind: Literal["given"] = "given"


class StaticPredictor(PartSettings):
    """Persistence: whatever is done, nothing changes. The baseline of every other predictor."""

    kind: Literal["static"] = "static"
    factory: ClassVar[str] = f"{__name__}:Persistence"


class LearnedPredictorSettings(PartSettings):
    """What is regressed from experience, online and from nothing: no model is given."""

    kind: Literal["learned"] = "learned"
    factory: ClassVar[str] = f"{__package__}.learned_predictor:LearnedPredictor"
    horizon: Annotated[int, Field(ge=1, le=50)] | None = None
    """Decisions that it looks ahead, what agents do in the first being held; none: as many as the
    scenario's own predictions do, 1 without such."""
    ridge: Positive = 10.0
    """Weight of the squared weights against the squared errors."""
    products: Literal["none", "private", "all"] = "private"
    """Pairs of which variables of a body say, beside each alone, what an agent moves: of none, of
    those that are its own to the body, or of the ``common`` ones, too."""
    memberships: Annotated[int, Field(ge=2, le=15)] | None = None
    """Membership functions per variable, spread evenly; none: the state space's own centres."""
    midpoint: Annotated[bool, unwritten(False)] = False
    """Whether what moves what is taken from the middle of the way of a decision, where motion
    changes what moves what, and not from its beginning."""
    mirrored: bool | None = None
    """Whether what the mirror image of the team would have met is experience as well; none: if the
    scenario tells what a mirror does."""


Predictor = Annotated[
    GivenPredictor | StaticPredictor | LearnedPredictorSettings, Field(discriminator="kind")
]
"""The settings of any predictor, distinguished by ``kind``."""


class Persistence(DynamicsModel):
    """Predicts that nothing changes."""

    def __init__(self, settings: StaticPredictor, scenario: Scenario) -> None:
        pass

    def predict(self, states: FloatArray) -> StaticPrediction:
        """Predict from states ``(n, d)``."""
        return StaticPrediction(states)


class StaticPrediction(Prediction):
    """The present states ``(n, d)``, whatever is done."""

    def __init__(self, present: FloatArray) -> None:
        self._present = present

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the present state of `agent` for joint actions ``(m, n)``: ``(m, d)``."""
        return np.tile(self._present[agent], (len(joint_actions), 1))


class Mirror:
    """Doubles experience: agents, and behind them their mirror images.

    Parameters
    ----------
    signs
        ``(d,)`` -1 where a mirror turns the sign of a state variable, else 1.
    partners
        ``(n,)`` the agent whose place each agent takes.

    Examples
    --------
    >>> mirror = Mirror(np.array([1.0, -1.0]), np.array([1, 0]))
    >>> mirror.states(np.array([[0.1, 0.5], [0.2, 0.5]])).tolist()
    [[0.1, 0.5], [0.2, 0.5], [0.1, -0.5], [0.2, -0.5]]
    >>> mirror.rows(np.array([0, 1])).tolist()
    [0, 1, 1, 0]
    """

    def __init__(self, signs: FloatArray, partners: IntArray) -> None:
        self.signs = signs
        self.partners = partners

    @classmethod
    def of(cls, scenario: Scenario) -> Mirror:
        """Return the mirror of a scenario.

        Raises
        ------
        ValueError
            If it has none, or a state variable does not say what a mirror does to it; one line.
        """
        partners = scenario.partners()
        if partners is None:
            raise ValueError("learner.mirrored: the scenario does not tell what a mirror does")
        variables = scenario.state_space.variables
        for variable in variables:
            if variable.mirrored is None:
                raise ValueError(
                    f"learner.mirrored: state variable {variable.name!r} does not say whether a "
                    "mirror turns its sign; declare mirrored = 'same' or 'opposite'"
                )
        signs = [-1.0 if variable.mirrored == "opposite" else 1.0 for variable in variables]
        return cls(np.array(signs), np.array(partners))

    def rows(self, rows: IntArray) -> IntArray:
        """Return the rows of weights ``(2 n,)`` of agents and images, of those ``(n,)`` of agents.

        The image of an agent has learned for its partner, in whose place it stands.
        """
        return np.concatenate([rows, rows[self.partners]])

    def states(self, states: FloatArray) -> FloatArray:
        """Return the states ``(2 n, d)`` of agents and images, of those ``(n, d)`` of agents."""
        return np.concatenate([states, self.signs * states])

    def reward(self, reward: float | FloatArray) -> float | FloatArray:
        """Return what agents and images are paid: the same."""
        return np.tile(reward, 2) if isinstance(reward, np.ndarray) else reward


class DrivenBodies:
    """Which variables there are to predict, by body, and who drives them.

    Bodies alike, in the roles of their agents, have the shared variables of their group each.
    Unlike ones count as one body, which has those of all groups, the common ones once.

    Parameters
    ----------
    scenario
        Whose bodies they are.
    products
        Pairs of which variables rules are over, see `LearnedPredictorSettings`.
    memberships
        Membership functions per variable; none: the state space's own centres.

    Attributes
    ----------
    members
        ``(b, w)`` the agents of each body.
    agents, columns
        ``(b, v)`` each variable of a body is this column of this agent's state.
    places
        ``(2, G, s)`` each shared variable of a group is of this body this variable.
    common
        ``(v,)`` whether a variable is the same for all of several bodies.
    rules
        The rule base over the variables of a body: single ones, and pairs of one group's.
    """

    def __init__(self, scenario: Scenario, *, products: str, memberships: int | None) -> None:
        space = scenario.state_space
        groups = scenario.groups
        roles = scenario.roles
        common = {j for j, v in enumerate(space.variables) if v.name in space.common}
        columns = range(space.n_own, space.n_variables)
        alike = len({tuple(roles[i] for i in group) for group in groups}) == 1
        # Variables are pairs of a group and a column.
        shared = [
            [(0 if j in common and not alike else g, j) for j in columns]
            for g in range(len(groups))
        ]
        once = list(dict.fromkeys(variable for own in shared for variable in own))
        owned = shared if alike else [once]
        place = {variable: (b, v) for b, own in enumerate(owned) for v, variable in enumerate(own)}
        self.members = np.array(groups if alike else [range(len(roles))])
        self.agents = np.array([[groups[g][0] for g, _ in own] for own in owned])
        self.columns = np.array([[j for _, j in own] for own in owned])
        self.places = np.moveaxis(np.array([[place[v] for v in own] for own in shared]), -1, 0)
        first = owned[0]
        self.common = np.array([len(owned) > 1 and j in common for _, j in first])
        terms: list[tuple[int, ...]] = [(v,) for v in range(len(first))]
        if products != "none":
            every = products == "all" or len(groups) == 1
            paired = [v for v, (_, j) in enumerate(first) if every or j not in common]
            terms += [(v, u) for v, u in combinations(paired, 2) if first[v][0] == first[u][0]]
        parts = [Partition.of(space.variables[j], count=memberships) for _, j in first]
        self.rules = RuleBase(parts, terms)


@njit(cache=True)
def driven_states(
    present: FloatArray,
    drivers: FloatArray,
    weights: FloatArray,
    keep: FloatArray,
    ranges: FloatArray,
    periods: FloatArray,
    horizon: int,
    passes: int,
    layout: Layout,
) -> FloatArray:
    """Return the states ``(m, b, v)`` of bodies some decisions ahead, the drivers being held.

    Parameters
    ----------
    present
        ``(b, v)`` where they begin.
    drivers
        ``(m, b, k)`` of every joint action and body.
    weights
        ``(k, n_rules, 2 v)`` by driver, W of the body's own variables, then V of the others'.
    keep
        ``(v,)`` 1 for variables whose change is regressed, 0 for those whose value is.
    ranges, periods
        ``(2, v)`` what variables cannot leave; ``(v,)`` their periods, 0 where there is none.
    horizon
        Decisions ahead.
    passes
        How often each is computed: by the rules of where it begins, then of the middle of the way.
    layout
        Layout of the rule base.
    """
    m, b, k = drivers.shape
    v = present.shape[1]
    begun = np.empty((m * b, v))
    moved = np.empty((b, 2 * v))
    for at in range(m * b):
        for x in range(v):
            begun[at, x] = present[at % b, x]
    middle = begun.copy()
    states = begun.copy()
    for ahead in range(horizon * passes):
        if ahead % passes == 0:
            for at in range(m * b):
                for x in range(v):
                    begun[at, x] = middle[at, x] = states[at, x]
        rules, strengths = active_rules(middle, layout)
        for c in range(m):
            moved[:] = 0.0
            for i in range(b):
                at = c * b + i
                for j in range(k):
                    driver = drivers[c, i, j]
                    if driver == 0.0:
                        continue
                    for a in range(rules.shape[1]):
                        share = driver * strengths[at, a]
                        effect = weights[j, rules[at, a]]
                        for x in range(2 * v):
                            moved[i, x] += share * effect[x]
            for x in range(v):
                others = 0.0
                for i in range(b):
                    others += moved[i, v + x]
                for i in range(b):
                    at = c * b + i
                    value = keep[x] * begun[at, x]
                    value += moved[i, x] + (others - moved[i, v + x])
                    middle[at, x] = 0.5 * (begun[at, x] + value)
                    if periods[x] > 0.0:
                        value -= periods[x] * np.floor((value - ranges[0, x]) / periods[x])
                        turns = np.floor((middle[at, x] - ranges[0, x]) / periods[x])
                        middle[at, x] -= periods[x] * turns
                    else:
                        value = min(max(value, ranges[0, x]), ranges[1, x])
                    states[at, x] = value
    return states.reshape(m, b, v)
