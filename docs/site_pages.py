"""Navigation of the site, and what its pages have in addition to the text that GitHub shows.

The pages in ``docs`` are plain Markdown. `extended` adds the tables of contents, the docstrings of
the pages in ``docs/api``, and turns links to ``research/notebooks`` into links within the site.
"""

import re
import shutil
from pathlib import Path

import nested_agents

HERE = Path(__file__).resolve().parent
NOTEBOOKS = HERE.parent / "research" / "notebooks"
NAVIGATION = {
    "Get started": ("install", "tutorials/first_study", "concepts"),
    "Tutorials": ("tutorials/index", "gallery/index"),
    "Guide": (
        "topologies", "communication", "learners", "dynamics_models", "joint_action_search",
        "coordination_graphs", "specs", "running", "statistics", "reading_results", "report",
        "explain", "faults", "cost", "scalability", "resilience", "python", "extending",
        "troubleshooting",
    ),
    "Environments": (
        "environments/index", "environments/box_pushing", "environments/arms",
        "environments/matrix_games", "environments/gymnasium_pettingzoo",
    ),
    "Results": (
        "results/index", "results/paper", "results/communication_lookahead", "results/scaling",
        "results/equal_computing",
        "results/failures", "results/ppo", "notebooks/README",
    ),
    "Reference": (
        "reference", "combinations", "glossary", "bibliography", "fidelity", "reproduce",
        "benchmarks", "reference/changelog",
    ),
}  # fmt: skip
"""Pages of the sidebar by caption."""
CONTENTS = {
    "tutorials/index": (
        "hierarchy", "scenario", "pettingzoo", "parts", "scaling", "growth", "wheel_failures",
        "costs", "functions", "mixed_teams", "other_results", "cluster",
    ),
    "reference": (
        "reference/keys", "reference/commands", "reference/columns", "api/studies",
        "api/hierarchies", "api/teams", "api/environments", "api/learners", "api/statistics",
        "api/modules",
    ),
    "notebooks/README": tuple(sorted({path.stem for path in NOTEBOOKS.glob("*.md")} - {"README"})),
}  # fmt: skip
"""Pages below a page."""


def copy_notebooks() -> None:
    """Copy the laboratory notebooks of ``research`` into the site, with links that work there."""
    target = HERE / "notebooks"
    shutil.rmtree(target, ignore_errors=True)
    shutil.copytree(NOTEBOOKS, target)
    for page in target.glob("*.md"):
        text = page.read_text(encoding="utf-8")
        text = re.sub(r"\]\(\.\./(?!\.\./)", "](../../research/", text)
        page.write_text(text.replace("](../../docs/", "](../"), encoding="utf-8")


def extended(docname: str, text: str) -> str:
    """Return the text of a page with the parts that only the site shows."""
    text = re.sub(r"\]\(((?:\.\./)*)\.\./research/notebooks/", r"](\1notebooks/", text)
    if docname == "index":
        for caption, pages in NAVIGATION.items():
            text += contents(pages, f":caption: {caption}\n:hidden:")
    if docname in CONTENTS:
        text += contents(CONTENTS[docname], ":hidden:")
    if docname.startswith("api/"):
        text += docstrings(text)
    return text


def contents(pages: tuple[str, ...], options: str) -> str:
    """Return a table of contents."""
    return "\n\n```{toctree}\n" + options + "\n\n" + "\n".join(pages) + "\n```\n"


def documented_names(text: str) -> list[str]:
    """Return the names that a page of the API documents, in order.

    Each is an item of a list: ``- `name`: purpose`` for a name of the package.
    """
    return re.findall(r"^- `na\.(\w+)`", text, re.MULTILINE)


def docstrings(text: str) -> str:
    """Return a section with the signatures and docstrings of the names on a page of the API."""
    lines = [".. currentmodule:: nested_agents", ""]
    for name in documented_names(text):
        thing = getattr(nested_agents, name)
        kind = "class" if isinstance(thing, type) else "function" if callable(thing) else "data"
        members = ["   :members:", "   :show-inheritance:"] if kind == "class" else []
        lines += [f".. auto{kind}:: {name}", *members, ""]
    for module in re.findall(r"^## `(nested_agents\.\w+)`", text, re.MULTILINE):
        lines += [f".. automodule:: {module}", "   :no-members:", ""]
    return "\n\n## Details\n\n```{eval-rst}\n" + "\n".join(lines) + "\n```\n"
