"""
A tracker of your own
=====================

``nested-agents run --track tensorboard`` (or mlflow, wandb) writes every finished trial to a tool
of others. One for yours takes a method: here each trial becomes a line of a file. It is an
observer, which shows the progress on the terminal as usual::

    import nested_agents as na
    from trial_loggers import Lines

    na.run("spec.toml", "out", observer=Lines("out/trials.jsonl"))
"""

# sphinx_gallery_thumbnail_path = "learning-curves.png"

import json
from pathlib import Path

from nested_agents.studies.presentation.progress import Terminal


class Lines(Terminal):
    """Writes a line for each trial that has finished, once its result is in the study."""

    def __init__(self, path):
        super().__init__(self.write)
        self.path = Path(path)

    def write(self, outcome):
        """Write what became of a trial."""
        line = {"condition": outcome.trial.condition, "seed": outcome.trial.seed}
        if outcome.result is not None:  # it has not failed
            line |= {"return": [row.return_ for row in outcome.result.rows]}
        with self.path.open("a") as file:
            print(json.dumps(line), file=file)
