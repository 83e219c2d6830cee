"""The table of claims, for the terminal, for programs and for the documentation."""

import json
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from rich.console import Console
from rich.table import Table

from ..presentation.tables import ends
from .claims import Finding

Format = Literal["table", "json", "markdown"]

COLOURS = {"holds": "green", "does not hold": "red", "not decided": "yellow"}


def print_claims(findings: Sequence[Finding], form: Format) -> None:
    """Print the findings."""
    if form == "json":
        print(json.dumps([_record(finding) for finding in findings], indent=1, allow_nan=False))
    elif form == "markdown":
        print(markdown(findings))
    else:
        _print_table(findings)


def _print_table(findings: Sequence[Finding]) -> None:
    table = Table(box=None, padding=(0, 1, 1, 0), pad_edge=False, header_style="bold")
    for title, ratio in (("claim", 4), ("measure, criterion", 5), ("result", 3), ("verdict", 2)):
        table.add_column(title, ratio=ratio)
    for finding in findings:
        claim, colour = finding.claim, COLOURS[finding.verdict]
        table.add_row(
            f"{claim.text} [dim]({claim.place})[/]",
            f"{claim.measure}: [dim]{claim.criterion.text}[/]",
            finding.result,
            f"[{colour}]{finding.verdict}[/]",
        )
    Console().print(table)
    print("With 95 % intervals. A claim holds if the whole interval meets the criterion,")
    print("does not if none of it does, and is not decided in between or by under 5 seeds.")


def markdown(findings: Sequence[Finding]) -> str:
    """Return the table as Markdown."""
    lines = ["| claim | in the paper | study | measure | criterion | result | verdict |"]
    lines.append("|---" * 7 + "|")
    for finding in findings:
        c = finding.claim
        cells = (
            c.text, c.place, c.study, c.measure, c.criterion.text, finding.result,
            f"**{finding.verdict}**",
        )  # fmt: skip
        lines.append("| " + " | ".join(str(cell) for cell in cells) + " |")
    return "\n".join(lines)


def _record(finding: Finding) -> dict[str, Any]:
    claim, measured = finding.claim, finding.measured
    record: dict[str, Any] = {
        "name": claim.name,
        "claim": claim.text,
        "place": claim.place,
        "study": claim.study,
        "measure": claim.measure,
        "criterion": claim.criterion.text,
        "verdict": finding.verdict,
    }
    if measured is not None:
        value, low, high = (v if np.isfinite(v) else None for v in ends(measured.estimate))
        record |= {"value": value, "low": low, "high": high, "seeds": measured.seeds}
        record |= {"p": measured.p, "note": measured.note}
    return record
