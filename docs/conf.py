"""Sphinx configuration."""

from importlib.metadata import version as installed_version

project = "nested-agents"
author = "nested-agents contributors"
copyright = "2026, nested-agents contributors"
release = installed_version("nested-agents")
version = release

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "numpydoc",
    "myst_parser",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_build"]
nitpicky = False

autodoc_typehints = "none"  # numpydoc's Parameters sections already say them
autosummary_generate = True
numpydoc_show_class_members = False
myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = f"nested-agents {release}"
