"""The explanation of a trained team as text of 80 columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from textwrap import fill

import numpy as np

from . import body as explain_body
from . import rules as explain_rules
from .rules import percent
from .team import Explanation

MOST_AGENTS = 8
"""Agents whose rules are printed; the file holds those of all."""


def text(explained: Explanation, agents: int | None = None) -> Iterator[str]:
    """Yield the explanation, line by line.

    Parameters
    ----------
    explained
        The explanation.
    agents
        How many agents' rules to write; none: all.
    """
    trial = explained.trial
    yield f"{trial.condition}, seed {trial.seed}: the team after {trial.lengths}"
    yield ""
    yield from _functions(explained, len(explained.agents) if agents is None else agents)
    yield "POLICY"
    yield ""
    if isinstance(explained.policy, str):
        yield f"Not drawn: {explained.policy}."
    else:
        yield from explained.policy.lines()
    yield ""
    yield "SELF-MODEL"
    yield ""
    yield from _bodies(explained)


def _functions(explained: Explanation, agents: int) -> Iterator[str]:
    yield "FUNCTIONS"
    yield ""
    if not any(p.variance > 0 for p in explained.parts):
        yield from _wrapped("Every consequent is the same: the agents have learned nothing.")
        yield ""
        return
    parts, names = explained.parts, [v.name for v in explained.variables]
    mean = [sum(p.share(p.singles[j]) for p in parts) / len(parts) for j in range(len(names))]
    order = sorted(range(len(names)), key=lambda j: -mean[j])
    shares = ", ".join(f"{names[j]} {percent(mean[j])}" for j in order)
    both = sum(p.share(pair) for p in parts for pair in p.pairs.values()) / len(parts)
    rest = sum(p.rest for p in parts) / len(parts)
    yield from _wrapped(f"What f depends on (share of its variance, mean over agents): {shares}.")
    if explained.rules.terms == tuple((j,) for j in range(len(names))):
        yield from _wrapped("Each rule has one variable: the functions below are all of f.")
    else:
        beyond = f"Pairs of variables beyond that: {percent(both)}."
        if max(map(len, explained.rules.terms)) > 2:
            beyond += f" Three and more together: {percent(rest)}, which cannot be drawn."
        yield from _wrapped(
            f"{beyond} The functions below are the mean over all rules of the other variables."
        )
    power = explain_rules.exponent(parts)
    times = f" times 10^{power}" if power else ""
    yield from _wrapped(
        f"Consequents{times}, less their mean over each variable: only differences decide."
    )
    yield ""
    shown = slice(0, agents)
    yield from explain_rules.table(
        explained.rules, explained.variables, explained.agents[shown], parts[shown]
    )
    for pair in explain_rules.strongest_pairs(parts):
        yield from _pair(explained, pair)
    if agents < len(explained.agents):
        yield f"The rules of {len(explained.agents) - agents} more agents are in the file."
        yield ""


def _pair(explained: Explanation, pair: tuple[int, int]) -> Iterator[str]:
    """Yield the rules in which two variables together add or take most, agents' mean."""
    mean = np.mean([p.pairs[pair] for p in explained.parts], axis=0)
    power = explain_rules.exponent(explained.parts)
    share = sum(p.share(p.pairs[pair]) for p in explained.parts) / len(explained.parts)
    (one, words), (other, more) = (
        (v.name, explain_rules.labels(v, explained.rules.partitions[i]))
        for i, v in ((i, explained.variables[i]) for i in pair)
    )
    yield f"{one} and {other} together: {percent(share)} (mean over agents)"
    for flat in np.abs(mean).ravel().argsort()[::-1][:3]:
        row, column = divmod(int(flat), len(more))
        value = mean[row, column] * 10**power
        yield f"IF {one} is {words[row]} AND {other} is {more[column]} THEN {value:+.2f} more"
    yield ""


def _bodies(explained: Explanation) -> Iterator[str]:
    bodies = explained.bodies
    if bodies is None:
        yield from _wrapped(
            "None: predictions take every body for what it was built as "
            "(learner.self_model.enabled = false)."
        )
        return
    verdicts = list(explain_body.verdicts(bodies, explained.actuators))
    yield from verdicts or ["No actuator is taken to drive otherwise than it was built to."]
    yield ""
    moments = {
        "built": "as built",
        "before": "before the first failure",
        "after": "after all training",
    }
    yield from _wrapped(
        "What an actuator does to the motion of its body per unit of its commanded speed: metres "
        "per second ahead and to the left, radians per second. Actuators that are driven alike "
        "most of the time are hardly distinguished. Shown: "
        f"{', '.join(moments[m] for m in bodies.moments)}."
    )
    yield ""
    yield from explain_body.table(bodies, explained.actuators)


def _wrapped(sentence: str) -> Sequence[str]:
    # A number stays with its percent sign.
    return fill(sentence.replace(" %", "\u00a0%"), 79).replace("\u00a0", " ").splitlines()
