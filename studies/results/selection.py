"""Results chosen and put together: a part of a study's trials, or those of several studies."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ...core.plugins.messages import near
from ..errors import SpecError
from ..spec.labels import label
from ..spec.overlay import flat
from ..trials.measures import joined as joined_measures
from .results import Results, join, select

COMPARISONS: dict[type[ast.cmpop], Callable[[Any, Any], bool]] = {
    ast.Eq: lambda a, b: a == b,
    ast.NotEq: lambda a, b: a != b,
    ast.Lt: lambda a, b: a < b,
    ast.LtE: lambda a, b: a <= b,
    ast.Gt: lambda a, b: a > b,
    ast.GtE: lambda a, b: a >= b,
    ast.In: lambda a, b: a in b,
    ast.NotIn: lambda a, b: a not in b,
}
TRUTHS = {"true": True, "false": False}
DIRECTORY = "directory"
"""Column that tells from which study a condition came, where there are several."""


class Where:
    """A choice among trials, written as ``robots == 8 and seed < 5``.

    Left of a comparison stands a setting by its dotted key or the last part of it, the `condition`,
    or the `seed`; right of it a number, a word, a text in quotes, or a list of them. Comparisons
    are joined by ``and``, ``or``, ``not`` and brackets. Nothing is ever run.

    Parameters
    ----------
    text
        The choice.

    Raises
    ------
    SpecError
        If it is none.

    Examples
    --------
    >>> chosen = Where("robots >= 4 and box in [square, circle]")
    >>> crowd, pair = ({"scenario": {"robots": n, "box": "circle"}} for n in (8, 2))
    >>> chosen("crowd", 0, crowd, {}), chosen("pair", 0, pair, {})
    (True, False)
    """

    def __init__(self, text: str) -> None:
        self.text = text
        try:
            self._tree = ast.parse(text.strip(), mode="eval").body
        except (SyntaxError, ValueError, RecursionError):
            raise SpecError(
                f"where = {text!r}: must be such as 'robots == 8 and seed < 5'"
            ) from None

    def __call__(
        self, condition: str, seed: int, settings: Mapping[str, Any], columns: Mapping[str, Any]
    ) -> bool:
        """Tell whether a trial is chosen.

        Parameters
        ----------
        condition, seed
            Which trial.
        settings
            Of its condition, as tables.
        columns
            What tells the condition from the others; what they say goes before settings, unless
            they are empty, as columns of another study are.

        Raises
        ------
        SpecError
            If the text names what the trial has not, or compares what cannot be compared.
        """
        filled = {key: value for key, value in columns.items() if value != ""}
        known = {"condition": condition, "seed": seed, **dict(flat(settings)), **filled}
        return bool(self._value(self._tree, known))

    def _value(self, node: ast.expr, known: Mapping[str, Any]) -> bool:
        if isinstance(node, ast.BoolOp):
            gather = all if isinstance(node.op, ast.And) else any
            return gather(self._value(part, known) for part in node.values)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            return not self._value(node.operand, known)
        if not isinstance(node, ast.Compare) or len(node.ops) > 1:
            raise self._refusal(node, "is no comparison, such as robots == 8")
        key = ast.unparse(node.left)
        own, other = self._look_up(key, known), self._constant(node.comparators[0])
        try:
            return COMPARISONS[type(node.ops[0])](own, other)
        except (KeyError, TypeError):
            raise self._refusal(node, f"{key} is {own!r}, which cannot be compared so") from None

    def _look_up(self, key: str, known: Mapping[str, Any]) -> Any:
        if key in known:
            return _plain(known[key])
        ends = {name: _plain(value) for name, value in known.items() if name.endswith(f".{key}")}
        if not ends:
            hint = near(key, {name.rpartition(".")[2] for name in known})
            hint = hint or "is no setting of these conditions"
            raise SpecError(f"where = {self.text!r}: {key}: {hint}")
        if len(set(map(repr, ends.values()))) > 1:
            raise SpecError(f"where = {self.text!r}: {key}: may be {' or '.join(sorted(ends))}")
        return next(iter(ends.values()))

    def _constant(self, node: ast.expr) -> Any:
        if isinstance(node, ast.Name):
            return TRUTHS.get(node.id, node.id)
        if isinstance(node, ast.List | ast.Tuple | ast.Set):
            return [self._constant(item) for item in node.elts]
        try:
            return _plain(ast.literal_eval(node))
        except ValueError:
            return ast.unparse(node).replace(" - ", "-")  # a word with a hyphen in it

    def _refusal(self, node: ast.expr, why: str) -> SpecError:
        return SpecError(f"where = {self.text!r}: {ast.unparse(node)!r} {why}")


def chosen(results: Results, where: Where, settings: Mapping[str, Any]) -> Results:
    """Return the results of the trials of a choice.

    Parameters
    ----------
    results
        Of any studies.
    where
        The choice.
    settings
        By condition, as tables.
    """
    trials = zip(results.trials["condition"], results.trials["seed"].tolist(), strict=True)
    keep = [where(c, s, settings.get(c, {}), results.columns.get(c, {})) for c, s in trials]
    return select(results, np.array(keep, dtype=bool))


def _apart(name: str, tables: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return labels of conditions of one name, by one or two settings that tell all apart; or none.

    Examples
    --------
    >>> _apart("default", [{"scenario": {"robots": n, "box": "disc"}} for n in (2, 4)])
    ['default, robots=2', 'default, robots=4']
    """
    own = [dict(flat(table)) for table in tables]
    keys = dict.fromkeys(key for table in own for key in table)
    other = [key for key in keys if len({repr(table.get(key)) for table in own}) > 1]
    labels = [label({key: table.get(key, "") for key in other}, name) for table in own]
    return labels if len(other) <= 2 and len(set(labels)) == len(labels) else []


def together(
    studies: Sequence[tuple[str, Results]], settings: Sequence[Mapping[str, Any]] = ()
) -> tuple[Results, list[dict[str, str]]]:
    """Return the results of several studies as those of one, and the new labels of each.

    Conditions whose label occurs more than once are told apart by their `settings`, where one or
    two of these differ, else by the name of their study. Their columns tell it, too, as
    `DIRECTORY`.

    Raises
    ------
    SpecError
        If two studies mean different things by the name of a measure.
    """
    times = Counter(condition for _, results in studies for condition in results.columns)
    several = [condition for condition, count in times.items() if count > 1]
    labels = [
        {c: f"{c} ({name})" if c in several else c for c in results.columns}
        for name, results in studies
    ]
    for condition in several if settings else ():
        at = [i for i, (_, results) in enumerate(studies) if condition in results.columns]
        apart = _apart(condition, [settings[i].get(condition, {}) for i in at])
        if not times.keys() & set(apart):
            for i, text in zip(at, apart, strict=False):
                labels[i][condition] = text
    keys = dict.fromkeys(k for _, r in studies for row in r.columns.values() for k in row)
    columns = {
        new[condition]: {**{key: row.get(key, "") for key in keys}, DIRECTORY: name}
        for (name, results), new in zip(studies, labels, strict=True)
        for condition, row in results.columns.items()
    }
    whole = join(
        [results for _, results in studies],
        labels,
        columns,
        joined_measures(results.measures for _, results in studies),
    )
    return whole, labels


def _plain(value: Any) -> Any:
    """Return a value of a column as what it stands for: ``true`` is a truth value there."""
    return TRUTHS.get(value, value) if isinstance(value, str) else value
