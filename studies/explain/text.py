"""The explanation of a trained team as text of 80 columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from textwrap import fill

import numpy as np

from . import body as explain_body
from . import rules as explain_rules
from .rules import percent
from .team import Explained

MOST_AGENTS = 8
"""Agents whose rules are printed; the file holds those of all."""


def text(found: Explained, agents: int | None = None) -> Iterator[str]:
    """Yield the explanation, line by line.

    Parameters
    ----------
    found
        What is to be told.
    agents
        How many agents' rules to tell; none: all.
    """
    trial = found.trial
    yield f"{trial.condition}, seed {trial.seed}: the team after {trial.lengths}"
    yield ""
    yield from _functions(found, len(found.agents) if agents is None else agents)
    yield "POLICY"
    yield ""
    if isinstance(found.policy, str):
        yield f"Not drawn: {found.policy}."
    else:
        yield from found.policy.lines()
    yield ""
    yield "SELF-MODEL"
    yield ""
    yield from _bodies(found)


def _functions(found: Explained, agents: int) -> Iterator[str]:
    yield "FUNCTIONS"
    yield ""
    if not any(p.variance > 0 for p in found.parts):
        yield from _wrapped("Every consequent is the same: the agents have learned nothing.")
        yield ""
        return
    parts, names = found.parts, [v.name for v in found.variables]
    mean = [sum(p.share(p.singles[j]) for p in parts) / len(parts) for j in range(len(names))]
    order = sorted(range(len(names)), key=lambda j: -mean[j])
    said = ", ".join(f"{names[j]} {percent(mean[j])}" for j in order)
    pairs = explain_rules.strongest_pairs(parts, len(names) ** 2)
    both = sum(p.share(p.pairs[pair]) for p in parts for pair in pairs) / len(parts)
    rest = sum(p.rest for p in parts) / len(parts)
    yield from _wrapped(f"What f depends on (share of its variance, mean over agents): {said}.")
    if found.rules.terms == tuple((j,) for j in range(len(names))):
        yield from _wrapped("Each rule has one variable: the functions below are all of f.")
    else:
        beyond = f"Pairs of variables beyond that: {percent(both)}."
        if max(map(len, found.rules.terms)) > 2:
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
    yield from explain_rules.table(found.rules, found.variables, found.agents[shown], parts[shown])
    for pair in explain_rules.strongest_pairs(parts):
        yield from _pair(found, pair)
    if agents < len(found.agents):
        yield f"The rules of {len(found.agents) - agents} more agents are in the file."
        yield ""


def _pair(found: Explained, pair: tuple[int, int]) -> Iterator[str]:
    """Yield the rules in which two variables together add or take most, agents' mean."""
    mean = np.mean([p.pairs[pair] for p in found.parts], axis=0)
    power = explain_rules.exponent(found.parts)
    share = sum(p.share(p.pairs[pair]) for p in found.parts) / len(found.parts)
    (one, words), (other, more) = (
        (v.name, explain_rules.labels(v, found.rules.partitions[i]))
        for i, v in ((i, found.variables[i]) for i in pair)
    )
    yield f"{one} and {other} together: {percent(share)} (mean over agents)"
    for flat in np.abs(mean).ravel().argsort()[::-1][:3]:
        row, column = divmod(int(flat), len(more))
        value = mean[row, column] * 10**power
        yield f"IF {one} is {words[row]} AND {other} is {more[column]} THEN {value:+.2f} more"
    yield ""


def _bodies(found: Explained) -> Iterator[str]:
    bodies = found.bodies
    if bodies is None:
        yield from _wrapped(
            "None: predictions take every body for what it was built as "
            "(learner.self_model.enabled = false)."
        )
        return
    verdicts = list(explain_body.verdicts(bodies, found.actuators))
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
    yield from explain_body.table(bodies, found.actuators)


def _wrapped(sentence: str) -> Sequence[str]:
    # A number stays with its percent sign.
    return fill(sentence.replace(" %", "\u00a0%"), 79).replace("\u00a0", " ").splitlines()
