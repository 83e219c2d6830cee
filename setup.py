"""The packages of the four folders at the top, which pyproject.toml cannot list by a pattern."""

from setuptools import find_namespace_packages, setup

FOLDERS = ("core", "topologies", "scenarios", "studies")

names = [
    f"nested_agents.{name}"
    for name in find_namespace_packages(include=[*FOLDERS, *(f"{folder}.*" for folder in FOLDERS)])
]
setup(packages=["nested_agents", *names])
