"""Printing, tables and exit statuses of command-line programs."""

from .core.plugins.words import closest, show
from .studies.cli.display import (
    in_form,
    print_data,
    print_lines,
    print_table,
    print_text,
    print_wrapped,
)
from .studies.cli.main import run_to_status
from .studies.presentation.tables import tabulate, write_csv

__all__ = [
    "closest",
    "in_form",
    "print_data",
    "print_lines",
    "print_table",
    "print_text",
    "print_wrapped",
    "run_to_status",
    "show",
    "tabulate",
    "write_csv",
]
