"""Settings of predictors (``[learner] predictor`` of a spec), mirror symmetry, and driven bodies.

Mirrored experience is that of the mirror image of a team. An agent that learns which way to turn
with the goal on the left then learns it for the right, too. In the mirror image every agent takes
the place of its partner (the left wheel of a robot that of the right one), some state variables
change sign, and rewards stay the same. A step thus gives two steps of experience to learners that
regress on after-states.

Bodies are driven: the effect of a driver is a function of the present state of its body, given by a
rule base. A driver moves the variables of its own body and those of all others::

    x_b(t + 1) = keep * x_b(t) + sum_k d_bk W_k phi(x_b(t)) + sum_(j != b, k) d_jk V_k phi(x_j(t))
"""

from __future__ import annotations

from itertools import combinations
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..interface.abilities import partners_of
from ..interface.prediction import Prediction
from ..interface.scenario import Scenario
from ..numerics import FloatArray, IntArray, njit
from ..plugins.settings import PartSettings, Positive
from ..values.partitions import Partition
from ..values.rule_base import RuleBase
from ..values.triangular import Layout, active_rules


class GivenPredictor(PartSettings):
    """The predictor of the scenario."""

    kind: Literal["given"] = "given"


class StaticPredictor(PartSettings):
    """Persistence: nothing changes, whatever the action. The baseline of all predictors."""

    kind: Literal["static"] = "static"


class LearnedPredictorSettings(PartSettings):
    """A model learned online from experience, without prior knowledge."""

    kind: Literal["learned"] = "learned"
    factory: ClassVar[str] = f"{__package__}.learned_predictor:LearnedPredictor"
    horizon: Annotated[int, Field(ge=1, le=50)] | None = None
    """Number of decisions to predict; the first joint action is held. With none, that of the
    scenario's own predictor, or 1 if it has none."""
    ridge: Positive = 10.0
    """Penalty on squared weights, relative to squared errors."""
    products: Literal["none", "private", "all"] = "private"
    """Pairs of variables used as features, in addition to single variables: none, pairs of a body's
    private variables, or all pairs including ``common`` variables."""
    memberships: Annotated[int, Field(ge=2, le=15)] | None = None
    """Number of evenly spread membership functions per variable; with none, the centers of the
    state space."""
    midpoint: bool = False
    """Whether effects are evaluated at the midpoint of a decision instead of its beginning, for
    bodies whose motion changes them."""
    mirrored: bool | None = None
    """Whether to learn from the mirror image of every step, too. With none, if the scenario
    declares a mirror symmetry."""


class PosePredictorSettings(PartSettings):
    """A model of poses learned online, which knows outlines and kinematics of bodies.

    It does not know masses, frictions and stiffness. A self-model may learn the effects of the
    wheels, too.
    """

    kind: Literal["poses"] = "poses"
    factory: ClassVar[str] = f"{__package__}.pose_model:PoseModel"
    horizon: Annotated[int, Field(ge=1, le=50)] = 4
    """Number of decisions to predict; the first joint action is held."""
    ridge: Positive = 0.001
    """Penalty on squared weights, relative to squared errors [m2/s2]."""


Predictor = Annotated[
    GivenPredictor | StaticPredictor | LearnedPredictorSettings | PosePredictorSettings,
    Field(discriminator="kind"),
]
"""The settings of any predictor, distinguished by ``kind``."""


class StaticPrediction(Prediction):
    """The present states ``(n, d)``, whatever the joint action."""

    def __init__(self, present: FloatArray) -> None:
        self._present = present

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the present state of `agent` for joint actions ``(m, n)``: ``(m, d)``."""
        return np.tile(self._present[agent], (len(joint_actions), 1))


class Mirror:
    """Doubles experience: agents, followed by their mirror images.

    Parameters
    ----------
    signs
        ``(d,)`` -1 for state variables that change sign in a mirror, else 1.
    partners
        ``(n,)`` index of each agent's mirror image.

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
            If it has none, or a state variable does not declare its mirror image.
        """
        partners = partners_of(scenario)
        if partners is None:
            raise ValueError("learner.mirrored: the scenario declares no mirror symmetry")
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
        """Return the rows of weights ``(2 n,)`` of agents and images, given ``(n,)`` of agents.

        The image of an agent has the weights of its partner.
        """
        return np.concatenate([rows, rows[self.partners]])

    def states(self, states: FloatArray) -> FloatArray:
        """Return states ``(2 n, d)`` of agents and images, given those ``(n, d)`` of agents."""
        return np.concatenate([states, self.signs * states])

    def reward(self, reward: float | FloatArray) -> float | FloatArray:
        """Return the rewards of agents and images, which are equal."""
        return np.tile(reward, 2) if isinstance(reward, np.ndarray) else reward


class DrivenBodies:
    """Predicted variables and driving agents of every body.

    If all bodies have agents of the same roles, each has the shared variables of its group. Bodies
    of different kinds count as one body with the variables of all groups, common ones once.

    Parameters
    ----------
    scenario
        The scenario with the bodies.
    products
        Pairs of variables with rules of their own, see `LearnedPredictorSettings`.
    memberships
        Membership functions per variable; None: the centers of the state space.

    Attributes
    ----------
    members
        ``(b, w)`` the agents of each body.
    agents, columns
        ``(b, v)`` agent and column of its state for every variable of a body.
    places
        ``(2, G, s)`` body, and variable of the body, for every shared variable of a group.
    common
        ``(v,)`` whether a variable is common to several bodies.
    rules
        The rule base over single variables of a body and over pairs of one group's variables.
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
    """Return the states ``(m, b, v)`` of bodies after some decisions, with constant drivers.

    Parameters
    ----------
    present
        ``(b, v)`` initial states.
    drivers
        ``(m, b, k)`` of every joint action and body.
    weights
        ``(k, n_rules, 2 v)`` by driver, W of the body's own variables, then V of the others'.
    keep
        ``(v,)`` 1 for variables predicted by their change, 0 for those predicted by their value.
    ranges, periods
        ``(2, v)`` bounds of the variables, and ``(v,)`` their periods, 0 for linear variables.
    horizon
        Number of decisions.
    passes
        Evaluations per decision: at the initial state, then at midpoints.
    layout
        Layout of the rule base.
    """
    m, b, k = drivers.shape
    v = present.shape[1]
    initial = np.empty((m * b, v))
    moved = np.empty((b, 2 * v))
    for at in range(m * b):
        for x in range(v):
            initial[at, x] = present[at % b, x]
    middle = initial.copy()
    states = initial.copy()
    for ahead in range(horizon * passes):
        if ahead % passes == 0:
            for at in range(m * b):
                for x in range(v):
                    initial[at, x] = middle[at, x] = states[at, x]
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
                    value = keep[x] * initial[at, x]
                    value += moved[i, x] + (others - moved[i, v + x])
                    middle[at, x] = 0.5 * (initial[at, x] + value)
                    if periods[x] > 0.0:
                        value -= periods[x] * np.floor((value - ranges[0, x]) / periods[x])
                        turns = np.floor((middle[at, x] - ranges[0, x]) / periods[x])
                        middle[at, x] -= periods[x] * turns
                    else:
                        value = min(max(value, ranges[0, x]), ranges[1, x])
                    states[at, x] = value
    return states.reshape(m, b, v)
