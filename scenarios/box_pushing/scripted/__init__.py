"""A scripted controller: the proof that the task can be solved."""
