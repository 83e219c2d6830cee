"""Results of studies whose answer is known, made without a simulation."""

from dataclasses import dataclass, field

import numpy as np

from nested_agents.core.interface.measures import SUCCESS
from nested_agents.scenarios.box_pushing.scenario import MEASURES
from nested_agents.studies.results.results import Results, from_arrays

SEEDS = 20


@dataclass
class Arrays:
    """What `from_arrays` makes frames of, fit to be changed by a test."""

    training: dict = field(default_factory=dict)
    evaluation: dict = field(default_factory=dict)
    phases: dict = field(default_factory=dict)
    seeds: dict = field(default_factory=dict)
    numbers: dict = field(default_factory=dict)
    usage: dict = field(default_factory=dict)
    columns: dict = field(default_factory=dict)
    measures: tuple = (SUCCESS,)

    def frames(self) -> Results:
        own = {"training": self.training, "evaluation": self.evaluation}
        phases = {phase: arrays for phase, arrays in (own | self.phases).items() if arrays}
        rows = {
            c: len(next(iter(arrays.values())))
            for by in (self.usage, self.numbers, *reversed(phases.values()))
            for c, arrays in by.items()
        }
        seeds = {c: self.seeds.get(c) or tuple(range(count)) for c, count in rows.items()}
        return from_arrays(phases, seeds, self.numbers, self.usage, self.columns, self.measures)


NOTHING = Arrays().frames()


def arrays(chances: np.ndarray, rng: np.random.Generator, seeds: int = SEEDS) -> dict:
    """Measures of episodes that succeed with these chances ``(n_episodes,)``."""
    shape = (seeds, len(chances))
    success = rng.random(shape) < chances
    return {
        "success": success.astype(int),
        "stopped_at_goal": (success & (rng.random(shape) < 0.9)).astype(int),
        "steps": np.where(success, rng.integers(30, 90, shape), 450),
        "final_distance_m": np.where(success, 0.05, rng.uniform(0.2, 1.2, shape)),
        "contact_fraction": rng.uniform(0.4, 0.8, shape),
        "return": rng.normal(size=shape),
    }


def ablation(chances: dict[str, float], seeds: int = SEEDS) -> Arrays:
    """Every condition succeeds with its chance, in training and greedy."""
    rng = np.random.default_rng(11)
    training = {c: arrays(np.full(20, p), rng, seeds) for c, p in chances.items()}
    evaluation = {c: arrays(np.full(10, p), rng, seeds) for c, p in chances.items()}
    numbered = dict.fromkeys(chances, tuple(range(seeds)))
    return Arrays(training, evaluation, seeds=numbered, measures=MEASURES)


def shapes(chances: dict[str, float], trained: float = 0.95, seeds: int = SEEDS) -> Arrays:
    """A team trained with success `trained`, and its success with other boxes."""
    base = ablation({"own-value": trained}, seeds)
    rng = np.random.default_rng(2)
    for box, chance in chances.items():
        base.phases[f"evaluation:{box}"] = {"own-value": arrays(np.full(10, chance), rng, seeds)}
    return base


def related(kept: tuple[float, float], seeds: int = SEEDS) -> Arrays:
    """Agents on wheels and a team by pushing points, and what success they keep with the star."""
    systems = ("nested", "pushing points, team")
    base = ablation(dict.fromkeys(systems, 0.95), seeds)
    rng = np.random.default_rng(6)
    base.phases["evaluation:star"] = {
        system: arrays(np.full(10, 0.95 * share), rng, seeds)
        for system, share in zip(systems, kept, strict=True)
    }
    return base


def games(systems: dict[str, float], by_game: dict[str, float] | None = None) -> Arrays:
    """Systems that find the optimum of games with a chance, or one of each game."""
    conditions = {
        f"{system}, game={game}": (system, game, chance if by_game is None else by_game[game])
        for system, chance in systems.items()
        for game in by_game or ("climbing",)
    }
    base = ablation({c: chance for c, (_, _, chance) in conditions.items()})
    columns = {c: {"name": s, "scenario.game": game} for c, (s, game, _) in conditions.items()}
    base.columns.update(columns)
    return base


