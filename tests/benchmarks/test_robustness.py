"""The proofs of robustness run, on a small scale; their figures are in docs/benchmarks.md."""

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
def test_killed_studies_end_with_the_bytes_of_undisturbed_ones() -> None:
    kills = {"loky": 2, "dask": 1}
    options = ["--kills", *map(str, kills.values()), "--seed", "3", "--seeds", "2"]
    said = run("benchmarks.crashes", "--backend", *kills, *options)
    killed = re.findall(r"backend +(\w+), .*\nkilled +(\d+) processes, (\d+) workers", said)
    assert {name: int(one) + int(other) for name, one, other in killed} == kills
    assert re.findall(r"lost +(\d+) trials", said) == ["0", "0"]
    assert re.findall(r"unequal +(\d+) studies", said) == ["0", "0"]


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_an_adversary_finds_neither_silence_nor_tracebacks() -> None:
    fewest = {
        "kills": 1,
        "flips": 4,
        "obstacles": 3,
        "hostile": 8,
        "others": 1,
        "scenarios": 1,
        "edits": 4,
        "published": 4,
        "environments": 20,
    }
    said = run("benchmarks.adversary", *(f"--{name}={n}" for name, n in fewest.items()))
    assert said.rstrip().endswith(", 0 failures")


@pytest.mark.slow
def test_the_runner_is_measured() -> None:
    said = run("benchmarks.runner", "--trials", "2", "--rounds", "1", "--episodes", "1")
    assert re.search(r"jobs 1: .* overhead \d", said)
    assert re.search(r"efficiency of 2 jobs: \d", said)
