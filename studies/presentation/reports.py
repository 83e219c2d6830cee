"""Results of an analysis that are printed, or shown by a notebook."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from html import escape

from .tables import SummaryTable


class Report(ABC):
    """Tables with notes below."""

    @property
    @abstractmethod
    def table(self) -> SummaryTable:
        """The main table."""

    @property
    def tables(self) -> Sequence[SummaryTable]:
        """The tables in the order in which they are shown."""
        return (self.table,)

    @property
    @abstractmethod
    def notes(self) -> Sequence[str]:
        """Lines below the tables."""

    def __str__(self) -> str:
        return "\n".join([*(f"{table}\n" for table in self.tables), *self.notes])

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        tables = "".join(table.html for table in self.tables)
        return f"{tables}<pre>{escape(chr(10).join(self.notes))}</pre>"
