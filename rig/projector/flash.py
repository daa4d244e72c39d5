"""Which screen is which: each shows its number and name, large, one after the other."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rig.projector.outputs import Output, full_window

if TYPE_CHECKING:
    import pygame

TURN = 0.25  # s of light and of dark
DARK, LIT = (0, 0, 0), (255, 255, 255)


def flash(outputs: Sequence[Output], seconds: float) -> None:
    """Let outputs flash one after the other, with their number; pygame's display is running."""
    for output in outputs:
        _flash(output, seconds)


def _flash(output: Output, seconds: float) -> None:
    import pygame

    window = full_window(output, output.size)
    end, lit = time.monotonic() + seconds, True
    while time.monotonic() < end:
        _draw(window, output, lit)
        pygame.event.pump()
        time.sleep(TURN)
        lit = not lit
    window.destroy()


def _draw(window: pygame.Window, output: Output, lit: bool) -> None:
    import cv2
    import numpy as np
    import pygame

    paper, ink = (LIT, DARK) if lit else (DARK, LIT)
    width, height = output.size
    image = np.full((height, width, 3), paper, np.uint8)
    label, scale = f"{output.index}", height / 60
    (wide, high), _ = cv2.getTextSize(label, cv2.FONT_HERSHEY_SIMPLEX, scale, int(2 * scale))
    place = (width - wide) // 2, (height + high) // 2
    cv2.putText(image, label, place, cv2.FONT_HERSHEY_SIMPLEX, scale, ink, int(2 * scale))
    drawn = pygame.image.frombuffer(image.tobytes(), output.size, "RGB")
    window.get_surface().blit(drawn, (0, 0))
    window.flip()
