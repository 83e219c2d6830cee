"""What an environment shows of the episode that is being played: pixels, or a window."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....core.interface.scenario import EpisodeRecorder, RecordedScenario, Transition


class Screen:
    """Remembers an episode and draws its present.

    Parameters
    ----------
    scenario
        Where it is played.
    mode
        ``"rgb_array"``: `render` returns a picture. ``"human"``: a window is kept up to date.
    sensors
        Whether rays of infrared sensors are drawn.
    """

    def __init__(self, scenario: RecordedScenario, mode: str, *, sensors: bool = False) -> None:
        self.scenario, self.mode, self.sensors = scenario, mode, sensors
        self._recorder: Any = None
        self._window: Any = None

    def begin(self) -> None:
        """Forget the past and take in the start of an episode."""
        self._recorder = EpisodeRecorder(self.scenario)
        if self.mode == "human":
            self._show()

    def add(self, transition: Transition) -> None:
        """Take in a step."""
        self._recorder.add(transition)
        if self.mode == "human":
            self._show()

    def render(self) -> np.ndarray | None:
        """Return the present as ``(height, width, 3)`` bytes; with a window, nothing.

        Raises
        ------
        RuntimeError
            If no episode has begun.
        """
        if self._recorder is None:
            raise RuntimeError("render: no episode has begun, call reset first")
        return None if self.mode == "human" else self._picture()

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            import pygame

            pygame.display.quit()
            self._window = None

    def _picture(self) -> np.ndarray:
        from .rendering import picture

        recording = self._recorder.recording()
        return picture(recording, len(recording["box_pose"]) - 1, sensors=self.sensors)

    def _show(self) -> None:
        try:
            import pygame
        except ImportError:
            raise ImportError(
                'render_mode = "human" needs pygame: pip install "nested-agents[human]"'
            ) from None
        pixels = self._picture()
        if self._window is None:
            pygame.display.init()
            pygame.display.set_caption("nested-agents")
            self._window = pygame.display.set_mode(pixels.shape[1::-1])
        pygame.event.pump()
        self._window.blit(pygame.surfarray.make_surface(pixels.transpose(1, 0, 2)), (0, 0))
        pygame.display.flip()
