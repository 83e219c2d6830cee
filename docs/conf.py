"""Sphinx configuration."""

import re
import sys
from importlib.metadata import version as installed_version
from pathlib import Path
from types import BuiltinFunctionType, GenericAlias

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

import reference  # noqa: E402
import site_pages  # noqa: E402
from docutils import nodes  # noqa: E402

from nested_agents.studies.results.notation import whole  # noqa: E402

reference.write(HERE / "reference")
site_pages.copy_notebooks()

project = "nested-agents"
author = "nested-agents contributors"
copyright = "2026, nested-agents contributors"
release = installed_version("nested-agents")
version = release

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx_gallery.gen_gallery",
    "numpydoc",
    "myst_parser",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_build", "gallery/**/*.py", "gallery/*.ipynb"]
nitpicky = False

autodoc_typehints = "none"  # numpydoc's Parameters sections already say them
autodoc_member_order = "bysource"
autodoc_default_options = {"exclude-members": "model_config, model_post_init"}
autosummary_generate = False
numpydoc_show_class_members = False
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3

sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    "default_thumb_file": str(HERE / "figures" / "idea.png"),
    "filename_pattern": r"/plot_",
    "ignore_pattern": r"(^|/)__init__\.py$",
    "download_all_examples": False,
    "show_memory": False,
    "write_computation_times": False,
    "remove_config_comments": True,
}

html_theme = "furo"
html_title = f"nested-agents {release}"
html_theme_options = {"navigation_with_keys": True}
html_static_path = ["_static"]
html_css_files = ["site.css"]


def escape_bars(app, what, name, thing, options, lines):
    """Keep sizes of sets, |S|, from being taken for substitutions outside of literal text."""
    for i, line in enumerate(lines):
        parts = line.split("``")
        parts[::2] = [re.sub(r"\|(\w+)\|", r"\|\1\|", part) for part in parts[::2]]
        lines[i] = "``".join(parts)


def skip_signatures_of_c(app, what, name, thing, skip, options):
    """Leave out aliases of types and functions of C, over whose signatures Sphinx 9.0 stumbles."""
    return True if isinstance(thing, GenericAlias | BuiltinFunctionType) else None


INTERVAL = r"(\[[^],]+,) ([^]]+\])"


def keep_numbers_whole(app, doctree):
    """Keep an estimate and its interval in one line; in tables the interval."""
    for paragraph in doctree.findall(nodes.paragraph):
        in_table = isinstance(paragraph.parent, nodes.entry)
        for text in [*paragraph.findall(nodes.Text)]:
            if not isinstance(text.parent, nodes.literal):
                kept = re.sub(INTERVAL, "\\1\u00a0\\2", text) if in_table else whole(text)
                kept = re.sub(r"^(\d+) of (\d+)$", "\\1\u00a0of\u00a0\\2", kept)
                text.parent.replace(text, nodes.Text(kept))


def extend_page(app, docname, source):
    """Add what GitHub does not show: the navigation, docstrings, and links within the site."""
    source[0] = site_pages.extended(docname, source[0])


def setup(app):
    """Connect the functions above to the events of Sphinx."""
    app.connect("source-read", extend_page)
    app.connect("doctree-read", keep_numbers_whole)
    app.connect("autodoc-process-docstring", escape_bars)
    app.connect("autodoc-skip-member", skip_signatures_of_c)
