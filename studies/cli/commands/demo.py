"""``nested-agents demo``: a small learning-curve study, from nothing to figures and a replay."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro

from .options import CORES, Jobs


def command(
    out: Annotated[Path, tyro.conf.arg(metavar="DIR")] = Path("nested-agents-demo"),
    jobs: Jobs = CORES,
    print_spec: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
) -> int:
    """Train two e-Pucks to push a box: table, figures and replay within minutes.

    Parameters
    ----------
    out
        Where to keep the study; made if it does not exist. The same command again continues it.
    jobs
        Worker processes; one for every core unless said otherwise.
    print_spec
        Print the spec that would be run, and stop.
    """
    text = (Path(__file__).parents[2] / "catalogue/learning_curve/demo.toml").read_text(
        encoding="utf-8"
    )
    if print_spec:
        print(text, end="")
        return 0
    from ...spec.spec import Spec
    from ..conduct import conduct

    return conduct(Spec.parse(text), out, jobs, replay=True)
