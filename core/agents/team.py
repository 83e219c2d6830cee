"""A team: agents in a hierarchy who decide together, turn by turn, and learn from what comes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ..hierarchy.failures import LeftAgents, MessageFailure, ReparentedAgents
from ..hierarchy.hierarchy import Hierarchy
from ..hierarchy.messages import Messages
from ..hierarchy.turns import Slot, Turn, slots_of
from ..interface.agents import Agents, Counts, Memory, Placement, under
from ..interface.environments import Transitions
from ..interface.experience import Decision, Experience, Observation
from ..interface.measures import Measure
from ..interface.plain import as_scenario
from ..interface.scenario import Scenario
from ..numerics import AnyArray, BoolArray, IntArray
from ..plugins.settings import Settings
from ..plugins.words import expect
from .kept import begin_with

if TYPE_CHECKING:
    from ..learners.learner import TeamSettings

A = TypeVar("A", bound=Agents[Any])
MESSAGES = Measure("messages", "messages", gathering="sum", better="lower", least=0.0)
"""What of a decision's cost is counted here, where agents say more than actions: the messages that
have arrived, whatever agents are of."""


class Team:
    """A hierarchy, its messages, and the agents that decide: of one kind, or part by part.

    Parameters
    ----------
    settings
        Of the agents: how they decide and learn.
    scenario
        Where they act.
    hierarchy
        Who decides before whom, and sees whom.
    seed
        Source of everything random in the team.
    failures
        What fails of the messages down the hierarchy.

    Attributes
    ----------
    parts
        The agents, kind by kind.
    messages
        Who is told what.
    costs
        What is measured of an episode of what its decisions cost: of functions, and of agents with
        views of their own.
    spent
        What its last decision cost, by their names.

    Raises
    ------
    ValueError
        If the hierarchy is over other agents than the scenario's, or the settings do not fit the
        scenario; one line.
    """

    def __init__(
        self,
        settings: TeamSettings,
        scenario: object,
        hierarchy: Hierarchy,
        seed: np.random.SeedSequence,
        failures: Sequence[MessageFailure] = (),
    ) -> None:
        expect("settings of a team or of a learner", Settings, settings=settings)
        expect("a hierarchy", Hierarchy, hierarchy=hierarchy)
        expect("what policy_seed returns", np.random.SeedSequence, seed=seed)
        world = as_scenario(scenario)
        if hierarchy.agents != tuple(world.agents):
            raise ValueError(
                f"topology: agents {', '.join(hierarchy.agents)} are not the scenario's "
                f"{', '.join(world.agents)}"
            )
        if not settings.uses_hierarchy:
            hierarchy, failures = Hierarchy(world.agents, []), ()
        self.hierarchy = hierarchy
        self.action_set = world.action_set
        kinds = settings.members(world, hierarchy)
        seeds = [seed] if len(kinds) == 1 else seed.spawn(len(kinds))
        parts: list[Agents[Any]] = []
        self._part_of = [0] * len(hierarchy)
        for (members, own, kept), own_seed in zip(kinds, seeds, strict=True):
            for agent in members.tolist():
                self._part_of[agent] = len(parts)
            fail = bool(failures)
            placement = Placement(world, hierarchy, members, own_seed, messages_fail=fail)
            parts.append(own.agents(placement))
            if kept is not None:
                begin_with(parts[-1], kept, len(parts) - 1)
        self.parts = tuple(parts)
        self.costs = costs_of(parts)
        self.spent: Mapping[str, float] = {}
        self._messages = 0
        self._has_contents = any(part.has_contents for part in parts)
        self.messages = Messages(
            hierarchy, failures, len(world.action_set), has_contents=self._has_contents
        )
        self._present = hierarchy
        self._actions_of_left = _actions_of_left(failures, world)

    @cached_property
    def _slots(self) -> tuple[Slot, ...]:
        # Who is told by another superior may not decide at once with it.
        one_by_one = any(
            isinstance(f, ReparentedAgents) or (isinstance(f, LeftAgents) and f.repair == "next")
            for f in self.messages.failures
        )
        at_once = [part.at_once and not one_by_one for part in self.parts]
        return slots_of(self.hierarchy, self._part_of, at_once)

    def only(self, kind: type[A]) -> A:
        """Return the team's agents, if all are of one kind, and of this one.

        Raises
        ------
        ValueError
            If they are not; one line.
        """
        if len(self.parts) == 1 and isinstance(self.parts[0], kind):
            return self.parts[0]
        others = ", ".join(type(part).__name__ for part in self.parts)
        raise ValueError(f"learner.kind: needs {kind.__name__}, the team is of {others}")

    @property
    def is_sampled(self) -> bool:
        """Whether a policy in it is one of probabilities."""
        return any(part.is_sampled for part in self.parts)

    @property
    def counts(self) -> Counts:
        """What all have evaluated so far."""
        total = Counts()
        for part in self.parts:
            total.add(part.counts)
        return total

    @property
    def weight_bytes(self) -> int:
        """How much memory all weights take."""
        return sum(part.weight_bytes for part in self.parts)

    @contextmanager
    def drawing_apart(self) -> Iterator[None]:
        """Let what is drawn within change nothing of what is drawn after."""
        generators = [part.rng.bit_generator for part in self.parts]
        states = [generator.state for generator in generators]
        yield
        for generator, state in zip(generators, states, strict=True):
            generator.state = state

    def check(self, seen: Observation) -> None:
        """Refuse a world without what the agents decide by.

        Raises
        ------
        ValueError
            One line.
        """
        for part in self.parts:
            part.check(seen)

    def begin_world(self, seed: int | np.random.SeedSequence, episode: int) -> None:
        """Begin a world; what fails of the messages in it follows from `seed`."""
        self.messages.begin(seed, episode)
        for part in self.parts:
            part.begin_world(episode)

    def begin_episode(self) -> None:
        """Begin an episode of learning."""
        for part in self.parts:
            part.begin_episode()

    def act(self, seen: Observation, *, explore: bool = True) -> Decision:
        """Decide a joint action, from the top of the hierarchy down.

        Without `explore` every agent takes its greatest action and the team's memory stays as it
        is, apart from the random numbers that break ties.
        """
        if self._present is not self.messages.hierarchy:
            self._rearrange()
        inputs = tuple(part.perceive(seen, explore=explore) for part in self.parts)
        joint = self._walk(seen, inputs)
        if self._has_contents:
            self.messages.advance(joint, self._contents(inputs))
        else:
            self.messages.advance(joint)
        for part, own in zip(self.parts, inputs, strict=True):
            part.conclude(own, joint)
        if self.costs:
            self.spent = self._spent(inputs)
        return Decision(joint, inputs)

    def _walk(self, seen: Observation, inputs: tuple[object, ...]) -> IntArray:
        """Let the agents decide, turn by turn; each is told what those above it have decided."""
        batch_shape = seen.present.shape[:-2]
        joint = np.full((*batch_shape, len(self.hierarchy)), self.action_set.neutral)
        decided = joint.T  # a view with the agents first, however many environments there are
        fail = bool(self.messages.failures)
        gone = self.messages.gone
        some_left = fail and bool(gone.any())
        if some_left:
            joint[..., gone] = self._joint_of_left()[gone]
        for part, agents, receivers, senders in self._slots:
            if some_left:
                agents = agents[~gone[agents]]
            if fail and self.parts[part].has_contents:  # whoever is absent is not asked
                agents = agents[~np.isin(agents, self.messages.absent(agents))]
            if not len(agents):
                continue
            if self.parts[part].has_contents:
                turn = self.messages.turn_with_contents(agents, joint, self._contents(inputs))
            elif fail:
                turn = self.messages.failed_turn(agents, joint)
            else:
                turn = Turn(agents, receivers, senders, decided[senders].T)
            decided[agents] = self.parts[part].decide(inputs[part], turn).T
            self._messages += len(turn.senders)
            if fail:
                joint[self.messages.absent(agents)] = self.action_set.neutral
        return joint

    def _joint_of_left(self) -> IntArray:
        """Return what agents do who have left ``(n,)``; others are neutral."""
        return self.messages.acting_for(self._actions_of_left, self.action_set.neutral)

    def _rearrange(self) -> None:
        """Let all parts know who has left or come, and the hierarchy of those who are there."""
        self._present = self.messages.hierarchy
        left = np.flatnonzero(self.messages.gone)
        for part in self.parts:
            part.rearrange(self._present, left, self._joint_of_left()[left])

    def _contents(self, inputs: tuple[object, ...]) -> Mapping[int, object]:
        """Return by agent what has been said beside actions so far."""
        contents: dict[int, object] = {}
        for part, own in zip(self.parts, inputs, strict=True):
            contents.update(part.contents(own))
        return contents

    def _spent(self, inputs: tuple[object, ...]) -> Mapping[str, float]:
        """Return what a decision has cost, by the names of `costs`."""
        total = {measure.name: 0.0 for measure in self.costs}
        total[MESSAGES.name] = float(self._messages)
        self._messages = 0
        for part, own in zip(self.parts, inputs, strict=True):
            for name, value in part.spent(own).items():
                total[name] += value
        return total

    def learn(self, experience: Experience) -> None:
        """Learn from what a decision led to."""
        for part, inputs in zip(self.parts, experience.decision.inputs, strict=True):
            part.learn(experience, inputs)

    def learn_batch(self, decision: Decision, steps: Transitions, last: BoolArray) -> None:
        """Learn from one step of many environments; `last` says which episodes end."""
        for part, inputs in zip(self.parts, decision.inputs, strict=True):
            part.learn_batch(decision.joint_action, inputs, steps, last)

    def continue_from(self, former: Team) -> None:
        """Begin where the team of another scenario or hierarchy ended, between two episodes.

        Raises
        ------
        ValueError
            If what was learned means nothing here; one line.
        """
        for part, before in zip(self.parts, former.parts, strict=True):
            part.continue_from(before)

    def check_world(self, scenario: Scenario) -> None:
        """Refuse another world for the very same team, if what it has learned means nothing there.

        Raises
        ------
        ValueError
            One line.
        """
        for part in self.parts:
            part.check_world(scenario)

    def save(self, path: Path | str) -> None:
        """Write everything that the team remembers to an ``.npz`` file: arrays only."""
        with open(path, "wb") as file:
            np.savez(file, allow_pickle=False, **self.arrays())

    def load(self, path: Path | str) -> None:
        """Continue from what `save` wrote; the team must be built from the same settings.

        Raises
        ------
        ValueError
            If the file is not of a team of this shape.
        """
        with np.load(path, allow_pickle=False) as arrays:
            self.restore(dict(arrays))

    def arrays(self) -> Memory:
        """Return everything that the team remembers as named arrays."""
        if len(self.parts) == 1:
            return self.parts[0].memory()
        return {
            f"part{k}.{name}": array
            for k, part in enumerate(self.parts)
            for name, array in part.memory().items()
        }

    def restore(self, arrays: Mapping[str, AnyArray]) -> None:
        """Continue from what `arrays` returned.

        Raises
        ------
        ValueError
            If they are of another team.
        """
        if len(self.parts) == 1:
            self.parts[0].restore(arrays)
            return
        for k, part in enumerate(self.parts):
            part.restore(under(f"part{k}.", arrays))


def costs_of(parts: Sequence[Agents[Any]]) -> tuple[Measure, ...]:
    """Return what decisions of some parts cost, each once.

    Raises
    ------
    ValueError
        If two parts give the same cost in different units; one line.
    """
    by_name: dict[str, Measure] = {}
    if any(part.has_contents for part in parts):
        by_name[MESSAGES.name] = MESSAGES
    for part in parts:
        for measure in part.costs:
            known = by_name.setdefault(measure.name, measure)
            if known != measure:
                raise ValueError(
                    f"learner.costs.{measure.name} = {measure.unit!r}: another part of the team "
                    f"gives it in {known.unit!r}"
                )
    return tuple(by_name.values())


def _actions_of_left(failures: Sequence[MessageFailure], world: Scenario) -> list[int]:
    """Return what those do who have left, failure by failure; others are neutral.

    Raises
    ------
    ValueError
        If there is no such action; one line.
    """
    names = world.action_set.names
    actions = []
    for k, failure in enumerate(failures):
        action = failure.action if isinstance(failure, LeftAgents) else None
        if action is not None and action not in names:
            raise ValueError(
                f"topology.failures[{k}].action = {action!r}: no action, allowed: "
                f"{', '.join(names)}"
            )
        actions.append(world.action_set.neutral if action is None else names.index(action))
    return actions
