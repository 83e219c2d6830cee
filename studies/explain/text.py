"""The explanation of a trained team as text of 80 columns."""

from pathlib import Path
from textwrap import fill

import jinja2
import numpy as np

from . import body as explain_body
from . import rules as explain_rules
from .rules import percent
from .team import Explanation

MOST_AGENTS = 8
"""Agents whose rules are printed; the file holds those of all."""


def text(explained: Explanation, agents: int | None = None) -> str:
    """Return the explanation.

    Parameters
    ----------
    explained
        The explanation.
    agents
        How many agents' rules to write; none: all.
    """
    parts, variables, bodies = explained.parts, explained.variables, explained.bodies
    names = explained.agents[:agents]
    shares = [
        f"{variables[j].name} {percent(float(np.mean([p.share(p.singles[j]) for p in parts])))}"
        for j in explain_rules.by_share(parts)
    ]
    environment = jinja2.Environment(trim_blocks=True, undefined=jinja2.StrictUndefined)
    environment.filters["wrapped"] = _wrapped
    template = environment.from_string(Path(__file__).with_name("text.txt.jinja").read_text())
    rendered = template.render(
        e=explained,
        has_learned=any(p.variance > 0 for p in parts),
        shares=shares,
        is_additive=max(map(len, explained.rules.terms)) == 1,
        rest=percent(float(np.mean([p.rest for p in parts]))),
        power=explain_rules.exponent(parts),
        rules=explain_rules.table(explained.rules, variables, names, parts[: len(names)]),
        more=len(explained.agents) - len(names),
        verdicts=list(explain_body.verdicts(bodies, explained.actuators)) if bodies else (),
        effects=explain_body.table(bodies, explained.actuators) if bodies else "",
        errors="" if explained.errors is None else explained.errors.to_string(float_format="%.3g"),
    )
    # Tables of pandas fill the last column with spaces.
    return "\n".join(line.rstrip() for line in rendered.splitlines()).rstrip() + "\n"


def _wrapped(sentence: str) -> str:
    # A number stays with its percent sign.
    sentence = " ".join(sentence.split()).replace(" %", "\u00a0%")
    return fill(sentence, 79).replace("\u00a0", " ") + "\n"
