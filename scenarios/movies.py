"""Pictures of recorded episodes: the figure they are drawn on, and animations, GIF or MP4."""

from collections.abc import Callable
from pathlib import Path

import imageio.v2 as imageio
import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

Pixels = NDArray[np.uint8]
"""A picture ``(height, width, 3)``; sides are multiples of 16, as video codecs want them."""
MOST_FRAMES = 120
"""Longer episodes are thinned out to this many frames."""
DPI = 100


class Scene:
    """A figure in metres on which any moment of an episode can be drawn.

    Parameters
    ----------
    sides
        Width and height of the picture in pixels.
    place
        Left, bottom, width and height of the axes as fractions of the picture.
    """

    def __init__(self, sides: tuple[int, int], place: tuple[float, float, float, float]) -> None:
        self.figure = Figure(figsize=(sides[0] / DPI, sides[1] / DPI), dpi=DPI)
        self.canvas = FigureCanvasAgg(self.figure)
        self.axes = self.figure.add_axes(place)
        self.axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
        self._moving: list[Artist] = []

    def draw(self, step: int) -> None:
        """Draw the moment after `step` steps in place of what moved in the last one."""
        for artist in self._moving:
            artist.remove()
        self._moving = []
        self._add(step)

    def _add(self, step: int) -> None:
        """Add what moves to `_moving`, and the title."""
        raise NotImplementedError

    def pixels(self, step: int) -> Pixels:
        """Return the moment after `step` steps as ``(height, width, 3)`` bytes."""
        self.draw(step)
        self.canvas.draw()
        return np.asarray(self.canvas.buffer_rgba())[..., :3].copy()


def film(draw: Callable[[int], Pixels], last: int, seconds: float, path: Path) -> None:
    """Write an animation, GIF or MP4 by the suffix of `path`.

    Parameters
    ----------
    draw
        Draws the moment after so many steps.
    last
        Number of the last step.
    seconds
        For which a frame is shown; the last frame of a GIF is shown for longer.
    path
        Where to write; an unfinished animation never bears this name.

    Raises
    ------
    ValueError
        If the suffix is neither ``.gif`` nor ``.mp4``.
    """
    if path.suffix not in (".gif", ".mp4"):
        raise ValueError(f"animation: suffix {path.suffix!r} of {path.name}, allowed .gif or .mp4")
    steps = np.unique(np.linspace(0, last, min(last + 1, MOST_FRAMES)).round().astype(int))
    frames = [draw(int(step)) for step in steps]
    partial = path.with_name(f".{path.stem}.partial{path.suffix}")
    if path.suffix == ".gif":
        _write_gif(partial, frames, seconds)
    else:
        imageio.mimwrite(partial, [*frames], fps=1 / seconds, macro_block_size=16)
    partial.replace(path)


def _write_gif(path: Path, frames: list[Pixels], seconds: float) -> None:
    # One palette for all frames: colours do not flicker, and it is found only once.
    palette = Image.fromarray(frames[-1]).quantize(128)
    images = [
        Image.fromarray(f).quantize(palette=palette, dither=Image.Dither.NONE) for f in frames
    ]
    durations = [round(1000 * seconds)] * (len(images) - 1) + [1500]
    images[0].save(path, save_all=True, append_images=images[1:], duration=durations, loop=0)
