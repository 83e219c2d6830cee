"""Pictures of scenarios as PNG, SVG or PDF; animations of episodes as GIF or MP4."""

from collections.abc import Callable
from pathlib import Path
from typing import Protocol, runtime_checkable

import imageio.v2 as imageio
import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

Pixels = NDArray[np.uint8]
"""A picture ``(height, width, 3)`` with sides that are multiples of 16, for video codecs."""
MAX_FRAMES = 120
"""Maximum number of frames of an animation."""
DPI = 100
PICTURES = (".png", ".svg", ".pdf")
"""Suffixes of pictures."""


@runtime_checkable
class Drawable(Protocol):
    """Optional part of a scenario: a picture of the present state."""

    def draw(self, path: Path | str) -> None:
        """Draw the present state, after `reset` the start of an episode, to a picture file."""


def save_picture(figure: Figure, path: Path | str) -> None:
    """Write a figure in the format of the suffix.

    Raises
    ------
    ValueError
        If the suffix is unknown or the file cannot be written.
    """
    path = Path(path)
    if path.suffix not in PICTURES:
        raise ValueError(f"picture: suffix {path.suffix!r} of {path.name}, allowed {PICTURES}")
    try:
        figure.savefig(path, dpi=DPI)
    except OSError as error:
        raise ValueError(f"picture: {path}: {error.strerror}") from None


class Scene:
    """A figure in meters that shows any step of an episode.

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
        """Replace the drawn step by another."""
        for artist in self._moving:
            artist.remove()
        self._moving = []
        self._add(step)

    def _add(self, step: int) -> None:
        """Draw the moving parts, add them to `_moving`, and set the title."""
        raise NotImplementedError

    def pixels(self, step: int) -> Pixels:
        """Return a picture of a step."""
        self.draw(step)
        self.canvas.draw()
        return np.asarray(self.canvas.buffer_rgba())[..., :3].copy()


def film(draw: Callable[[int], Pixels], last: int, seconds: float, path: Path) -> None:
    """Write an animation, GIF or MP4 by the suffix of `path`.

    Parameters
    ----------
    draw
        Returns the picture of a step.
    last
        Number of the last step.
    seconds
        Duration of a frame; the last frame of a GIF is shown for longer.
    path
        Path of the file, which exists only once the animation is complete.

    Raises
    ------
    ValueError
        If the suffix is neither ``.gif`` nor ``.mp4``.
    """
    if path.suffix not in (".gif", ".mp4"):
        raise ValueError(f"animation: suffix {path.suffix!r} of {path.name}, allowed .gif or .mp4")
    steps = np.unique(np.linspace(0, last, min(last + 1, MAX_FRAMES)).round().astype(int))
    frames = [draw(int(step)) for step in steps]
    partial = path.with_name(f".{path.stem}.partial{path.suffix}")
    if path.suffix == ".gif":
        # A common palette avoids flicker and is computed once.
        palette = Image.fromarray(frames[-1]).quantize(128)
        dither = Image.Dither.NONE
        images = [Image.fromarray(f).quantize(palette=palette, dither=dither) for f in frames]
        durations = [round(1000 * seconds)] * (len(images) - 1) + [1500]
        images[0].save(partial, save_all=True, append_images=images[1:], duration=durations, loop=0)
    else:
        imageio.mimwrite(partial, [*frames], fps=1 / seconds, macro_block_size=16)
    partial.replace(path)
