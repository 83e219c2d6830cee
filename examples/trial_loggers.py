"""
Trials in TensorBoard or MLflow
===============================

Observers that write every finished trial to a tool of yours, and show the progress on the terminal
as usual. Neither package is needed by anything else::

    import nested_agents as na
    from trial_loggers import TensorBoard

    na.run("spec.toml", "out", observer=TensorBoard("out"))
"""

# sphinx_gallery_thumbnail_path = "learning-curves.png"

from pathlib import Path

from nested_agents.studies.presentation.progress import Terminal


class TrialLogger(Terminal):
    """Writes every trial that has finished, once its result is in the study."""

    def follow(self, outcomes, total, done):
        """Run the trials by asking for their outcomes, and write each."""
        super().follow(map(self._written, outcomes), total, done)

    def _written(self, outcome):
        if outcome.result is not None:  # it has not failed
            self.write(outcome.trial, outcome.result)
        return outcome


class TensorBoard(TrialLogger):
    """Curves of every measure, a run for each trial, below ``tensorboard`` in the study."""

    def __init__(self, directory):
        self.directory = Path(directory) / "tensorboard"

    def write(self, trial, result):
        """Write what a trial has measured."""
        from tensorboard.summary import Writer

        writer = Writer(str(self.directory / trial.condition / f"seed {trial.seed}"))
        for row in result.rows:
            for name, value in {**row.measures, "return": row.return_}.items():
                writer.add_scalar(f"{row.phase}/{name}", float(value), row.episode)
        writer.close()


class MLflow(TrialLogger):
    """A run for each trial: its settings, its curves, what it took."""

    def __init__(self, directory):
        import mlflow

        self.mlflow = mlflow
        mlflow.set_experiment(Path(directory).name)

    def write(self, trial, result):
        """Write what a trial has measured."""
        with self.mlflow.start_run(run_name=f"{trial.condition}, seed {trial.seed}"):
            self.mlflow.log_params({"condition": trial.condition, "seed": trial.seed})
            for row in result.rows:
                values = {f"{row.phase}.{name}": float(v) for name, v in row.measures.items()}
                self.mlflow.log_metrics(values, step=row.episode)
            self.mlflow.log_metrics({f"seconds.{k}": v for k, v in result.seconds.items()})
