"""``nested-agents status``: how far a study is."""

from __future__ import annotations

from .options import Directory


def command(directory: Directory) -> int:
    """Tell how many trials are done, running, failed (with the reason) and left, and for how long.

    Parameters
    ----------
    directory
        Where the study is kept.
    """
    from ...store.store import Store
    from ...workers.progress import progress
    from ..display import duration

    with Store.open(directory) as store:
        spec, now, failed = store.spec(), progress(store), store.failed()
    conditions = now.total // len(spec.seeds)
    print(f"study    {spec.study}: {conditions} conditions x {len(spec.seeds)} seeds")
    print(f"done     {now.done} of {now.total} trials")
    print(f"running  {len(now.running)}")
    for condition, seed, seconds in now.running:
        print(f"         {condition}, seed {seed}, for {duration(seconds)}")
    print(f"failed   {now.failed}")
    print(f"left     {now.left}")
    if now.seconds:
        count = f"{now.processes} process{'' if now.processes == 1 else 'es'}"
        print(f"time     about {duration(now.seconds)} with {count}")
    if now.refusal:
        print(f"\nnothing can be added: {now.refusal}")
    for line in now.damaged:
        print(f"\n{line}")
    for condition, seed, error in failed:
        print(f"\n{condition}, seed {seed} failed:\n{error.rstrip()}")
    if failed:
        print(f"\nto run them again: nested-agents retry {directory}")
    return 1 if failed else 0
