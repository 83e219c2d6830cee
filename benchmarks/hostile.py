"""Specs, topologies and polygons, mutated or absurd, for `benchmarks.adversary`."""

from __future__ import annotations

import contextlib
import io
import json
import math
import random
import sys
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

from nested_agents.scenarios.box_pushing.world.boxes import BoxSpec
from nested_agents.studies.cli.main import main as command_line
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec

from . import misbehaving

SLOW, BLOCKED = 10.0, 60.0
"""Seconds, of the processor and by the clock, after which an input counts as one that stalls."""


def hostile(number: int, rng: random.Random, folder: Path) -> Counter[str]:
    """Offer specs, topologies and polygons in turn; return what became of them."""
    makers = {
        "specs": _specs(rng),
        "topologies": _topologies(rng),
        "polygons": _polygons(rng),
        "functions": misbehaving.topologies(rng),
    }
    tally = Counter[str]()
    for attempt in range(number):
        kind = list(makers)[attempt % len(makers)]
        tally[kind] += 1
        attack = next(makers[kind])
        begin, used = time.monotonic(), time.process_time()
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            try:
                became = attack(folder)
            except BaseException:
                print(f"{kind}:\n{traceback.format_exc()}", file=sys.stderr)
                became = "traceback"
        if time.monotonic() - begin > BLOCKED or time.process_time() - used > SLOW:
            became = "stalled"
        if any(issubclass(w.category, RuntimeWarning) for w in warned):
            became = "warned"
        tally[f"{kind}: {became}"] += 1
    return tally


Attack = Callable[[Path], str]
VALUES = (
    "-1", "0", "1e999", "nan", "true", '""', "[]", "{}", '"\\u0000"', '"' + "x" * 5000 + '"',
    "[[[[[1]]]]]", "99999999999999999999", '"chain:a,a"', '"nothing.py:x"', "1979-05-27",
)  # fmt: skip
KEYS = (
    "seeds", "episodes", "steps", "evaluation", "preset", "study", "topology", "scenario.robots",
    "scenario.box", "scenario.robot", "scenario.failures", "learner.kind", "learner.discount",
    "learner.decision", "sweep.preset", "overrides", "evaluations.x", "k" * 5000,
    "scenario.x\\u001b",
)  # fmt: skip


def _specs(rng: random.Random) -> Iterator[Attack]:
    """Yield specs that are mutated byte by byte, or hold a strange value."""
    sound = (
        b'study = "learning-curve"\nseeds = 2\nepisodes = 3\n[scenario]\nrobots = 2\nbox = "L"\n'
        b'[topology]\nkind = "tree"\n[learner]\nridge = 3.0\n'
        b'[sweep]\npreset = ["default", "paper"]\n'
    )
    while True:
        data = bytearray(sound)
        kind = rng.randrange(3)
        if kind == 0:
            for _ in range(rng.randrange(1, 4)):
                data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        elif kind == 1:
            key = rng.choice(KEYS)
            head, _, tail = key.rpartition(".")
            table = f"[{head}]\n" if head else ""
            data = bytearray(f'{table}"{tail}" = {rng.choice(VALUES)}\n'.encode())
        else:
            depth = rng.choice([10, 1000, 100_000])
            data = bytearray(b"seeds = " + b"[" * depth + b"]" * depth + b"\n")

        def attack(folder: Path, data: bytes = bytes(data)) -> str:
            (folder / "spec.toml").write_bytes(data)
            try:
                Spec.load(folder / "spec.toml")
            except SpecError as error:
                return "refused in one line" if "\n" not in str(error) else "refused at length"
            return "accepted"

        yield attack


def _topologies(rng: random.Random) -> Iterator[Attack]:
    """Yield files of graphs."""
    names = [
        "a",
        "b",
        "c",
        1,
        None,
        0.5,
        True,
        "",
        "\x1b[31m",
        "x\ny",
        "\ud800",
        "n" * 5000,
        [],
        {},
    ]
    names += ["a", "b", "c", "d"] * 5
    graphml = (
        '<graphml xmlns="http://graphml.graphdrawing.org/xmlns"><graph edgedefault="directed">'
        '<node id="a"/><node id="b"/><edge source="a" target="b"/></graph></graphml>'
    )
    while True:
        kind, suffix = rng.randrange(4), "json"
        pairs = [[rng.choice(names), rng.choice(names)] for _ in range(rng.randrange(1, 4))]
        if kind == 0:
            text = json.dumps({"edges": pairs}).replace("0.5", rng.choice(["NaN", "1e999", "0.5"]))
        elif kind == 1:
            nodes = [{"id": rng.choice(names)} if rng.random() < 0.7 else rng.choice(names)]
            links = [{"source": a, "target": b} if rng.random() < 0.8 else [a, b] for a, b in pairs]
            text = json.dumps({"nodes": nodes * rng.randrange(1, 3), "links": links})
        elif kind == 2:
            depth = rng.choice([100, 100_000])
            text = '{"edges": ' + "[" * depth + "]" * depth + "}"
        else:
            data, suffix = bytearray(graphml.encode()), "graphml"
            at = rng.randrange(len(data))
            data[at : at + rng.randrange(1, 9)] = rng.randbytes(rng.randrange(3))
            text = data.decode("utf-8", "replace")

        def attack(folder: Path, text: str = text, suffix: str = suffix) -> str:
            path = folder / f"graph.{suffix}"
            path.write_bytes(text.encode("utf-8", "surrogatepass"))
            out, error = io.StringIO(), io.StringIO()
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
                status = command_line(["topology", "show", str(path)])
            message = error.getvalue()
            if status == 0:
                return "accepted" if out.getvalue().replace("\n", "").isprintable() else "raw"
            one_line = (
                message.count("\n") == 1 and message[:-1].isprintable() and path.name in message
            )
            return "refused in one line" if one_line else "refused at length"

        yield attack


def _polygons(rng: random.Random) -> Iterator[Attack]:
    """Yield outlines of boxes."""
    while True:
        count = rng.choice([1, 2, 3, 5, 12, 50, 300, 1000, 1001, 20_000])
        size = 10.0 ** rng.choice([-12, -4, -1, -1, -1, -1, -1, 0, 0, 2, 9, 308])
        radii = [rng.uniform(0.3, 1.0) * size for _ in range(count)]
        angles = [2 * math.pi * i / count for i in range(count)]
        ring = [(r * math.cos(a), r * math.sin(a)) for r, a in zip(radii, angles, strict=True)]
        change = rng.randrange(9)
        if change == 0:
            ring.append(ring[0])
        elif change == 1:
            ring.insert(rng.randrange(count), rng.choice(ring))
        elif change == 2:
            ring[rng.randrange(count)] = (rng.choice([math.nan, math.inf, -1e308]), 0.0)
        elif change == 3:
            rng.shuffle(ring)

        def attack(folder: Path, ring: object = tuple(ring)) -> str:
            try:
                box = BoxSpec("attack", ring)  # type: ignore[arg-type]
                pieces = box.fixtures  # made when a world is built
            except ValueError as error:
                return "refused in one line" if "\n" not in str(error) else "refused at length"
            area = sum(_area(piece.tolist()) for piece in pieces)
            return "accepted" if math.isclose(area, box.area, rel_tol=1e-6) else "unlike its pieces"

        yield attack


def _area(ring: list[list[float]]) -> float:
    following = [*ring[1:], ring[0]]
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(ring, following, strict=True)) / 2
