"""Conditions of several team sizes, and their figure."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from ..results.analysis import EVALUATED
from ..results.sizes import Sizes
from ..results.statistics import Estimate
from .study import distinct

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LINEAR_UP_TO = 1.0
"""Messages up to which their axis is linear, because there may be none."""


class SizedCase(NamedTuple):
    """A condition with a team size: a hierarchy, or a search method, within a setting."""

    condition: str
    """Label of the condition."""
    name: str
    """Label without the number of robots and the setting, such as the hierarchy."""
    group: str
    """Setting besides the number of robots, such as the value that decides; may be empty."""
    robots: int
    """Number of bodies."""
    sizes: Sizes
    """Numbers of bodies of all cases, and the name of bodies."""
    values: dict[str, Estimate]
    """Estimates by title."""
    phase: str = "evaluation"
    """Phase of the evaluated episodes."""

    @property
    def setting(self) -> str:
        """Setting in words, which compared cases share."""
        return f"{self.sizes.shown(self.robots)}, {self.group}".strip(", ")

    @property
    def label(self) -> str:
        """Label of its row in the table."""
        return f"{self.setting}, {self.name}".removeprefix(", ")

    @property
    def main(self) -> str:
        """Title of the evaluation."""
        return next((title for title in self.values if title.startswith("evaluation ")), EVALUATED)


def draw_by_size(cases: Sequence[SizedCase], titles: Sequence[str]) -> "Figure":
    """Return a figure of means with 95% intervals against the number of bodies.

    Each title has a row of panels, with a column for each group; those of a single group stand side
    by side. Lines differ by color and marker and are slightly offset.
    """
    from ..presentation import figures  # matplotlib takes its time

    names = distinct(case.name for case in cases)
    groups = distinct(case.group for case in cases)
    count = len(titles) * len(groups)
    columns = len(groups) if len(groups) > 1 else min(count, 3)
    all_sizes = sorted({case.robots for case in cases})
    figure, panels = figures.grid(count, columns, (2.8, 2.3), (0.3, 0.8), least=5.6)
    for k, axes in enumerate(panels.flat[:count]):
        title = titles[k // len(groups)]
        group = groups[k % len(groups)]
        for index, name in enumerate(names):
            own = [
                case
                for case in cases
                if (case.name, case.group) == (name, group) and title in case.values
            ]
            if own:
                estimates = [case.values[title] for case in own]
                robots = [case.robots for case in own]
                figures.draw_line(axes, robots, estimates, index, len(names))
        axes.set_title(f"{title}, {group}" if group else title, loc="left")
        figures.scale_axis(axes, all_sizes)
        axes.set_xlabel(cases[0].sizes.word)
        if len(all_sizes) == 1:
            axes.set_xticks([])
            axes.set_xlabel(cases[0].sizes.shown(all_sizes[0]))
        if title == EVALUATED:
            figures.as_rates(axes)
        elif title == "messages":
            axes.set_yscale("symlog", linthresh=LINEAR_UP_TO)
            axes.yaxis.set_major_formatter("{x:,.10g}")
            axes.set_ylim(-0.3, 2.0 * max(case.values[title].value for case in cases) + 1.0)
        elif title != cases[0].main:
            figures.log_axis(axes)
    figures.name_lines(figure, names, "means over seeds, bars: 95% intervals")
    return figure
