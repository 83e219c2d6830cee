"""Benchmarks: what a control step costs, as ratios of paired rounds in one process.

``python -m benchmarks`` (or ``./dev bench``) prints tables, ``--json FILE`` writes them.
"""
