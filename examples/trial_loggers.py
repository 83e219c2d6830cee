"""
An experiment tracker
=====================

An observer receives the outcome of every trial when it finishes. This one writes each trial as one
line of a file and shows the usual progress on the terminal; call TensorBoard, MLflow or Weights &
Biases in its method ``write`` to log there::

    import nested_agents as na
    from trial_loggers import Lines

    na.run("spec.toml", "out", observer=Lines("out/trials.jsonl"))
"""

# sphinx_gallery_thumbnail_path = "figures/learning_curves.png"

import json
from pathlib import Path

from nested_agents.studies.presentation.progress import Terminal


class Lines(Terminal):
    """Writes one line per finished trial, after its result has been stored."""

    def __init__(self, path):
        super().__init__(self.write)
        self.path = Path(path)

    def write(self, outcome):
        """Write the condition, the seed and the returns of a trial."""
        line = {"condition": outcome.trial.condition, "seed": outcome.trial.seed}
        if outcome.result is not None:  # the trial succeeded
            line |= {"return": [row.return_ for row in outcome.result.rows]}
        with self.path.open("a") as file:
            print(json.dumps(line), file=file)
