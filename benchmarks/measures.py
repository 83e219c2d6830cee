"""The measures: each returns rows, plain dictionaries that go to the table and to the JSON file."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from typing import Any

import numpy as np

from nested_agents.core.agents.fuzzy import FuzzyAgents
from nested_agents.core.numerics import FloatArray

from .baselines import Baselines
from .situations import ADDITIVE, COMPACT, DENSE, Moment, situation
from .timing import paired

Row = dict[str, Any]

RULE_BASES = {
    "dense": DENSE, "dense32": {**DENSE, "precision": "float32"}, "compact": COMPACT,
    "order 1": ADDITIVE,
}  # fmt: skip
TRIAL = """
import json, sys, time
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import run_trial
from nested_agents.studies.trials.trial import trials_of

trial = trials_of(Spec.of({"seeds": 1, "episodes": int(sys.argv[1])}))[0]
begin = time.process_time()
run_trial(trial)
first = time.process_time()
rows = run_trial(trial).rows
again = time.process_time() - first
print(json.dumps({"compile_s": first - begin - again, "trial_s": again,
                  "decision_us": 1e6 * again / sum(row.steps for row in rows)}))
"""
"""A trial by default in a process of its own, and once more."""

LARGEST_LITERAL = 4
"""Agents up to which the literal step is timed whole; it takes 20 s for 8."""


LARGEST_FACTORISED = 8
"""Agents up to which the factorised step is timed; for 10 its arrays take 2 GB."""


def steps(kind: str, n_agents: int, budget: float) -> Row:
    """Time decision + update by exact enumeration against the baselines.

    The tables of predicted states are common to all and not timed; "predict" is prediction and
    decision together.

    Raises
    ------
    ArithmeticError
        If the values of the three differ: they would not be timed doing the same.
    """
    moment = situation(n_agents, RULE_BASES[kind], {"evaluator": "exact"})
    candidates = {"ours": moment.step, "decide": moment.act, "predict": moment.predict_and_act}
    baselines = None
    if kind != "order 1":
        baselines = Baselines(moment)
        _check(moment, baselines)
        candidates["streaming"] = baselines.streaming_step
        if n_agents <= LARGEST_FACTORISED:
            candidates["factorised"] = baselines.factorised_step
        if n_agents <= LARGEST_LITERAL:
            candidates["literal"] = baselines.literal_step
    times = paired(candidates, budget=budget, clock=time.thread_time)
    ours = times.median("ours")
    return {
        "rule_base": kind,
        "agents": n_agents,
        "joint_actions": moment.joint_actions,
        "ours_us": 1e6 * ours,
        "decide_ns_per_joint_action": 1e9 * times.median("decide") / moment.joint_actions,
        "predict_ns_per_joint_action": 1e9 * times.median("predict") / moment.joint_actions,
        "literal_ratio": times.ratio("literal", "ours") if "literal" in candidates else None,
        "factorised_ratio": (
            times.ratio("factorised", "ours") if "factorised" in candidates else None
        ),
        "streaming_ratio": times.ratio("ours", "streaming") if baselines else None,
        "bytes_per_agent": memory_per_agent(moment),
        "rounds": len(times.seconds["ours"]),
    }


def _check(moment: Moment, baselines: Baselines) -> None:
    rng = np.random.default_rng(0)
    last = len(moment.scenario.agents) - 1
    for agent in {0, last}:
        indices = rng.choice(baselines.indices(agent, np.zeros(last + 1, dtype=np.int64)), 8)
        literal = baselines.literal(agent, indices)
        baselines._features = {}
        ours = baselines.rules.block_values(
            baselines.theta[agent], baselines.blocks[agent], indices
        )
        for name, values in (("ours", ours), ("factorised", baselines.factorised(agent, indices))):
            if np.abs(values - literal).max() > 1e-5 * np.abs(literal).max():
                raise ArithmeticError(f"{name} and literal values differ at agent {agent}")


def large(kind: str, n_agents: int, budget: float) -> Row:
    """Time a control step of a team beyond enumeration: simulate, predict, decide, learn."""
    moment = situation(n_agents, RULE_BASES[kind], {"teammates": "best-response"})
    neutral = np.full(n_agents, moment.scenario.action_set.neutral)
    times = paired(
        {
            "simulate": lambda: moment.scenario.step(neutral),
            "predict": moment.predict_and_act,
            "learn": moment.learn,
        },
        budget=budget,
        most_rounds=20,
        clock=time.thread_time,
    )
    row: Row = {f"{name}_ms": 1e3 * times.median(name) for name in times.seconds}
    total = sum(row.values())
    evaluator = type(moment.team.only(FuzzyAgents).evaluator).__name__
    return {
        "rule_base": kind, "agents": n_agents, "evaluator": evaluator,
        **row, "total_ms": total, "us_per_agent": 1e3 * total / n_agents,
        "bytes_per_agent": memory_per_agent(moment),
    }  # fmt: skip


def memory_per_agent(moment: Moment) -> int:
    """Return the bytes that the team holds per agent in arrays."""
    arrays: dict[str, FloatArray] = moment.team.arrays()
    return sum(array.nbytes for array in arrays.values()) // len(moment.scenario.agents)


def import_seconds(repeats: int = 3) -> Row:
    """Return the least time [s] that a fresh interpreter takes to import the package.

    The least of several, since it is the interpreter's start that is subtracted.
    """
    row: Row = {}
    for name, statement in {
        "interpreter": "pass",
        "nested_agents": "import nested_agents",
        "core.team": "import nested_agents.core.agents.team",
        "studies.cli": "import nested_agents.studies.cli.main",
    }.items():
        taken = []
        for _ in range(repeats):
            begin = time.perf_counter()
            subprocess.run([sys.executable, "-c", statement], check=True)
            taken.append(time.perf_counter() - begin)
        row[name] = min(taken)
    return row


def trial_seconds(episodes: int, *, compiled: bool) -> Row:
    """Return what a trial by default takes, in processor time.

    Parameters
    ----------
    episodes
        Of training; as many as usual of evaluation.
    compiled
        Whether cached kernels may be used; otherwise all are compiled.

    Returns
    -------
    dict
        ``compile_s``: what the first trial of a process takes more than the second [s].
        ``trial_s``: what that takes [s]. ``decision_us``: the same per decision [us].
    """
    with tempfile.TemporaryDirectory() as empty:
        environment = os.environ if compiled else os.environ | {"NUMBA_CACHE_DIR": empty}
        line = [sys.executable, "-c", TRIAL, str(episodes)]
        run = subprocess.run(line, check=True, capture_output=True, text=True, env=environment)
    row: Row = json.loads(run.stdout)
    return row
