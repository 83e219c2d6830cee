"""The door for functions of users: which parameters they have, and how they are called.

A function has some of the parameters that `TAKES` lists, in any order; one that decides for several
agents in one call has those of `TAKES_MANY`, each a list. It may be ``async``. Or it is the method
``decide`` of a class, of which every agent has an object of its own in every episode.
"""

from __future__ import annotations

import asyncio
import signal
import threading
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from inspect import Parameter, iscoroutinefunction, signature
from types import FrameType
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ..interface.plain import offered
from ..plugins import sources

TAKES = ("observation", "told", "rng", "agent", "actions", "step")
"""What a function may take."""
TAKES_MANY = ("observations", "told", "rngs", "agents", "actions", "step")
"""What one may take that decides for several agents at once: lists, an entry for each."""
SHARED = ("actions", "step")
"""Which of these are the same for all."""

A = TypeVar("A")
MEMORY = ("memory", "restore")
"""What an object must have whose answers are recorded."""


class HeardMessage(NamedTuple):
    """What an agent is told by another one."""

    action: str
    """What that one has decided."""
    content: Any = None
    """What it says beside: a text, a number, an intention; none: nothing, or it was garbled."""


@dataclass(frozen=True)
class Query:
    """What an agent is asked to decide by."""

    agent: str
    """Its name."""
    observation: Mapping[str, float]
    """Its state variables by name."""
    told: Mapping[str, HeardMessage]
    """What it has been told, by sender."""
    rng: np.random.Generator
    """Its random numbers of this decision alone."""
    actions: tuple[str, ...]
    """Names of all actions."""
    step: int
    """Number of the decision in its episode, from 0."""
    seed: tuple[int, ...] = ()
    """What its random numbers follow from."""


class CallError(ValueError):
    """An agent's function has not answered as it should: one line that names the agent."""


