"""Keys and names of earlier versions: refused, with what they are called now."""

from __future__ import annotations

KEYS = {
    "scenario.hold": "scenario.action_repeat",
    "scenario.lookahead": "scenario.prediction_horizon",
    "scenario.arena": "scenario.termination_radius",
    "learner.sweeps": "learner.regression_iterations",
    "learner.mixing": "learner.target_averaging_rate",
    "learner.decision.others": "learner.decision.teammates",
    "learner.decision.samples": "learner.decision.evaluator.samples",
    "learner.decision.exact_up_to": "learner.decision.evaluator.exact_up_to",
    "learner.decision.sampling_up_to": "learner.decision.evaluator.sampling_up_to",
    "topology.source": "topology.kind",
    "topology.digest": "nothing: files are kept with the study",
}
"""By the dotted key of earlier versions, the present one."""

VALUES = {
    ("preset", "greedy"): "planner",
    ("learner.decision.teammates", "max"): "best-response",
    ("learner.decision.teammates", "mean"): "uniform",
    ("learner.decision.teammates", "observed"): "empirical",
    ("topology.kind", "python"): "the function itself, as kind = 'file.py:function'",
    ("topology.kind", "package"): "the name that the package offers",
    ("scenario.state_space", "miss"): "cross_track_error",
}
"""By key and value of earlier versions, the present value."""

GONE = {
    ("learner.kind", "fitted-value"): "is no more: batch-td learns as much in far less time",
    ("learner.decision.evaluator", "latin-hypercube"): (
        "is no more: take exact up to eight agents, sampling beyond"
    ),
}
"""What is no more, and what to use instead."""


def now_called(path: str, value: object = None) -> str | None:
    """Return what is to be said of a key, or of a value at a key, of an earlier version.

    Examples
    --------
    >>> now_called("overrides[2].scenario.hold")
    "is now called 'scenario.action_repeat'"
    >>> now_called("preset", "greedy")
    "is now called 'planner'"
    """
    for start in ("scenario", "learner", "topology", "preset"):
        at = path.rfind(start)
        key = path[at:] if at >= 0 else ""
        if value is None and key in KEYS:
            return f"is now called {KEYS[key]!r}"
        if not isinstance(value, str):
            continue
        for place in ((key, value), (key.removesuffix(".kind"), value)):
            if place in GONE:
                return GONE[place]
            if place in VALUES:
                return f"is now called {VALUES[place]!r}"
    return None
