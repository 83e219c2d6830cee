"""Files of a finished study that are harmed bit by bit, for `benchmarks.adversary`."""

from __future__ import annotations

import random
from collections import Counter
from pathlib import Path

from nested_agents.studies.store.database import DATABASE
from nested_agents.studies.store.writer import LOCK

from .victim import EXPLAIN, LINES, Adversary, mended, read, without_figures


def flips(number: int, rng: random.Random, folder: Path) -> Counter[str]:
    """Flip bits one by one, read the study, and mend it every fourth time; return what happened."""
    without_figures()
    adversary, tally = Adversary(folder, rng, (*LINES, EXPLAIN)), Counter[str]()
    for attempt in range(number):
        tally["flips"] += 1
        path = adversary.damage()
        lines = [*LINES, *([EXPLAIN] if attempt % 10 == 0 else [])]
        for line in lines:
            tally["reads"] += 1
            tally[read(adversary, line, path)] += 1
        if attempt % 4 == 0:
            tally["runs"] += 1
            tally[mended(adversary, path)] += 1
        adversary.restore()
    return tally


def every_byte(rng: random.Random, folder: Path) -> Counter[str]:
    """Flip a bit in every byte of the database, one after the other, and read the study."""
    adversary, tally = Adversary(folder, rng, LINES), Counter[str]()
    path = adversary.study / DATABASE
    sound = path.read_bytes()
    for at in range(len(sound)):
        tally["flips"] += 1
        data = bytearray(sound)
        data[at] ^= 1 << rng.randrange(8)
        path.write_bytes(data)
        for line in LINES[:2]:
            tally["reads"] += 1
            tally[read(adversary, line, path)] += 1
    return tally


def obstacles(number: int, rng: random.Random, folder: Path) -> Counter[str]:
    """Put folders in place of files, and cut files short; return what happened."""
    without_figures()
    adversary, tally = Adversary(folder, rng, LINES), Counter[str]()
    harms: list[tuple[Path, int | None]] = [
        (adversary.study / name, None)
        for name in (LOCK, DATABASE, f"{DATABASE}-journal", f"{DATABASE}-wal")
    ]
    for source in adversary.files:
        path, size = adversary.study / source.relative_to(adversary.sound), source.stat().st_size
        harms += [(path, left) for left in (size - 1, size // 2, 0)]
    for path, left in rng.sample(harms, min(number, len(harms))):
        tally["files"] += 1
        if left is None:
            path.unlink(missing_ok=True)
            path.mkdir()
        else:
            path.write_bytes(path.read_bytes()[:left])
        for line in LINES:
            tally["reads"] += 1
            tally[read(adversary, line, path)] += 1
        adversary.restore()
    return tally
