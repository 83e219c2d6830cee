"""Builds wheel and sdist, and installs and runs each in an empty environment.

    python -m benchmarks.packages

Box2D is compiled for both, so this takes minutes and is part of a release, not of the tests. pip
needs what it always does to find packages, and the machine a C++ compiler with Python's headers.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SPEC = """\
study = "learning-curve"
seeds = 2
episodes = 2
steps = 8
evaluation = 1
"""


def call(*command: object, cwd: Path = ROOT) -> str:
    """Run a command and return what it prints; stop if it fails."""
    print("$", *command, flush=True)
    done = subprocess.run(
        list(map(str, command)), cwd=cwd, check=True, stdout=subprocess.PIPE, text=True
    )
    return done.stdout


def build(folder: Path) -> list[Path]:
    """Build both from what is committed; return their paths."""
    source = folder / "source"
    call("git", "clone", "--quiet", "--no-hardlinks", ROOT, source)
    for kind in ("wheel", "sdist"):  # in processes of their own: setuptools keeps where it built
        script = f"import sys; from setuptools import build_meta as b; b.build_{kind}(sys.argv[1])"
        call(sys.executable, "-c", script, folder, cwd=source)
    return sorted([*folder.glob("*.whl"), *folder.glob("*.tar.gz")])


def try_out(package: Path, folder: Path) -> str:
    """Install a package into an empty environment, run a study there, and return its rows."""
    environment = folder / f"env{package.suffix}"
    call(sys.executable, "-m", "venv", environment)
    python = environment / "bin" / "python"
    # box2d-py calls swig while it is built, and does not say so.
    call(python, "-m", "pip", "install", "--quiet", "swig>=4.2,<5", "setuptools>=77,<85")
    call(
        "env", f"PATH={environment / 'bin'}:/usr/bin:/bin", python, "-m", "pip", "install",
        "--quiet", "--no-build-isolation", package,
    )  # fmt: skip
    study = folder / f"study{package.suffix}"
    study.mkdir()
    (study / "spec.toml").write_text(SPEC, encoding="utf-8")
    program = environment / "bin" / "nested-agents"
    call(program, "run", "spec.toml", "--out", "out", "--jobs", "1", cwd=study)
    return call(program, "results", "out", "--format", "csv", cwd=study)


def main() -> None:
    """Try both; their rows must be equal."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rows = {package.name: try_out(package, folder) for package in build(folder)}
    print(f"{len(rows)} packages run:", ", ".join(rows))
    if len(set(rows.values())) != 1:
        sys.exit("their rows differ")


if __name__ == "__main__":
    main()
