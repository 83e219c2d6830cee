"""Some worlds of a vector environment, stepped one after the other, each with a row of an array.

The rows of all worlds are one structured array, which processes share: actions are read from it,
observations, rewards and measurements are written into it, and nothing is sent. A world's row is
what `nested_agents.scenarios.box_pushing.environments.BoxPushingEnv` gives, bit by bit, whatever
other worlds there are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from ....core.numerics.arrays import FloatArray
from ..config import BoxPushingSettings
from ..environments import Game, Seat


def row_type(game: Game, seat: Seat) -> np.dtype[Any]:
    """Return the fields of a world's row.

    ``told`` says whether the last call wrote into the row, ``final`` whether an episode ended in it
    and another began, so that the fields ``final_`` hold the last of the old one.
    """
    measured = {k: np.asarray(v) for k, v in game.info(game.scenario.measure()).items()}
    info = np.dtype([(name, value.dtype, value.shape) for name, value in measured.items()])
    seen = (seat.observation_space.dtype, seat.observation_space.shape)
    return np.dtype(
        [
            ("action", np.int64, (len(seat.wheels),)),
            ("reward", np.float64),
            ("terminated", np.bool_),
            ("truncated", np.bool_),
            ("told", np.bool_),
            ("final", np.bool_),
            ("observation", *seen),
            ("info", info),
            ("final_observation", *seen),
            ("final_info", info),
        ],
        align=True,
    )


class Worlds:
    """Some of the worlds of a vector environment.

    Parameters
    ----------
    settings, steps, render_mode, sensors
        As in `nested_agents.scenarios.box_pushing.environments.Game`.
    by_wheel
        Whether observations have a row for every wheel.
    autoreset
        When a world that is over starts anew.
    rows
        A row for each of them, see `row_type`; written to.
    """

    def __init__(
        self,
        settings: BoxPushingSettings,
        steps: int,
        render_mode: str | None,
        sensors: bool,
        by_wheel: bool,
        autoreset: AutoresetMode,
        rows: Any,
    ) -> None:
        self._autoreset, self._rows = autoreset, rows
        self._games = [Game(settings, steps, render_mode, sensors=sensors) for _ in rows]
        self._seats = [Seat.of_all(game.scenario, by_wheel=by_wheel) for game in self._games]

    def reset(
        self,
        seeds: Sequence[int | None],
        chosen: Sequence[bool],
        options: Sequence[Mapping[str, Any]],
    ) -> None:
        """Start episodes in the chosen worlds, see `Game.reset`."""
        for i, row in enumerate(self._rows):
            row["told"], row["final"] = chosen[i], False
            if chosen[i]:
                self._begin(i, seeds[i], options[i])

    def step(self) -> None:
        """Carry out the actions that stand in the rows, or start an episode where one is over."""
        for i, (game, seat) in enumerate(zip(self._games, self._seats, strict=True)):
            row = self._rows[i]
            over = row["terminated"] or row["truncated"]
            row["told"], row["final"] = True, False
            if over and self._autoreset is AutoresetMode.NEXT_STEP:
                self._begin(i, None, None)
                continue
            transition, truncated = game.step(row["action"])
            row["reward"] = seat.paid(transition.reward)
            row["terminated"], row["truncated"] = transition.terminated, truncated
            self._tell(i, transition.states, transition.info)
            ended = transition.terminated or truncated
            if ended and self._autoreset is AutoresetMode.SAME_STEP:
                row["final"], row["final_observation"] = True, row["observation"]
                row["final_info"] = row["info"]
                self._tell(i, game.reset(None, None), game.scenario.measure())

    def render(self) -> list[Any]:
        """Return a picture of each world."""
        return [game.render() for game in self._games]

    def _begin(self, i: int, seed: int | None, options: Mapping[str, Any] | None) -> None:
        row, game = self._rows[i], self._games[i]
        row["reward"], row["terminated"], row["truncated"] = 0.0, False, False
        self._tell(i, game.reset(seed, options), game.scenario.measure())

    def _tell(self, i: int, states: FloatArray, measured: Mapping[str, Any]) -> None:
        row = self._rows[i]
        row["observation"] = self._seats[i].observe(states)
        info = row["info"]
        for name in info.dtype.names:
            info[name] = measured[name]
