"""Wheel and sdist, each installed by itself, run a study outside of the checkout, with equal rows.

Dependencies are those of the environment that runs the tests, so that nothing is fetched or
compiled; ``python -m benchmarks.packages`` installs these, too. The wheel compiles its kernels;
those of the sdist, which would be the same ones, are interpreted.
"""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
SPEC = """\
study = "learning-curve"
seeds = 1
episodes = 1
steps = 4
evaluation = 1
scenario.kind = "line-up"
"""
BUILD = "import sys; from setuptools import build_meta as b; getattr(b, sys.argv[1])(sys.argv[2])"


def call(*command: object, cwd: Path, **environment: str) -> str:
    done = subprocess.run(
        list(map(str, command)), cwd=cwd, env={**os.environ, **environment},
        stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of what is committed or about to be: building leaves nothing in the checkout."""
    folder = tmp_path_factory.mktemp("checkout")
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if listed.returncode:
        pytest.skip("not a git checkout")
    for name in filter(None, listed.stdout.split("\0")):
        copy = folder / name
        copy.parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).is_file():
            copy.write_bytes((ROOT / name).read_bytes())
    return folder


@pytest.fixture(scope="module")
def packages(checkout: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Wheel and sdist, each alone in a folder."""
    built = {}
    for kind in ("wheel", "sdist"):
        place = tmp_path_factory.mktemp(kind)
        call(sys.executable, "-c", BUILD, f"build_{kind}", place, cwd=checkout)
        (built[kind],) = place.iterdir()
    return built


@pytest.mark.slow
def test_wheel_and_sdist_run_where_there_is_no_checkout(
    packages: dict[str, Path], tmp_path: Path
) -> None:
    rows = []
    for kind, package in packages.items():
        place = tmp_path / kind
        place.mkdir()
        call(
            sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index",
            "--no-build-isolation", "--target", place / "env", package, cwd=place,
        )  # fmt: skip
        (place / "spec.toml").write_text(SPEC)
        program = [sys.executable, "-P", "-m", "nested_agents"]
        where = "import nested_agents; print(nested_agents.__file__)"
        alone = {"PYTHONPATH": str(place / "env"), "NUMBA_DISABLE_JIT": str(int(kind == "sdist"))}
        said = call(sys.executable, "-P", "-c", where, cwd=place, **alone)
        assert Path(said.strip()).is_relative_to(place / "env")
        call(*program, "run", "spec.toml", "--out", "out", "--jobs", "1", cwd=place, **alone)
        rows.append(call(*program, "results", "out", "--format", "csv", cwd=place, **alone))
    assert rows[0] == rows[1]
    assert rows[0].count("\n") > 1


@pytest.mark.slow
def test_the_wheel_holds_the_four_packages(packages: dict[str, Path], checkout: Path) -> None:
    names = set(zipfile.ZipFile(packages["wheel"]).namelist())
    sources = {
        f"nested_agents/{path.relative_to(checkout).as_posix()}"
        for package in ("core", "topologies", "scenarios", "studies")
        for path in (checkout / package).rglob("*.py")
    }
    assert sources
    assert sources <= names
    assert {"nested_agents/__main__.py", "nested_agents/py.typed"} <= names
    assert {name.split("/")[0] for name in names if ".dist-info" not in name} == {"nested_agents"}
    assert "nested_agents/studies/catalogue/ablation/ablation.toml" in names
    assert [name for name in names if name.startswith("nested_agents/research/")] == []