class Caller:
    """Calls a user's function for agents.

    Parameters
    ----------
    name
        Where it is, for messages.
    thing
        The function, or class with a method ``decide``.
    named
        Its own settings, by name.

    Attributes
    ----------
    is_class
        Whether every agent has an object of its own.

    Raises
    ------
    ValueError
        If it takes something else than it may; one line.
    """

    def __init__(self, name: str, thing: Any, named: Mapping[str, object]) -> None:
        self._name = name
        self._thing = thing
        self._named = dict(named)
        self.is_class = isinstance(thing, type)
        decide = offered(thing, "decide") if self.is_class else thing
        own = [p for p in signature(decide).parameters.values() if p.kind is not p.KEYWORD_ONLY]
        given = [p.name for p in own][self.is_class :]
        self.is_batched = "observations" in given
        self.is_async = iscoroutinefunction(decide)
        allowed = TAKES_MANY if self.is_batched else TAKES
        for parameter in own[self.is_class :]:
            if parameter.name not in allowed and parameter.default is Parameter.empty:
                raise ValueError(
                    f"learner.kind = {name!r}: parameter {parameter.name!r} of decide, allowed: "
                    f"{', '.join(allowed)}; settings of its own stand after a *, annotated"
                )
        if self.is_batched and self.is_class:
            raise ValueError(
                f"learner.kind = {name!r}: observations of several agents are for a function, a "
                "class is asked for one observation"
            )
        self.takes = tuple(name for name in given if name in allowed)
        self._objects: dict[str, Any] = {}
        self._runner: asyncio.Runner | None = None

    def begin(self) -> None:
        """Begin an episode: objects that remember are made anew."""
        self._objects = {}

    def answers(
        self, queries: Sequence[Query], timeout: float, at_once: int
    ) -> Iterator[tuple[Query, object]]:
        """Yield what each of some agents answers, as it arrives.

        Parameters
        ----------
        queries
            What they are asked.
        timeout
            Longest time of an answer [s].
        at_once
            Most calls under way, if the function is ``async``.

        Raises
        ------
        CallError
            If one raises or takes too long.
        """
        if self.is_batched:
            yield from self._batch(queries, timeout)
        elif self.is_async:
            yield from self._concurrent(queries, timeout, at_once)
        else:
            with alarm() as within:
                for query in queries:
                    with self._naming(query.agent, timeout), within(timeout):
                        answer = self._call(query)
                    yield query, answer

    def question(self, query: Query) -> dict[str, object]:
        """Return all that an answer may depend on, but for the function itself."""
        given: dict[str, object] = {}
        for one, many in zip(TAKES, TAKES_MANY, strict=True):
            if one in self.takes or many in self.takes:
                given[one] = query.seed if one == "rng" else vars(query)[one]
        if self.is_class:
            given["memory"] = self.memory(query.agent)
        return given

    def memory(self, agent: str) -> object:
        """Return what the object of an agent remembers, if there are such."""
        return self._object(agent).memory() if self.is_class else None

    def restore(self, agent: str, memory: object) -> None:
        """Let the object of an agent, if there is one, remember what it did."""
        if self.is_class:
            self._object(agent).restore(memory)

    def check_memory(self) -> None:
        """Refuse objects whose memory cannot be kept beside their answers.

        Raises
        ------
        ValueError
            One line.
        """
        if self.is_class and not all(callable(vars(self._thing).get(n)) for n in MEMORY):
            raise ValueError(
                f"learner.recorded = true: {self._name} remembers, and needs methods memory() and "
                "restore(memory) of what JSON holds, to go on after a recorded answer"
            )

    def _object(self, agent: str) -> Any:
        if agent not in self._objects:
            self._objects[agent] = self._thing(**self._named)
        return self._objects[agent]

    def _function(self, agent: str) -> Callable[..., Any]:
        """Return what decides for an agent."""
        decide: Callable[..., Any] = self._object(agent).decide if self.is_class else self._thing
        return decide

    def _call(self, query: Query) -> Any:
        given = {name: vars(query)[name] for name in self.takes}
        return self._function(query.agent)(**given, **({} if self.is_class else self._named))

    def _batch(self, queries: Sequence[Query], timeout: float) -> Iterator[tuple[Query, object]]:
        first = queries[0]
        given: dict[str, object] = {}
        for one, many in zip(TAKES, TAKES_MANY, strict=True):
            if many in self.takes:
                each = [vars(query)[one] for query in queries]
                given[many] = each[0] if many in SHARED else each
        names = ", ".join(query.agent for query in queries)
        with alarm() as within, self._naming(names, timeout), within(timeout):
            answers = self._thing(**given, **self._named)
            if self.is_async:
                answers = self._loop().run(limited(answers, timeout))
        is_listed = isinstance(answers, list | tuple | np.ndarray)
        if not is_listed or len(answers) != len(queries):
            raise CallError(
                f"agent {first.agent!r}: {self._name} returns {answers!r:.60}, allowed: a list of "
                f"{len(queries)} answers, one for each observation"
            )
        yield from zip(queries, answers, strict=True)

    def _concurrent(
        self, queries: Sequence[Query], timeout: float, at_once: int
    ) -> Iterator[tuple[Query, object]]:
        """Yield answers as they arrive; once one fails, those under way are still waited for."""
        loop = self._loop()
        free = asyncio.Semaphore(at_once)
        failed: dict[str, CallError] = {}

        async def ask(query: Query) -> tuple[Query, object] | None:
            async with free:
                if failed:
                    return None
                try:
                    with self._naming(query.agent, timeout):
                        return query, await limited(self._call(query), timeout)
                except CallError as error:
                    failed[query.agent] = error
                    return None

        async def begin() -> set[asyncio.Task[tuple[Query, object] | None]]:
            return {asyncio.ensure_future(ask(query)) for query in queries}

        async def wait(tasks: set[asyncio.Task[tuple[Query, object] | None]]) -> Any:
            return await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)

        left = loop.run(begin())
        while left:
            # A call that blocks is not stopped by its loop.
            name = queries[0].agent
            with alarm() as within, self._naming(name, timeout), within(2 * timeout):
                done, left = loop.run(wait(left))
            yield from filter(None, (task.result() for task in done))
        for query in queries:
            if query.agent in failed:
                raise failed[query.agent]

    def _loop(self) -> asyncio.Runner:
        """Return the event loop of all calls, so that connections can be kept."""
        if self._runner is None:
            self._runner = asyncio.Runner()
        return self._runner

    @contextmanager
    def _naming(self, agent: str, timeout: float) -> Iterator[None]:
        """Name the agent whose function fails."""
        where = f"agent {agent!r}: {self._name}"
        try:
            yield
        except CallError:
            raise
        except OutOfTimeError:
            raise CallError(
                f"{where} has not answered within learner.timeout = {timeout:g} s"
            ) from None
        except (Exception, SystemExit) as error:
            what = f"raises {sources.format_error(error)}{sources.place(error)}"
            raise CallError(f"{where} {what}") from error


class OutOfTimeError(BaseException):
    """The time of a call is over; no Exception, which functions may catch and try again."""


async def limited(answer: Awaitable[A], seconds: float) -> A:
    """Return what is waited for.

    Raises
    ------
    OutOfTimeError
        When the time is over.
    """
    try:
        async with asyncio.timeout(seconds) as limit:
            return await answer
    except TimeoutError:
        if limit.expired():
            raise OutOfTimeError from None
        raise  # the function's own


@contextmanager
def alarm() -> Iterator[Callable[[float], AbstractContextManager[None]]]:
    """Give what interrupts calls that take longer than some seconds, by a signal.

    It raises `OutOfTimeError`; outside of the main thread there is no such signal.
    """
    if threading.current_thread() is not threading.main_thread():
        yield lambda seconds: nullcontext()
        return

    def ring(number: int, frame: FrameType | None) -> None:
        raise OutOfTimeError

    usual = signal.signal(signal.SIGALRM, ring)
    try:
        yield _within
    finally:
        signal.signal(signal.SIGALRM, usual)


@contextmanager
def _within(seconds: float) -> Iterator[None]:
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
