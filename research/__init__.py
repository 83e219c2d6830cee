"""Published results, their specs, and the programs that made and read them.

A folder of the repository; an installed package does not have it. Programs run from the top of a
checkout, ``python -m research.NAME``, and use public names of the package only.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import nested_agents as na

FOLDER = Path(__file__).parent
RESULTS = FOLDER / "results"
"""Published results, one file for each table of the pages."""
SPECS = FOLDER / "specs"
"""Specs of the published results, under the same names, unless the catalog has them."""
QUICK = FOLDER / "quick"
"""Small versions of the studies that the paper's claims rest on."""


def study_of(name: str) -> str:
    """Return the reference to a study of this folder that a spec anywhere may use."""
    attribute = "".join(part.title() for part in name.split("-"))
    return f"{FOLDER}/studies/{name.replace('-', '_')}.py:{attribute}Study"


def load(name: str) -> na.StudyResults:
    """Return published results by name, analyzed by their study.

    A study of this folder, which the results name relative to themselves, is trusted.
    """
    path = RESULTS / f"{name}.json"
    results = na.load(path)
    study = results.outline.study
    is_file = study.startswith("../")
    return results.as_study(str((path.parent / study).resolve())) if is_file else results


BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
