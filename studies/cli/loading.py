"""Studies that a command opens: their results, how far they are, and whether they are trusted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Literal

from ...core.plugins.trust import LIBRARIES, is_trusted, module_text, modules_in
from ...core.plugins.trust import trust as trust_text
from ..presentation.progress import count, duration, say
from ..spec.outline import StudyOutline, other_spec, outdated
from ..store.database import DATABASE
from ..store.store import Store
from ..store.writer import look
from ..workers.runner import cores

if TYPE_CHECKING:
    from ..api.study import StudyResults


@contextmanager
def open_study(directory: Path) -> Iterator[Store]:
    """Open a study to read it, and say so if the spec beside its database is another one."""
    with Store.open(directory) as store:
        if (remark := other_spec(store)) is not None:
            say(remark)
        yield store


def load_results(
    sources: Sequence[Path],
    *,
    study: str | None = None,
    where: str | None = None,
    trust: bool,
    columns: Sequence[str] = (),
    better: Literal["higher", "lower"] = "higher",
) -> StudyResults:
    """Return the results at some places, as a study analyses them, or a choice of the trials."""
    from ..api.study import load

    if trust:
        trust_files(*sources)
    results = load(*sources, columns=columns, better=better)
    for remark in results.remarks:
        say(remark)
    results = results if where is None else results.where(where)
    return results if study is None else results.as_study(study)


def trust_files(*sources: Path) -> None:
    """Allow what studies keep and name to be run and imported, and say what."""
    for source in sources:
        for title, text in untrusted(source).items():
            say(f"{title} is trusted from now on")
            trust_text(text)


def trust_beside(*places: Path) -> None:
    """Do so for the studies that places are, or lie in as their specs do."""
    folders = {place if place.is_dir() else place.parent for place in map(Path.resolve, places)}
    trust_files(*(folder for folder in folders if (folder / DATABASE).exists()))


def untrusted(source: Path) -> dict[str, str]:
    """Return the code of others that a study brings along or names, by what it is.

    These are the Python files that are kept with it, and modules by name; those of a file of
    results are named in its spec.
    """
    texts: dict[str, str] = {}
    if source.is_dir():
        with Store.open(source) as store:
            kept = store.sources()
            tables: object = [store.spec(), *store.settings().values()]
        texts = {f"{n}, which came with {source},": t for n, t in kept.items() if n.endswith(".py")}
    else:
        from ..results import published  # pandas takes its time

        tables = published.load(source).outline.table
    modules = {m for m, _ in modules_in(tables) if m.partition(".")[0] not in LIBRARIES}
    texts |= {f"{name}, which {source} names,": module_text(name) for name in modules}
    return {title: text for title, text in texts.items() if not is_trusted(text)}


@dataclass(frozen=True)
class Progress:
    """The trials of a study, each counted once."""

    total: int
    """Number of trials."""
    done: int
    """Of these, how many have ended well."""
    failed: int
    """How many have failed."""
    left: int
    """How many neither ended nor run."""
    running: tuple[tuple[str, int, float], ...]
    """Condition, seed, and seconds so far of the trials that are running."""
    processes: int
    """How many trials run at a time; if none does, the cores of this machine; or none where nothing
    is left."""
    seconds: float | None
    """Estimate of the time left [s]; None if nothing has finished to go by."""
    damaged: tuple[str, ...]
    """What has finished but is not as it was written, one line each; counted as left."""
    refusal: str | None
    """Why the installed code would not go on with the study, in one line; None if it would."""

    @property
    def is_going_on(self) -> bool:
        """Whether anything is still to come: of a damaged study only if somebody runs it."""
        is_possible = self.refusal is None and not self.damaged
        return bool(self.running or (self.left and is_possible))


def progress(store: Store) -> Progress:
    """Return how far the study of an open store is."""
    trials = store.planned()
    refusal = outdated(store)
    states = store.states()
    now = None if refusal is not None else look(store.directory)
    begun = {} if now is None else now[1]
    pending = [trial for trial in trials if trial.identity not in states]
    running = [(t.condition, t.seed, begun[t.identity]) for t in pending if t.identity in begun]
    left = [trial.condition for trial in pending if trial.identity not in begun]
    failed = [*states.values()].count("failed")
    usual = cores() if left and refusal is None else 0
    processes = usual if now is None else now[0]
    spent = [(condition, seconds) for condition, _, seconds in running]
    return Progress(
        total=len(trials),
        done=len(trials) - len(pending) - failed,
        failed=failed,
        left=len(left),
        running=tuple(running),
        processes=processes,
        seconds=_estimate(store.mean_seconds(), left, spent, processes),
        damaged=tuple(store.notes),
        refusal=refusal,
    )


def _estimate(
    means: Mapping[str, float], left: list[str], running: list[tuple[str, float]], processes: int
) -> float | None:
    """Return the time left [s], by what the finished trials of each condition took on average.

    Conditions of which none has finished are taken to be like the others on average.
    """
    if not (left or running):
        return 0.0
    if not means or not processes:
        return None
    overall = fmean(means.values())
    rest = [max(means.get(condition, overall) - spent, 0.0) for condition, spent in running]
    waiting = sum(means.get(condition, overall) for condition in left)
    return max((waiting + sum(rest)) / processes, max(rest, default=0.0))


def describe(store: Store, now: Progress) -> Iterator[str]:
    """Yield how many trials are done, running, failed and left, and for how long.

    Then, each after an empty line, why nothing can be added to the study, and what is damaged.

    Parameters
    ----------
    store
        The open store.
    now
        How far its study is.
    """
    outline = StudyOutline.kept(store)
    extent = f"{count(len(outline.columns), 'condition')} x {count(len(outline.seeds), 'seed')}"
    yield f"study    {outline.study}: {extent}"
    yield f"done     {now.done} of {now.total} trials"
    yield f"running  {len(now.running)}"
    for condition, seed, seconds in now.running:
        yield f"         {condition}, seed {seed}, for {duration(seconds)}"
    yield f"failed   {now.failed}"
    yield f"left     {now.left}"
    if now.seconds:
        yield f"time     about {duration(now.seconds)} with {count(now.processes, 'process', 'es')}"
    if (remark := other_spec(store)) is not None:
        yield f"spec     {remark}"
    if (versions := store.versions_of_code()) > 1:
        yield f"code     finished trials are of {versions} versions of the installed code"
    if now.refusal:
        yield f"\nnothing can be added: {now.refusal}"
    for line in now.damaged:
        yield f"\n{line}"
