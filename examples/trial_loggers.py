"""
Trials in TensorBoard or MLflow
===============================

Loggers that are told of every finished trial. Neither package is needed by anything else::

    nested-agents run spec.toml --out out --log trial_loggers.py:TensorBoard
"""

# sphinx_gallery_thumbnail_path = "learning-curves.png"


class TensorBoard:
    """Curves of every measure, a run for each trial, below ``tensorboard`` in the study."""

    def __init__(self, spec, directory):
        from tensorboard.summary import Writer

        self.writer = lambda name: Writer(str(directory / "tensorboard" / name))

    def trial(self, trial, result):
        """Write what a trial has measured."""
        writer = self.writer(f"{trial.condition}/seed {trial.seed}")
        for row in result.rows:
            for name, value in {**row.measures, "return": row.return_}.items():
                writer.add_scalar(f"{row.phase}/{name}", float(value), row.episode)
        writer.close()

    def close(self):
        """Do nothing: every trial is written by itself."""


class MLflow:
    """A run for each trial: its settings, its curves, what it took."""

    def __init__(self, spec, directory):
        import mlflow

        self.mlflow = mlflow
        mlflow.set_experiment(f"{spec.study} {directory.name}")

    def trial(self, trial, result):
        """Write what a trial has measured."""
        with self.mlflow.start_run(run_name=f"{trial.condition}, seed {trial.seed}"):
            self.mlflow.log_params({"condition": trial.condition, "seed": trial.seed})
            for row in result.rows:
                values = {f"{row.phase}.{name}": float(v) for name, v in row.measures.items()}
                self.mlflow.log_metrics(values, step=row.episode)
            self.mlflow.log_metrics({f"seconds.{k}": v for k, v in result.seconds.items()})

    def close(self):
        """Do nothing: every trial is written by itself."""
