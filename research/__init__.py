"""What has been published: rows, the specs that only document a result, and what is said of them.

A folder of the repository, not of the installed package. Nothing of the package imports it;
``nested-agents claims`` and ``nested-agents benchmark`` find it in a checkout.
"""

from pathlib import Path

FOLDER = Path(__file__).parent
ROWS = FOLDER / "results"
"""Committed results, one file for each table of the pages."""
SPECS = FOLDER / "specs"
"""Specs that they are run by, unless the catalogue has them; a folder for each study."""
QUICK = FOLDER / "quick"
"""Small versions of the studies that the paper's claims rest on."""
