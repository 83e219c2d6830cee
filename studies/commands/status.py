"""``nested-agents status``: how far a study is."""

from __future__ import annotations

from .options import Directory


def command(directory: Directory) -> int:
    """Tell how many trials are done, failed (with the reason) and left.

    Parameters
    ----------
    directory
        Where the study is kept.
    """
    from ..store import Store
    from ..trial import trials_of

    with Store.open(directory) as store:
        spec = store.spec()
        trials = trials_of(spec)
        counts = store.counts()
        left = len(store.pending(trials))
        failed = store.failed()
    conditions = len(trials) // len(spec.seeds)
    print(f"study   {spec.study}: {conditions} conditions x {len(spec.seeds)} seeds")
    print(f"done    {counts['done']} of {len(trials)} trials")
    print(f"failed  {counts['failed']}")
    print(f"left    {left}")
    for condition, seed, error in failed:
        print(f"\n{condition}, seed {seed} failed:\n{error.rstrip()}")
    if failed:
        print(f"\nto run them again: nested-agents retry {directory}")
    return 1 if failed else 0
