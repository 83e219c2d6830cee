"""A decorator that turns slow calls for single agents into a function agent of nested-agents."""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import Awaitable, Callable, Mapping, Sequence
from functools import wraps
from inspect import Parameter, Signature, iscoroutinefunction, signature
from pathlib import Path
from types import CodeType
from typing import Any, TypeVar, get_type_hints

import numpy as np

from .record import RecordedAnswers, canonical, shorten

BATCH = {
    "observation": "observations",
    "received": "received",
    "rng": "rngs",
    "agent": "agents",
    "actions": "actions",
    "step": "step",
}
"""Parameters of a call for one agent, and of the function for several agents."""
COMMON = ("actions", "step")
"""Parameters that are equal for all agents."""

Decide = TypeVar("Decide", bound=Callable[..., Any])


class CallError(RuntimeError):
    """A call failed, took too long, or has no recorded answer; the message names the agent."""


def slow_calls(
    *,
    timeout_s: float = 60.0,
    max_concurrent: int = 8,
    record: str | Path | None = None,
    offline: bool = False,
) -> Callable[[Decide], Decide]:
    """Return a decorator for a function, async or not, that decides for one agent.

    The decorated function is called for all agents whose turn it is, concurrently: an ordinary
    function runs in threads. Its parameters are those of a function agent (``observation``,
    ``received``, ``rng``, ``agent``, ``actions``, ``step``); keyword-only parameters are keys of
    the spec.

    Parameters
    ----------
    timeout_s
        Time limit of a call [s].
    max_concurrent
        Maximum number of calls at a time.
    record
        SQLite file of recorded answers; None: answers are not recorded.
    offline
        Whether to use recorded answers only.

    Raises
    ------
    ValueError
        If `offline` is given without `record`, or the function has another parameter.
    """
    if offline and record is None:
        raise ValueError("offline = True: needs record, the file of recorded answers")
    answers = None if record is None else RecordedAnswers(Path(record).absolute())

    def decorate(function: Decide) -> Decide:
        own = signature(function).parameters.values()
        takes = [p.name for p in own if p.kind is not Parameter.KEYWORD_ONLY]
        unknown = [name for name in takes if name not in BATCH]
        if unknown:
            raise ValueError(f"parameter {unknown[0]!r}, allowed: {', '.join(BATCH)}")
        caller = _Caller(function, takes, timeout_s, max_concurrent, answers, offline)

        @wraps(function)
        def decide(**given: Any) -> list[Any]:
            return caller.decide(given)

        hints = get_type_hints(function)
        batch = dict.fromkeys(["observations", "agents", *(BATCH[name] for name in takes)])
        decide.__signature__ = Signature(  # type: ignore[attr-defined]
            [
                *(Parameter(name, Parameter.POSITIONAL_OR_KEYWORD) for name in batch),
                *(
                    p.replace(annotation=hints.get(p.name, p.annotation))
                    for p in own
                    if p.kind is Parameter.KEYWORD_ONLY
                ),
            ]
        )
        return decide  # type: ignore[return-value]

    return decorate


class _Caller:
    """Answers for several agents: recorded ones, or those of concurrent calls."""

    def __init__(
        self,
        function: Callable[..., Any],
        takes: Sequence[str],
        timeout_s: float,
        max_concurrent: int,
        answers: RecordedAnswers | None,
        offline: bool,
    ) -> None:
        self._function = function
        self._takes = takes
        self._timeout_s = timeout_s
        self._max_concurrent = max_concurrent
        self._answers = answers
        self._offline = offline
        self._digest = code_digest(function.__code__)

    def decide(self, given: Mapping[str, Any]) -> list[Any]:
        """Return the answer of every agent, in the order of ``given["agents"]``."""
        options = {k: v for k, v in given.items() if k not in BATCH.values()}
        calls = []
        for k, agent in enumerate(given["agents"]):
            arguments = {
                name: given[BATCH[name]] if name in COMMON else given[BATCH[name]][k]
                for name in self._takes
            }
            calls.append((agent, self._question(agent, arguments, options), arguments | options))
        return asyncio.run(self._all(calls))

    async def _all(self, calls: Sequence[tuple[str, str, Mapping[str, Any]]]) -> list[Any]:
        free = asyncio.Semaphore(self._max_concurrent)
        outcomes = await asyncio.gather(
            *(self._answer(*call, free) for call in calls), return_exceptions=True
        )
        for outcome in outcomes:  # only now: calls under way have been recorded
            if isinstance(outcome, BaseException):
                raise outcome
        return list(outcomes)

    async def _answer(
        self, agent: str, question: str, arguments: Mapping[str, Any], free: asyncio.Semaphore
    ) -> Any:
        if self._answers is not None:
            known = self._answers.find(question)
            if known is not None:
                return known
            if self._offline:
                raise CallError(f"{self._answers.path} has no answer to {shorten(question)}")
        async with free:
            try:
                answer = await self._limited(arguments)
            except Exception as error:
                reason = " ".join(f"{type(error).__name__}: {error}".split())
                raise CallError(f"agent {agent!r}: {reason}") from error
        if self._answers is None:
            return answer
        return self._answers.store(question, answer)

    async def _limited(self, arguments: Mapping[str, Any]) -> Any:
        call: Awaitable[Any] = (
            self._function(**arguments)
            if iscoroutinefunction(self._function)
            else asyncio.to_thread(self._function, **arguments)
        )
        try:
            async with asyncio.timeout(self._timeout_s) as limit:
                return await call
        except TimeoutError:
            if limit.expired():
                raise TimeoutError(f"no answer within timeout_s = {self._timeout_s:g}") from None
            raise  # the function's own

    def _question(
        self, agent: str, arguments: Mapping[str, Any], options: Mapping[str, Any]
    ) -> str:
        """Return the text of everything that an answer depends on; empty without a record."""
        if self._answers is None:
            return ""
        asked = {name: value for name, value in arguments.items() if name != "rng"}
        if "rng" in arguments:
            asked["rng"] = _plain(arguments["rng"].bit_generator.state)
        try:
            return canonical({"code": self._digest, "settings": options, "arguments": asked})
        except (TypeError, ValueError) as error:
            raise CallError(f"agent {agent!r}: arguments cannot be recorded: {error}") from None


def _plain(value: Any) -> Any:
    """Return the state of a random generator as JSON can represent it."""
    if isinstance(value, Mapping):
        return {name: _plain(own) for name, own in value.items()}
    return value.tolist() if isinstance(value, np.ndarray) else value


def code_digest(code: CodeType) -> str:
    """Return a digest of a function's compiled code, independent of its place in a file."""
    digest = hashlib.sha256(code.co_code)
    for constant in code.co_consts:
        own = code_digest(constant) if isinstance(constant, CodeType) else repr(constant)
        digest.update(own.encode())
    digest.update(repr(code.co_names).encode())
    return digest.hexdigest()
