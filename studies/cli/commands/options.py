"""Arguments and options that several commands share."""

from __future__ import annotations

import click

from ..arguments import Assignments, Choice, File, Several, Text, Whole

directory = click.argument("directory", type=File(), metavar="DIR")
"""An existing study."""

jobs = click.option(
    "--jobs",
    type=Whole(),
    metavar="N",
    help="Trials at a time; one for every core unless said otherwise.",
)
"""Number of worker processes."""

backend = click.option(
    "--backend",
    type=Choice(["loky", "dask"]),
    default="loky",
    help="Who runs the trials: loky, processes of this machine, or dask, workers of a Dask cluster "
    "(extra nested-agents[dask]). The results are the same.",
)
"""Kind of workers, see `nested_agents.studies.workers.workers`."""

address = click.option(
    "--address",
    type=Text(),
    metavar="tcp://HOST:PORT",
    help="Of the scheduler of a running Dask cluster, all of whose workers are used unless --jobs "
    "says otherwise. If missing, a cluster is started here.",
)
"""Of a Dask scheduler."""

accept_code = click.option(
    "--accept-code",
    is_flag=True,
    help="Go on with a study although the installed code that computes it has changed since.",
)
"""Whether results of two versions of the code may stand side by side."""

trust = click.option(
    "--trust",
    is_flag=True,
    help="Run, from now on, the Python files that came with the study, though no spec of yours has "
    "run them yet. They can do whatever you can.",
)
"""Whether the users' files that a study brings along may be run."""

changes = click.option(
    "--set",
    "changes",
    cls=Assignments,
    type=Text(),
    metavar="KEY=VALUE...",
    help='Lay values over the spec: --set learner.ridge=1 "seeds=[3, 5]". May be repeated.',
)
"""Assignments laid over a spec, see `nested_agents.studies.spec.overlay.assignment`."""

figures = click.option(
    "--figures",
    cls=Several,
    type=Choice(["png", "svg", "pdf"]),
    metavar="png|svg|pdf...",
    default=("png", "svg"),
    help="Formats of the figures.",
)
"""What figures of a study are written as."""

plot = click.option(
    "--plot", type=File(), metavar="PATH", help="A figure to write: SVG, PNG or PDF by suffix."
)
"""A picture to write."""

as_study = click.option(
    "--as",
    "study",
    type=Text(),
    metavar="STUDY",
    help="Analyse the trials as this study does, by its name or file.py:NAME; nothing is run.",
)
"""Another study than that which the trials were run for."""

where = click.option(
    "--where",
    type=Text(),
    metavar="CHOICE",
    help='Only the trials of a choice: "robots == 8 and seed < 5", "box in [square, circle]".',
)
"""A part of the trials, see `nested_agents.studies.results.selection.Where`."""

form = click.option(
    "--format",
    "form",
    type=Choice(["table", "markdown", "latex", "csv"]),
    default="table",
    help="How to print the table; CSV holds every digit, LaTeX needs the package booktabs.",
)
"""How a table of estimates is printed."""
