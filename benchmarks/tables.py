"""How the measures are printed: tables of 80 columns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

Row = dict[str, Any]

STEPS = {
    "rule_base": "rules", "agents": "n", "ours_us": "toolkit\n\\[us]",
    "literal_ratio": "literal\n/toolkit", "factorised_ratio": "factor.\n/toolkit",
    "streaming_ratio": "toolkit/\nstream",
    "decide_ns_per_joint_action": "decide\n\\[ns/ja]",
    "predict_ns_per_joint_action": "+predict\n\\[ns/ja]", "bytes_per_agent": "kB/\nagent",
}  # fmt: skip
LARGE = {
    "rule_base": "rules", "agents": "n", "evaluator": "evaluator", "simulate_ms": "world\n\\[ms]",
    "predict_ms": "decide\n\\[ms]", "learn_ms": "learn\n\\[ms]", "total_ms": "step\n\\[ms]",
    "us_per_agent": "agent\n\\[us]", "bytes_per_agent": "kB/\nagent",
}  # fmt: skip


def show(console: Console, title: str, columns: dict[str, str], rows: Sequence[Row]) -> None:
    """Print rows under the given column headings."""
    table = Table(title=title, title_justify="left", padding=(0, 1, 0, 0))
    for heading in columns.values():
        table.add_column(heading, justify="right", no_wrap=True)
    for row in rows:
        table.add_row(*(_cell(name, row[name]) for name in columns))
    console.print(table)


def _cell(name: str, value: object) -> str:
    if value is None:
        return "-"
    if name == "bytes_per_agent":
        assert isinstance(value, int)
        return f"{value / 1000:.0f}"
    if isinstance(value, float):
        return f"{value:.0f}" if value >= 100 else f"{value:.3g}"
    return str(value)