def edges(chance: float, without: dict[str, float], seeds: int = SEEDS) -> Arrays:
    """Teams of four and eight robots, own values and the team's, and the same with other edges."""
    columns = {
        f"value_of={of}, robots={n}": {"learner.decision.value_of": of, "scenario.robots": n}
        for of in ("own", "team")
        for n in (4, 8)
    }
    base = ablation(dict.fromkeys(columns, chance), seeds)
    base.columns.update(columns)
    rng = np.random.default_rng(7)
    for name, rest in without.items():
        base.phases[f"evaluation:{name}"] = {
            c: arrays(np.full(10, rest if "own" in c else chance), rng, seeds) for c in columns
        }
    return base


def wheel_failure(
    ends: dict[str, dict[str, float]], onset: int = 20, episodes: int = 40, seeds: int = SEEDS
) -> Arrays:
    """By fault and what adapts, the level that is reached ten episodes after the failure."""
    rng = np.random.default_rng(3)
    base = Arrays(phases={"weights kept": {}}, measures=MEASURES)
    before = np.minimum(0.95, np.linspace(0.0, 2.0, onset))
    for fault, by_case in ends.items():
        for enabled, cases in (
            ("false", ("weights", "nothing")),
            ("true", ("both", "self-model")),
        ):
            condition = f"{fault}, enabled={enabled}"
            for phase, case in zip(("training", "weights kept"), cases, strict=True):
                after = np.minimum(np.linspace(0.1, 2.0, episodes - onset), by_case[case])
                whole = arrays(np.concatenate([before, after]), rng, seeds)
                if phase == "weights kept":
                    whole = {name: values[:, onset:] for name, values in whole.items()}
                kept = base.training if phase == "training" else base.phases[phase]
                kept[condition] = whole
            base.columns[condition] = {"name": fault, "learner.self_model.enabled": enabled}
            base.seeds[condition] = tuple(range(seeds))
            base.numbers[condition] = {"onset": np.full(seeds, float(onset))}
    return base


def scaling(success: dict[int, float], seconds_per_agent: float = 1e-4) -> Arrays:
    """Two evaluators: one whose decisions take time in proportion to agents, one to agents^2."""
    rng = np.random.default_rng(4)
    chances = {
        f"{name}, robots={robots}": chance
        for name in ("sums", "sampling")
        for robots, chance in success.items()
    }
    base = ablation(chances)
    for condition in chances:
        name, _, robots = condition.partition(", robots=")
        base.columns[condition] = {"name": name, "scenario.robots": int(robots)}
        agents = 2 * int(condition.rpartition("=")[2])
        steps = base.training[condition]["steps"].sum(axis=1)
        power = 1 if condition.startswith("sums") else 2
        spread = rng.uniform(0.9, 1.1, SEEDS)
        base.numbers[condition] = {
            "robots": np.full(SEEDS, agents / 2),
            "period_s": np.full(SEEDS, 0.512),
            "agents": np.full(SEEDS, float(agents)),
            "messages": np.full(SEEDS, agents * (agents - 1) / 2),
            "team_bytes": np.full(SEEDS, 1e5 * agents),
            "all_touching": rng.uniform(0.0, 1.0, SEEDS),
        }
        base.usage[condition] = {
            "decision_median": seconds_per_agent * agents**power * spread,
            "seconds.learning": 1e-5 * agents * steps,
            "seconds.physics": 1e-5 * agents * steps,
            "seconds.sensors": 1e-5 * agents * steps,
        }
    return base


def hierarchies(chances: dict[tuple[str, str, int], float], seeds: int = SEEDS) -> Arrays:
    """By hierarchy, whose value decides and number of robots, the chance of success."""
    by_label = {f"topology={t}, value_of={of}, robots={n}": (t, of, n) for t, of, n in chances}
    base = ablation(dict(zip(by_label, chances.values(), strict=True)), seeds)
    rng = np.random.default_rng(5)
    for condition, (topology, value_of, robots) in by_label.items():
        base.columns[condition] = {
            "topology": topology,
            "learner.decision.value_of": value_of,
            "scenario.robots": robots,
        }
        passed = {"chain": robots * (2 * robots - 1), "star": 2 * robots - 1}
        base.numbers[condition] = {
            "robots": np.full(seeds, float(robots)),
            "agents": np.full(seeds, 2.0 * robots),
            "messages": np.full(seeds, float(passed.get(topology, 0))),
        }
        base.usage[condition] = {"decision_median": 2e-4 * robots * rng.uniform(0.9, 1.1, seeds)}
    return base
