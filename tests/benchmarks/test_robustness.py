"""The proofs of robustness run, on a small scale; their figures are in docs/studies.md."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def run(*arguments: str) -> str:
    command = [sys.executable, "-m", *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize(("backend", "kills"), [("loky", 3), ("dask", 1)])
def test_killed_studies_end_with_the_bytes_of_undisturbed_ones(backend: str, kills: int) -> None:
    said = run(
        "benchmarks.crashes",
        "--backend",
        backend,
        "--kills",
        str(kills),
        "--seed",
        "3",
        "--seeds",
        "3",
    )
    killed = re.search(r"killed +(\d+) processes, (\d+) workers", said)
    assert killed is not None
    assert sum(map(int, killed.groups())) == kills
    assert re.search(r"lost +0 trials", said)
    assert re.search(r"unequal +0 studies", said)


@pytest.mark.slow
def test_an_adversary_finds_neither_silence_nor_tracebacks() -> None:
    said = run(
        "benchmarks.adversary",
        "--kills",
        "2",
        "--flips",
        "9",
        "--hostile",
        "12",
        "--others",
        "2",
        "--scenarios",
        "4",
    )
    assert said.rstrip().endswith(", 0 failures")


@pytest.mark.slow
def test_the_runner_is_measured() -> None:
    said = run("benchmarks.runner", "--trials", "2", "--rounds", "1", "--episodes", "1")
    assert re.search(r"jobs 1: .* overhead \d", said)
    assert re.search(r"efficiency of 2 jobs: \d", said)
