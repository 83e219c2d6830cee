"""How far a study is, in lines: what `status` prints and `watch` shows."""

from collections.abc import Iterator

from ..presentation.words import count, duration
from ..spec.outline import StudyOutline, other_spec
from ..store.store import Store
from ..workers.progress import Progress


def describe(store: Store, now: Progress) -> Iterator[str]:
    """Yield how many trials are done, running, failed and left, and for how long.

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


def warnings(now: Progress) -> Iterator[str]:
    """Yield, each after an empty line, why nothing can be added to a study, and what is damaged."""
    if now.refusal:
        yield f"\nnothing can be added: {now.refusal}"
    for line in now.damaged:
        yield f"\n{line}"
