"""
A study on Slurm, in parts
==========================

Submits a study as an array of jobs with submitit (``pip install submitit``) and exits. Each job
runs a part of the seeds. The same command later submits the parts that have not finished; when all
have finished, it prints the table of the whole study: ``python slurm_parts.py study.toml out 8``.
"""

import sys
from pathlib import Path

import submitit

import nested_agents as na
from nested_agents.studies.errors import SpecError


def parts(spec: na.Spec, count: int) -> list[na.Spec]:
    """Return the study in parts, which have different seeds."""
    seeds = [spec.seeds[i::count] for i in range(min(count, len(spec.seeds)))]
    return [na.Spec.of({**spec.table(), "seeds": list(own)}) for own in seeds]


def is_done(part: na.Spec, place: Path) -> bool:
    """Tell whether a part has run to its end."""
    try:
        study = na.load(place)
    except SpecError:  # nothing is there, or it is being written
        return False
    return len(study.trials) == len(part.seeds) * len(part.conditions())


def run_part(path: str, count: int, number: int, place: str) -> None:
    """Run one part, on the machine of a job."""
    na.run(parts(na.Spec.load(path), count)[number], place, jobs=1, progress=False)


def main(path: str, out: str, count: int, cluster: str | None = None) -> None:
    """Submit what is left, or print the table."""
    places = [Path(out) / f"part-{i}" for i in range(count)]
    own = parts(na.Spec.load(path), count)
    left = [i for i, part in enumerate(own) if not is_done(part, places[i])]
    if not left:
        print(na.load(*places[: len(own)]))
        return
    executor = submitit.AutoExecutor(Path(out) / "jobs", cluster=cluster)
    executor.update_parameters(timeout_min=240, cpus_per_task=1, mem_gb=2)
    with executor.batch():
        jobs = [executor.submit(run_part, path, count, i, str(places[i])) for i in left]
    print(f"{len(jobs)} of {len(own)} parts submitted as {jobs[0].job_id}; come back later")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), *sys.argv[4:])
