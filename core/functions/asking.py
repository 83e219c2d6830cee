"""Asking a function: recorded answers first, then calls, whose answers are kept as they arrive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..learners import LEARNERS
from ..plugins import sources
from .plain import Caller, CallError, Query
from .recorded import RecordedAnswers, canonical
from .replies import Reply, read_reply
from .settings import FunctionSettings


@dataclass(frozen=True)
class Unit:
    """What is asked in one call: one agent, or all whose turn it is."""

    queries: Sequence[Query]
    """What each of its agents is asked."""
    question: str
    """All that their answers depend on, written down; empty if they are not recorded."""


class Asking:
    """Asks a function, or its recorded answers.

    Parameters
    ----------
    settings
        Which function, and its settings.
    actions
        Names of all actions.

    Raises
    ------
    ValueError
        If the function takes something else than it may, or its memory cannot be kept; one line.
    """

    def __init__(self, settings: FunctionSettings, actions: tuple[str, ...]) -> None:
        self._settings = settings
        self._actions = actions
        own = type(settings).model_fields.keys() - FunctionSettings.model_fields.keys()
        named = {name: value for name, value in settings if name in own}
        self._caller = Caller(settings.kind, LEARNERS.find(settings.kind), named)
        self._head: dict[str, Any] = {}
        self._recorded: RecordedAnswers | None = None
        self._may_call = True
        place = sources.active().answers
        if not settings.recorded:
            return
        self._caller.check_memory()
        self._head = {
            "function": settings.kind,
            "settings": settings.model_dump(mode="json", include=set(own)),
        }
        if sources.is_reference(settings.kind):
            file = sources.split(settings.kind)[0]
            self._head["code"] = sources.active().digest(file)
        if place is not None:
            self._recorded = RecordedAnswers(place.path)
            self._may_call = place.calls

    def begin(self) -> None:
        """Begin an episode: nobody remembers the one before."""
        self._caller.begin()

    def replies(self, queries: Sequence[Query]) -> list[Reply]:
        """Return what each of some agents answers, in their order.

        Raises
        ------
        CallError
            If one does not answer as it should, or its answer is missing and nobody may be called;
            one line that names the agent.
        """
        replies: dict[str, Reply] = {}
        left = []
        together = [queries] if self._caller.is_batched else [[query] for query in queries]
        for unit in [Unit(own, self._question(own)) for own in together if own]:
            answer = None if self._recorded is None else self._recorded.find(unit.question)
            if answer is None:
                left.append(unit)
            else:
                replies |= self._read(unit, answer)
        if left and self._recorded is not None and not self._may_call:
            agent = left[0].queries[0].agent
            raise CallError(f"agent {agent!r}: {self._recorded.missing(left[0].question)}")
        replies |= self._called(left)
        return [replies[query.agent] for query in queries]

    def _called(self, units: Sequence[Unit]) -> dict[str, Reply]:
        """Return by agent what a function that is called answers."""
        settings = self._settings
        unit_of = {query.agent: unit for unit in units for query in unit.queries}
        queries = [query for unit in units for query in unit.queries]
        replies: dict[str, Reply] = {}
        wrong: dict[str, ValueError] = {}
        called = self._caller.answers(queries, settings.timeout, settings.calls_at_once)
        for query, answer in called if queries else ():
            try:
                replies[query.agent] = read_reply(answer, self._actions, settings.costs)
            except ValueError as error:
                wrong[query.agent] = error
                if self._caller.is_async:
                    continue  # what is under way is still taken in
                break
            unit = unit_of[query.agent]
            if self._recorded is not None and all(q.agent in replies for q in unit.queries):
                answer = self._answer([replies[q.agent] for q in unit.queries], query.agent)
                replies |= self._read(unit, self._recorded.keep(unit.question, answer))
        for query in queries:
            if query.agent in wrong:
                raise CallError(f"agent {query.agent!r}: {settings.kind} {wrong[query.agent]}")
        return replies

    def _question(self, queries: Sequence[Query]) -> str:
        """Write down all that the answers of some agents depend on."""
        if self._recorded is None:
            return ""
        asked = [self._caller.question(query) for query in queries]
        try:
            return canonical({**self._head, "asked": asked})
        except ValueError as error:
            raise CallError(
                f"agent {queries[0].agent!r}: memory of {self._settings.kind}: {error}"
            ) from None

    def _answer(self, replies: Sequence[Reply], agent: str) -> dict[str, Any]:
        """Return what is kept of an answer."""
        tables = [
            {"action": self._actions[r.action], "message": r.message, "costs": dict(r.costs)}
            for r in replies
        ]
        return {"replies": tables, "memory": self._caller.memory(agent)}

    def _read(self, unit: Unit, answer: Mapping[str, Any]) -> dict[str, Reply]:
        """Return by agent what a recorded answer means, as if they had been called."""
        self._caller.restore(unit.queries[0].agent, answer["memory"])
        tables = zip(unit.queries, answer["replies"], strict=True)
        costs = self._settings.costs
        return {query.agent: read_reply(table, self._actions, costs) for query, table in tables}
