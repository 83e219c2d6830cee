"""The packages of the four folders at the top, which pyproject.toml cannot list by a pattern."""

from setuptools import find_namespace_packages, setup

FOLDERS = ("core", "topologies", "scenarios", "studies")
PUBLISHED = "studies.claims.published"
"""Committed results stay in the repository; `nested-agents claims` reads them in a checkout."""

names = [
    f"nested_agents.{name}"
    for name in find_namespace_packages(include=[*FOLDERS, *(f"{folder}.*" for folder in FOLDERS)])
    if name != PUBLISHED
]
setup(packages=["nested_agents", *names])
