"""Draws the pictures of docs/environments/index.md with the public API.

``python -m docs.gallery`` writes them into ``docs/figures``.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import gymnasium
import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from PIL import Image

import nested_agents as na

FIGURES = Path(__file__).resolve().parent / "figures"
PIXELS = 320
"""Longest side of a picture."""
CLIMBING = np.array([[11, -30, 0], [-30, 7, 6], [0, 0, 5]])
"""Payoffs of the climbing game (Claus and Boutilier 1998)."""
PLAIN = {
    "xtick.labelbottom": False,
    "ytick.labelleft": False,
    "axes.labelcolor": "none",
    "axes.titlecolor": "none",
}
"""Style without labels, which are too small to read in a small picture."""
SCENARIOS = {
    "box-pushing": na.BoxPushingSettings(robots=2),
    "box-shapes": na.BoxPushingSettings(robots=4, box="L"),
    "arm": na.KinematicChainSettings(joints=8),
}


def save(picture: Image.Image, name: str) -> None:
    """Save a picture, no side of which is longer than `PIXELS`, with few colors."""
    picture = picture.convert("RGB")
    picture.thumbnail((PIXELS, PIXELS))
    picture.quantize(64).save(FIGURES / f"gallery-{name}.png", optimize=True)


def first_frame(scenario: na.Scenario, path: Path) -> Image.Image:
    """Return the start of an episode, as the animation of a recording shows it."""
    scenario.reset(seed=3)
    state = scenario.measure()
    recording = {name: np.stack([np.asarray(state[name])] * 2) for name in scenario.recorded}
    constants = {k: np.asarray(value) for k, value in scenario.constants_of_episode().items()}
    with mpl.rc_context(PLAIN):
        scenario.animate(recording | constants, path)
    return Image.open(path)


def matrix_game() -> Figure:
    """Draw the payoffs of the climbing game."""
    figure = Figure(figsize=(2.4, 2.4), layout="constrained")
    axes = figure.subplots()
    axes.imshow(CLIMBING, cmap="Blues", vmin=-40, vmax=25)
    for row, column in np.ndindex(3, 3):
        axes.text(column, row, str(CLIMBING[row, column]), ha="center", va="center", size=13)
    axes.set_xticks(range(3), ("a", "b", "c"))
    axes.set_yticks(range(3), ("a", "b", "c"))
    axes.set(xlabel="action of agent 2", ylabel="action of agent 1")
    return figure


def line_up() -> Figure:
    """Draw three carts on their line."""
    scenario = na.LineUpSettings(carts=3).build()
    scenario.reset(seed=3)
    figure = Figure(figsize=(2.4, 1.6), layout="constrained")
    axes = figure.subplots()
    axes.axhline(0, color="gray", zorder=0)
    axes.scatter(scenario.measure()["places"], np.zeros(3), s=80, marker="s", color="#0072B2")
    axes.set(xlabel="place [m]", yticks=(), xlim=(-2, 2))
    return figure


if __name__ == "__main__":
    with TemporaryDirectory() as folder:
        path = Path(folder) / "picture.png"
        for name, settings in SCENARIOS.items():
            save(first_frame(settings.build(), Path(folder) / f"{name}.gif"), name)
        with mpl.rc_context({"font.size": 10}):
            for name, draw in {"matrix-game": matrix_game, "line-up": line_up}.items():
                draw().savefig(path, dpi=150)
                save(Image.open(path), name)
    pendulum = gymnasium.make("Pendulum-v1", render_mode="rgb_array")
    pendulum.reset(seed=1)
    save(Image.fromarray(pendulum.render()), "gymnasium")
