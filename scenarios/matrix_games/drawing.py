"""Pictures of matrix games."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure
from numpy import ndindex

from ...core.numerics import FloatArray
from ..movies import save_picture


def draw_tables(
    tables: FloatArray, titles: Sequence[str], actions: Sequence[str], path: Path | str
) -> None:
    """Draw payoff tables side by side; the maximum payoff of all tables is framed.

    Parameters
    ----------
    tables
        ``(k, A, A)`` payoffs: rows are actions of the first agent, columns of the second.
    titles
        ``(k,)`` title of each table.
    actions
        Names of the actions.
    path
        Picture file.
    """
    figure = Figure(figsize=(3.2 * len(tables), 3.4), layout="constrained")
    panels = figure.subplots(1, len(tables), squeeze=False)[0]
    ticks = range(len(actions))
    for axes, table, title in zip(panels, tables, titles, strict=True):
        axes.imshow(table, cmap="PuOr", vmin=tables.min(), vmax=tables.max(), alpha=0.6)
        axes.set(title=title, xlabel="second agent", ylabel="first agent")
        axes.set_xticks(ticks, actions)
        axes.set_yticks(ticks, actions)
        for (row, column), payoff in zip(ndindex(table.shape), table.ravel(), strict=True):
            is_best = payoff == tables.max()
            frame = {"boxstyle": "square", "fc": "none"} if is_best else None
            axes.text(column, row, f"{payoff:g}", ha="center", va="center", bbox=frame)
    save_picture(figure, path)
