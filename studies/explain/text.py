"""The explanation of a trained team as text of 80 columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from textwrap import fill

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
    parts, variables = explained.parts, explained.variables
    shares = (
        f"{variables[j].name} {percent(sum(p.share(p.singles[j]) for p in parts) / len(parts))}"
        for j in explain_rules.by_share(parts)
    )
    rest = percent(sum(p.rest for p in parts) / len(parts))
    power = explain_rules.exponent(parts)
    times = f" times 10^{power}" if power else ""
    whole = "Each rule has one variable: the functions below are all of f."
    if max(map(len, explained.rules.terms)) > 1:
        whole = (
            f"Several variables together do {rest} beyond that. The functions below are the mean "
            "over all rules of the other variables."
        )
    for sentence in (
        f"What f depends on (share of its variance, mean over agents): {', '.join(shares)}.",
        whole,
        f"Consequents{times}, less their mean over each variable: only differences decide.",
    ):
        yield from _wrapped(sentence)
    yield ""
    shown = slice(0, agents)
    names = explained.agents[shown]
    yield from _lines(explain_rules.table(explained.rules, variables, names, parts[shown]))
    if agents < len(explained.agents):
        yield f"The rules of {len(explained.agents) - agents} more agents are in the file."
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
    yield from _lines(explain_body.table(bodies, explained.actuators))


def _lines(table: str) -> list[str]:
    """Return the lines of a table, of which pandas fills the last column with spaces."""
    return [line.rstrip() for line in table.splitlines()]


def _wrapped(sentence: str) -> Sequence[str]:
    # A number stays with its percent sign.
    return fill(sentence.replace(" %", "\u00a0%"), 79).replace("\u00a0", " ").splitlines()
